"""Least quadratic cost under linear inequalities and one ball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix

from ._solver import Array, Point, nonnegative, second_order, solved


@dataclass(frozen=True)
class Ball:
    """The constraint |rows x + center| <= radius, or radius plus one of the unknowns.

    Parameters
    ----------
    rows : ndarray, shape (p, n)
        Linear part of what is limited.
    center : ndarray, shape (p,)
        Constant part of what is limited.
    radius : float
        Largest Euclidean norm.
    slack : int, optional
        Number of the unknown that is added to the radius.
    """

    rows: Array
    center: Array
    radius: float
    slack: int | None = None


def least_quadratic(quadratic: Array, cost: Array, rows: Array, bounds: Array, *, ball: Ball | None = None,
                    tolerance: float | None = None) -> Point:
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
    ball : Ball, optional
        One more constraint, of a Euclidean norm.
    tolerance : float, optional
        Of gap and feasibility; default the solver's own.

    Returns
    -------
    Point
        Its value is the cost.

    Examples
    --------
    >>> found = least_quadratic(np.eye(2), np.array([-2.0, 0.0]), np.array([[1.0, 1.0]]), np.array([1.0]))
    >>> print(found.x.round(4))  # of (x - 2)² + y², x + y <= 1
    [ 1.5 -0.5]
    >>> near = Ball(np.eye(2), np.zeros(2), 1.0)
    >>> print(least_quadratic(np.eye(2), np.array([-3.0, -4.0]), np.zeros((0, 2)), np.zeros(0), ball=near).x.round(4))
    [0.6 0.8]
    """
    left, right, cones = rows, bounds, [nonnegative(len(bounds))] if len(bounds) else []
    if ball is not None:
        top = np.zeros((1, len(cost)))
        if ball.slack is not None:
            top[0, ball.slack] = -1.0
        left = np.vstack([rows, top, -ball.rows])
        right = np.concatenate([bounds, [ball.radius], ball.center])
        cones.append(second_order(1 + len(ball.center)))
    found = solved(cost, csc_matrix(left), right, cones, quadratic=quadratic, tolerance=tolerance)
    if not found.solved:
        return Point(np.zeros(len(cost)), np.nan, found.status, False)
    return found
