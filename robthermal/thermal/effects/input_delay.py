"""A heater or amplifier acts late, by a dead time."""

from __future__ import annotations

import numpy as np

from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import prompt
from ._response import RecordContext, Response, TrialContext, Values, Where
from ._signatures import column_of, driven_by

_add = numbers("", delay="drive.delay")


def _delays(context: TrialContext, where: Where) -> list[float]:
    return [context.h * n for n in (0.5, 1.5, 5.0, 15.0)]


def _late(record: RecordContext, where: Where, values: Values) -> Response:
    """The mean over every sample of the delayed input, at the trial delay."""
    u, delay = column_of(record, where[0]), values["delay"]
    whole, part = divmod(delay / record.h, 1.0)
    k = np.arange(u.size) - int(whole)
    late = part * u[np.maximum(k - 1, 0)] + (1.0 - part) * u[np.maximum(k, 0)]
    return driven_by(record, where[0], late, delay)


EFFECT = Effect(
    name="input_delay",
    rank=210,
    meaning="A heater or amplifier acts late, by a dead time.",
    where=("input or module",),
    places=prompt("delay"),
    quantities=(Quantity("delay", "s", 0.0, 1e4, grid=_delays, typical=0.1),),
    nonnegative=("delay",),
    add=_add,
    signature=_late,
    confused_with=("input_lag", "sensor_lag"),
    separated_by="fast switching",
    measure="record the current or power of {0} itself, sampled faster",
)
