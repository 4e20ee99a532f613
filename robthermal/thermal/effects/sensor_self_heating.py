"""The current that reads a sensor heats its lump."""

from __future__ import annotations

from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import sensors
from ._signatures import by_heat, constant

_add = numbers("sensors", heat="self_heating")

EFFECT = Effect(
    name="sensor_self_heating",
    rank=280,
    meaning="The current that reads a sensor heats its lump.",
    where=("sensor",),
    places=sensors,
    quantities=(Quantity("heat", "W", -10.0, 10.0),),
    add=_add,
    signature=by_heat(_add, "heat", 1.0),
    hidden=constant,
    confused_with=("heat_source", "sensor_offset"),
    separated_by="another excitation of the sensor",
    measure="read {0} with another excitation current",
)
