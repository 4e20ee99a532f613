"""State feedback for a hull of plants: matrix inequalities in W = 1/P and Y = F W, at the vertices that matter.

Bernussou, Peres and Geromel (1989); Boyd, El Ghaoui, Feron and Balakrishnan (1994), section 7.2. The program is solved
for a few vertices, those that break its solution are added. Nothing here is evidence.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import matrix_balance, solve_continuous_are, solve_discrete_are

from .._arrays import Array
from ..conic import Inequality, inside
from ._vertices import Vertices

_ROUNDS, _ADDED, _ALL = 20, 4, 10  # of the vertices used; up to _ALL, all from the start
_BROKEN = -1e-7  # an inequality of matrices of size one is broken by this much
_GAIN = 1e-3  # weight of the size of W in the program that keeps gains small
_FLOOR = 1e-5  # smallest W of a bound, where its size is that of what w does


@dataclass(frozen=True)
class Wanted:
    """What is asked of every vertex.

    objective: "stability", "hinf" or "h2"; rate: of all states [1/s; sampled: 1 - factor]; poles: region of the
    eigenvalues; kept: which entries of the gain may differ from zero.
    """

    objective: str
    rate: float
    poles: Mapping[str, float]
    kept: Array


@dataclass(frozen=True)
class Found:
    """W and Y in the coordinates of the plants, and the least squared bound of the program."""

    W: Array
    Y: Array
    level: float

    @property
    def gain(self) -> Array:
        F: Array = np.linalg.solve(self.W, self.Y.T).T
        return F


def find(vertices: Vertices, wanted: Wanted, level: float | None = None) -> Found | None:
    """W and Y with the least bound; with a `level`, or for stability, those of small gain that keep it."""
    T, unit = _coordinates(vertices, wanted)
    inverse = np.linalg.inv(T)
    own = replace(vertices, A=inverse @ vertices.A @ T, B1=inverse @ vertices.B1, B2=inverse @ vertices.B2 * unit,
                  C=vertices.C @ T, D2=vertices.D2 * unit)
    program = _Program(own, wanted)
    used = list(range(len(own))) if len(own) <= _ALL else [0]
    x = program.solve(used, level)
    for _ in range(_ROUNDS):
        if x is None:
            return None
        least = program.least(x, level)
        broken = [int(k) for k in np.argsort(least) if least[k] < _BROKEN and k not in used][:_ADDED]
        if not broken:
            break
        used += broken
        x = program.solve(used, level)
    if x is None:
        return None
    W, Y = program.at(x)
    if not np.isfinite(W).all() or np.linalg.eigvalsh(W)[0] <= 0:
        return None
    W, Y = T @ W @ T.T, unit[:, None] * Y @ T.T
    return Found((W + W.T) / 2, Y, float(x[program.g]) if program.bounded else np.inf)


def _coordinates(vertices: Vertices, wanted: Wanted) -> tuple[Array, Array]:
    """States in which the optimal cost of the mean plant is |x|², where a structure allows it; units of the controls.
    """
    A, B = vertices.A.mean(axis=0), vertices.B2.mean(axis=0)
    n = len(A)
    scale = matrix_balance(abs(A) + np.eye(n) * abs(A).max(), permute=False, separate=True)[1][0]
    T = np.diag(scale)
    A, B = A * scale / scale[:, None], B / scale[:, None]
    speed = max(float(np.abs(np.linalg.eigvals(A)).max()), 1e-12) if not vertices.dt else 1.0
    size = np.abs(vertices.B2 / scale[:, None]).max(axis=(0, 1))
    unit = speed / np.where(size > 0, size, 1.0)
    if not wanted.kept.all():
        return T, unit
    try:
        if vertices.dt:
            X = solve_discrete_are(A / (1 - wanted.rate), B * unit, np.eye(n), np.eye(B.shape[1]))
        else:
            X = solve_continuous_are((A + wanted.rate * np.eye(n)) / speed, B * unit / speed, np.eye(n),
                                     np.eye(B.shape[1]))
        return T @ np.linalg.inv(np.linalg.cholesky((X + X.T) / 2).T), unit
    except (np.linalg.LinAlgError, ValueError):
        return T, unit


class _Program:
    """Unknowns x: W (groups of states that share the zeros of the gain), Y, a bound g, gains Z with FWF' <= Z, energies
    of every vertex (H2)."""

    def __init__(self, vertices: Vertices, wanted: Wanted):
        self.v, self.wanted = vertices, wanted
        n, w, m, _ = vertices.sizes
        alike = (wanted.kept[:, :, None] == wanted.kept[:, None, :]).all(axis=0)
        self.bounded = wanted.objective != "stability"
        energies = len(vertices) if wanted.objective == "h2" else 0
        parts = [_symmetric(n, alike), _units(m, n, wanted.kept), np.ones((1, 1, 1)),
                 _symmetric(m, np.ones((m, m), bool)), *([_symmetric(w, np.ones((w, w), bool))] * energies)]
        starts = np.cumsum([0, *map(len, parts)])
        self.size, self.g = int(starts[-1]), int(starts[2])
        self.W, self.Y, self.level, self.Z, *self.energy = (
            self._placed(part, int(start)) for part, start in zip(parts, starts, strict=False))
        self.level = self.level[:, 0, 0]
        self.speed = 1.0 if vertices.dt else float(np.abs(vertices.A).max()) or 1.0

    def _placed(self, part: Array, start: int) -> Array:
        whole = np.zeros((self.size, *part.shape[1:]))
        whole[start:start + len(part)] = part
        return whole

    def at(self, x: Array) -> tuple[Array, Array]:
        return np.tensordot(x, self.W, 1), np.tensordot(x, self.Y, 1)

    def solve(self, used: list[int], level: float | None) -> Array | None:
        """The least level, or small gains at a level; None where the solver gives up."""
        n, _, m, _ = self.v.sizes
        inequalities = [one for k in used for one in self.vertex(k, level)]
        floor = _FLOOR if self.bounded else 1.0
        inequalities.append(Inequality(-floor * np.eye(n), self.W))
        cost = np.zeros(self.size)
        if self.bounded and level is None:
            cost += self.level
        else:
            gain = np.block([[self.Z, self.Y], [self.Y.transpose(0, 2, 1), self.W]])
            inequalities.append(Inequality(np.zeros((m + n,) * 2), gain))
            cost += np.trace(self.Z, axis1=1, axis2=2) + _GAIN * np.trace(self.W, axis1=1, axis2=2)
        idle = np.flatnonzero([not any(one.slopes[j].any() for one in inequalities) for j in range(self.size)])
        for j in idle:  # unknowns that appear nowhere stay at zero
            cost[j] = 0.0
        keep = np.setdiff1d(np.arange(self.size), idle)
        point = inside([Inequality(one.constant, one.slopes[keep]) for one in inequalities], cost[keep])
        if "Infeasible" in point.status or not np.isfinite(point.value):
            return None  # what is not quite solved may serve all the same: it is judged later
        x = np.zeros(self.size)
        x[keep] = point.x
        return x

    def least(self, x: Array, level: float | None) -> Array:
        """Least eigenvalue of the inequalities of every vertex, relative to their size."""
        return np.array([min(_relative(one.constant + np.tensordot(x, one.slopes, 1)) for one in self.vertex(k, level))
                         for k in range(len(self.v))])

    def vertex(self, k: int, level: float | None) -> list[Inequality]:
        """Inequalities of one vertex; Lc = A W + B2 Y."""
        v, wanted, W = self.v, self.wanted, self.W
        moved = v.A[k] @ W + v.B2[k] @ self.Y
        both = moved + moved.transpose(0, 2, 1)
        g = self.level[:, None, None] if level is None else np.zeros((self.size, 1, 1))
        given = 0.0 if level is None else level
        found = []
        if wanted.objective == "stability" or wanted.rate > 0:
            found.append(_plain(_pair((1 - wanted.rate) ** 2 * W, moved, W) if v.dt else
                                (-both - 2 * wanted.rate * W) / self.speed))
        found += self._poles(moved, both)
        if not self.bounded:
            return found
        n, w, _, p = v.sizes
        seen = v.C[k] @ W + v.D2[k] @ self.Y
        if wanted.objective == "hinf":
            rows = _pair(W, moved, W) if v.dt else -both
            first = rows.shape[-1]
            slopes = np.zeros((self.size, first + w + p, first + w + p))
            slopes[:, :first, :first] = rows
            slopes[:, first + w:, :n] = seen
            slopes[:, :n, first + w:] = seen.transpose(0, 2, 1)
            slopes[:, first + w:, first + w:] = g * np.eye(p)
            constant = np.zeros(slopes.shape[1:])
            constant[first:first + w, first:first + w] = np.eye(w)
            constant[first - n:first, first:first + w] = v.B1[k] if v.dt else -v.B1[k]
            constant[first:first + w, first - n:first] = constant[first - n:first, first:first + w].T
            constant[first + w:, first:first + w] = v.D1[k]
            constant[first:first + w, first + w:] = v.D1[k].T
            if not v.dt:  # -[Lc + Lc', B1, S'; ., -1, D1'; ., ., -g]
                constant[first + w:, first:first + w] *= -1
                constant[first:first + w, first + w:] *= -1
                slopes[:, first + w:, :n] *= -1
                slopes[:, :n, first + w:] *= -1
            constant[first + w:, first + w:] = given * np.eye(p)
            return [*found, Inequality(constant, slopes)]
        return [*found, *self._energy(k, both, moved, seen, given, level is None)]

    def _energy(self, k: int, both: Array, moved: Array, seen: Array, given: float, free: bool) -> list[Inequality]:
        """A'P + PA + C'C < 0 and tr B1'PB1 < g, P = 1/W."""
        v = self.v
        n, w, _, p = v.sizes
        rows = _pair(self.W, moved, self.W) if v.dt else -both
        first = rows.shape[-1]
        slopes = np.zeros((self.size, first + p, first + p))
        slopes[:, :first, :first] = rows
        slopes[:, first:, :n], slopes[:, :n, first:] = seen, seen.transpose(0, 2, 1)
        constant = np.zeros(slopes.shape[1:])
        constant[first:, first:] = np.eye(p)
        direct = v.D1[k] if v.dt else np.zeros((0, w))
        q = len(direct)
        energy = np.zeros((self.size, w + n + q, w + n + q))
        energy[:, :w, :w], energy[:, w:w + n, w:w + n] = self.energy[k], self.W
        fixed = np.zeros(energy.shape[1:])
        fixed[:w, w:w + n], fixed[w:w + n, :w] = v.B1[k].T, v.B1[k]
        fixed[:w, w + n:], fixed[w + n:, :w], fixed[w + n:, w + n:] = direct.T, direct, np.eye(q)
        trace = -np.trace(self.energy[k], axis1=1, axis2=2)
        total = (trace + (self.level if free else 0.0)).reshape(-1, 1, 1)
        return [Inequality(constant, slopes), Inequality(fixed, energy), Inequality(np.full((1, 1), given), total)]

    def _poles(self, moved: Array, both: Array) -> list[Inequality]:
        """Chilali and Gahinet (1996), theorem 2.2."""
        found, poles = [], self.wanted.poles
        if "decay" in poles:
            found.append(_plain((-both - 2 * poles["decay"] * self.W) / self.speed))
        if "radius" in poles:
            found.append(_plain(_pair(poles["radius"] * self.W, moved, poles["radius"] * self.W)
                                / (1.0 if self.v.dt else self.speed)))
        if "damping" in poles:
            zeta = poles["damping"]
            own, skew = -np.sqrt(1 - zeta**2) * both, zeta * (moved - moved.transpose(0, 2, 1))
            found.append(_plain(_pair(own, skew, own) / self.speed))
        return found


def _plain(slopes: Array) -> Inequality:
    return Inequality(np.zeros(slopes.shape[1:]), slopes)


def _pair(own: Array, cross: Array, last: Array) -> Array:
    """[own, cross'; cross, last], of stacks."""
    return np.block([[own, cross.transpose(0, 2, 1)], [cross, last]])


def _symmetric(n: int, kept: Array) -> Array:
    i, j = np.nonzero(np.triu(kept))
    units = np.zeros((len(i), n, n))
    units[np.arange(len(i)), i, j] = units[np.arange(len(i)), j, i] = 1.0
    return units


def _units(m: int, n: int, kept: Array) -> Array:
    i, j = np.nonzero(kept)
    units = np.zeros((len(i), m, n))
    units[np.arange(len(i)), i, j] = 1.0
    return units


def _relative(matrix: Array) -> float:
    values = np.linalg.eigvalsh((matrix + matrix.T) / 2)
    return float(values[0] / max(abs(values[-1]), 1e-300))
