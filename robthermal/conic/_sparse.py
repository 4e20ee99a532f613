"""Least squares in which few groups of coefficients differ from zero."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, hstack, vstack

from ._solver import Array, Point, nonnegative, second_order, solved


def group_sparse(G: Array, c: Array, groups: Sequence[NDArray[np.intp]], weights: Array, lower: Array,
                 upper: Array) -> Point:
    """Minimize x'Gx/2 - c'x + Σ_g w_g |x_g| with lower <= x <= upper.

    Parameters
    ----------
    G : ndarray, shape (n, n)
        Matrix of the quadratic form, positive semidefinite.
    c : ndarray, shape (n,)
        Linear part of the objective.
    groups : sequence of ndarray of int
        A partition of the coefficients; |.| is Euclidean.
    weights : ndarray, shape (n_groups,)
        Weights w_g of the groups, zero or above.
    lower, upper : ndarray, shape (n,)
        Bounds; infinite ones bound nothing.

    Returns
    -------
    Point
        Its value is the objective.

    Examples
    --------
    >>> groups = [np.array([0, 1]), np.array([2])]
    >>> found = group_sparse(np.eye(3), np.array([3.0, 4.0, -2.0]), groups, np.ones(2), np.array([-9.0, -9.0, 0.0]),
    ...                      np.full(3, np.inf))
    >>> print(found.x.round(4) + 0.0)  # (3, 4) shrinks by 1 in length; the third may not be negative
    [2.4 3.2 0. ]
    """
    n, m = len(c), len(groups)
    unit = csc_matrix(np.eye(n))
    below, above = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
    # s = offset - A (x, t): x - lower >= 0, upper - x >= 0, (t_g, x_g) in a second-order cone
    bounds = hstack([vstack([-unit[below], unit[above]]), csc_matrix((below.size + above.size, m))])
    norms, cones = [], [nonnegative(below.size + above.size)] if below.size + above.size else []
    for g, group in enumerate(groups):
        rows = np.zeros((1 + len(group), n + m))
        rows[0, n + g] = -1.0
        rows[1 + np.arange(len(group)), group] = -1.0
        norms.append(csc_matrix(rows))
        cones.append(second_order(1 + len(group)))
    A = vstack([bounds, *norms], format="csc")
    offset = np.concatenate([-lower[below], upper[above], np.zeros(n + m)])
    P = np.zeros((n + m, n + m))
    P[:n, :n] = G
    found = solved(np.concatenate([-c, weights]), A, offset, cones, quadratic=P)
    if not np.isfinite(found.x).all():
        return Point(np.zeros(n), np.nan, found.status, False)
    return Point(found.x[:n], found.value, found.status, found.solved)
