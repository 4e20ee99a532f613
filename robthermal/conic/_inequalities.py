"""Coefficients inside linear matrix inequalities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, vstack

from ._solver import LOOSE, Array, Point, semidefinite, solved
from ._stacked import stack, strictly


@dataclass(frozen=True)
class Inequality:
    """The matrix inequality constant + Σ x_k slopes[k] >= margin t I.

    Parameters
    ----------
    constant : ndarray, shape (s, s)
        Constant part, a symmetric matrix.
    slopes : ndarray, shape (n, s, s)
        Symmetric, one per coefficient.
    margin : float
        0 for a plain inequality.
    """

    constant: Array
    slopes: Array
    margin: float = 0.0


def inside(inequalities: Sequence[Inequality], cost: Array | None = None) -> Point:
    """Find x deep inside linear matrix inequalities: the largest t, or the least cost at t = 1.

    Parameters
    ----------
    inequalities : sequence of Inequality
        Their margins bound t when no cost is given.
    cost : ndarray, shape (n,), optional
        Minimizes costᵀx instead.

    Returns
    -------
    Point
        Its value is t, or the cost.

    Examples
    --------
    >>> hyperbola = Inequality(np.array([[0.0, 1.0], [1.0, 0.0]]),  # [[x, 1], [1, y]] >= 0: x y >= 1
    ...                        np.array([[[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]]))
    >>> print(inside([hyperbola], np.array([4.0, 1.0])).x.round(2))  # of least 4 x + y
    [0.5 2. ]
    """
    columns = vstack([csc_matrix(strictly(stack(one.slopes).T, one.margin)) for one in inequalities], format="csc")
    offset = np.concatenate([stack(one.constant[None])[0] for one in inequalities])
    n = columns.shape[1] - 1
    if cost is not None:  # t = 1 is no unknown
        columns, offset = columns[:, :n], offset + columns[:, n].toarray().ravel()
    linear = np.eye(n + 1)[n] * -1.0 if cost is None else cost
    cones = [semidefinite(len(one.constant)) for one in inequalities]
    found = solved(linear, -columns, offset, cones, tolerance=LOOSE, decompose=False)
    y = found.x
    if not np.isfinite(y).all():
        return Point(np.zeros(n), np.nan, found.status, False)
    value = float(y[-1]) if cost is None else float(linear @ y)
    return Point(y[:n], value, found.status, found.solved)
