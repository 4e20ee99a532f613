"""Scalings of D-K iteration: magnitudes at frequencies, and stable, minimum-phase functions of these magnitudes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.polynomial import chebyshev

from .._arrays import Array
from ..conic import least_quadratic
from ..linear import Plant

Sizes = Sequence[tuple[int, int]]  # rows and columns of the blocks of Delta
_CYCLES = 6
_GOLDEN = (np.sqrt(5) - 1) / 2
_SPAN = 4.0  # of ln d in the first cycle, to either side
_BISECTIONS = 14
_LARGEST = 1e4  # ratio between fit and magnitude at which the bisection begins


def magnitudes(M: Array, sizes: Sizes) -> tuple[Array, Array]:
    """Least σ_max(D_L M D_R⁻¹), shape (n_f,), and d (n_f, n_blocks), the last one 1; M has shape (n_f, p, m).

    The function is convex in ln d; one entry after the other is searched, at all frequencies together.
    """
    logs = np.zeros((len(M), len(sizes)))
    span = _SPAN
    for _ in range(_CYCLES):
        for k in range(len(sizes) - 1):
            logs[:, k] = _searched(M, sizes, logs, k, span)
        span /= 2
    return _scaled_norm(M, sizes, logs), np.exp(logs)


def _searched(M: Array, sizes: Sizes, logs: Array, k: int, span: float) -> Array:
    """ln d of one block by golden section, the others held."""
    low, high = logs[:, k] - span, logs[:, k] + span

    def at(value: Array) -> Array:
        moved = logs.copy()
        moved[:, k] = value
        return _scaled_norm(M, sizes, moved)

    for _ in range(16):
        left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        lower = at(left) < at(right)
        low, high = np.where(lower, low, left), np.where(lower, right, high)
    middle: Array = (low + high) / 2
    return np.where(at(middle) < at(logs[:, k]), middle, logs[:, k])


def _scaled_norm(M: Array, sizes: Sizes, logs: Array) -> Array:
    left, right = (np.exp(np.repeat(logs, [size[side] for size in sizes], axis=1)) for side in (1, 0))
    return np.linalg.norm(left[:, :, None] * M / right[:, None, :], 2, axis=(1, 2))


def fitted(omega: Array, magnitude: Array, order: int) -> Plant:
    """Stable, minimum-phase system of one input and output with about these magnitudes.

    |d|² = b/a, polynomials of the order in ω², of least largest ratio to the magnitudes: linear programs.
    """
    middle = float(np.exp(np.log(omega[omega > 0]).mean()))
    y = (omega**2 - middle**2) / (omega**2 + middle**2)
    squared = magnitude**2
    low, high, best = 0.0, np.log(_LARGEST), None
    for _ in range(_BISECTIONS):
        level = (low + high) / 2 if best is not None else high
        found = _within(y, squared, order, float(np.exp(level)))
        if found is None:
            if best is None:
                break
            low = level
        else:
            best, high = found, level
    if best is None:
        return _constant(float(np.exp(np.log(magnitude).mean())))
    b, a = best
    return _factor(b, a, y, squared, middle)


def _within(y: Array, squared: Array, order: int, ratio: float) -> tuple[Array, Array] | None:
    """b, a in Chebyshev's basis with m²a/ratio <= b <= ratio m²a and a >= 1 on a grid; None where there are none."""
    basis = chebyshev.chebvander(y, order)
    dense = chebyshev.chebvander(np.cos(np.linspace(0, np.pi, 12 * order + 13)), order)
    nothing = np.zeros_like(dense)
    mean = float(np.exp(np.log(squared).mean()))
    m = squared[:, None] / mean
    rows = np.vstack([np.hstack([basis / ratio, -m * basis]), np.hstack([-basis * ratio, m * basis]),
                      np.hstack([nothing, -dense]), np.hstack([-dense, nothing])])
    scale = abs(rows).max(axis=1)
    bounds = np.concatenate([np.zeros(2 * len(y)), -np.ones(len(dense)), -np.full(len(dense), 1e-6)]) / scale
    n = order + 1
    found = least_quadratic(1e-9 * np.eye(2 * n), np.zeros(2 * n), rows / scale[:, None], bounds)
    return (found.x[:n] * mean, found.x[n:]) if found.solved and found.x.any() else None


def _factor(b: Array, a: Array, y: Array, squared: Array, middle: float) -> Plant:
    """The factor of b/a with all zeros and poles in the left half-plane."""
    zeros, poles = (_roots(part, middle) for part in (b, a))
    k = int(np.argsort(y)[len(y) // 2])
    at = 1j * middle * np.sqrt((1 + y[k]) / (1 - y[k]))
    size = abs(np.prod(at - zeros) / np.prod(at - poles))
    wanted = np.sqrt(abs(chebyshev.chebval(y[k], b) / chebyshev.chebval(y[k], a)))
    found = _constant(float(wanted / size))
    for above, below in zip(_quadratics(zeros), _quadratics(poles), strict=True):
        found = series(found, _section(above, below))
    return found if found.stable else _constant(float(np.exp(0.5 * np.log(squared).mean())))


def _quadratics(roots: Array) -> list[Array]:
    """Real polynomials of degree two, and one of degree one where the number is odd, slow ones first."""
    pairs = [np.array([1.0, -2 * one.real, abs(one)**2]) for one in roots if one.imag > 1e-9 * abs(one)]
    single = np.sort(-np.array([one.real for one in roots if abs(one.imag) <= 1e-9 * abs(one)]))
    pairs += [np.array([1.0, p + q, p * q]) for p, q in zip(single[0:-1:2], single[1::2], strict=False)]
    pairs.sort(key=lambda one: float(one[-1]))
    return [*pairs, np.array([1.0, single[-1]])] if len(single) % 2 else pairs


def _section(above: Array, below: Array) -> Plant:
    """above/below, monic and of one degree, in states of a size."""
    rest = above[1:] - below[1:]
    if len(rest) == 1:
        return Plant(-below[1:, None], np.ones((1, 1)), rest[:, None], np.ones((1, 1)), 0.0)
    w = float(np.sqrt(below[2]))
    return Plant(np.array([[0.0, w], [-w, -below[1]]]), np.array([[0.0], [1.0]]), np.array([[rest[1] / w, rest[0]]]),
                 np.ones((1, 1)), 0.0)


def _roots(polynomial: Array, middle: float) -> Array:
    y: Array = chebyshev.chebroots(polynomial).astype(complex)
    y = y[abs(1 - y) > 1e-12]
    s = -np.sqrt(-(middle**2) * (1 + y) / (1 - y))
    return np.concatenate([s, np.full(len(polynomial) - 1 - len(y), -middle)])


def _constant(value: float) -> Plant:
    return Plant(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[value]]), 0.0)


def inverse(d: Plant) -> Plant:
    """1/d."""
    one = 1.0 / d.D
    return Plant(d.A - d.B @ one @ d.C, d.B @ one, -one @ d.C, one, d.dt)


def diagonal(parts: Sequence[Plant]) -> Plant:
    """Block-diagonal system."""
    block = scipy.linalg.block_diag
    A, B, C, D = (block(*(getattr(part, key) for part in parts)) for key in "ABCD")
    return Plant(A, B, C, D, parts[0].dt)


def series(first: Plant, second: Plant) -> Plant:
    """second after first."""
    A = np.block([[first.A, np.zeros((len(first.A), len(second.A)))], [second.B @ first.C, second.A]])
    return Plant(A, np.vstack([first.B, second.B @ first.D]), np.hstack([second.D @ first.C, second.C]),
                 second.D @ first.D, first.dt)
