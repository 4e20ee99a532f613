"""The electrical resistance of a module changes with its mean temperature."""

from __future__ import annotations

from ._builders import slope
from ._effect import Effect, Quantity
from ._places import modules
from ._signatures import by_heat

_add = slope("resistance")

EFFECT = Effect(
    name="resistance_slope",
    rank=20,
    meaning="The electrical resistance of a module changes with its mean temperature.",
    where=("module",),
    places=modules,
    quantities=(Quantity("slope", "Ω/K", -1.0, 1.0, typical=1e-4),),
    add=_add,
    signature=by_heat(_add, "slope", 1e-4),
    confused_with=("lead_heating", "joule_split"),
    separated_by="two levels of mean temperature with large current",
    measure="measure the voltage of {0}: it gives its resistance alone",
)
