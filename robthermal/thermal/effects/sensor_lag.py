"""A sensor follows its lump with a first-order lag."""

from __future__ import annotations

from .._system import System
from ._builders import numbers
from ._effect import Effect, Quantity
from ._response import RecordContext, Response, Values, Where
from ._signatures import TIMES, follow, reading

_add = numbers("sensors", time_constant="time_constant")


def _places(system: System) -> list[Where]:
    return [(name,) for name, sensor in system.thermometers.items() if not sensor.time_constant]


def _lagged(record: RecordContext, where: Where, values: Values) -> Response:
    """(lagged - reading) / τ at the trial τ."""
    y, tau = record.readings[:, record.system.sensor_names.index(where[0])], values["time_constant"]
    return reading(record, where[0], (follow(y, tau, record.h) - y) / tau)


EFFECT = Effect(
    name="sensor_lag",
    rank=250,
    meaning="A sensor follows its lump with a first-order lag.",
    where=("sensor",),
    places=_places,
    quantities=(Quantity("time_constant", "s", 0.0, 1e5, grid=TIMES, typical=0.1),),
    nonnegative=("time_constant",),
    add=_add,
    signature=_lagged,
    confused_with=("hidden_mass", "input_delay"),
    separated_by="frequencies above 0.3/time_constant",
)
