"""A heater or amplifier follows its record column with a first-order lag."""

from __future__ import annotations

import numpy as np

from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import prompt
from ._response import RecordContext, Response, Values, Where
from ._signatures import TIMES, column_of, driven_by, follow_held

_add = numbers("", time_constant="drive.time_constant")


def _lagged(record: RecordContext, where: Where, values: Values) -> Response:
    """The mean over every sample of the lagged input, at the trial τ."""
    u, tau = column_of(record, where[0]), values["time_constant"]
    start = follow_held(u, tau, record.h, float(u[0]))
    mean = u + (start - u) * (tau / record.h) * (1.0 - np.exp(-record.h / tau))
    return driven_by(record, where[0], mean, tau)


EFFECT = Effect(
    name="input_lag",
    rank=220,
    meaning="A heater or amplifier follows its record column with a first-order lag.",
    where=("input or module",),
    places=prompt("time_constant"),
    quantities=(Quantity("time_constant", "s", 0.0, 1e5, grid=TIMES, typical=0.1),),
    nonnegative=("time_constant",),
    add=_add,
    signature=_lagged,
    confused_with=("input_delay", "sensor_lag"),
    separated_by="fast switching",
    measure="record the current or power of {0} itself, sampled faster",
)
