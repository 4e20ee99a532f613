"""Local descent of a nonsmooth function of a gain: eigenvalues, then the H-infinity norm (Apkarian and Noll 2006).

At every step the largest eigenvalues, or the singular values near the peaks of the response, are replaced by their
tangents; the gain that makes the largest tangent smallest within a box is a quadratic program. Floats: nothing is
proven here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .._arrays import Array
from ..conic import least_quadratic
from ..linear import Plant, close, plant_norm, responder
from ._plant import GeneralizedPlant

_NEAR = 0.6  # of the largest value: what is below it does not count in a step
_MOST = 24  # tangents of a step
_POINTS = 120  # of the frequency grid, beside the peak
_STEPS = 150  # of a descent
_SMALLEST = 1e-7  # box, relative to the gain, at which a descent ends
_STALLED = 1e-4  # relative decrease over ten steps that ends it too

Tangents = tuple[Array, Array]  # values (k,), gradients (k, number of free entries)


@dataclass(frozen=True)
class StaticLoop:
    """A continuous plant with a static gain, some of whose entries are free."""

    plant: GeneralizedPlant
    free: Array

    def gain(self, x: Array) -> Array:
        """The gain of its free entries."""
        K = np.zeros(self.free.shape)
        K[self.free] = x
        return K

    def closed(self, x: Array) -> Plant:
        """Loop from w to z; LinAlgError or InputError where it is not well-posed."""
        K = self.gain(x)
        return close(self.plant.joined, Plant(np.zeros((0, 0)), np.zeros((0, K.shape[1])), np.zeros((len(K), 0)), K,
                                              0.0))

    def eigenvalues(self, x: Array) -> float:
        """Largest real part of an eigenvalue."""
        return float(self.closed(x).poles.real.max(initial=-np.inf))

    def norm(self, x: Array) -> float:
        """H-infinity norm, infinity where the loop is not stable."""
        loop = self.closed(x)
        return plant_norm(loop)[0] if loop.stable else np.inf

    def parts(self, x: Array) -> tuple[Array, Array]:
        """E = (1 - K D22)⁻¹ and F = (1 - D22 K)⁻¹."""
        K, D22 = self.gain(x), self.plant.D22
        return np.linalg.inv(np.eye(len(K)) - K @ D22), np.linalg.inv(np.eye(len(D22)) - D22 @ K)

    def tangents_of_eigenvalues(self, x: Array) -> Tangents:
        """Real parts of the rightmost eigenvalues: dλ = y'(B2 E dK F C2) v / y'v."""
        E, F = self.parts(x)
        A = self.closed(x).A
        values, right = np.linalg.eig(A)
        left = np.linalg.pinv(right)
        top = values.real.max()
        chosen = [k for k in np.argsort(-values.real)[:_MOST]
                  if values[k].real >= top - 0.5 * abs(top) - 1e-9 and values[k].imag >= 0]
        before, after = left @ self.plant.B2 @ E, F @ self.plant.C2 @ right
        gradients = [np.outer(before[k], after[:, k]).real[self.free] for k in chosen]
        return values[chosen].real, np.array(gradients)

    def tangents_of_norm(self, x: Array) -> Tangents:
        """Singular values near the peaks: dσ = Re u'(H_zu dK H_yw) v."""
        p, (E, F) = self.plant, self.parts(x)
        loop = self.closed(x)
        K, D12, D21 = self.gain(x), p.D12 @ E, F @ p.D21
        both = Plant(loop.A, np.hstack([loop.B, p.B2 @ E]), np.vstack([loop.C, F @ p.C2]),
                     np.block([[loop.D, D12], [D21, np.zeros(K.T.shape)]]), 0.0)
        q, m = loop.D.shape
        M = responder(both)(_frequencies(loop))
        size = np.linalg.norm(M[:, :q, :m], 2, axis=(1, 2))
        top = size.max()
        peaks = [k for k in range(len(size)) if size[k] >= _NEAR * top
                 and size[k] >= size[max(k - 1, 0)] and size[k] >= size[min(k + 1, len(size) - 1)]]
        found: list[tuple[float, Array]] = []
        for k in sorted(peaks, key=lambda k: -size[k])[:_MOST]:
            U, sigma, Vt = np.linalg.svd(M[k, :q, :m])
            for i in np.flatnonzero(sigma >= _NEAR * top):
                before, after = U[:, i].conj() @ M[k, :q, m:], M[k, q:, :m] @ Vt[i].conj()
                found.append((float(sigma[i]), np.outer(before, after).real[self.free]))
        found.sort(key=lambda one: -one[0])
        return np.array([one[0] for one in found[:_MOST]]), np.array([one[1] for one in found[:_MOST]])


def _frequencies(loop: Plant) -> Array:
    peak = plant_norm(loop)[1]
    modes: Array = abs(loop.poles)
    modes = modes[modes > 0]
    low, high = (float(modes.min()) / 30, float(modes.max()) * 30) if len(modes) else (1e-2, 1e2)
    grid = np.concatenate([[0.0], np.geomspace(low, high, _POINTS), modes])
    return np.unique(np.append(grid, peak) if np.isfinite(peak) else grid)


def descend(loop: StaticLoop, x: Array, value: Callable[[Array], float], tangents: Callable[[Array], Tangents],
            enough: float) -> tuple[Array, int]:
    """Free entries after a descent of `value`, and how many steps it took; it ends below `enough`."""
    best = value(x)
    box, history, count = 0.3 * max(float(abs(x).max(initial=0.0)), 1.0), [best], 0
    while count < _STEPS and best > enough:
        count += 1
        values, gradients = tangents(x)
        step = _step(values, gradients, box)
        found = _tried(value, x + step)
        if found < best - 1e-3 * max(best - _predicted(values, gradients, step), 0.0) and found < best:
            x, best = x + step, found
            box *= 2.0
        else:
            box *= 0.25
        history.append(best)
        if box < _SMALLEST * max(float(abs(x).max()), 1e-3):
            break
        if len(history) > 12 and history[-11] - best < _STALLED * abs(best):
            break
    return x, count


def _tried(value: Callable[[Array], float], x: Array) -> float:
    try:
        return value(x)
    except (ValueError, np.linalg.LinAlgError):  # an InputError is one: not well-posed
        return np.inf


def _predicted(values: Array, gradients: Array, step: Array) -> float:
    return float((values + gradients @ step).max())


def _step(values: Array, gradients: Array, box: float) -> Array:
    """Least largest tangent within the box, the shortest step among equals."""
    count, n = gradients.shape
    scale = max(float(abs(gradients).max()) * box, 1e-300)
    quadratic = np.diag([*np.full(n, 1e-3), 0.0])
    rows = np.vstack([np.hstack([gradients * box / scale, -np.ones((count, 1))]),
                      np.hstack([np.eye(n), np.zeros((n, 1))]), np.hstack([-np.eye(n), np.zeros((n, 1))])])
    bounds = np.concatenate([(values.max() - values) / scale, np.ones(2 * n)])
    found = least_quadratic(quadratic, np.array([*np.zeros(n), 1.0]), rows, bounds)
    step: Array = found.x[:n] * box
    return step
