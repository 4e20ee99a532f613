"""Gains of largest integral action under disc margins: a convex-concave sequence of second-order cone programs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .._arrays import Array
from ..conic import ConeBounds, least_cost

Accept = Callable[[Array], bool]
_ROUNDS = 40
_SHARES = (1.0, 0.5, 0.25, 0.1, 0.03)  # of a step, in turn, until the loop can be followed
_STEP = 1e-4  # relative: gains of the objective below it end the sequence
_CAUTION = 1e-6  # relative, of every margin above what is asked


@dataclass(frozen=True)
class Bins:
    """Everything at the bins of all responses: center, radius, basis, and the weights of S, KS and T there."""

    center: Array
    radius: Array
    basis: Array
    S: Array
    KS: Array
    T: Array

    def distance(self, gains: Array) -> Array:
        """Smallest \\|1 + GC\\| over the disc of every bin."""
        C = self.basis @ gains
        found: Array = abs(1 + self.center * C) - self.radius * abs(C)
        return found

    def excess(self, gains: Array) -> float:
        """Largest violation of a weight or margin, relative to \\|1 + GC\\|; negative where all are kept."""
        C, left = abs(self.basis @ gains), self.distance(gains)
        asked = np.maximum.reduce([self.S, self.KS * C, self.T * (abs(self.center) + self.radius) * C])
        return float((asked / np.maximum(left, 1e-300) - 1).max()) if left.min() > 0 else np.inf


def ascend(bins: Bins, start: Array, objective: Array, margin: float, accept: Accept) -> tuple[Array, int]:
    """Gains from a stabilizing start that keep its winding number: first all weights, then the objective."""
    gains, count, share = start, 0, 0.0
    for _ in range(_ROUNDS):  # weights of S, raised from the margin alone to what is asked
        if bins.excess(gains) <= 0:
            share = 1.0
            break
        found = _step(bins, gains, objective, margin, None)
        count += 1
        moved = None if found is None else _accepted(gains, found[0], accept)
        if found is None or moved is None or found[1] <= share + 1e-6:
            break
        gains, share = moved, found[1]
    if share < 1 - 1e-9 and bins.excess(gains) > 0:
        return gains, count
    for _ in range(_ROUNDS):
        found = _step(bins, gains, objective, margin, 1.0)
        count += 1
        moved = None if found is None else _accepted(gains, found[0], accept)
        if moved is None:
            break
        before, gains = float(objective @ gains), moved
        if objective @ gains <= before + _STEP * max(abs(before), 1e-12):
            break
    return gains, count


def _accepted(at: Array, new: Array, accept: Accept) -> Array | None:
    """New gains, or some on the way to them, whose loop can be followed from bin to bin and is stable."""
    for share in _SHARES:
        moved = at + share * (new - at)
        if accept(moved):
            return moved
    return None


def _step(bins: Bins, at: Array, objective: Array, margin: float, share: float | None) -> tuple[Array, float] | None:
    """One program around the last gains; with ``share`` None the part of the weights of S that can be kept is
    maximized, else the objective.

    Re(conj(φ) (1 + GC)) / |φ|, φ = 1 + GC of the last gains, is at most |1 + GC|: what is kept here is kept (Karimi and
    Galdos 2010). It is positive, so that the loop winds as often as before around zero.
    """
    n = len(at)
    phi = 1 + bins.center * (bins.basis @ at)
    unit = (phi.conj() / abs(phi))[:, None]
    slope = (unit * bins.center[:, None] * bins.basis).real  # of Re(...), per gain
    constant = unit[:, 0].real
    basis = np.stack([bins.basis.real, bins.basis.imag], axis=1)  # |C|, as a norm of two numbers
    more = 1 + _CAUTION
    groups = [(bins.radius, margin * np.ones(len(phi)), more * (bins.S - margin))]
    if bins.KS.any() or bins.T.any():
        for weight in (bins.KS, bins.T * (abs(bins.center) + bins.radius)):
            groups.append((bins.radius + more * weight, np.zeros(len(phi)), np.zeros(len(phi))))
    free = share is None
    bounds = []
    for size, fixed, varying in groups:
        known = constant - more * fixed - (0.0 if free else varying)
        bounds.append(ConeBounds(_padded(size[:, None, None] * basis, free), np.zeros((len(phi), 2)),
                                 np.hstack([slope, -varying[:, None]]) if free else slope, known))
    keeps_sign = np.append(objective, 0.0) if free else objective
    bounds.append(ConeBounds(np.zeros((1, 1, len(keeps_sign))), np.zeros((1, 1)), keeps_sign[None], np.zeros(1)))
    if free:  # 0 <= share <= 1
        both = np.zeros((2, n + 1))
        both[:, -1] = 1.0, -1.0
        bounds.append(ConeBounds(np.zeros((2, 1, n + 1)), np.zeros((2, 1)), both, np.array([0.0, 1.0])))
    cost = np.eye(n + 1)[n] * -1.0 if free else -objective
    found = least_cost(cost, bounds)
    if not found.solved:
        return None
    return found.x[:n], float(found.x[n]) if free else 1.0


def _padded(matrix: Array, free: bool) -> Array:
    return np.concatenate([matrix, np.zeros((*matrix.shape[:2], 1))], axis=2) if free else matrix


def best_start(bins: Bins, starts: Sequence[Array], objective: Array, margin: float,
               accept: Accept) -> tuple[Array, int]:
    """The best end of all starts: one that keeps everything if any does, then the largest objective."""
    ends, count = [], 0
    for start in starts:
        gains, steps = ascend(bins, start, objective, margin, accept)
        ends.append(gains)
        count += steps
    keep = [gains for gains in ends if bins.excess(gains) <= 0]
    if keep:
        return max(keep, key=lambda gains: float(objective @ gains)), count
    return min(ends, key=bins.excess), count
