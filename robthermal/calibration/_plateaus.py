"""Stretches of constant input in a staircase experiment, and whether the readings had settled at their end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import Floats
from ..errors import InputError
from ..signals import Record

_TAIL = 0.2  # part of a plateau whose mean stands for its steady state
_SHORTEST = 10  # samples


@dataclass(frozen=True)
class Plateau:
    """A stretch of constant input.

    Parameters
    ----------
    start, stop : int
        First sample, and the one after the last.
    level : float
        Value of the input [unit].
    """

    start: int
    stop: int
    level: float

    def tail(self, signal: Floats) -> Floats:
        """The end of a signal on it."""
        return signal[self.stop - max(4, round(_TAIL * (self.stop - self.start))):self.stop]

    def drift(self, signal: Floats) -> float:
        """Change between the two halves of the tail [unit of the signal]."""
        tail = self.tail(signal)
        half = tail.size // 2
        return float(tail[-half:].mean() - tail[:half].mean())


def plateaus(record: Record, name: str, least: int) -> list[Plateau]:
    """Plateaus of one column, at least `least` of them."""
    signal = column(record, name)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(signal)) + 1, [signal.size]]).tolist()
    found = [Plateau(a, b, float(signal[a])) for a, b in zip(edges[:-1], edges[1:], strict=True) if b - a >= _SHORTEST]
    if len(found) < least:
        raise InputError(f"{name!r} is constant over {len(found)} stretches of {_SHORTEST} samples or more",
                         where="argument record", expected=f"a staircase of at least {least} steps",
                         remedy="Make one with rt.signals.staircase; filter no input.")
    return found


def column(record: Record, name: str) -> Floats:
    """A column of the record by name."""
    if name not in record:
        raise InputError(f"the record has no column {name!r}", where="argument record",
                         expected="one of " + ", ".join(record.names))
    return np.asarray(record[name], np.float64)
