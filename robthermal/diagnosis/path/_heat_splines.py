"""Cubic splines: in time of extra heat into a lump, in log frequency of what is left of a response."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
N_SPLINES = 16
_DEGREE = 3


def heat_splines(time: Array, count: int = N_SPLINES) -> Array:
    """Cubic B-splines on even knots over the record, (n, count)."""
    return cubic_splines((time - time[0]) / (time[-1] - time[0]), count)


def cubic_splines(t: Array, count: int) -> Array:
    """Cubic B-splines on even knots from 0 to 1, at `t` (n,) within, (n, count).

    By the recursion of Cox and de Boor; scipy.interpolate has it too, and takes a fifth of a second to import.
    """
    knots = np.concatenate([[0.0] * _DEGREE, np.linspace(0.0, 1.0, count - 2), [1.0] * _DEGREE])
    t = np.minimum(t, 1.0 - 1e-12)[:, None]
    basis = ((knots[:-1] <= t) & (t < knots[1:])).astype(float)
    for degree in range(1, _DEGREE + 1):
        width = knots[degree:] - knots[:-degree]
        part = (t - knots[:-degree]) / np.where(width > 0, width, 1.0)  # between knots that are one all splines are 0
        basis = part[:, :-1] * basis[:, :-1] + (1.0 - part[:, 1:]) * basis[:, 1:]
    return basis
