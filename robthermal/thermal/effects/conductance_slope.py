"""The thermal conductance of a module changes with its mean temperature."""

from __future__ import annotations

from ._builders import slope
from ._effect import Effect, Quantity
from ._places import modules
from ._signatures import by_heat

_add = slope("conductance")

EFFECT = Effect(
    name="conductance_slope",
    rank=30,
    meaning="The thermal conductance of a module changes with its mean temperature.",
    where=("module",),
    places=modules,
    quantities=(Quantity("slope", "W/K²", -0.1, 0.1, typical=1e-5),),
    add=_add,
    signature=by_heat(_add, "slope", 1e-5),
    confused_with=("missing_link", "natural_convection"),
    separated_by="a temperature difference made by the heater at zero current, and by the current",
)
