"""Rows of a held input in which it is elsewhere for one sample: a pulse, or a cell that was misread."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._rhythm import in_rhythm

_APART = 4.0  # times what the two rows beside it differ by
_LARGE = 0.05  # of the largest value of the column
_RARE = 0.01  # of the rows; three at least
_SHORT = 3  # samples of a short pulse


def lone_rows(column: NDArray[np.float64]) -> NDArray[np.intp]:
    """Rows in which an input stands apart from the rows before and after it, which are alike.

    Parameters
    ----------
    column : ndarray, shape (n,)
        Values of the input, in its own unit.

    Returns
    -------
    ndarray of int
        Such rows; none where they come in a rhythm, are more than 1 % of the column (three at least), or stand among
        as many pulses of two or three samples (three at least), as in an experiment with short pulses.

    Examples
    --------
    >>> import numpy as np
    >>> current = np.full(500, 4.37)
    >>> current[40] = 1.10
    >>> lone_rows(current)
    array([40])
    """
    before, here, after = column[:-2], column[1:-1], column[2:]
    off, large = np.minimum(np.abs(here - before), np.abs(here - after)), _LARGE * np.max(np.abs(column), initial=0.0)
    same_side = (here - before) * (here - after) > 0.0
    apart = (off > _APART * np.abs(after - before)) & (off > large)
    rows = np.flatnonzero(same_side & apart) + 1
    rows = rows[~in_rhythm(rows, here[rows - 1] - before[rows - 1])]
    held = np.diff(np.flatnonzero(np.abs(np.diff(column)) > large))  # from step to step
    pulses = int(np.sum((held > 1) & (held <= _SHORT)))
    return rows if rows.size <= max(3, _RARE * len(column)) and pulses < max(3, rows.size) else rows[:0]
