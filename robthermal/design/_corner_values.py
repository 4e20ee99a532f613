"""Corners of ranges of parameters: all of them where they are few, else those that matter and some at random."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product

import numpy as np

from ..errors import InputError
from ..thermal import System

Ranges = Mapping[str, tuple[float, float]]
Corner = dict[str, float]
MOST = 64  # corners that are computed; all of up to six parameters


def checked_ranges(system: System, parameters: Ranges | None) -> dict[str, tuple[float, float]]:
    """Ranges with their names and order checked.

    Parameters
    ----------
    system : System
        Whose parameters they are.
    parameters : mapping or None
        {parameter name: (lower, upper)}, each in its unit.
    """
    found = {}
    for name, pair in (parameters or {}).items():
        system.parameter(name)  # refuses unknown names
        try:
            low, high = (float(end) for end in pair)
        except (TypeError, ValueError):
            low = high = float("nan")
        if not (np.isfinite([low, high]).all() and low <= high):
            raise InputError(f"{pair!r}", where=f"argument parameters[{name!r}]",
                             expected="(lower, upper), finite, lower <= upper")
        if low < high:
            found[name] = (low, high)
    return found


def corners(ranges: Ranges, worst: Callable[[Sequence[Corner]], Sequence[Sequence[int]]]) -> tuple[list[Corner], int]:
    """Corners to compute, and how many there are in all.

    Parameters
    ----------
    ranges : mapping
        Of the parameters that matter.
    worst : callable
        Called with one corner per end of every parameter, the others nominal (low and high in turn); gives for every
        quantity of interest the end, 0 or 1, of every parameter that makes it smaller.
    """
    names, total = list(ranges), 2 ** len(ranges)
    if total <= MOST:
        return [dict(zip(names, ends, strict=True)) for ends in product(*ranges.values())] if names else [], total
    single = [{name: end} for name in names for end in ranges[name]]
    chosen = {tuple(ends) for ends in worst(single)}
    rng = np.random.default_rng(0)
    while len(chosen) < MOST - len(single):
        chosen.add(tuple(int(end) for end in rng.integers(0, 2, len(names))))
    return single + [{name: ranges[name][end] for name, end in zip(names, ends, strict=True)}
                     for ends in sorted(chosen)], total
