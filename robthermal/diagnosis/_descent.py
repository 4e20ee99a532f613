"""Gauss-Newton with bounds; where a step fails, shorter ones, then Marquardt's damping."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ..errors import Diverged, InputError

Array = NDArray[np.float64]
_FLAT = 1e-10  # relative singular value that is rounding
_DAMPINGS = tuple(10.0**power for power in range(-2, 6))  # relative to the squares of the derivatives


class Problem(Protocol):
    """What is minimised."""

    def residual(self, v: Array) -> Array:
        """Weighted residuals, (m,)."""

    def slopes(self, v: Array) -> Array:
        """Derivative of the model, - ∂z/∂v, (m, p)."""


@dataclass(frozen=True, eq=False)
class Point:
    """Residuals at some unknowns, and derivatives once they are asked for: they cost more, and few points need them.

    Parameters
    ----------
    problem : Problem
        What is minimised.
    v : ndarray, shape (p,)
        Unknowns.
    """

    problem: Problem
    v: Array

    @cached_property
    def z(self) -> Array:
        """Weighted residuals, (m,)."""
        return self.problem.residual(self.v)

    @cached_property
    def J(self) -> Array:
        """Derivative of the model, - ∂z/∂v, (m, p)."""
        return self.problem.slopes(self.v)


@dataclass(frozen=True, eq=False)
class Descent:
    """Where a minimisation ended.

    Parameters
    ----------
    at : Point
        The best one.
    converged : bool
        Whether a further step, shortened or damped where longer ones fail, would change the sum of squares by less
        than `enough`.
    iterations : int
        Evaluations.
    """

    at: Point
    converged: bool
    iterations: int


def descend(problem: Problem, v: Array, bounds: tuple[Array, Array], limit: int, enough: float) -> Descent:
    """Minimise |z(v)|² from v.

    Parameters
    ----------
    problem : Problem
        What to minimise.
    v : ndarray
        Start; moved inside the bounds.
    bounds : tuple of ndarray
        Lower and upper.
    limit : int
        Evaluations; whether the last one has converged is not looked at.
    enough : float
        Predicted decrease of the sum of squares, relative to it, at which to stop; ten times as much per factor e by
        which the mean square exceeds 1: what is hopeless is not polished.
    """
    now, count = Point(problem, np.clip(v, *bounds)), 1
    now.z  # noqa: B018  # a start that does not survive its simulation raises here
    while count < limit:
        power = float(now.z @ now.z)
        little = enough * power * (1.0 + 10.0 * np.log(max(power / now.z.size, 1.0)))
        for step in _trials(now.z, now.J, now.v, bounds, little):
            decrease = power - float(np.sum((now.z - now.J @ step) ** 2))
            if decrease <= little:
                return Descent(now, True, count)
            if count >= limit:
                return Descent(now, False, count)
            count += 1
            if (new := _better(Point(problem, now.v + step), power - 1e-4 * decrease, count < limit)) is not None:
                break
        else:
            return Descent(now, False, count)
        now = new
    return Descent(now, False, count)


def _better(new: Point, power: float, goes_on: bool) -> Point | None:
    """The point if it survives, as its derivatives must if they will be needed, and its sum of squares is smaller."""
    try:
        if not new.z @ new.z < power:
            return None
        if goes_on:
            new.J  # noqa: B018
    except (Diverged, InputError):  # beyond what the system accepts or survives
        return None
    return new


def _trials(z: Array, J: Array, v: Array, bounds: tuple[Array, Array], little: float) -> Iterator[Array]:
    """The full step, shorter ones in its direction, then ones that turn away from what the data hardly determine."""
    full = _step(z, J, v, bounds, little)
    yield from (full, full / 2, full / 4)
    norms = np.linalg.norm(J, axis=0)
    for damping in _DAMPINGS:
        rows = np.diag(np.sqrt(damping) * norms)
        yield _step(np.append(z, np.zeros(v.size)), np.concatenate([J, rows]), v, bounds, little)


def _step(z: Array, J: Array, v: Array, bounds: tuple[Array, Array], little: float) -> Array:
    """Least-squares step within the bounds; unknowns that would leave are put on their bound, the rest solved again.

    Where that leaves no decrease to speak of, the best step within the bounds says whether there is one.
    """
    step, free = np.zeros(v.size), np.ones(v.size, bool)
    for _ in range(v.size + 1):
        step[free] = _solve(J[:, free], z - J[:, ~free] @ step[~free])
        out = free & ((v + step < bounds[0]) | (v + step > bounds[1]))
        if not out.any():
            break
        step[out] = np.clip(v + step, *bounds)[out] - v[out]
        free &= ~out
    if not free.all() and z @ z - np.sum((z - J @ step) ** 2) <= little:
        return _best_step(z, J, v, bounds)
    return step


def _best_step(z: Array, J: Array, v: Array, bounds: tuple[Array, Array]) -> Array:
    """Least-squares step within the bounds, exactly (Stark and Parker's active sets)."""
    step, free = np.zeros(v.size), bounds[1] > bounds[0]
    scale = np.linalg.norm(J[:, free], axis=0)
    scale[scale == 0] = 1.0
    R = np.asarray(np.linalg.qr(np.column_stack([J[:, free] / scale, z]), mode="r"), np.float64)
    low, high = ((bound - v)[free] * scale for bound in bounds)
    step[free] = lsq_linear(R[:, :-1], R[:, -1], (np.minimum(low, 0.0), np.maximum(high, 0.0)), "bvls").x / scale
    return step


def _solve(J: Array, z: Array) -> Array:
    scale = np.linalg.norm(J, axis=0)
    scale[scale == 0] = 1.0
    return np.asarray(np.linalg.lstsq(J / scale, z, rcond=_FLAT)[0] / scale, np.float64)
