"""A quadratic form and multipliers for all maps of a closed loop, by linear matrix inequalities and cutting planes.

With heat d_j at port j beyond the held one, (e, d) -> M e + S d, the inequality
e'Pe - |M e + S d|²_P - e'He + Σ l d² > 0 is linear in P, the weights l and the sizes w in H = Σ w q².
The unknowns are one block-diagonal matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..conic import Form, largest_margin
from ._loop_picture import Maps, Picture

Array = NDArray[np.floating[Any]]
_ROUNDS = 12
_ADDED = 6  # maps per round
_ENOUGH = 0.3  # share of the solver's margin that must be left at the maps it did not see
_RANK = 2  # directions kept of what heat at a port does within a sample
_LEAST = 1e-6


@dataclass(frozen=True)
class Candidate:
    """What was found, in floats.

    Parameters
    ----------
    matrix : ndarray, shape (N, N)
        Matrix P of the quadratic norm.
    weights, sizes : ndarray
        Multipliers, (p,) and (2p + 4m,); empty for a plant with held heat.
    contraction : float
        Factor of the square root of e'Pe per sample at all corners; inf where none was found.
    solves : int
        Linear matrix inequalities solved.
    """

    matrix: Array
    weights: Array
    sizes: Array
    contraction: float
    solves: int


class Between:
    """What happens between two samples, by quadrature in the modes of the passive network."""

    def __init__(self, found: Picture, sample_time: float):
        root = np.sqrt(found.capacity)
        rates, modes = np.linalg.eigh(found.F * root[:, None] / root)  # symmetric: conduction is
        right, left = modes / root[:, None], modes.T * root
        nodes, weights = np.polynomial.legendre.leggauss(16)
        marks = sample_time * np.linspace(0, 1, 13) ** 2  # fine at the start, where fast modes move
        s = np.concatenate([(a + b) / 2 + (b - a) / 2 * nodes for a, b in zip(marks[:-1], marks[1:], strict=True)])
        w = np.concatenate([(b - a) / 2 * weights for a, b in zip(marks[:-1], marks[1:], strict=True)])
        decay = np.exp(np.outer(s, rates))
        safe = np.where(rates == 0, 1.0, rates)
        grown = np.where(rates == 0, s[:, None], np.expm1(np.outer(s, rates)) / safe)
        self.scatter = [_gram(decay * left[:, j] @ right.T / found.capacity[j], w) for j in found.ports]
        self.moved = [_gram(grown * right[k] @ left, w) for k in found.ports]


def _gram(rows: Array, weights: Array) -> Array:
    return (rows * weights[:, None]).T @ rows


def search(found: Picture, sample_time: float, scale: Array, pattern: NDArray[np.bool_], *, held: bool) -> Candidate:
    """P (and multipliers) for all corners of a picture.

    Parameters
    ----------
    found : Picture
        Of the loop.
    sample_time : float
        Time between two samples [s].
    scale : ndarray, shape (N,)
        Units in which a well-conditioned P is expected.
    pattern : ndarray of bool, shape (N, N)
        Entries of P that may differ from zero.
    held : bool
        The plant is the sampled model: nothing happens between the samples.
    """
    problem = _Problem(found, sample_time, scale, held)
    use: list[int] = []
    Q: Array = np.eye(problem.size)
    margin, solves = np.inf, 0
    left = problem.left(Q)
    for _ in range(_ROUNDS):
        new = [int(k) for k in np.argsort(left)[:_ADDED] if k not in use]
        if not new or (left.min() > 0 and left.min() >= _ENOUGH * margin):
            break
        use += new
        answer = largest_margin([*(problem.form(k) for k in use), *problem.bound()], problem.pattern(pattern),
                                least=_LEAST)
        solves, Q, margin = solves + 1, answer.matrix, answer.margin
        left = problem.left(Q)
        if not margin > 0:
            break
    P, weights, sizes = problem.unpack(Q)
    return Candidate(P, weights, sizes, contraction(found, sample_time, P, weights, sizes), solves)


def contraction(found: Picture, sample_time: float, P: Array, weights: Array, sizes: Array) -> float:
    """Least factor c with e+'Pe+ <= c² e'Pe at all corners; inf where P or the multipliers prove nothing."""
    try:
        factor = np.linalg.inv(np.linalg.cholesky(P))
        after = growth(found, Between(found, sample_time) if len(weights) else None, sample_time, P, weights, sizes)
    except np.linalg.LinAlgError:
        return np.inf
    return float(np.sqrt(max(np.linalg.eigvalsh(factor @ R @ factor.T)[-1] for R in after)))


def growth(found: Picture, between: Between | None, sample_time: float, P: Array, weights: Array,
           sizes: Array) -> Array:
    """What e'Pe can become at every corner, (k, N, N)."""
    maps, p = found.corners, len(found.ports)
    if between is None:
        return maps.M.transpose(0, 2, 1) @ P @ maps.M
    rest = np.diag(sizes) - found.reach.T @ (weights[:, None] * found.reach)
    np.linalg.cholesky(rest)  # LinAlgError: the multipliers bound nothing
    X = np.zeros_like(P)
    n = len(found.F)
    X[:n, :n] = sum(scatter / weight for scatter, weight in zip(between.scatter, weights, strict=True))
    wider = np.linalg.inv(P) - X
    np.linalg.cholesky(0.5 * (wider + wider.T))
    moved = sum((size * gram for size, gram in zip(sizes, between.moved, strict=False)), np.zeros((n, n)))
    after = maps.M.transpose(0, 2, 1) @ np.linalg.inv(wider) @ maps.M + maps.W.transpose(0, 2, 1) @ moved @ maps.W
    after[:, found.ports, found.ports] += sample_time * sizes[p:2 * p]
    after += sample_time * np.einsum("kma,kmb,m->kab", maps.free, maps.free, sizes[2 * p:])
    return 0.5 * (after + after.transpose(0, 2, 1))


class _Problem:
    """The matrix inequality in the unknown block_diag(P, weights, sizes), everything in units near one."""

    def __init__(self, found: Picture, sample_time: float, scale: Array, held: bool):
        self.found, self.scale, self.time = found, scale, sample_time
        self.N, self.p = len(scale), 0 if held else len(found.ports)
        n, maps = len(found.F), found.corners
        self.M = maps.M * scale[:, None] / scale
        self.between = None if held else Between(found, sample_time)
        self.count = 0 if held else found.reach.shape[1]
        drive: list[Array] = [np.zeros((self.N, 0))]
        units: list[float] = []
        for scatter in self.between.scatter if self.between else []:
            values, vectors = np.linalg.eigh(scatter * np.outer(scale[:n], scale[:n]))
            units.append(float(np.sqrt(values[-1])))
            columns = np.zeros((self.N, _RANK))
            columns[:n] = vectors[:, -_RANK:] * np.sqrt(np.maximum(values[-_RANK:], 0) / values[-1])
            drive.append(columns)
        self.S, self.port_units = np.hstack(drive), np.array(units)
        self.lifted = self.N + self.S.shape[1]
        self.size = self.N + self.p + self.count
        if not held:
            reach = self.port_units[:, None] * found.reach
            self.units = np.sqrt(self.count) * np.maximum(reach.max(axis=0), 1e-9 * reach.max())
            self.reach = reach / self.units

    def pattern(self, own: NDArray[np.bool_]) -> NDArray[np.bool_]:
        full = np.eye(self.size, dtype=bool)
        full[:self.N, :self.N] = own
        return full

    def unpack(self, Q: Array) -> tuple[Array, Array, Array]:
        P = Q[:self.N, :self.N] * np.outer(self.scale, self.scale)
        if not self.p:
            return P, np.zeros(0), np.zeros(0)
        values = np.diag(Q)[self.N:]
        return P, values[:self.p] * self.port_units**2, values[self.p:self.p + self.count] * self.units**2

    def left(self, Q: Array) -> Array:
        """Least eigenvalue of e'Pe - (e'Pe after) at every corner, in the units of the search."""
        P, weights, sizes = self.unpack(Q)
        if not len(weights):
            after = growth(self.found, None, self.time, P, weights, sizes)
        else:
            try:
                after = growth(self.found, self.between, self.time, P, weights, sizes)
            except np.linalg.LinAlgError:  # not yet: look at the plain maps
                after = growth(self.found, None, self.time, P, weights, sizes)
        return np.linalg.eigvalsh((P - after) / np.outer(self.scale, self.scale))[:, 0]

    def form(self, k: int) -> Form:
        """e'Pe - |M e + S d|²_P - Σ w q² + Σ l d²."""
        shape, N = (self.size, self.lifted), self.N
        move, keep = np.zeros(shape), np.zeros(shape)
        move[:N, :N], move[:N, N:] = self.M[k], self.S
        keep[:N, :N] = np.eye(N)
        terms: list[tuple[Array, Array]] = [(0.5 * keep, keep), (-0.5 * move, move)]
        for j in range(self.p):
            for r in range(_RANK):
                terms.append(_square(shape, N + j, N + j * _RANK + r))
        for o, rows in enumerate(self._sizes(k)):
            for row in rows:
                unit = np.zeros(shape)
                unit[N + self.p + o, :N] = row
                terms.append((-0.5 * unit, unit))
        return Form(tuple(terms))

    def bound(self) -> list[Form]:
        """diag(sizes) - reach' diag(weights) reach."""
        if not self.p:
            return []
        first, shape = self.N + self.p, (self.size, self.count)
        terms = [_square(shape, first + o, o) for o in range(self.count)]
        for j in range(self.p):
            unit = np.zeros(shape)
            unit[self.N + j] = self.reach[j]
            terms.append((-0.5 * unit, unit))
        return [Form(tuple(terms))]

    def _sizes(self, k: int) -> list[Array]:
        if self.between is None:
            return []
        found, maps = self.found, self.found.corners
        rows: list[Array] = []
        for o, gram in enumerate(self.between.moved):
            values, vectors = np.linalg.eigh(gram)
            large = values > 1e-9 * values[-1]
            rows.append(self.units[o] * (vectors[:, large] * np.sqrt(values[large])).T @ maps.W[k] / self.scale)
        step = np.sqrt(self.time)
        for j, port in enumerate(found.ports):
            row = np.zeros((1, self.N))
            row[0, port] = step * self.units[self.p + j]
            rows.append(row / self.scale)
        rows += [step * self.units[2 * self.p + i] * row[None] / self.scale for i, row in enumerate(maps.free[k])]
        return rows


def _square(shape: tuple[int, int], unknown: int, place: int) -> tuple[Array, Array]:
    """The term (unknown) times the square of one coordinate."""
    unit = np.zeros(shape)
    unit[unknown, place] = 1.0
    return 0.5 * unit, unit


def sides(links: Sequence[tuple[int, int]], n: int, C: Array, cold: Sequence[int]) -> NDArray[np.bool_]:
    """Entries of P within the two sides of the modules, every controller state with the cold face it drives most."""
    label = np.arange(n)
    for _ in range(n):
        for a, b in links:
            label[[a, b]] = min(label[a], label[b])
    controllers = [label[cold[int(np.argmax(np.abs(column)))]] for column in C.T]
    whole = np.concatenate([label, np.array(controllers, int)])
    whole = np.where(np.isin(whole, label[list(cold)]), -1, -2)  # all cold sides together, all others together
    return whole[:, None] == whole[None, :]


def frozen(maps: Maps) -> float:
    """Largest spectral radius."""
    return float(np.abs(np.linalg.eigvals(maps.M)).max())

