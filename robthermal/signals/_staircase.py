"""Staircase: levels held one after the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ._checks import finite_number, positive_number
from ._excitation_settings import held_samples


def staircase(levels: ArrayLike, dwell: float, *, sample_time: float) -> NDArray[np.float64]:
    """Hold each level for the same time.

    Parameters
    ----------
    levels : array_like, shape (n_levels,)
        In the unit of the input, in order.
    dwell : float
        Time each level is held [s], a whole number of samples.
    sample_time : float
        Time between two samples [s].

    Returns
    -------
    ndarray, shape (n_levels * dwell / sample_time,)

    Raises
    ------
    InputError
        No levels, levels that are not finite numbers, a dwell time that is not a whole number of samples.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.signals.staircase([0.0, 2.0, 1.0], 4.0, sample_time=2.0)
    array([0., 0., 2., 2., 1., 1.])
    """
    if isinstance(levels, (str, bytes)) or np.ndim(levels) != 1 or np.size(levels) == 0:
        raise InputError(f"levels is {levels!r}", where="argument levels", expected="a list of at least one number")
    values = np.array([finite_number(level, f"levels[{k}]") for k, level in enumerate(np.asarray(levels).tolist())])
    h = positive_number(sample_time, "sample_time", "s")
    return np.repeat(values, held_samples(dwell, "dwell", h))
