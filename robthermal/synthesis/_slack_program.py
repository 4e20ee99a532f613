"""One quadratic form per vertex, tied by a slack matrix: state feedback for constant plants of a hull.

Synthesis: de Oliveira, Bernussou and Geromel (1999), in continuous time with a number κ that is searched on a grid
(Apkarian and Tuan 2001). Analysis of the gain found: the same inequality in P, for the certificate. No evidence.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._arrays import Array
from ..conic import Inequality, inside
from ._polytope_program import Wanted
from ._vertices import Vertices

_KAPPAS = (1.0, 0.2, 5.0, 0.04, 25.0)  # times the reciprocal of the speed, in turn
_MOST = 40  # states times vertices: beyond, the program takes minutes
_SPARE = (0.02, 1e-3)  # of the speed: decay beyond what is asked


def slack_design(v: Vertices, wanted: Wanted) -> tuple[Array, Array, Array, float] | None:
    """F, matrices P_i, slack matrix and rate; None where none is found."""
    n = v.sizes[0]
    if n * len(v) > _MOST:
        return None
    speed = 1.0 if v.dt else float(np.abs(np.linalg.eigvals(v.A)).max()) or 1.0
    for spare in _SPARE:
        rate = wanted.rate + spare * speed if not v.dt else wanted.rate + spare * (1 - wanted.rate)
        for kappa in _KAPPAS[:1] if v.dt else _KAPPAS:
            F = _gain(v, rate, kappa / speed, wanted.kept)
            found = None if F is None else slack_matrices(v.loops(F)[0], wanted.rate, v.dt)
            if F is not None and found is not None:
                return F, *found
    return None


def _gain(v: Vertices, rate: float, kappa: float, kept: Array) -> Array | None:
    """Y G⁻¹ from [2ρW_i + AG + ., W_i - G' + κ AG; ., -κ (G + G')] < 0, AG = A_i G + B_i Y (sampled as 1999)."""
    n, _, m, _ = v.sizes
    alike = (kept[:, :, None] == kept[:, None, :]).all(axis=0)
    count, unit = len(v), _symmetric(n)
    place = np.argwhere(alike)
    gains = np.argwhere(kept)
    size = count * len(unit) + len(place) + len(gains)
    W = np.zeros((count, size, n, n))
    for k in range(count):
        W[k, k * len(unit):(k + 1) * len(unit)] = unit
    G, Y = np.zeros((size, n, n)), np.zeros((size, m, n))
    first = count * len(unit)
    for q, (i, j) in enumerate(place):
        G[first + q, i, j] = 1.0
    for q, (i, j) in enumerate(gains):
        Y[first + len(place) + q, i, j] = 1.0
    turned = G.transpose(0, 2, 1)
    inequalities = [_bounded(G + turned, 1.0)]  # bounds the size of everything
    for k in range(count):
        moved = v.A[k] @ G + v.B2[k] @ Y
        if v.dt:
            whole = np.block([[(1 - rate) ** 2 * W[k], moved], [moved.transpose(0, 2, 1), G + turned - W[k]]])
        else:
            cross = W[k] - turned + kappa * moved
            own = 2 * rate * W[k] + moved + moved.transpose(0, 2, 1)
            whole = -np.block([[own, cross], [cross.transpose(0, 2, 1), -kappa * (G + turned)]])
        inequalities += [Inequality(np.zeros(whole.shape[1:]), whole, 1.0),
                         Inequality(np.zeros((n, n)), W[k], 1.0), _bounded(W[k], 100.0)]
    bound = np.block([[np.zeros((size, m, m)), Y], [Y.transpose(0, 2, 1), np.zeros((size, n, n))]])
    inequalities.append(Inequality(1e4 * np.eye(m + n), bound))
    point = inside(inequalities)
    if not np.isfinite(point.value) or not point.value > 0:
        return None
    found, value = np.tensordot(point.x, Y, 1), np.tensordot(point.x, G, 1)
    F: Array = np.linalg.solve(value.T, found.T).T
    return F * kept


def slack_matrices(A: Sequence[Array] | Array, rate: float, dt: float) -> tuple[Array, Array, float] | None:
    """P_i and G with [2ρP_i, P_i; P_i, 0] + G [A_i, -1] + . < 0 (sampled [-(1 - ρ)²P_i, 0; 0, P_i]), and the rate."""
    A = np.asarray(A)
    count, n = A.shape[:2]
    unit = _symmetric(n)
    size = count * len(unit) + 2 * n * n
    P, G = np.zeros((count, size, n, n)), np.zeros((size, 2 * n, n))
    for k in range(count):
        P[k, k * len(unit):(k + 1) * len(unit)] = unit
    G[count * len(unit):] = np.eye(2 * n * n).reshape(-1, 2 * n, n)
    inequalities = []
    speed = 1.0 if dt else float(np.abs(A).max()) or 1.0
    for k in range(count):
        zero = np.zeros_like(P[k])
        half = G @ np.hstack([A[k] / speed, -np.eye(n)])
        own = (np.block([[-((1 - rate) ** 2) * P[k], zero], [zero, P[k]]]) if dt else
               np.block([[2 * rate / speed * P[k], P[k]], [P[k], zero]]))
        inequalities += [Inequality(np.zeros((2 * n, 2 * n)), -(own + half + half.transpose(0, 2, 1)), 1.0),
                         Inequality(np.zeros((n, n)), P[k], 1e-2), _bounded(P[k], 1.0)]
    inequalities.append(Inequality(1e3 * np.eye(3 * n), np.block([[np.zeros((size, 2 * n, 2 * n)), G],
                                                                  [G.transpose(0, 2, 1), np.zeros((size, n, n))]])))
    point = inside(inequalities)
    if not np.isfinite(point.value) or not point.value > 0:
        return None
    forms = np.array([np.tensordot(point.x, one, 1) for one in P])
    slack = np.tensordot(point.x, G, 1)
    slack[n:] /= speed  # of x', in the time of the plants
    return (forms + forms.transpose(0, 2, 1)) / 2, slack, rate


def _bounded(slopes: Array, size: float) -> Inequality:
    return Inequality(size * np.eye(slopes.shape[-1]), -slopes)


def _symmetric(n: int) -> Array:
    i, j = np.triu_indices(n)
    units = np.zeros((len(i), n, n))
    units[np.arange(len(i)), i, j] = units[np.arange(len(i)), j, i] = 1.0
    return units
