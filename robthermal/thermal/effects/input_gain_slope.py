"""The gain of a heater grows with the value in its record column."""

from __future__ import annotations

from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import level
from ._signatures import altered, by_heat

_add = numbers("inputs", slope="drive.gain_slope")

EFFECT = Effect(
    name="input_gain_slope",
    rank=205,
    meaning="The gain of a heater grows with the value in its record column, as power does with a voltage.",
    where=("input",),
    places=level,
    quantities=(Quantity("slope", "1/unit", 0.0, 10.0, typical=1e-6),),
    add=_add,
    signature=by_heat(_add, "slope", 1e-6),
    hidden=altered,
    confused_with=("input_gain", "heater_power_slope"),
    separated_by="the heater at three levels or more",
    measure="measure the electrical power of {0} at two levels",
)
