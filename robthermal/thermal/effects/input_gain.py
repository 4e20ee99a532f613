"""A heater or amplifier gives more or less than its record column says, by a factor."""

from __future__ import annotations

from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import driven
from ._signatures import by_heat

_add = numbers("", gain="drive.gain")

EFFECT = Effect(
    name="input_gain",
    rank=180,
    meaning="A heater or amplifier gives more or less than its record column says, by a factor.",
    where=("input or module",),
    places=driven,
    quantities=(Quantity("gain", "-", -0.9, 9.0),),
    add=_add,
    signature=by_heat(_add, "gain", 1e-4),
    confused_with=("input_saturation",),
    separated_by="a measured current or power",
    measure="measure the current or power of {0} itself",
)
