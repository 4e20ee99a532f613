"""The Seebeck coefficient of a module changes with its mean temperature."""

from __future__ import annotations

from ._builders import slope
from ._effect import Effect, Quantity
from ._places import modules
from ._signatures import by_heat

_add = slope("seebeck")

EFFECT = Effect(
    name="seebeck_slope",
    rank=10,
    meaning="The Seebeck coefficient of a module changes with its mean temperature.",
    where=("module",),
    places=modules,
    quantities=(Quantity("slope", "V/K²", -1e-2, 1e-2, typical=1e-6),),
    add=_add,
    signature=by_heat(_add, "slope", 1e-6),
    confused_with=("thomson", "resistance_slope"),
    separated_by="two levels of mean temperature with both signs of current",
    measure="measure the voltage of {0} at zero current: it gives its Seebeck coefficient alone",
)
