"""A sine at times the same step apart, for a hundredth of the sines and cosines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def sine(n: int, step: float, start: float) -> NDArray[np.float64]:
    """sin(start + k step) for k from 0 to n - 1: by the sum of two angles, one of which goes in long steps.

    Parameters
    ----------
    n : int
        How many numbers.
    step : float
        From one angle to the next [rad].
    start : float
        First angle [rad].

    Examples
    --------
    >>> import numpy as np
    >>> bool(np.allclose(sine(1000, 0.3, 2.0), np.sin(2.0 + 0.3 * np.arange(1000)), rtol=0, atol=1e-13))
    True
    """
    some = int(np.sqrt(n)) + 1
    long, short = start + step * some * np.arange(-(-n // some)), step * np.arange(some)
    by_long, by_short = np.column_stack([np.sin(long), np.cos(long)]), np.stack([np.cos(short), np.sin(short)])
    return np.asarray(by_long @ by_short).ravel()[:n]
