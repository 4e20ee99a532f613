"""Least quadratic cost under linear inequalities."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix

from ._solver import Array, Point, nonnegative, solved


def least_quadratic(quadratic: Array, cost: Array, rows: Array, bounds: Array) -> Point:
    """Find x with the least x'Px/2 + cost'x under rows x <= bounds: a convex quadratic program.

    Parameters
    ----------
    quadratic : ndarray, shape (n, n)
        P, symmetric and positive semidefinite.
    cost : ndarray, shape (n,)
        Linear part of the cost.
    rows : ndarray, shape (k, n)
        Left-hand sides of the inequalities.
    bounds : ndarray, shape (k,)
        Right-hand sides of the inequalities.

    Returns
    -------
    Point
        Its value is the cost.

    Examples
    --------
    >>> found = least_quadratic(np.eye(2), np.array([-2.0, 0.0]), np.array([[1.0, 1.0]]), np.array([1.0]))
    >>> print(found.x.round(4))  # of (x - 2)² + y², x + y <= 1
    [ 1.5 -0.5]
    """
    found = solved(cost, csc_matrix(rows), bounds, [nonnegative(len(bounds))], quadratic=quadratic)
    if not found.solved:
        return Point(np.zeros(len(cost)), np.nan, found.status, False)
    return found
