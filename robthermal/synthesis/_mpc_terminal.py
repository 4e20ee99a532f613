"""Terminal cost, law and set of a predictive controller: one matrix inequality, and the proof of what it says.

Kothare, Balakrishnan and Morari (1996): with W = level P^-1 and Y = K W, [W, (AW + BY)', WQ^½, Y'R^½; ., W, 0, 0;
., ., level, 0; ., ., ., level] >= 0 and r W r' <= g² for every limit. Coordinates: the largest set of the
linear-quadratic law is the unit ball.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import cholesky, solve_discrete_are, solve_discrete_lyapunov

from .._arrays import Array
from ..conic import inside
from ..linear import Plant, made_by
from ..verification import Certificate, establish
from ._affine import Matrices, Unknowns, symmetric
from ._mpc_limits import Limits

DEARER = 2.0  # times the least cost: what the terminal law may cost
_LARGEST = 100.0  # semi-axes of the set, in those of the linear-quadratic law
_SPARES = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # of P, in turn, so that the inequality is strict
_MARGIN = 1e-7
_INSIDE = 1e-9  # of the level below the largest one


@dataclass(frozen=True)
class Terminal:
    """Where a prediction has to end, and what the rest costs at most.

    Parameters
    ----------
    P : ndarray, shape (n, n)
        The cost from x on is at most x'Px under the law u = K x.
    K : ndarray, shape (m, n)
        Law u = K x that keeps all limits in the set.
    level : float
        The set is x'Px <= level; zero where none was found.
    """

    P: Array
    K: Array
    level: float


def optimal(plant: Plant, Q: Array, R: Array) -> tuple[Array, Array] | None:
    """P and K of the linear-quadratic law without limits."""
    try:
        P = solve_discrete_are(plant.A, plant.B, Q, R)
    except (np.linalg.LinAlgError, ValueError):
        return None
    K = -np.linalg.solve(R + plant.B.T @ P @ plant.B, plant.B.T @ P @ plant.A)
    stable = np.abs(np.linalg.eigvals(plant.A + plant.B @ K)).max() < 1
    return ((P + P.T) / 2, K) if stable and np.linalg.eigvalsh(P)[0] > 0 else None


def largest_level(P: Array, K: Array, limits: Limits) -> float:
    """Largest level of x'Px at which u = K x keeps every row."""
    rows = limits.G + limits.H @ K
    squares = np.einsum("ij,ji->i", rows, np.linalg.solve(P, rows.T))
    met = squares > 0
    return float((limits.g[met] ** 2 / squares[met]).min(initial=np.inf))


def terminal(plant: Plant, Q: Array, R: Array, limits: Limits, best: tuple[Array, Array]
             ) -> tuple[Terminal, Certificate | None]:
    """The largest set with its certificate; that of the linear-quadratic law where the inequality gives none."""
    for P, K in (_program(plant, Q, R, limits, best), best):
        for spare in _SPARES:
            found = _strict(plant, Q, R, limits, P, K, spare)
            if found is None:
                continue
            cert = _proven(plant, Q, R, limits, found)
            if cert.holds:
                return found, cert
    return Terminal(best[0], best[1], 0.0), None


def _program(plant: Plant, Q: Array, R: Array, limits: Limits, best: tuple[Array, Array]) -> tuple[Array, Array]:
    """P and K of the largest ball, in the coordinates of the linear-quadratic law; that law where nothing is found."""
    P0, K0 = best
    size = largest_level(P0, K0, limits)
    if not np.isfinite(size):
        return best
    T = np.sqrt(size) * np.linalg.inv(cholesky(P0))
    A, B, G = np.linalg.solve(T, plant.A @ T), np.linalg.solve(T, plant.B), limits.G @ T
    n, m = B.shape
    cost_x, cost_u = _root(T.T @ Q @ T / size), _root(R / size)
    q, r = len(cost_x), len(cost_u)
    unknowns = Unknowns({"W=": (n, n), "Y": (m, n), "s": (1, 1), "t": (1, 1)})

    def falls(v: Matrices) -> Array:
        W, Y, s = v["W"], v["Y"], v["s"][0, 0]
        return symmetric([[W, (A @ W + B @ Y).T, W @ cost_x.T, Y.T @ cost_u.T],
                          [W, np.zeros((n, q)), np.zeros((n, r))], [s * np.eye(q), np.zeros((q, r))], [s * np.eye(r)]])

    def row(k: int, v: Matrices) -> Array:
        if not limits.H[k].any():  # r W r' <= g² as it stands
            return np.array([[1 - G[k] @ v["W"] @ G[k] / limits.g[k] ** 2]])
        return symmetric([[np.eye(1), ((G[k] @ v["W"] + limits.H[k] @ v["Y"]) / limits.g[k])[None]], [v["W"]]])

    eye = np.eye(n)
    forms = [unknowns.inequality(falls, _MARGIN), unknowns.inequality(lambda v: v["W"] - v["t"][0, 0] * eye),
             unknowns.inequality(lambda v: v["W"] - v["s"][0, 0] / DEARER * eye),
             unknowns.inequality(lambda v: _LARGEST**2 - v["t"])]
    forms += [unknowns.inequality(partial(row, k)) for k in _distinct(limits)]
    found = inside(forms, unknowns.gradient(lambda v: -float(v["t"][0, 0])))
    v = unknowns.matrices(found.x)
    if not found.solved or np.linalg.eigvalsh(v["W"])[0] <= 0 or v["s"][0, 0] <= 0:
        return best
    inverse = np.linalg.inv(T)
    W = v["W"]
    P = size * v["s"][0, 0] * inverse.T @ np.linalg.solve(W, inverse)
    return (P + P.T) / 2, v["Y"] @ np.linalg.solve(W, inverse)


def _distinct(limits: Limits) -> list[int]:
    """The tightest of the rows that are equal but for sign and size: the set is symmetric."""
    found: dict[bytes, int] = {}
    rows = np.hstack([limits.G, limits.H]) / limits.g[:, None]
    for k in np.argsort(-np.abs(rows).max(axis=1), kind="stable"):
        first = rows[k][np.flatnonzero(rows[k])[0]] if rows[k].any() else 1.0
        found.setdefault((np.round(rows[k] / first, 12) + 0.0).tobytes(), int(k))  # + 0.0: there is one zero
    return sorted(found.values())


def _strict(plant: Plant, Q: Array, R: Array, limits: Limits, P: Array, K: Array, spare: float) -> Terminal | None:
    """P with a little of the law's own cost added, and its largest level."""
    loop, paid = plant.A + plant.B @ K, Q + K.T @ R @ K
    if np.abs(np.linalg.eigvals(loop)).max() >= 1:
        return None
    own = solve_discrete_lyapunov(loop.T, paid + spare * np.trace(paid) / len(P) * np.eye(len(P)))
    P = P + spare * own
    P = (P + P.T) / 2
    level = largest_level(P, K, limits) * (1 - _INSIDE)
    return Terminal(P, K, level) if np.isfinite(level) and level > 0 else None


def _proven(plant: Plant, Q: Array, R: Array, limits: Limits, found: Terminal) -> Certificate:
    m, n = found.K.shape
    system = {"vertices": [{"A": plant.A, "B": plant.B}], "sample_time": plant.dt,
              "controller": {"A": [], "B": [], "C": [[]] * m, "D": found.K}}
    region: dict[str, Any] = {"level": found.level, "limits": {"state": limits.G, "control": limits.H,
                                                               "bound": limits.g}, "cost": {"state": Q, "control": R}}
    return establish("ellipsoid", system=system, region=region, evidence={"matrix": found.P}, margin={},
                     made_by=made_by("Clarabel semidefinite program", "candidate in floats"))


def _root(matrix: Array) -> Array:
    """Rows whose squares add up to a positive semidefinite matrix."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    kept = values > 1e-14 * max(values[-1], 1e-300)
    found: Array = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
    return found
