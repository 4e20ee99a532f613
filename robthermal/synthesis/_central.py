"""The central H-infinity controller of a regular plant, D11 arbitrary, from two Riccati equations.

Glover and Doyle (1988); Zhou, Doyle and Glover (1996), theorem 17.1, whose symbols the names follow. Written once for
floats and for balls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import Array
from ..linear import Plant
from ._arithmetic import Arithmetic, floats
from ._plant import GeneralizedPlant, with_direct_path

_NEGATIVE = 1e-6  # relative to the largest: an eigenvalue of X this far below zero counts as zero
_SCALED = 1e-4  # the same with the diagonal of X scaled to one, but for entries below
_SMALL = 1e-8  # of the largest


@dataclass(frozen=True)
class Regular:
    """Plant in coordinates with D12 = [0; 1], D21 = [0 1], D22 = 0; u = from_u u', y' = to_y y."""

    A: Array
    B1: Array
    B2: Array
    C1: Array
    C2: Array
    D11: Array
    from_u: Array
    to_y: Array
    D22: Array

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        """Numbers of outputs z, measurements, disturbances, controls."""
        return len(self.C1), len(self.C2), self.B1.shape[1], self.B2.shape[1]


@dataclass(frozen=True)
class Solutions:
    """Stabilizing solutions of both Riccati equations at one level."""

    level: float
    X: Array
    Y: Array


def regular(plant: GeneralizedPlant, arithmetic: Arithmetic) -> Regular:
    """Rotate z and w, scale u and y; D12 and D21 must have full rank."""
    A, B1, B2, C1, C2 = (arithmetic.array(matrix) for matrix in (plant.A, plant.B1, plant.B2, plant.C1, plant.C2))
    D11, D12, D21 = (arithmetic.array(matrix) for matrix in (plant.D11, plant.D12, plant.D21))
    Q, R = arithmetic.orthogonal(D12)
    V, S = arithmetic.orthogonal(D21.T)
    n_u, n_y = B2.shape[1], len(C2)
    Q, V = np.hstack([Q[:, n_u:], Q[:, :n_u]]), np.hstack([V[:, n_y:], V[:, :n_y]])
    from_u, to_y = arithmetic.inv(R), arithmetic.inv(S.T)
    return Regular(A, B1 @ V, B2 @ from_u, Q.T @ C1, to_y @ C2, Q.T @ D11 @ V, from_u, to_y, plant.D22)


def least_level(plant: Regular) -> float:
    """What no controller can do better, from D11 alone: max(σ[D1111 D1112], σ[D1111; D1121])."""
    p, n_y, m, n_u = plant.sizes
    D11 = floats(plant.D11)
    return max((float(np.linalg.norm(part, 2)) for part in (D11[:p - n_u], D11[:, :m - n_y]) if part.size), default=0.0)


def solutions(plant: Regular, level: float, arithmetic: Arithmetic) -> Solutions | None:
    """X and Y at a level, None where the optimum is above it: X, Y >= 0 and ρ(XY) < level² are needed."""
    p, n_y, m, n_u = plant.sizes
    squared = arithmetic.array(np.array([[level]]))[0, 0] ** 2
    X = _equation(plant.A, plant.B1, plant.B2, plant.C1, plant.D11, n_u, squared, arithmetic)
    if X is None or not not_negative(X):
        return None
    Y = _equation(plant.A.T, plant.C1.T, plant.C2.T, plant.B1.T, plant.D11.T, n_y, squared, arithmetic)
    if Y is None or not not_negative(Y):
        return None
    if len(X) and float(abs(np.linalg.eigvals(floats(X @ Y))).max()) >= level**2:
        return None
    return Solutions(level, X, Y)


def _equation(A: Array, B1: Array, B2: Array, C1: Array, D11: Array, n_u: int, squared: object,
              arithmetic: Arithmetic) -> Array | None:
    """Stabilizing X of H∞ (its dual gives Y), D12 = [0; 1]."""
    p, m = D11.shape
    B, D12 = np.hstack([B1, B2]), arithmetic.array(np.eye(p)[:, p - n_u:])
    D = np.hstack([D11, D12])
    R = D.T @ D
    R[:m, :m] = R[:m, :m] - squared * arithmetic.array(np.eye(m))
    try:
        gain = arithmetic.inv(R) @ np.vstack([np.hstack([D.T @ C1, B.T])])
    except np.linalg.LinAlgError:
        return None
    n = len(A)
    weight = C1.T @ arithmetic.difference(D @ gain[:, :n], C1)
    H = np.block([[A - B @ gain[:, :n], -B @ gain[:, n:]], [weight, -A.T + C1.T @ D @ gain[:, n:]]])
    return arithmetic.riccati(H)


def not_negative(X: Array) -> bool:
    """Whether X >= 0 but for rounding, with its diagonal scaled to one."""
    plain = floats(X)
    diagonal = np.diag(plain)
    if len(plain) == 0:
        return True
    largest = float(abs(diagonal).max())
    if diagonal.min() < -_NEGATIVE * largest:
        return False
    if largest == 0:
        return not plain.any()
    root = np.sqrt(np.maximum(diagonal, _SMALL * largest))
    return bool(np.linalg.eigvalsh(plain / np.outer(root, root))[0] >= -_SCALED)


def controller(plant: Regular, found: Solutions, arithmetic: Arithmetic) -> Plant:
    """Central controller from y to u, D22 of the plant taken into account, in floats; LinAlgError at the optimum."""
    p, n_y, m, n_u = plant.sizes
    n, X, Y = len(plant.A), found.X, found.Y
    one = arithmetic.array(np.eye(1))[0, 0]
    squared = (one * found.level) ** 2
    B, C = np.hstack([plant.B1, plant.B2]), np.vstack([plant.C1, plant.C2])
    D_row = np.hstack([plant.D11, arithmetic.array(np.eye(p)[:, p - n_u:])])
    D_column = np.vstack([plant.D11, arithmetic.array(np.eye(m)[m - n_y:])])
    R, S = D_row.T @ D_row, D_column @ D_column.T
    R[:m, :m] = R[:m, :m] - squared * arithmetic.array(np.eye(m))
    S[:p, :p] = S[:p, :p] - squared * arithmetic.array(np.eye(p))
    F = -arithmetic.inv(R) @ (D_row.T @ plant.C1 + B.T @ X)
    L = -(plant.B1 @ D_column.T + Y @ C.T) @ arithmetic.inv(S)
    F12, F2, L12, L2 = F[m - n_y:m], F[m:], L[:, p - n_u:p], L[:, p:]
    D1111, D1112 = plant.D11[:p - n_u, :m - n_y], plant.D11[:p - n_u, m - n_y:]
    D1121, D1122 = plant.D11[p - n_u:, :m - n_y], plant.D11[p - n_u:, m - n_y:]
    left = arithmetic.inv(squared * arithmetic.array(np.eye(p - n_u)) - D1111 @ D1111.T)
    right = arithmetic.inv(squared * arithmetic.array(np.eye(m - n_y)) - D1111.T @ D1111)
    D11h = -D1121 @ D1111.T @ left @ D1112 - D1122
    D12h = _root(arithmetic.array(np.eye(n_u)) - D1121 @ right @ D1121.T)
    D21h = _root(arithmetic.array(np.eye(n_y)) - D1112.T @ left @ D1112).T
    D12h, D21h = arithmetic.array(D12h), arithmetic.array(D21h)
    Z = arithmetic.inv(arithmetic.array(np.eye(n)) - Y @ X / squared)
    B2h = Z @ (plant.B2 + L12) @ D12h
    C2h = -D21h @ (plant.C2 + F12)
    scaled = D11h @ arithmetic.inv(D21h)
    B1h = -Z @ L2 + B2h @ arithmetic.inv(D12h) @ D11h
    C1h = F2 + scaled @ C2h
    A = plant.A + B @ F + B1h @ arithmetic.inv(D21h) @ C2h
    parts = A, B1h @ plant.to_y, plant.from_u @ C1h, plant.from_u @ D11h @ plant.to_y
    A, B, C, D = (floats(part) for part in parts)
    return with_direct_path(Plant(A, B, C, D, 0.0), plant.D22)


def _root(matrix: Array) -> Array:
    """Lower triangular L with L L' = matrix, in floats: any square root of these two is allowed, to rounding."""
    return np.linalg.cholesky(floats(matrix)) if matrix.size else floats(matrix)
