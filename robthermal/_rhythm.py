"""Excursions of a reading that repeat in a rhythm: a thermostat or a pulsed heater, and no glitches."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

_BACK = 4  # distances before, among which one that is the same is looked for: pulses between samples alternate
_SPREAD = 0.05  # relative, by which the distances of a rhythm differ; a sample at least
_OFTEN = 0.7  # of the distances that come again
_SURE = 1e-5  # chance that as many come again by themselves
_ALIKE = 3.0  # times the usual size: a larger excursion is none of the rhythm


def in_rhythm(rows: NDArray[np.intp], sizes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which excursions of one reading repeat at even distances, with sizes that are alike.

    Distances between excursions at random are hardly ever the same. Counted are those that one of the four before
    equals, give or take a sample or 5 %: most must, and more than chance would have it.

    Parameters
    ----------
    rows : ndarray of int
        Rows of the readings that are off, in order.
    sizes : ndarray, shape as `rows`
        By how much each is off, with its sign [K].

    Examples
    --------
    >>> import numpy as np
    >>> on = np.arange(5, 300, 17)
    >>> bool(in_rhythm(on, np.ones(on.size)).all())
    True
    >>> lost = np.sort(np.random.default_rng(1).choice(300, 18, replace=False))
    >>> bool(in_rhythm(lost, np.ones(lost.size)).any())
    False
    """
    found = np.zeros(rows.size, np.bool_)
    for sign in (-1.0, 1.0):
        at = np.flatnonzero(sign * sizes > 0)
        if at.size and _even(rows[at[np.r_[True, np.diff(rows[at]) > 1]]]):  # side by side they are one
            found[at] = np.abs(sizes[at]) <= _ALIKE * np.median(np.abs(sizes[at]))
    return found


def _even(events: NDArray[np.intp]) -> bool:
    """Whether most distances between excursions come again."""
    distances = np.diff(events)
    tried = distances.size - _BACK
    if tried < 1:
        return False
    near = np.maximum(1.0, _SPREAD * distances[_BACK:])
    again = np.any([np.abs(distances[_BACK:] - distances[_BACK - back:-back]) <= near for back in range(1, _BACK + 1)],
                   axis=0)
    usual = float(np.mean(distances))
    one = min((2.0 * max(1.0, _SPREAD * usual) + 1.0) / (2.0 * usual), 1.0)  # of two exponential distances
    count = int(again.sum())
    by_chance = float(scipy.special.bdtrc(count - 1, tried, 1.0 - (1.0 - one) ** _BACK)) if count else 1.0
    return count >= _OFTEN * tried and by_chance < _SURE
