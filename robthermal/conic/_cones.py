"""Coefficients of least cost under bounds on norms that themselves depend on the coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, vstack

from ._inequalities import Inequality
from ._solver import Array, Point, second_order, semidefinite, solved
from ._stacked import stack


@dataclass(frozen=True)
class ConeBounds:
    """Many bounds of one shape: |M_k x + m_k| <= a_k'x + b_k, Euclidean norm.

    Parameters
    ----------
    matrix : ndarray, shape (n_k, d, n)
        Matrices M_k of the norms.
    offset : ndarray, shape (n_k, d)
        Constant parts m_k.
    slope : ndarray, shape (n_k, n)
        Slopes a_k of the bounds.
    bound : ndarray, shape (n_k,)
        Constant parts b_k of the bounds.
    """

    matrix: Array
    offset: Array
    slope: Array
    bound: Array


def least_cost(cost: Array, bounds: Sequence[ConeBounds], matrices: Sequence[Inequality] = ()) -> Point:
    """Find x with the least cost'x under bounds on norms and matrix inequalities: a cone program.

    Parameters
    ----------
    cost : ndarray, shape (n,)
        Coefficients of the cost.
    bounds : sequence of ConeBounds
        What x has to keep.
    matrices : sequence of Inequality, optional
        Matrices that have to be positive semidefinite; their margins do not count.

    Returns
    -------
    Point
        Its value is the cost.

    Examples
    --------
    >>> cone = ConeBounds(np.eye(2)[None], np.zeros((1, 2)), np.array([[0.5, 0.0]]), np.ones(1))  # |x| <= 1 + x0/2
    >>> print(least_cost(np.array([-1.0, 0.0]), [cone]).x.round(4) + 0.0)
    [2. 0.]
    """
    rows, offsets, cones = [], [], []
    for group in bounds:
        count, d, n = group.matrix.shape
        block = np.concatenate([-group.slope[:, None, :], -group.matrix], axis=1)
        rows.append(csc_matrix(block.reshape(-1, n)))
        offsets.append(np.column_stack([group.bound, group.offset]).ravel())
        cones += [second_order(d + 1)] * count
    for one in matrices:
        rows.append(csc_matrix(-stack(one.slopes).T))
        offsets.append(stack(one.constant[None])[0])
        cones.append(semidefinite(len(one.constant)))
    found = solved(cost, vstack(rows, format="csc"), np.concatenate(offsets), cones, decompose=not matrices)
    if not found.solved:
        return Point(np.zeros(len(cost)), np.nan, found.status, False)
    return found
