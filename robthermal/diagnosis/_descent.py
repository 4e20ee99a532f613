"""Gauss-Newton with bounds; where a step fails, shorter ones, then Marquardt's damping."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import Diverged, InputError

Array = NDArray[np.float64]
_FLAT = 1e-10  # relative singular value that is rounding
_DAMPINGS = tuple(10.0**power for power in range(-2, 6))  # relative to the squares of the derivatives


@dataclass(frozen=True, eq=False)
class Descent:
    """Where a minimisation ended.

    Parameters
    ----------
    v : ndarray, shape (p,)
        Unknowns.
    z : ndarray, shape (m,)
        Weighted residuals there.
    J : ndarray, shape (m, p)
        Derivative of the model, - ∂z/∂v.
    converged : bool
        Whether a further step, shortened or damped where longer ones fail, would change the sum of squares by less
        than `enough`.
    iterations : int
        Evaluations.
    """

    v: Array
    z: Array
    J: Array
    converged: bool
    iterations: int


def descend(evaluate: Callable[[Array], tuple[Array, Array]], v: Array, bounds: tuple[Array, Array],
            limit: int, enough: float) -> Descent:
    """Minimise |z(v)|² from v.

    Parameters
    ----------
    evaluate : callable
        v to (z, J).
    v : ndarray
        Start; moved inside the bounds.
    bounds : tuple of ndarray
        Lower and upper.
    limit : int
        Evaluations.
    enough : float
        Predicted decrease of the sum of squares, relative to it, at which to stop; ten times as much per factor e by
        which the mean square exceeds 1: what is hopeless is not polished.
    """
    v = np.clip(v, *bounds)
    z, J = evaluate(v)
    count = 1
    while True:
        power = float(z @ z)
        little = enough * power * (1.0 + 10.0 * np.log(max(power / z.size, 1.0)))
        for step in _trials(z, J, v, bounds):
            decrease = power - float(np.sum((z - J @ step) ** 2))
            if decrease <= little:
                return Descent(v, z, J, True, count)
            if count >= limit:
                return Descent(v, z, J, False, count)
            count += 1
            try:
                new_z, new_J = evaluate(v + step)
            except (Diverged, InputError):  # beyond what the system accepts or survives
                continue
            if new_z @ new_z < power - 1e-4 * decrease:
                break
        else:
            return Descent(v, z, J, False, count)
        v, z, J = v + step, new_z, new_J


def _trials(z: Array, J: Array, v: Array, bounds: tuple[Array, Array]) -> Iterator[Array]:
    """The full step, shorter ones in its direction, then ones that turn away from what the data hardly determine."""
    full = _step(z, J, v, bounds, 0.0)
    yield from (full, full / 2, full / 4)
    for damping in _DAMPINGS:
        yield _step(z, J, v, bounds, damping)


def _step(z: Array, J: Array, v: Array, bounds: tuple[Array, Array], damping: float) -> Array:
    """Least-squares step within the bounds; unknowns that would leave are put on their bound, the rest solved again."""
    rows = np.diag(np.sqrt(damping) * np.linalg.norm(J, axis=0))
    J, z = (np.concatenate([J, rows]), np.append(z, np.zeros(v.size))) if damping else (J, z)
    step, free = np.zeros(v.size), np.ones(v.size, bool)
    for _ in range(v.size + 1):
        step[free] = _solve(J[:, free], z - J[:, ~free] @ step[~free])
        out = free & ((v + step < bounds[0]) | (v + step > bounds[1]))
        if not out.any():
            break
        step[out] = np.clip(v + step, *bounds)[out] - v[out]
        free &= ~out
    return step


def _solve(J: Array, z: Array) -> Array:
    scale = np.linalg.norm(J, axis=0)
    scale[scale == 0] = 1.0
    return np.asarray(np.linalg.lstsq(J / scale, z, rcond=_FLAT)[0] / scale, np.float64)
