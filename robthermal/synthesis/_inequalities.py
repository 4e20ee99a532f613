"""Output feedback by matrix inequalities: Scherer, Gahinet and Chilali (1997), one Lyapunov matrix for all aims.

With P = [X 1; 1 Y] and the loop in new unknowns A^, B^, C^, D^ (their equations (35)-(47)) every aim is affine. Nothing
is proven here: what comes out is a controller, and whoever asked evaluates it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cholesky, solve_continuous_lyapunov, solve_discrete_lyapunov, svd

from .._arrays import Array
from ..conic import Inequality, Point, inside
from ..linear import Plant, close
from ._affine import Matrices, Unknowns, symmetric
from ._plant import GeneralizedPlant, with_direct_path

MOST_STATES = 12  # of a plant: unknowns grow with the square, time with the sixth power
_RELAXED = 1.002  # of the optimum, for a solution away from the boundary
_LARGEST = 100.0  # of t in [X t; t Y], in coordinates where X = Y of a known loop
_MARGIN = 1e-7  # of every inequality, in the same coordinates


@dataclass(frozen=True)
class Aims:
    """What is asked of a loop.

    Parameters
    ----------
    norm2 : GeneralizedPlant or None
        Channels whose H2 norm is to be small.
    norminf : GeneralizedPlant or None
        Channels whose H-infinity norm counts.
    level : float or None
        Bound of the H-infinity norm; None: it is to be small.
    poles : mapping
        Region of the closed-loop eigenvalues: decay, damping, radius.
    """

    norm2: GeneralizedPlant | None
    norminf: GeneralizedPlant | None
    level: float | None
    poles: Mapping[str, float]


def solved_for(plant: GeneralizedPlant, aims: Aims, known: Plant) -> Plant | None:
    """Controller of the plant's own order, from the coordinates of a known stabilizing one; None where none comes."""
    T = coordinates(plant, known)
    if T is None:
        return None
    aims = replace(aims, norm2=moved(aims.norm2, T), norminf=moved(aims.norminf, T))
    own = moved(plant, T)
    assert own is not None
    unknowns, inequalities, cost, first = _optimum(own, aims)
    if not np.isfinite(first.value) or not first.x.any():
        return None
    found = _apart(unknowns, inequalities, cost, first.value, len(own.A))
    for x in (found, first.x):
        K = None if x is None else rebuilt(own, unknowns.matrices(x))
        if K is not None:
            return with_direct_path(K, plant.D22)
    return None


def _optimum(plant: GeneralizedPlant, aims: Aims) -> tuple[Unknowns, list[Inequality], Array, Point]:
    """The program and its solution."""
    unknowns = _unknowns(plant, aims)
    inequalities = [unknowns.inequality(form, _MARGIN) for form in _forms(aims, plant)]
    cost = unknowns.gradient(lambda v: _cost(aims, v))
    return unknowns, inequalities, cost, inside(inequalities, cost)


def _cost(aims: Aims, v: Matrices) -> float:
    """H2 norm squared, level squared, or the size of X and Y where the level is given."""
    if aims.norm2 is not None:
        return float(np.trace(v["Q"]))
    return float(v["g"][0, 0]) if aims.level is None else float(np.trace(v["X"]) + np.trace(v["Y"]))


def coordinates(plant: GeneralizedPlant, K: Plant) -> Array | None:
    """T, x = T x̂, in which X = Y is diagonal for the loop of a known controller: the free scale of X and Y is gone."""
    loop = close(plant.joined, K)
    n, size = len(plant.A), len(loop.A)
    if not loop.stable or n == 0:
        return None
    try:
        seen = loop.C.T @ loop.C
        seen = seen + 1e-6 * (np.trace(seen) / size or 1.0) * np.eye(size)
        P = (solve_discrete_lyapunov(loop.A.T, seen) if plant.dt else solve_continuous_lyapunov(loop.A.T, -seen))
        X, Y = np.linalg.inv((P + P.T) / 2)[:n, :n], (P[:n, :n] + P[:n, :n].T) / 2
        L = cholesky((X + X.T) / 2, lower=True)
        U, squares, _ = svd(L.T @ Y @ L)
    except (np.linalg.LinAlgError, ValueError):
        return None
    T: Array = L @ U / squares**0.25
    return T if np.isfinite(T).all() and np.linalg.cond(T) < 1e12 else None


def moved(plant: GeneralizedPlant | None, T: Array) -> GeneralizedPlant | None:
    """The plant with states x = T x̂."""
    if plant is None:
        return None
    into = np.linalg.inv(T)
    return replace(plant, A=into @ plant.A @ T, B1=into @ plant.B1, B2=into @ plant.B2, C1=plant.C1 @ T,
                   C2=plant.C2 @ T)


def _unknowns(plant: GeneralizedPlant, aims: Aims) -> Unknowns:
    n, m, p = len(plant.A), plant.B2.shape[1], len(plant.C2)
    shapes = {"X=": (n, n), "Y=": (n, n), "A": (n, n), "B": (n, p), "C": (m, n), "D": (m, p), "g": (1, 1), "t": (1, 1)}
    masks = {"g": np.array([[aims.norminf is not None and aims.level is None]])}
    if aims.norm2 is not None:
        q = len(aims.norm2.C1)
        shapes["Q="] = (q, q)
        if not plant.dt:  # D11 + D12 D^ D21 = 0, exactly: only entries that no channel sees are free
            masks["D"] = ~np.outer(aims.norm2.D12.any(axis=0), aims.norm2.D21.any(axis=1))
    return Unknowns(shapes, masks)


def _loop(plant: GeneralizedPlant, v: Matrices) -> tuple[Array, Array, Array, Array, Array]:
    """P, and A, B, C, D of the loop in the new unknowns."""
    eye = np.eye(len(plant.A))
    P = symmetric([[v["X"], eye], [v["Y"]]])
    A = np.block([[plant.A @ v["X"] + plant.B2 @ v["C"], plant.A + plant.B2 @ v["D"] @ plant.C2],
                  [v["A"], v["Y"] @ plant.A + v["B"] @ plant.C2]])
    B = np.vstack([plant.B1 + plant.B2 @ v["D"] @ plant.D21, v["Y"] @ plant.B1 + v["B"] @ plant.D21])
    C = np.hstack([plant.C1 @ v["X"] + plant.D12 @ v["C"], plant.C1 + plant.D12 @ v["D"] @ plant.C2])
    return P, A, B, C, plant.D11 + plant.D12 @ v["D"] @ plant.D21


def _forms(aims: Aims, plant: GeneralizedPlant) -> Iterator[Callable[[Matrices], Array]]:
    """Affine forms that have to be positive."""
    if aims.norm2 is not None:
        two = aims.norm2
        yield lambda v: _gramian(two, v)
        yield lambda v: _trace(two, v)
    if aims.norminf is not None:
        inf, level = aims.norminf, aims.level
        yield lambda v: bounded_real(inf, v, level)
    if aims.poles:
        yield from _region(plant, aims.poles)
    yield lambda v: symmetric([[v["X"], np.eye(len(plant.A))], [v["Y"]]])


def _gramian(plant: GeneralizedPlant, v: Matrices) -> Array:
    P, A, B, _, _ = _loop(plant, v)
    eye = np.eye(B.shape[1])
    if plant.dt:
        return symmetric([[P, A, B], [P, np.zeros_like(B)], [eye]])
    return symmetric([[-A - A.T, -B], [eye]])


def _trace(plant: GeneralizedPlant, v: Matrices) -> Array:
    P, _, B, C, D = _loop(plant, v)
    if plant.dt:
        return symmetric([[v["Q"], C, D], [P, np.zeros_like(B)], [np.eye(B.shape[1])]])
    return symmetric([[v["Q"], C], [P]])


def bounded_real(plant: GeneralizedPlant, v: Matrices, level: float | None) -> Array:
    """Positive where the norm of the loop stays below the level, or below the root of the unknown g."""
    P, A, B, C, D = _loop(plant, v)
    square = float(v["g"][0, 0]) if level is None else level**2  # with 1, level²: implies the gramian's of the H2 norm
    top, bottom = np.eye(B.shape[1]), square * np.eye(len(C))
    if plant.dt:
        return symmetric([[P, A, B, np.zeros_like(C.T)], [P, np.zeros_like(B), C.T], [top, D.T], [bottom]])
    return symmetric([[-A - A.T, -B, -C.T], [top, -D.T], [bottom]])


def _region(plant: GeneralizedPlant, poles: Mapping[str, float]) -> Iterator[Callable[[Matrices], Array]]:
    if "decay" in poles:
        def decay(v: Matrices) -> Array:
            P, A, *_ = _loop(plant, v)
            return -A - A.T - 2 * 1.001 * poles["decay"] * P
        yield decay
    if "radius" in poles:
        def radius(v: Matrices) -> Array:
            P, A, *_ = _loop(plant, v)
            return symmetric([[0.999 * poles["radius"] * P, A], [0.999 * poles["radius"] * P]])
        yield radius
    if "damping" in poles:
        zeta = poles["damping"] * (1 + 1e-3 * (1 - poles["damping"]))

        def damping(v: Matrices) -> Array:
            A = _loop(plant, v)[1]
            own = -np.sqrt(1 - zeta**2) * (A + A.T)
            return symmetric([[own, zeta * (A.T - A)], [own]])
        yield damping


def _apart(unknowns: Unknowns, inequalities: list[Inequality], cost: Array, best: float, n: int) -> Array | None:
    """Solution a little above the optimum with X > t² Y⁻¹, t as large as possible: 1 - YX is regular."""
    eye = np.eye(n)
    more = [unknowns.inequality(lambda v: np.array([[_RELAXED * best + 1e-9 - float(cost @ _vector(unknowns, v))]])),
            unknowns.inequality(lambda v: symmetric([[v["X"], v["t"][0, 0] * eye], [v["Y"]]])),
            unknowns.inequality(lambda v: np.array([[_LARGEST - v["t"][0, 0]]]))]
    found = inside([*inequalities, *more], -unknowns.gradient(lambda v: float(v["t"][0, 0])))
    return found.x if np.isfinite(found.value) and found.x.any() else None


def _vector(unknowns: Unknowns, v: Matrices) -> Array:
    return np.concatenate([v[name][rows, columns] for name, (_, rows, columns, _, _) in unknowns.places.items()])


def factors(X: Array, Y: Array) -> tuple[Array, Array] | None:
    """N, M with N M' = 1 - YX; None where that is singular."""
    U, sigma, Vt = svd(np.eye(len(X)) - Y @ X)
    return None if sigma[-1] < 1e-9 else (U * np.sqrt(sigma), Vt.T * np.sqrt(sigma))


def rebuilt(plant: GeneralizedPlant, v: Matrices) -> Plant | None:
    """K by N M' = 1 - YX; None where 1 - YX is singular or numbers are none."""
    X, Y, D = v["X"], v["Y"], v["D"]
    parts = factors(X, Y)
    if parts is None:
        return None
    N, M = parts
    try:
        C = np.linalg.solve(M, (v["C"] - D @ plant.C2 @ X).T).T
        B = np.linalg.solve(N, v["B"] - Y @ plant.B2 @ D)
        left = (v["A"] - N @ B @ plant.C2 @ X - Y @ plant.B2 @ C @ M.T - Y @ (plant.A + plant.B2 @ D @ plant.C2) @ X)
        A = np.linalg.solve(M, np.linalg.solve(N, left).T).T
    except np.linalg.LinAlgError:
        return None
    K = Plant(A, B, C, D, plant.dt)
    return K if all(np.isfinite(part).all() for part in (A, B, C, D)) else None
