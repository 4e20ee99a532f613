"""Inputs that change within the steps of a record of means: they act there by their mean, early or late."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

from ..thermal import System
from ._data import Data

_MOVES = 0.02  # of the range of an input: rms by which it is off its mean within a step
_STEPS = 5  # within which heat that acts half a step early or late is seen
_PART = re.compile(r" part \d+$")


def within_steps(system: System, data: Sequence[Data]) -> Iterator[str]:
    """Which inputs change within steps of means, and which times are uncertain for it, a sentence for every file.

    Parameters
    ----------
    system : System
        Model with the heaters and modules.
    data : sequence of Data
        Records, with the ripple of their inputs; the parts of a file are one.
    """
    files: dict[str, list[Data]] = {}
    for one in data:
        if one.record.averaged:
            files.setdefault(_PART.sub("", one.label), []).append(one)
    for label, parts in files.items():
        changes = {name: sum(_changes(one, name) for one in parts) for name in [*system.inputs, *system.modules]}
        names = [name for name, n in changes.items() if n]
        if names:
            several, steps = len(names) > 1, sum(len(one.record) for one in parts)
            longest = max(one.record.sample_time for one in parts)
            yield (f"{', '.join(names[:-1])}{' and ' * several}{names[-1]} {'change' if several else 'changes'} within "
                   f"{'up to ' * several}{max(changes.values())} of the {steps} steps of record {label!r} and "
                   f"{'act' if several else 'acts'} there by {'their means' if several else 'its mean'}, up to half a "
                   f"step early or late: times and capacities that act within about {_STEPS * longest:.4g} s are off "
                   "by more than is said of them. Take shorter steps, or a part of the log at its own.")


def _changes(one: Data, name: str) -> int:
    """In how many steps an input changes."""
    record = one.record
    return int(np.sum(record.ripple[name] > _MOVES * np.ptp(record[name]))) if name in record.ripple else 0
