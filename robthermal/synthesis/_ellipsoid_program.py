"""The smallest ellipsoid that disturbances of limited size do not drive a hull of plants out of: matrix inequalities.

With Q = P^-1 and a decay α, at every vertex [AQ + QA' + αQ, B; B', -diag β] <= 0, Σ β_k d_k² <= α (Boyd et al. 1994,
section 6.1.3; sampled [(1 - α)Q, QA', 0; ., Q, B; ., ., diag β] >= 0). One search over α; the volume, whose logarithm
is concave in Q, by its tangent, a few times.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy
from scipy.linalg import cholesky, solve_continuous_lyapunov, solve_discrete_lyapunov

from .._arrays import Array
from ..conic import inside
from ._affine import Matrices, Unknowns, symmetric

_MARGIN = 1e-6  # of the inequalities in round coordinates: above the solver's own tolerance
_TANGENTS = 3  # of the logarithm of the volume
_TRIES = 24  # decays that are tried
_SPARE = 1e-7  # of the level above what floats say


@dataclass(frozen=True)
class Driven:
    """x' = A x + B w (or x+) at the vertices; ``size``: bounds of |w|, one number or one per input; rows r x <= g."""

    A: Array
    B: Array
    dt: float
    size: Array
    joint: bool
    rows: Array
    bounds: Array

    @property
    def longest(self) -> float:
        """Largest decay that every vertex allows; not positive where one is not stable."""
        modes = np.linalg.eigvals(self.A)
        return float(1 - np.abs(modes).max() ** 2 if self.dt else -2 * modes.real.max())


@dataclass(frozen=True)
class Kept:
    """P of x'Px <= 1 with what proves it: decay and multipliers (one, or one per disturbance); -log det P."""

    P: Array
    decay: float
    multipliers: Array
    volume: float


def smallest(driven: Driven) -> Kept | None:
    """Ellipsoid of small volume within the rows; None where none is found."""
    longest = driven.longest
    seen: list[Kept] = []

    def volume(share: float) -> float:
        found = _at(driven, share * longest, 1)
        seen.extend([] if found is None else [found])
        return 1e3 + share if found is None else found.volume

    # shares near the optimum of one mode are tried first: where all fail the search has no slope to follow
    start = min((0.5, 0.2, 0.8, 0.05, 0.95), key=volume)
    if not seen:
        return None
    scipy.optimize.minimize_scalar(volume, bounds=(max(start - 0.3, 1e-3), min(start + 0.3, 0.999)), method="bounded",
                                   options={"maxiter": _TRIES, "xatol": 1e-3})
    best = min(seen, key=lambda kept: kept.volume)
    return _at(driven, best.decay, _TANGENTS) or best


def _at(driven: Driven, decay: float, tangents: int) -> Kept | None:
    """Ellipsoid for one decay; the shape is improved ``tangents`` times."""
    T = _start(driven, decay)
    best = None
    for _ in range(tangents):
        solved = _program(driven, decay, T)
        if solved is None:
            break
        Q, weights = solved
        kept = _scaled(driven, decay, np.linalg.inv(Q), weights)
        if kept is None or (best is not None and kept.volume >= best.volume):
            break
        best = kept
        T = cholesky((Q + Q.T) / 2, lower=True)
    return best


def _start(driven: Driven, decay: float) -> Array:
    """Coordinates in which the reachable set of the mean plant is round."""
    A, B = driven.A.mean(axis=0), driven.B.mean(axis=0) * (driven.size if not driven.joint else driven.size[0])
    n = len(A)
    noise = B @ B.T
    noise = noise + 1e-6 * (np.trace(noise) / n or 1.0) * np.eye(n)
    half = 0.5 * decay
    Q = (solve_discrete_lyapunov(A / np.sqrt(1 - half), noise) if driven.dt else
         solve_continuous_lyapunov(A + half / 2 * np.eye(n), -noise))
    values, vectors = np.linalg.eigh((Q + Q.T) / 2)
    return vectors * np.sqrt(np.maximum(values, 1e-9 * values.max()))


def _program(driven: Driven, decay: float, T: Array) -> tuple[Array, Array] | None:
    A = np.linalg.solve(T, driven.A @ T)
    B = np.linalg.solve(T, driven.B * (driven.size if not driven.joint else driven.size[0]))
    n, m = B.shape[1:]
    rows = (driven.rows @ T) / driven.bounds[:, None]
    shapes = {"Q=": (n, n)} if driven.joint else {"Q=": (n, n), "b": (m, m)}
    unknowns = Unknowns(shapes, {"b": np.eye(m)})
    zero = np.zeros((n, m))

    def weights(v: Matrices) -> Array:
        return decay * np.eye(m) if driven.joint else v["b"]

    def form(k: int, v: Matrices) -> Array:
        Q, a = v["Q"], A[k]
        if driven.dt:
            return symmetric([[(1 - decay) * Q, Q @ a.T, zero], [Q, B[k]], [weights(v)]])
        return symmetric([[-a @ Q - Q @ a.T - decay * Q, B[k]], [weights(v)]])

    forms = [unknowns.inequality(partial(form, k), _MARGIN) for k in range(len(A))]
    if not driven.joint:
        forms.append(unknowns.inequality(lambda v: np.array([[decay - np.trace(v["b"])]])))
    forms += [unknowns.inequality(partial(_room, row), _SPARE) for row in rows]
    forms.append(unknowns.inequality(lambda v: v["Q"], _MARGIN))
    found = inside(forms, unknowns.gradient(lambda v: float(np.trace(v["Q"]))))
    if not found.solved:
        return None
    v = unknowns.matrices(found.x)
    if np.linalg.eigvalsh(v["Q"])[0] <= 0:
        return None
    sizes = driven.size if not driven.joint else np.full(m, driven.size[0])
    return T @ v["Q"] @ T.T, np.diag(weights(v)) / sizes**2


def _room(row: Array, v: Matrices) -> Array:
    return np.array([[1 - row @ v["Q"] @ row]])


def _scaled(driven: Driven, decay: float, P: Array, weights: Array) -> Kept | None:
    """The smallest multiple of the ellipsoid that floats show, a little larger, as x'Px <= 1."""
    P = (P + P.T) / 2
    if weights.min() <= 0:
        return None
    need = 0.0
    for A, B in zip(driven.A, driven.B, strict=True):
        own = (1 - decay) * P - A.T @ P @ A if driven.dt else -(P @ A + A.T @ P) - decay * P
        cross, last = (A.T @ P @ B, B.T @ P @ B) if driven.dt else (P @ B, 0.0)
        if np.linalg.eigvalsh(own)[0] <= 0:
            return None
        wanted = cross.T @ np.linalg.solve(own, cross) + last
        half = 1 / np.sqrt(weights)
        need = max(need, float(np.linalg.eigvalsh(half[:, None] * wanted * half)[-1]))
    paid = weights[0] * driven.size[0] ** 2 if driven.joint else float(np.sum(weights * driven.size**2))
    level = need * paid / decay * (1 + _SPARE)
    multipliers = need * weights / level * (1 + _SPARE / 2)
    P = P / level
    inverse = np.linalg.inv(P)
    if any(row @ inverse @ row >= bound**2 for row, bound in zip(driven.rows, driven.bounds, strict=True)):
        return None
    return Kept(P, decay, multipliers[:1] if driven.joint else multipliers, -float(np.linalg.slogdet(P)[1]))
