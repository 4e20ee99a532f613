"""A heater or amplifier gives more or less than its record column says, by a constant."""

from __future__ import annotations

from .._system import System
from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import driven
from ._response import Where
from ._signatures import CONSTANT, by_heat

_add = numbers("", offset="drive.offset")


def _of_a_heater(system: System, where: Where) -> str:
    """An offset of a heater is a constant heat; one of a current changes the response."""
    return CONSTANT if where[0] in system.inputs else ""


EFFECT = Effect(
    name="input_offset",
    rank=190,
    meaning="A heater or amplifier gives more or less than its record column says, by a constant.",
    where=("input or module",),
    places=driven,
    quantities=(Quantity("offset", "unit", -1e3, 1e3),),
    add=_add,
    signature=by_heat(_add, "offset", 1e-4),
    hidden=_of_a_heater,
    confused_with=("heat_source",),
    separated_by="the input at zero, and both polarities",
    measure="measure the current or power of {0} itself",
)
