"""Bins whose residual is larger than the noise of neighboring bins explains: the local model does not fit there."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from .._arrays import Array
from ._threads import run_all

_LEVEL = 2e-3  # chance of a false alarm in one output of one bin, before the estimation error of the reference
_PIECE = 2**16  # bins compared at a time: few long calls, for threads wait for each other between calls of numpy
_SIDE_BY_SIDE = 50_000  # bins of all outputs from which other threads help
_REACH = 6  # width of the reference on either side, in half widths


def suspect_bins(variance: Array, degrees_of_freedom: Array, half_width: int, rounding: Array) -> Array:
    """Compare each noise variance (n_y, F) with the median of the bins next to its window, left and right.

    A residual as small as the `rounding` (n_y,) of the data is no evidence of anything.

    The lower of the two medians counts, so that a hump between quiet neighbors (a resonance narrower than the window,
    the slowest pole near bin 0) is found, while a slope of the noise spectrum is not. Bins share data within
    2 half_width, hence the gap. The reference has an error of its own, which the threshold allows for.
    """
    n_y, n_f = variance.shape
    gap, reach = 2 * half_width + 1, _REACH * max(half_width, 1)
    if n_f < gap + reach:
        gap, reach = min(gap, n_f // 2), max(1, n_f // 4)
    # F(2q, 2q') with q' the independent bins of the reference times their q: a median of correlated estimates.
    independent = max(2.0, 1.5 * reach / gap)
    least, most = (max(1, int(one)) for one in (degrees_of_freedom.min(), degrees_of_freedom.max()))
    q = np.arange(1.0, most + 1.0)
    # One number for all bins, as without weak ones: nothing to look up.
    place = most - 1 if least == most else np.maximum(degrees_of_freedom, 1) - 1
    limit = np.broadcast_to(scipy.special.fdtri(2.0 * q, 2.0 * q * independent, 1.0 - _LEVEL / n_y)[place], n_f)
    ratio = np.broadcast_to(_median_ratio(q)[place], n_f)
    by_output = np.zeros((n_y, n_f), dtype=bool)
    stride = max(1, reach // 2)
    piece = max(1, _PIECE // stride) * stride
    pieces = range(0, n_f, piece)

    def compare(item: int) -> None:
        o, part = item % n_y, slice(pieces[item // n_y], pieces[item // n_y] + piece)
        level = _reference(lambda few: variance[o, few] / ratio[few], n_f, part, gap, reach)
        np.maximum(level, rounding[o] ** 2, out=level)
        np.greater(variance[o, part], np.multiply(limit[part], level, out=level), out=by_output[o, part])

    run_all(compare, range(n_y * len(pieces)), worth=n_y * n_f > _SIDE_BY_SIDE)
    return np.asarray(by_output.any(axis=0))


def _median_ratio(q: Array) -> Array:
    """Median over mean of chi-square with 2q degrees of freedom (Wilson and Hilferty)."""
    return (1.0 - 1.0 / (9.0 * q)) ** 3


def _medians(rows: Array) -> Array:
    """Medians of rows; a sort of short rows is several times faster than np.median."""
    n = rows.shape[1]
    increasing = np.sort(rows, axis=1)  # not-a-number comes last
    medians = 0.5 * (increasing[:, (n - 1) // 2] + increasing[:, n // 2])
    medians[np.isnan(increasing[:, -1])] = np.nan
    return medians


def _reference(row: Callable[[slice], Array], n: int, part: slice, gap: int, reach: int) -> Array:
    """Lower of the medians of the `reach` bins beyond `gap`, left and right, of some of the n bins of a row.

    Infinite sides do not count. `row` gives the values of a slice. The part begins at a multiple of half of `reach`.
    """
    # Medians at half-overlapping windows only: the reference then moves by less than half its own width. Window i
    # begins at bin i stride. On the right of bin k the first with i stride >= k + gap counts, on the left the last that
    # ends at k - gap or before: the same two for all bins of a block of `stride` between two places in it.
    a, b, stride = part.start, min(part.stop, n), max(1, reach // 2)
    place = np.arange(stride)
    right, left = -((-place - gap) // stride), (place - gap - reach + 1) // stride
    first, count = a // stride, -(-(b - a) // stride)
    low, high = first + left[0], first + count + right[-1]  # windows that may be asked for
    medians = np.full(high - low, np.inf)
    there = slice(max(low, 0), min(high, (n - reach) // stride + 1))
    if there.stop > there.start:
        values = row(slice(there.start * stride, (there.stop - 1) * stride + reach))
        medians[there.start - low : there.stop - low] = _medians(sliding_window_view(values, reach)[::stride])
    blocks = np.empty((count, stride))
    limits = [0, *(np.flatnonzero(np.diff(right) + np.diff(left)) + 1), stride]
    for r, end in pairwise(limits):
        on_right, on_left = (medians[first + side[r] - low :][:count] for side in (right, left))
        blocks[:, r:end] = np.minimum(on_right, on_left)[:, None]
    lower = blocks.ravel()[: b - a]
    known = np.isfinite(lower)
    return lower if known.all() else np.where(known, lower, np.median(row(slice(0, n))))
