"""A sensor reads too much or too little, by a constant."""

from __future__ import annotations

import numpy as np

from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import sensors
from ._response import RecordContext, Response, Values, Where
from ._signatures import constant, reading

_add = numbers("sensors", offset="offset")


def _one_kelvin(record: RecordContext, where: Where, values: Values) -> Response:
    return reading(record, where[0], np.ones(len(record.x)))


EFFECT = Effect(
    name="sensor_offset",
    rank=260,
    meaning="A sensor reads too much or too little, by a constant.",
    where=("sensor",),
    places=sensors,
    quantities=(Quantity("offset", "K", -50.0, 50.0),),
    add=_add,
    signature=_one_kelvin,
    hidden=constant,
    confused_with=("heat_source", "sensor_offset"),
    separated_by="an isothermal soak",
    measure="compare {0} with a reference thermometer in an isothermal soak",
)
