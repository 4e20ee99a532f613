"""Coefficients that keep Euclidean norms small."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, vstack

from ._solver import Array, Point, second_order, solved


@dataclass(frozen=True)
class NormBounds:
    """Many bounds of one shape: |M_k x + m_k| <= b_k + c_k t, Euclidean norm.

    Parameters
    ----------
    matrix : ndarray, shape (n_k, d, n)
        Matrices M_k of the norms.
    offset : ndarray, shape (n_k, d)
        Constant parts m_k.
    bound : ndarray, shape (n_k,)
        Bounds b_k of the norms.
    slope : float
        c_k, the same for all: 0 for a plain constraint, 1 where t bounds the norm.
    """

    matrix: Array
    offset: Array
    bound: Array
    slope: float = 0.0


def smallest_bound(bounds: Sequence[NormBounds], n: int) -> Point:
    """Find x with the smallest t under bounds on norms: a second-order cone program.

    The cones are stacked as arrays: a program of 60 coefficients and 4000 frequencies is assembled in milliseconds.

    Parameters
    ----------
    bounds : sequence of NormBounds
        At least one of them with a slope.
    n : int
        Number of coefficients.

    Returns
    -------
    Point

    Examples
    --------
    >>> far = NormBounds(np.eye(2)[None], np.array([[-3.0, -4.0]]), np.zeros(1), 1.0)  # distance to (3, 4)
    >>> disc = NormBounds(np.eye(2)[None], np.zeros((1, 2)), np.ones(1))  # inside the unit circle
    >>> found = smallest_bound([far, disc], 2)
    >>> print(found.x.round(4), round(found.value, 4))
    [0.6 0.8] 4.0
    """
    rows, offsets, cones = [], [], []
    for group in bounds:
        count, d, _ = group.matrix.shape
        # s = offset - rows (x, t) lies in the cone s_0 >= |s_1..d|
        block = np.zeros((count, d + 1, n + 1))
        block[:, 0, -1] = -group.slope
        block[:, 1:, :-1] = -group.matrix
        rows.append(csc_matrix(block.reshape(-1, n + 1)))
        offsets.append(np.column_stack([group.bound, group.offset]).ravel())
        cones += [second_order(d + 1)] * count
    cost = np.zeros(n + 1)
    cost[-1] = 1.0
    found = solved(cost, vstack(rows, format="csc"), np.concatenate(offsets), cones)
    if not found.solved:
        return Point(np.zeros(n), np.nan, found.status, False)
    return Point(found.x[:-1], float(found.x[-1]), found.status, True)
