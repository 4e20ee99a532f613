"""The power of a heater changes with the temperature of its lump."""

from __future__ import annotations

from .._system import System
from ._builders import numbers
from ._effect import Effect, Quantity
from ._response import Where
from ._signatures import by_heat

_add = numbers("inputs", slope="power_slope")


def _places(system: System) -> list[Where]:
    return [(name,) for name in system.inputs]


EFFECT = Effect(
    name="heater_power_slope",
    rank=230,
    meaning="The power of a heater changes with the temperature of its lump.",
    where=("input",),
    places=_places,
    quantities=(Quantity("slope", "1/K", -0.05, 0.05),),
    add=_add,
    signature=by_heat(_add, "slope", 1e-3),
    confused_with=("radiation", "natural_convection"),
    separated_by="the same power at two temperatures",
)
