"""A module remembers its polarity: extra heat into the cold face, of the sign of the current, late."""

from __future__ import annotations

import numpy as np

from .._system import System
from ._builders import subtable
from ._effect import Effect, Quantity
from ._response import RecordContext, Response, Values, Where
from ._signatures import TIMES, altered, column_of, follow_held, into

_add = subtable("modules", "hysteresis", ("heat", "time_constant"), time_constant=60.0)


def _without_memory(system: System) -> list[Where]:
    return [(name,) for name, module in system.modules.items() if module.hysteresis is None]


def _memory(record: RecordContext, where: Where, values: Values) -> Response:
    """The memory of the polarity, per watt, into the cold face."""
    memory = follow_held(np.sign(column_of(record, where[0])), values["time_constant"], record.h, 0.0)
    cold = record.system.modules[where[0]].cold
    return into(record, {cold: (memory, np.concatenate([memory[1:], memory[-1:]]))})


EFFECT = Effect(
    name="hysteresis",
    rank=60,
    meaning="A module remembers its polarity: extra heat into the cold face, of the sign of the current, late.",
    where=("module",),
    places=_without_memory,
    quantities=(Quantity("heat", "W", -100.0, 100.0),
                Quantity("time_constant", "s", 1e-3, 1e6, grid=TIMES)),
    nonnegative=("time_constant",),
    add=_add,
    signature=_memory,
    hidden=altered,
    confused_with=("hidden_mass", "input_offset"),
    separated_by="polarity reversals with different dwell",
)
