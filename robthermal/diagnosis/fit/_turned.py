"""Long least-squares problems made small: columns turned into a triangle, whose problem has the same answers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dtpqrt, dtrcon, dtrtrs

Array = NDArray[np.float64]
_ROWS = 512  # reflected at once: they stay in the cache
_COLUMNS = 8  # of them in one product
_APART = 1e-5  # reciprocal condition number of scaled columns, above which their products keep six digits of a step
_LEFT = 1e-8  # share of |z|² that the columns must leave: less is lost where it is a difference


def turned(J: Array, z: Array) -> tuple[Array, Array]:
    """Columns J (m, p) and z (m,) turned so that all but the first p + 1 rows are 0: |z - J a| is the same for every a.

    By the products of the columns (the normal equations) where these are far enough from each other, else by
    reflections.

    Parameters
    ----------
    J : ndarray, shape (m, p)
        Columns of a least-squares problem.
    z : ndarray, shape (m,)
        Its right side.

    Returns
    -------
    tuple of ndarray, shapes (p + 1, p) and (p + 1,)
    """
    found = _by_products(J, z)
    return _by_reflections(J, z) if found is None else found


def orthonormal(J: Array, flat: float) -> Array:
    """Orthonormal columns (m, r) with the span of the columns J (m, p), directions of relative size `flat` left out.

    Parameters
    ----------
    J : ndarray, shape (m, p)
        Columns, at least as many rows.
    flat : float
        Singular value of the columns, each scaled to length 1, relative to the largest, that counts as none.

    Returns
    -------
    ndarray
    """
    length = np.linalg.norm(J, axis=0)
    length[length == 0.0] = 1.0
    R = _by_reflections(J, np.zeros(len(J)))[0][:-1]
    _, s, V = np.linalg.svd(R / length)
    kept = s > flat * s[0]
    return J @ (V[kept].T / length[:, None] / s[kept])


def _by_products(J: Array, z: Array) -> tuple[Array, Array] | None:
    """Cholesky factor R of JᵀJ, R⁻ᵀJᵀz, and what is left of z; None where this would cost digits.

    With the condition number κ of the columns, each scaled to length 1, a step is found to κ² 1e-16 of its size (Golub
    and Van Loan 2013, section 5.3.8).
    """
    G = J.T @ J
    length = np.sqrt(np.diag(G))
    if not np.all((length > 0.0) & np.isfinite(length)):
        return None
    R, failed = dpotrf(G / np.outer(length, length), lower=0, clean=1)
    if failed or dtrcon(R)[0] < _APART:
        return None
    inner, power = dtrtrs(R, (z @ J) / length, trans=1)[0], float(z @ z)
    left = power - float(inner @ inner)
    if not left > _LEFT * power:
        return None
    return np.concatenate([R * length, np.zeros((1, len(R)))]), np.append(inner, np.sqrt(left))


def _by_reflections(J: Array, z: Array) -> tuple[Array, Array]:
    """By Householder's reflections, some rows at a time below the triangle of those before.

    Golub and Van Loan 2013, section 5.2.2; a whole record does not fit into a cache.
    """
    size = J.shape[1] + 1
    R = np.zeros((size, size), order="F")
    for first in range(0, len(J), _ROWS):
        some = slice(first, first + _ROWS)
        rows = np.empty((len(z[some]), size), order="F")
        rows[:, :-1], rows[:, -1] = J[some], z[some]
        R = dtpqrt(0, min(_COLUMNS, size), R, rows, overwrite_a=1, overwrite_b=1)[0]
    return R[:, :-1], R[:, -1]
