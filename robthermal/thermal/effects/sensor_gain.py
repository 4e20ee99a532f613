"""A sensor reads too much or too little, by a factor around the ambient temperature."""

from __future__ import annotations

from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import sensors
from ._response import RecordContext, Response, Values, Where
from ._signatures import reading

_add = numbers("sensors", absent=1.0, gain="gain")  # relative: the sensor's own gain is 1 + this


def _from_reference(record: RecordContext, where: Where, values: Values) -> Response:
    """Distance of the reading from the reference, per unit of the sensor's own gain."""
    sensor = record.system.sensors[where[0]]
    y = record.readings[:, record.system.sensor_names.index(where[0])]
    return reading(record, where[0], (y - sensor.offset - record.reference) / sensor.gain)


EFFECT = Effect(
    name="sensor_gain",
    rank=270,
    meaning="A sensor reads too much or too little, by a factor around the ambient temperature.",
    where=("sensor",),
    places=sensors,
    quantities=(Quantity("gain", "-", -0.5, 0.5),),
    add=_add,
    signature=_from_reference,
    confused_with=("sensor_gain",),
    separated_by="isothermal soaks at two temperatures",
    measure="compare {0} with a reference thermometer at two temperatures",
)
