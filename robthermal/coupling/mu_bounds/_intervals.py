"""Where mu of a system is looked at, and the intervals of frequency on which one scaling serves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robthermal.linear import interval_norms

from ..._control import control
from ..systems import Response
from ._blocks import Complex, Real, Structure
from ._cycles import cycles
from ._lower import worst_perturbation
from ._upper import best_scaling, largest_gain, scaled

_PER_DECADE = 6  # frequencies of the first grid; the first intervals are a decade wide
_INSIDE = np.linspace(0.0, 1.0, 7)  # where a scaling is tried on its interval before the level sets are asked
_ROOM = 1.0015  # distance to the bound that the proof wants
_SPLITS = 40  # halvings of one interval
_PEAKS = 6
_ZOOMS = 7
_SMALLEST = 1e-8  # mu below this times the largest gain is taken for zero


class Samples:
    """Frequencies at which mu of a system has been computed.

    Parameters
    ----------
    system : control.StateSpace
        Stable system M(s) or M(z).
    structure : Structure
        Blocks of Delta.
    """

    def __init__(self, system: control.StateSpace, structure: Structure):
        self.system, self.structure = system, structure
        self._response = Response(system)
        self.grid = self._grid()
        M = self.at(self.grid)
        self.kept, self.level = cycles(M, structure)
        self.smallest = _SMALLEST * float(largest_gain(M).max())
        self._omega, self._lower, self._upper = np.zeros(0), np.zeros(0), np.zeros(0)
        self.add(self.grid)

    @property
    def end(self) -> float:
        """Last frequency [rad/s]: infinity, or Nyquist."""
        return np.pi / self.system.dt if self.system.dt else np.inf

    @property
    def largest(self) -> float:
        """Largest upper bound seen so far, not below what rounding leaves of a mu that is zero."""
        return max(float(self._upper.max()), self.smallest)

    def at(self, omega: Real) -> Complex:
        """Response (n_f, p, m) at frequencies [rad/s], infinity included."""
        M = np.moveaxis(self._response(np.where(np.isinf(omega), 0.0, omega)), 2, 0)
        return np.where(np.isinf(omega)[:, None, None], self._response.D, M)

    def add(self, omega: Real) -> None:
        """Compute mu at more frequencies."""
        part = self.at(omega) * self.kept
        scaling = best_scaling(part, self.structure)
        lower, _ = worst_perturbation(part, self.structure, scaling.upper, scaling.dual)
        self._omega = np.concatenate([self._omega, omega])
        self._lower = np.concatenate([self._lower, lower])
        self._upper = np.concatenate([self._upper, np.maximum(scaling.upper, lower)])

    def table(self) -> tuple[Real, Real, Real]:
        """Frequencies in order, with lower and upper bounds."""
        order = np.argsort(self._omega)
        return self._omega[order], self._lower[order], self._upper[order]

    def search(self) -> float:
        """Zoom in on the highest peaks; the largest upper bound."""
        for _ in range(_ZOOMS):
            omega, _, upper = self.table()
            padded = np.concatenate([[-1.0], upper, [-1.0]])
            tops = np.flatnonzero((upper >= padded[:-2]) & (upper >= padded[2:]))
            tops = tops[np.argsort(-upper[tops])][:_PEAKS]
            below, above = omega[np.maximum(tops - 1, 0)], omega[np.minimum(tops + 1, len(omega) - 1)]
            new = np.unique(np.concatenate([between(a, b, np.array([0.25, 0.75])) for a, b in
                                            zip([*below, *omega[tops]], [*omega[tops], *above], strict=True)]))
            new = np.setdiff1d(new, omega)
            if not len(new):
                break
            self.add(new)
        return self.largest

    def _grid(self) -> Real:
        poles = np.linalg.eigvals(np.asarray(self.system.A)) if self.system.nstates else np.zeros(0)
        if self.system.dt:
            poles = np.log(np.where(poles == 0, np.finfo(float).tiny, poles)) / self.system.dt
        corners = np.concatenate([np.abs(poles), np.abs(poles.imag)])
        corners = corners[(corners > 0) & (corners < self.end)]
        span = corners if len(corners) else np.array([min(1.0, self.end / 2)])
        low, high = np.log10(0.01 * span.min()), np.log10(min(100 * span.max(), self.end))
        count = int(_PER_DECADE * (high - low)) + 2
        return np.unique(np.concatenate([[0.0, self.end], corners, np.logspace(low, high, count)[:-1]]))


@dataclass(frozen=True)
class Partition:
    """Intervals with a scaling each.

    Parameters
    ----------
    edges : ndarray, shape (K + 1,)
        From 0 to the last frequency [rad/s].
    left, right : ndarray, shape (K, p, p) and (K, m, m)
        Scalings of every interval.
    bound : float
        sigma_max(left M right⁻¹) stays below it on every interval, as far as floating point can tell.
    """

    edges: Real
    left: Complex
    right: Complex
    bound: float


def between(a: float, b: float, position: Real) -> Real:
    """Frequencies at positions 0..1 of an interval: logarithmic, linear from zero, reciprocal up to infinity."""
    if np.isinf(b):
        with np.errstate(divide="ignore"):
            return max(a, np.finfo(float).tiny) / (1 - position)
    return b * position if a == 0 else a * (b / a) ** position


def cover(samples: Samples, factor: float) -> Partition:
    """Split all frequencies until on every interval one scaling stays below factor times the largest mu.

    Parameters
    ----------
    samples : Samples
        Of the system; every center of an interval is added, so that a peak found late raises the bound.
    factor : float
        Growth of the bound, above 1.

    Returns
    -------
    Partition
    """
    edges = np.unique(np.concatenate([samples.grid[:1], samples.grid[1:-1:_PER_DECADE], samples.grid[-1:]]))
    left, right = _scalings(samples, edges, factor)
    for _ in range(_SPLITS):
        bound = factor * samples.largest
        inside = _sampled(samples, edges, left, right)
        if (inside < bound / _ROOM).all():  # the level sets cost more: ask them when the samples are content
            inside = interval_norms(samples.system, edges, left=left, right=right)
        bad = np.flatnonzero(~(inside < bound / _ROOM))
        if not len(bad):
            break
        edges, left, right = _split(samples, edges, left, right, bad, factor)
    return Partition(edges, left, right, factor * samples.largest)


def _split(samples: Samples, edges: Real, left: Complex, right: Complex, bad: NDArray[np.intp],
           factor: float) -> tuple[Real, Complex, Complex]:
    """Halve the bad intervals and give both halves scalings of their own."""
    middle = np.concatenate([between(edges[k], edges[k + 1], np.array([0.5])) for k in bad])
    finer = np.insert(edges, bad + 1, middle)
    halves = np.repeat(np.arange(len(edges) - 1), np.where(np.isin(np.arange(len(edges) - 1), bad), 2, 1))
    new = np.flatnonzero(np.isin(halves, bad))
    left, right = left[halves], right[halves]
    left[new], right[new] = _scalings(samples, finer, factor, new)
    return finer, left, right


def _scalings(samples: Samples, edges: Real, factor: float, which: NDArray[np.intp] | None = None
              ) -> tuple[Complex, Complex]:
    """Best scalings at the centers of intervals; parts of M that lie in no cycle of blocks are scaled away."""
    chosen = np.arange(len(edges) - 1) if which is None else which
    centers = np.array([between(edges[k], edges[k + 1], np.array([0.5]))[0] for k in chosen])
    samples.add(centers)
    M = samples.at(centers)
    scaling = best_scaling(M * samples.kept, samples.structure, enough=factor**0.75 * samples.largest)
    across = largest_gain(scaled(scaling.left, M * ~samples.kept, scaling.right))
    small = 1e-3 * samples.largest / np.maximum(across, 1e-3 * samples.largest)  # 1 where nothing was dropped
    left, right = scaling.left.copy(), scaling.right.copy()
    for block, level in zip(samples.structure.blocks, samples.level, strict=True):
        left[:, block.columns] *= small[:, None, None] ** level
        right[:, block.rows] *= small[:, None, None] ** level
    return left, right


def _sampled(samples: Samples, edges: Real, left: Complex, right: Complex) -> Real:
    omega = np.concatenate([between(a, b, _INSIDE) for a, b in zip(edges[:-1], edges[1:], strict=True)])
    count = len(_INSIDE)
    gains = largest_gain(scaled(np.repeat(left, count, 0), samples.at(omega), np.repeat(right, count, 0)))
    return gains.reshape(-1, count).max(1)

