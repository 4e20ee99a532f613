"""Inputs that change within the steps of a record of means: they act there by their mean, early or late."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..thermal import System
from ._data import Data

_MOVES = 0.02  # of the range of an input: rms by which it is off its mean within a step
_STEPS = 5  # within which heat that acts half a step early or late is seen


def within_steps(system: System, one: Data) -> Iterator[str]:
    """Which inputs change within steps of means, and which times are uncertain for it, a sentence each.

    Parameters
    ----------
    system : System
        Model with the heaters and modules.
    one : Data
        Record, with the ripple of its inputs.
    """
    record = one.record
    for name in [*system.inputs, *system.modules]:
        if not record.averaged or name not in record.ripple:
            continue
        n = int(np.sum(record.ripple[name] > _MOVES * np.ptp(record[name])))
        if n:
            yield (f"{name} changes within {n} of the {len(record)} steps of record {one.label!r} and acts there by "
                   "its mean, up to half a step early or late: times and capacities that act within about "
                   f"{_STEPS * record.sample_time:.4g} s are off by more than is said of them. Take shorter steps, or "
                   "a part of the log at its own.")
