"""Long least-squares problems made small: columns turned into a triangle, whose problem has the same answers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dtpqrt, dtrcon, dtrtrs

Array = NDArray[np.float64]
_ROWS = 512  # reflected at once: they stay in the cache
_COLUMNS = 8  # of them in one product
_APART = 1e-5  # reciprocal condition number of scaled columns, above which their products keep six digits of a step
_SOLVABLE = 1e-9  # the same, above which a triangle is solved to six digits
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


def turned_again(rows: Array, along: Array, z: Array) -> Array | None:
    """Another right side z (m,) as the columns J that `turned` made `rows` of turn it, (p + 1,): with R their triangle,
    R⁻ᵀ Jᵀ z. None where the columns are too near each other.

    Parameters
    ----------
    rows : ndarray, shape (p + 1, p)
        A triangle, and a row of zeros.
    along : ndarray, shape (p,)
        Products Jᵀ z.
    z : ndarray, shape (m,)
        Right side of the problem.
    """
    R = rows[:-1]
    length = np.linalg.norm(R, axis=0)
    if not np.all((length > 0.0) & np.isfinite(length)) or dtrcon(R / length)[0] < _SOLVABLE:
        return None
    inner = dtrtrs(R / length, along / length, trans=1)[0]
    return np.append(inner, np.sqrt(max(float(z @ z - inner @ inner), 0.0)))


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
    length, s, V = right_singular(J)
    kept = s > flat * s[0]
    return J @ (V[kept].T / length[:, None] / s[kept])


def right_singular(J: Array) -> tuple[Array, Array, Array]:
    """Lengths of columns J (m, p), and singular values (p,) and right vectors (p, p), by rows, of these scaled to 1.

    Parameters
    ----------
    J : ndarray, shape (m, p)
        Columns, at least as many rows.
    """
    length = np.linalg.norm(J, axis=0)
    length[length == 0.0] = 1.0
    _, s, V = np.linalg.svd(_by_reflections(J, np.zeros(len(J)))[0][:-1] / length)
    return length, s, V


def triangle(G: Array, less: Array | None = None) -> tuple[Array, Array] | None:
    """Cholesky factor R of the products G of columns, and their lengths.

    R is that of columns scaled to length 1, without what other columns explain of them; None where a step would have
    less than six digits.

    Parameters
    ----------
    G : ndarray, shape (p, p)
        Products of the columns, JᵀJ.
    less : ndarray, shape (p, p), optional
        Products of the parts of them that other columns explain.
    """
    length = np.sqrt(np.diag(G))
    if not np.all((length > 0.0) & np.isfinite(length)):
        return None
    R, failed = dpotrf((G if less is None else G - less) / np.outer(length, length), lower=0, clean=1)
    if failed or dtrcon(R)[0] * min(np.abs(R).sum(axis=0).max(), 1.0) < _APART:
        return None
    return R, length


def _by_products(J: Array, z: Array) -> tuple[Array, Array] | None:
    """By the Cholesky factor R of JᵀJ; None where this would cost digits.

    With the condition number κ of the columns, each scaled to length 1, a step is found to κ² 1e-16 of its size (Golub
    and Van Loan 2013, section 5.3.8).
    """
    return by_triangle(triangle(J.T @ J), z @ J, float(z @ z))


def by_triangle(found: tuple[Array, Array] | None, along: Array, power: float, less: float = 0.0
                ) -> tuple[Array, Array] | None:
    """A triangle from `triangle` with a right side turned in the same way; None where nothing of it would be left.

    Parameters
    ----------
    found : tuple of ndarray, or None
        What `triangle` found.
    along : ndarray, shape (p,)
        Products of the columns and the right side.
    power, less : float
        Square of the right side, and of the part of it that other columns explain.
    """
    if found is None:
        return None
    R, length = found
    inner = dtrtrs(R, along / length, trans=1)[0]
    left = power - less - float(inner @ inner)
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
