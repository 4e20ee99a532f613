"""Tails of chi-square, F and Student's t by scipy.special: what scipy.stats answers, without its import of 0.5 s.

The survival function is the chance of a value above x; its inverse is the value that is exceeded with a given chance.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike


def chi2_sf(x: ArrayLike, freedom: ArrayLike) -> Any:
    """Survival function of chi-square.

    Parameters
    ----------
    x : array_like
        Values, at least 0 [-].
    freedom : array_like
        Degrees of freedom, above 0 [-]; else nan.

    Examples
    --------
    >>> f"{chi2_sf(3.8415, 1):.4f}"
    '0.0500'
    """
    return scipy.special.chdtrc(_positive(freedom), x)


def chi2_isf(chance: ArrayLike, freedom: ArrayLike) -> Any:
    """Inverse of `chi2_sf`.

    Parameters
    ----------
    chance : array_like
        Chance of a larger value [-].
    freedom : array_like
        Degrees of freedom, above 0 [-]; else nan.

    Examples
    --------
    >>> f"{chi2_isf(0.05, 1):.4f}"
    '3.8415'
    """
    return scipy.special.chdtri(_positive(freedom), chance)


def f_sf(x: ArrayLike, above: ArrayLike, below: ArrayLike) -> Any:
    """Survival function of F.

    Parameters
    ----------
    x : array_like
        Values, at least 0 [-].
    above, below : array_like
        Degrees of freedom of numerator and denominator, above 0 and finite [-]; else nan.

    Examples
    --------
    >>> f"{f_sf(4.9646, 1, 10):.4f}"
    '0.0500'
    """
    return scipy.special.fdtrc(above, below, x)


def f_isf(chance: ArrayLike, above: ArrayLike, below: ArrayLike) -> Any:
    """Inverse of `f_sf`.

    Parameters
    ----------
    chance : array_like
        Chance of a larger value [-].
    above, below : array_like
        Degrees of freedom of numerator and denominator, above 0 and finite [-]; else nan.

    Examples
    --------
    >>> f"{f_isf(0.05, 1, 10):.4f}"
    '4.9646'
    """
    return scipy.special.fdtri(above, below, 1.0 - np.asarray(chance))


def t_isf(chance: ArrayLike, freedom: ArrayLike) -> Any:
    """Value that Student's t exceeds with a given chance.

    Parameters
    ----------
    chance : array_like
        Chance of a larger value [-].
    freedom : array_like
        Degrees of freedom, above 0 [-]; else nan.

    Examples
    --------
    >>> f"{t_isf(0.025, 10):.4f}"
    '2.2281'
    """
    return -scipy.special.stdtrit(freedom, chance)


def _positive(freedom: ArrayLike) -> Any:
    """Degrees of freedom, those that are none as nan: scipy.special takes 0 for a chance of 0."""
    values = np.asarray(freedom, dtype=float)
    return np.where(values > 0, values, np.nan)[()]
