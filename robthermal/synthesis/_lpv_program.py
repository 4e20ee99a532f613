"""Controllers for the vertices of a hull of plants with one Lyapunov matrix: Apkarian, Gahinet and Becker (1995).

X and Y of the linearizing change of variables are common, A^, B^, C^, D^ belong to the vertices; B2, C2, D12, D21 are
common and D22 = 0, so that loop and inequalities are affine in the weights. Nothing here is evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.linalg import block_diag

from .._arrays import Array
from ..conic import Inequality, inside
from ..linear import Plant
from ._affine import Matrices, Unknowns, symmetric
from ._inequalities import bounded_real, coordinates, factors, moved, rebuilt
from ._plant import GeneralizedPlant

_MARGIN = 1e-7  # of every inequality, in coordinates where X = Y of a known loop
_LARGEST = 100.0  # of t in [X t; t Y]
_RELAXED = (1.02, 1.06, 1.2)  # of the least squared level, in turn
_INSIDE = 0.01  # of the least eigenvalues of that solution, kept as well
_APART, _ENOUGH = 0.5, 2.0  # of the largest t, or t itself, whichever is less: kept while controllers are made small
MOST_UNKNOWNS = 2500


@dataclass(frozen=True)
class Scheduled:
    """Controllers at the vertices in one set of states, P of their loops, the level they are for, and the least."""

    controllers: list[Plant]
    P: Array
    level: float
    least: float


def unknowns_of(plant: GeneralizedPlant, count: int) -> int:
    """How many unknowns the program has for that many vertices."""
    n, m, p = len(plant.A), plant.B2.shape[1], len(plant.C2)
    return n * (n + 1) + 3 + count * (n + m) * (n + p)


def scheduled(plants: Sequence[GeneralizedPlant], mean: GeneralizedPlant, known: Plant,
              asked: float | None) -> Iterator[Scheduled]:
    """Controllers for the least level, or the level asked for where that is larger; then for a little more.

    `known` stabilizes the mean plant: it gives the coordinates.
    """
    T = coordinates(mean, known)
    if T is None:
        return
    own = [found for found in (moved(plant, T) for plant in plants) if found is not None]
    program = _Program(own)
    least = inside(program.inequalities, program.cost("g"))
    if not np.isfinite(least.value) or not least.x.any():
        return
    level = float(np.sqrt(max(least.value, 0.0)))
    relaxed = [factor * least.value + 1e-9 for factor in _RELAXED]
    if asked is not None and asked > level:
        relaxed = [(0.999 * asked) ** 2, *relaxed]
    for bound in relaxed:
        for x in program.solutions(bound):
            made = program.controllers(x)
            if made is not None:
                back = block_diag(np.linalg.inv(T), np.eye(len(T)))
                P = back.T @ made[1] @ back
                yield Scheduled(made[0], (P + P.T) / 2, float(np.sqrt(bound)), level)


class _Program:
    """Unknowns: X, Y, g = level², t, s, then A^, B^, C^, D^ of every vertex."""

    def __init__(self, plants: Sequence[GeneralizedPlant]):
        self.plants = plants
        n, m, p = len(plants[0].A), plants[0].B2.shape[1], len(plants[0].C2)
        self.one = Unknowns({"X=": (n, n), "Y=": (n, n), "g": (1, 1), "t": (1, 1), "s": (1, 1),
                             "A": (n, n), "B": (n, p), "C": (m, n), "D": (m, p)})
        self.shared = n * (n + 1) + 3
        self.own = self.one.count - self.shared
        self.count = self.shared + len(plants) * self.own
        self.eye = np.eye(n)
        self.inequalities = [self._shared(lambda v: symmetric([[v["X"], self.eye], [v["Y"]]]), _MARGIN)]
        for k, plant in enumerate(plants):
            self.inequalities.append(self._placed(self.one.inequality(partial(_bounded, plant), _MARGIN), k))

    def _placed(self, inequality: Inequality, k: int) -> Inequality:
        slopes = np.zeros((self.count, *inequality.constant.shape))
        slopes[self.index(k)] = inequality.slopes
        return Inequality(inequality.constant, slopes, inequality.margin)

    def _shared(self, form: Callable[[Matrices], Array], margin: float = 0.0) -> Inequality:
        return self._placed(self.one.inequality(form, margin), 0)

    def index(self, k: int) -> Array:
        """Where the unknowns of one vertex stand among all."""
        return np.concatenate([np.arange(self.shared), self.shared + k * self.own + np.arange(self.own)])

    def cost(self, name: str) -> Array:
        """Coefficients of g, t or s."""
        found = np.zeros(self.count)
        found[:self.one.count] = self.one.gradient(lambda v: float(v[name][0, 0]))
        return found

    def solutions(self, bound: float) -> Iterator[Array]:
        """g below a bound and X > t² Y⁻¹, t large, so that 1 - YX is regular: of small controllers, then of any.

        Small: s, that every [A^ B^; C^ D^] has as a bound of its norm.
        """
        apart = [*self.inequalities, self._shared(lambda v: bound - v["g"]), self._shared(lambda v: _LARGEST - v["t"]),
                 self._shared(lambda v: symmetric([[v["X"], v["t"][0, 0] * self.eye], [v["Y"]]]))]
        first = inside(apart, -self.cost("t"))
        if not np.isfinite(first.value) or not first.x.any():
            return
        t = float(self.cost("t") @ first.x)
        unit = max(float(np.linalg.norm(_joined(self.one.matrices(first.x[self.index(k)])), 2))
                   for k in range(len(self.plants)))
        size = self.one.inequality(partial(_size, unit))
        apart = [replace(one, margin=max(one.margin, _INSIDE * _least(one, first.x))) for one in apart]
        small = inside([*apart, self._shared(lambda v: v["t"] - min(_APART * t, _ENOUGH)),
                        *(self._placed(size, k) for k in range(len(self.plants)))], self.cost("s"))
        if np.isfinite(small.value) and small.x.any():
            yield small.x
        yield first.x

    def controllers(self, x: Array) -> tuple[list[Plant], Array] | None:
        """Controllers of the vertices, and P = [1 Y; 0 N'] [X 1; M' 0]⁻¹ of their loops."""
        every = [self.one.matrices(x[self.index(k)]) for k in range(len(self.plants))]
        found = [K for K in (rebuilt(plant, v) for plant, v in zip(self.plants, every, strict=True)) if K is not None]
        parts = factors(every[0]["X"], every[0]["Y"])
        if parts is None or len(found) < len(every):
            return None
        (N, M), zero = parts, 0 * self.eye
        right = np.block([[every[0]["X"], self.eye], [M.T, zero]])
        return found, np.linalg.solve(right.T, np.block([[self.eye, every[0]["Y"]], [zero, N.T]]).T).T


def _least(inequality: Inequality, x: Array) -> float:
    value = inequality.constant + np.tensordot(x, inequality.slopes, 1)
    return float(np.linalg.eigvalsh(value)[0])


def _bounded(plant: GeneralizedPlant, v: Matrices) -> Array:
    return bounded_real(plant, v, None)


def _joined(v: Matrices) -> Array:
    return np.block([[v["A"], v["B"]], [v["C"], v["D"]]])


def _size(unit: float, v: Matrices) -> Array:
    """[s, M; M', s] of M = [A^ B^; C^ D^], in units of a size that is known to do."""
    M, s = _joined(v) / unit, v["s"][0, 0]
    return symmetric([[s * np.eye(len(M)), M], [s * np.eye(M.shape[1])]])
