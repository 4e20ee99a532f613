"""Anti-windup in a region: the gain and an ellipsoid from whose every start the limited loop comes to rest.

q = v - sat(v) obeys q_i (v_i - G_i x - q_i) >= 0 wherever |G_i x| <= limit_i (Gomes da Silva and Tarbouriech 2005). For
the gain found the ellipsoid is enlarged with all combinations of limited controls (Hu and Lin 2001), which is also what
the certificate proves.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from scipy.linalg import block_diag, cholesky, solve_continuous_lyapunov, solve_discrete_lyapunov

from .._arrays import Array
from ..conic import inside
from ..linear import Plant, made_by
from ..verification import Certificate, establish
from ._affine import Matrices, Unknowns, symmetric
from ._plant import GeneralizedPlant

_MARGIN = 1e-6
_RATES = (0.1, 0.01, 0.0)  # of the speed of the loop without limits: decay in the region, in turn
_MOST_CONTROLS = 6  # whose combinations are listed
_INSIDE = 1e-9  # of the level below what floats say
_SPARE = 1e-6  # of the rate below what floats say
_SHARE = 0.5  # of the largest energy of disturbances: what the gain is shown for
_SLACKS = (1e-4, 1e-3, 1e-2)  # of the gain above that of floats, in turn


@dataclass(frozen=True)
class Attraction:
    """Gain E, and the set x'Px <= level that is never left; ``held``: H of the proof, ``rate`` of the decay."""

    E: Array
    P: Array
    level: float
    rate: float
    held: Array


def attraction(loop: Plant, limits: Array, states: int, k: int) -> Attraction | None:
    """E and the region of a loop from (w, q, e) to (z, v); ``states``: of the plant, the first ones, ``k``: of K."""
    n_u = len(limits)
    T = _coordinates(loop, states)
    A, B, F = np.linalg.solve(T, loop.A @ T), np.linalg.solve(T, loop.B), loop.C[-n_u:] @ T
    m = loop.B.shape[1] - n_u - k
    Bq, Be = B[:, m:m + n_u], B[:, m + n_u:]
    speed = float(1 - np.abs(np.linalg.eigvals(A)).max() if loop.dt else -np.linalg.eigvals(A).real.max())
    for share in _RATES:
        rate = share * speed
        first = _sector(A, Bq, Be, F, limits, states, rate, loop.dt)
        if first is None:
            continue
        E, Q, Z = first
        larger = _corners(A, Bq + Be @ E, F, limits, states, rate, loop.dt) if n_u <= _MOST_CONTROLS else None
        for pair in (larger, (Q, Z)):
            found = None if pair is None else _measured(loop, limits, m, E, T, *pair)
            if found is not None:
                return found
    return None


def _coordinates(loop: Plant, states: int) -> Array:
    """States of plant and controller in sizes of their own, those of the plant not mixed with the others."""
    driven = loop.B @ loop.B.T
    driven = driven + 1e-9 * np.trace(driven) / len(driven) * np.eye(len(driven))
    W = solve_discrete_lyapunov(loop.A, driven) if loop.dt else solve_continuous_lyapunov(loop.A, -driven)
    W = (W + W.T) / 2
    return block_diag(cholesky(W[:states, :states], lower=True), cholesky(W[states:, states:], lower=True))


def _sector(A: Array, Bq: Array, Be: Array, F: Array, limits: Array, states: int, rate: float, dt: float
            ) -> tuple[Array, Array, Array] | None:
    """E, Q, Z = GQ of the largest ball of plant states with the controller at rest."""
    N, n_u, k = len(A), len(F), Be.shape[1]
    unknowns = Unknowns({"Q=": (N, N), "Z": (n_u, N), "M": (n_u, n_u), "X": (k, n_u), "t": (1, 1)}, {"M": np.eye(n_u)})

    def form(v: Matrices) -> Array:
        Q, M = v["Q"], v["M"]
        into, seen = Bq @ M + Be @ v["X"], F @ Q - v["Z"]
        if dt:
            return symmetric([[(1 - rate) ** 2 * Q, -seen.T, Q @ A.T], [2 * M, into.T], [Q]])
        return symmetric([[-A @ Q - Q @ A.T - 2 * rate * Q, -into - seen.T], [2 * M]])

    forms = [unknowns.inequality(form, _MARGIN), unknowns.inequality(lambda v: v["M"], _MARGIN)]
    found = _largest(unknowns, forms, limits, states)
    if found is None:
        return None
    M = np.diag(found["M"])
    return (found["X"] / M, found["Q"], found["Z"]) if M.min() > 0 else None


def _corners(A: Array, B: Array, F: Array, limits: Array, states: int, rate: float, dt: float
             ) -> tuple[Array, Array] | None:
    """Q, Z = HQ for a given gain, with every set of limited controls."""
    N, n_u = len(A), len(F)
    unknowns = Unknowns({"Q=": (N, N), "Z": (n_u, N), "t": (1, 1)})

    def form(limited: tuple[int, ...], v: Matrices) -> Array:
        Q = v["Q"]
        moved = A @ Q + B @ np.diag(limited) @ (F @ Q - v["Z"])
        if dt:
            return symmetric([[(1 - rate) ** 2 * Q, moved.T], [Q]])
        return -moved - moved.T - 2 * rate * Q

    forms = [unknowns.inequality(partial(form, one), _MARGIN) for one in product((0, 1), repeat=n_u)]
    found = _largest(unknowns, forms, limits, states)
    return None if found is None else (found["Q"], found["Z"])


def _largest(unknowns: Unknowns, forms: list[Any], limits: Array, states: int) -> Matrices | None:
    """Solve with the limits of Z, and the plant's block of Q^-1 below t, least t."""
    def room(k: int, v: Matrices) -> Array:
        return symmetric([[np.eye(1), (v["Z"][k] / limits[k])[None]], [v["Q"]]])

    def shape(v: Matrices) -> Array:
        start = np.eye(len(v["Q"]))[:states]
        return symmetric([[v["t"] * np.eye(states), start], [v["Q"]]])

    forms = [*forms, *(unknowns.inequality(partial(room, k)) for k in range(len(limits))),
             unknowns.inequality(shape), unknowns.inequality(lambda v: v["Q"], _MARGIN)]
    found = inside(forms, unknowns.gradient(lambda v: float(v["t"][0, 0])))
    v = unknowns.matrices(found.x)
    return v if found.solved and np.linalg.eigvalsh(v["Q"])[0] > 0 else None


def _measured(loop: Plant, limits: Array, m: int, E: Array, T: Array, Q: Array, Z: Array) -> Attraction | None:
    """The set in the coordinates of the loop, with its level and rate as floats see them."""
    n_u = len(limits)
    H = Z @ np.linalg.inv(Q) @ np.linalg.inv(T)
    inverse = np.linalg.inv(T)
    P = inverse.T @ np.linalg.inv(Q) @ inverse
    P = (P + P.T) / 2
    F, B = loop.C[-n_u:], loop.B[:, m:m + n_u] + loop.B[:, m + n_u:] @ E
    L = np.linalg.inv(np.linalg.cholesky(np.linalg.inv(P)))
    rates = []
    for limited in product((0, 1), repeat=n_u):
        own = L @ (loop.A + B @ np.diag(limited) @ (F - H)) @ np.linalg.inv(L)
        rates.append(1 - float(np.linalg.norm(own, 2)) if loop.dt else -float(np.linalg.eigvalsh(own + own.T)[-1]) / 2)
    sizes = np.einsum("ij,ji->i", H, np.linalg.solve(P, H.T))
    level = float(np.min(limits**2 / np.maximum(sizes, 1e-300))) * (1 - _INSIDE)
    rate = min(rates) * (1 - _SPARE)
    return Attraction(E, P / min(level, 1.0), 1.0, rate, H) if rate > 0 and level > 0 else None


def prove_region(p: GeneralizedPlant, K: Plant, limits: Array, found: Attraction) -> Certificate:
    """Certificate of kind "ellipsoid" without disturbance: never left, and V falls with the rate."""
    system = {"vertices": [{"A": p.A, "B": p.B2}], "measured": {"C": p.C2, "D": [[]] * len(p.C2)},
              "controller": _controller(K, found.E), "sample_time": p.dt}
    return _established(system, {"level": found.level, "rate": found.rate, "saturation": limits.tolist()}, found)


def prove_gain(p: GeneralizedPlant, K: Plant, limits: Array, found: Attraction, loop: Plant) -> Certificate | None:
    """Certificate of the gain from rest under disturbances of a certain energy; None where nothing is proven.

    With s P in the place of P the level s is the energy: half of the largest s at which any gain is shown is taken.
    """
    n_u, k = len(limits), len(K.A)
    m, q = loop.B.shape[1] - n_u - k, len(loop.C) - n_u
    F, V, P = loop.C[q:], loop.D[q:, :m], found.P
    B, D = (part[:, m:m + n_u] + part[:, m + n_u:] @ found.E for part in (loop.B, loop.D[:q]))
    parts = []
    for limited in product((0, 1), repeat=n_u):
        S = np.diag(limited)
        missing = S @ (F - found.held)
        parts.append((loop.A + B @ missing, loop.B[:, :m] + B @ S @ V, loop.C[:q] + D @ missing,
                      loop.D[:q, :m] + D @ S @ V))
    falls = [P - A.T @ P @ A if loop.dt else -(P @ A + A.T @ P) for A, *_ in parts]
    needs = []
    for own, (A, Bw, _, _) in zip(falls, parts, strict=True):
        cross = A.T @ P @ Bw if loop.dt else P @ Bw
        needs.append(cross.T @ np.linalg.solve(own, cross) + (Bw.T @ P @ Bw if loop.dt else 0.0))
    most = max(float(np.linalg.eigvalsh(one)[-1]) for one in needs)
    if not most > 0 or not np.isfinite(most):
        return None
    s, squared = _SHARE / most, 0.0
    for own, (A, Bw, C, Dw) in zip(falls, parts, strict=True):
        cross = s * (A.T @ P @ Bw if loop.dt else P @ Bw)
        last = np.eye(m) - (s * Bw.T @ P @ Bw if loop.dt else 0.0)
        whole, both = np.block([[s * own, -cross], [-cross.T, last]]), np.hstack([C, Dw])
        squared = max(squared, float(np.linalg.eigvalsh(both @ np.linalg.solve(whole, both.T))[-1]))
    system = {"vertices": [{"A": p.A, "B": np.hstack([p.B1, p.B2])}], "measured": {"C": p.C2, "D": p.D21},
              "controller": _controller(K, found.E), "performance": {"C": p.C1, "D": np.hstack([p.D11, p.D12])},
              "sample_time": p.dt}
    scaled = Attraction(found.E, s * P, s, 0.0, found.held)
    for slack in _SLACKS:
        bound = float(np.sqrt(squared)) * (1 + slack)
        cert = _established(system, {"level": s, "bound": bound, "saturation": limits.tolist()}, scaled)
        if cert.holds:
            return cert
    return None


def _controller(K: Plant, E: Array) -> dict[str, Array]:
    return {"A": K.A, "B": K.B, "C": K.C, "D": K.D, "windup": E}


def _established(system: dict[str, Any], region: dict[str, Any], found: Attraction) -> Certificate:
    return establish("ellipsoid", system=system, region=region, evidence={"matrix": found.P, "feedback": found.held},
                     margin={}, made_by=made_by("Clarabel semidefinite program", "candidate in floats"))
