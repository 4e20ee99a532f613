"""Follow a curve of equilibria F(y, λ) = 0 from λ = 0, around folds, and collect where it crosses λ = 1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ._terms import Array

_NEWTON = 12
_LARGEST = 0.25
_SMALLEST = 1e-7


@dataclass(frozen=True)
class Curve:
    """A curve of equilibria.

    Parameters
    ----------
    points : ndarray, shape (n_points, n + 1)
        (y, λ) along the curve.
    crossings : list of ndarray
        y at every crossing of λ = 1, in order.
    reached : float
        Largest λ on the curve.
    """

    points: Array
    crossings: list[Array]
    reached: float


def follow(F: Callable[[Array, float], Array], J: Callable[[Array, float], Array], y0: Array, scale: Array,
           inside: Callable[[Array], bool], steps: int = 400) -> Curve:
    """Pseudo-arclength continuation.

    Parameters
    ----------
    F, J : callable
        Residual (n,) and Jacobian (n, n + 1) with respect to (y, λ).
    y0 : ndarray, shape (n,)
        Solution at λ = 0.
    scale : ndarray, shape (n,)
        Sizes of y that count as much as λ = 1.
    inside : callable
        Whether y is still of interest.
    steps : int
        Largest number of steps along the curve.

    Returns
    -------
    Curve
    """
    weight = np.append(scale, 1.0)
    point = np.append(y0, 0.0)
    tangent = _tangent(J, point, weight, np.append(np.zeros_like(y0), 1.0))
    points, crossings, step = [point], [], 0.02
    while len(points) < steps and step > _SMALLEST:
        new = _correct(F, J, point + step * tangent * weight, tangent, weight)
        if new is None or not np.isfinite(new).all():
            step /= 2
            continue
        direction = _tangent(J, new, weight, tangent)
        if direction @ tangent < 0.9:  # turned too far: the curve may have been left
            step /= 2
            continue
        passed = [new]
        if tangent[-1] > 0 > direction[-1]:  # a fold in between: both crossings may hide inside the step
            passed.insert(0, _fold(F, J, point, tangent, step, weight))
        for after in passed:
            if (point[-1] - 1) * (after[-1] - 1) <= 0 and after[-1] != point[-1]:
                crossings.append(_at_one(F, J, point, after))
            point = after
            points.append(point)
        tangent = direction
        if not inside(point[:-1]) or point[-1] < -0.05:
            break
        step = min(1.5 * step, _LARGEST)
    along = np.array(points)
    return Curve(along, crossings, float(along[:, -1].max()))


def _fold(F: Callable[[Array, float], Array], J: Callable[[Array, float], Array], point: Array, tangent: Array,
          step: float, weight: Array) -> Array:
    """Point of largest λ within a step, by bisection on the sign of the tangent's λ."""
    best, low, high = point, 0.0, step
    for _ in range(40):
        middle = 0.5 * (low + high)
        trial = _correct(F, J, point + middle * tangent * weight, tangent, weight)
        if trial is None:
            high = middle
            continue
        rising = _tangent(J, trial, weight, tangent)[-1] > 0
        low, high = (middle, high) if rising else (low, middle)
        if trial[-1] > best[-1]:
            best = trial
    return best


def _tangent(J: Callable[[Array, float], Array], point: Array, weight: Array, previous: Array) -> Array:
    """Unit null vector of the scaled Jacobian, pointing like the previous one."""
    matrix = J(point[:-1], point[-1]) * weight
    rows = np.abs(matrix).max(axis=1, keepdims=True)
    bordered = np.vstack([matrix / rows, previous])
    t = np.linalg.solve(bordered, np.append(np.zeros(len(matrix)), 1.0))
    return t / np.linalg.norm(t)


def _correct(F: Callable[[Array, float], Array], J: Callable[[Array, float], Array], guess: Array, tangent: Array,
             weight: Array) -> Array | None:
    """Newton in the plane through the guess that is normal to the tangent."""
    point = guess
    for _ in range(_NEWTON):
        matrix = np.vstack([J(point[:-1], point[-1]) * weight, tangent])
        try:
            change = np.linalg.solve(matrix, np.append(F(point[:-1], point[-1]), tangent @ ((point - guess) / weight)))
        except np.linalg.LinAlgError:
            return None
        point = point - change * weight
        size = np.abs(change).max()
        if size < 1e-12:
            return point
        if not size < 10:
            return None
    return point if size < 1e-9 else None


def _at_one(F: Callable[[Array, float], Array], J: Callable[[Array, float], Array], before: Array,
            after: Array) -> Array:
    """Newton at λ = 1 from the chord between two points."""
    share = (1 - before[-1]) / (after[-1] - before[-1])
    y = (before + share * (after - before))[:-1]
    for _ in range(_NEWTON):
        change = np.linalg.solve(J(y, 1.0)[:, :-1], F(y, 1.0))
        y = y - change
        if np.abs(change).max() < 1e-10:
            break
    return y
