"""Gauss-Newton with bounds; where a step fails, one along the curvature it shows, then Marquardt's damping."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from ...errors import Diverged, InputError
from ._columns import Columns, Plain

Array = NDArray[np.float64]
_FLAT = 1e-10  # relative size of a direction that is rounding
_DAMPINGS = tuple(10.0**power for power in range(-2, 6))  # relative to the squares of the derivatives
_LESS = 0.1  # factor on a damping that was not needed
_NONE = 1e-7  # damping below which the full step is tried
_WORTH = 0.05  # of the decrease that the linearization predicts: less is left to a larger damping
_AS_PREDICTED = 0.75  # of the predicted decrease: the model is nearly linear along the step, which may be longer


class Problem(Protocol):
    """What is minimized."""

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
        What is minimized.
    v : ndarray, shape (p,)
        Values of the unknowns.
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

    @cached_property
    def columns(self) -> Columns:
        """The derivatives, as the problem has them: some may be the same everywhere."""
        split = getattr(self.problem, "columns", None)
        return Plain(self.J) if split is None else split(self.v)

    @cached_property
    def small(self) -> tuple[Array, Array]:
        """Derivatives (p + 1, p) and residuals (p + 1,) turned so that all other rows are 0: for linear problems."""
        return self.columns.turned(self.z)


@dataclass(frozen=True, eq=False)
class Descent:
    """Where a minimization ended.

    Parameters
    ----------
    at : Point
        The best one.
    converged : bool
        Whether a further step, damped where longer ones fail, would change the sum of squares by less than `enough`.
    iterations : int
        Number of evaluations.
    """

    at: Point
    converged: bool
    iterations: int


def descend(problem: Problem, v: Array, bounds: tuple[Array, Array], limit: int, enough: float) -> Descent:
    """Minimize |z(v)|² from v.

    Parameters
    ----------
    problem : Problem
        What to minimize.
    v : ndarray
        Start; moved inside the bounds.
    bounds : tuple of ndarray
        Lower and upper.
    limit : int
        Evaluations; whether the last one has converged is not looked at.
    enough : float
        Predicted decrease of the sum of squares, relative to it, at which to stop; ten times as much per factor e by
        which the mean square exceeds 1: a large misfit is not polished.
    """
    now, count, damped = Point(problem, np.clip(v, *bounds)), 1, 0.0
    now.z  # noqa: B018  # a start that does not survive its simulation raises here
    while count < limit:
        power = float(now.z @ now.z)
        little = enough * power * (1.0 + 10.0 * np.log(max(power / now.z.size, 1.0)))
        for damping in _dampings(damped):
            step = _damped_step(now, damping, bounds, little)
            J, z = now.small
            decrease = power - float(np.sum((z - J @ step) ** 2))
            if decrease <= little:
                return Descent(now, True, count)
            if count >= limit:
                return Descent(now, False, count)
            count += 1
            new = Point(problem, np.clip(now.v + step, *bounds))  # a rounding may lie beyond
            if _better(new, power - 1e-4 * decrease, count < limit):
                damped = _relaxed(damping) if power - float(new.z @ new.z) > _AS_PREDICTED * decrease else damping
                break
            curved, gain = _curved(now, new, step, damping, bounds)
            if gain > max(little, _WORTH * decrease) and count < limit:
                count += 1
                new = Point(problem, np.clip(now.v + curved, *bounds))
                if _better(new, power - 1e-4 * gain, count < limit):
                    damped = damping
                    break
        else:
            return Descent(now, False, count)
        now = new
    return Descent(now, False, count)


def decrease(at: Point, bounds: tuple[Array, Array]) -> float:
    """Decrease of the sum of squares that the linearization at a point promises.

    Parameters
    ----------
    at : Point
        Where the problem is linearized.
    bounds : tuple of ndarray
        Lower and upper.
    """
    J, z = at.small
    return float(z @ z - np.sum((z - J @ _damped_step(at, 0.0, bounds, 0.0)) ** 2))


def _better(new: Point, power: float, goes_on: bool) -> bool:
    """Whether the point survives, as its derivatives must if they will be needed, with a smaller sum of squares."""
    try:
        if not new.z @ new.z < power:
            return False
        if goes_on:
            new.columns  # noqa: B018
    except (Diverged, InputError):  # beyond what the system accepts or survives
        return False
    return True


def _dampings(first: float) -> list[float]:
    """Dampings tried one after the other: the first one, then larger ones; it is not looked for from the beginning."""
    return [first, *(damping for damping in _DAMPINGS if damping > 2.0 * first)]


def _relaxed(damping: float) -> float:
    """Damping of the next step after one that was as good as predicted; none if it is next to nothing."""
    return _LESS * damping if _LESS * damping > _NONE else 0.0


def _curved(now: Point, new: Point, step: Array, damping: float, bounds: tuple[Array, Array]) -> tuple[Array, float]:
    """Step along the parabola that a failed step shows, and its predicted decrease; 0 if it leads nowhere.

    What the failed step found beyond its linearization is the curvature of the residuals along it. t step +
    t² acceleration follows the valley (geodesic acceleration, Transtrum and Sethna 2012), with the t at which the sum
    of squares of z - t J step - t² (curvature + J acceleration) is lowest.
    """
    try:
        beyond = now.z - now.columns.along(step) - new.z
    except (Diverged, InputError):
        return step, 0.0
    if not np.isfinite(beyond).all():
        return step, 0.0
    rows, against = now.columns.again(now.small[0], -beyond)
    scale = np.linalg.norm(rows, axis=0)
    scale[scale == 0] = 1.0
    rows = rows / scale
    if damping:
        rows = np.concatenate([rows, np.sqrt(damping) * np.eye(step.size)])
        against = np.append(against, np.zeros(step.size))
    acceleration = _least_squares(rows, against) / scale
    along, across = now.columns.along(step), beyond + now.columns.along(acceleration)
    t = _lowest(now.z, along, across)
    curved = np.clip(now.v + t * step + t**2 * acceleration, *bounds) - now.v
    predicted = now.z - t * along - t**2 * across
    return curved, float(now.z @ now.z - predicted @ predicted)


def _lowest(z: Array, along: Array, across: Array) -> float:
    """The t between 0 and 1 at which |z - t along - t² across|² is lowest."""
    quartic = np.polynomial.Polynomial([z @ z, -2.0 * (z @ along), along @ along - 2.0 * (z @ across),
                                        2.0 * (along @ across), across @ across])
    roots = quartic.deriv().roots()
    real = roots[np.abs(roots.imag) < 1e-9].real
    return float(min([t for t in real if 0.0 < t < 1.0] + [1.0], key=quartic))


def _damped_step(at: Point, damping: float, bounds: tuple[Array, Array], little: float) -> Array:
    """Step within the bounds, with Marquardt's damping relative to the squares of the derivatives."""
    J, z = at.small
    if damping:
        J = np.concatenate([J, np.diag(np.sqrt(damping) * np.linalg.norm(J, axis=0))])
        z = np.append(z, np.zeros(at.v.size))
    return _step(z, J, at.v, bounds, little)


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
    low, high = ((bound - v)[free] * scale for bound in bounds)
    ends = np.minimum(low, 0.0), np.maximum(high, 0.0)
    step[free] = scipy.optimize.lsq_linear(J[:, free] / scale, z, ends, "bvls").x / scale
    return step


def _solve(J: Array, z: Array) -> Array:
    scale = np.linalg.norm(J, axis=0)
    scale[scale == 0] = 1.0
    return _least_squares(J / scale, z) / scale


def _least_squares(J: Array, z: Array) -> Array:
    """The shortest of the solutions of least squares, by QR with pivoting: faster than by singular values."""
    return np.asarray(scipy.linalg.lstsq(J, z, cond=_FLAT, lapack_driver="gelsy")[0], np.float64)
