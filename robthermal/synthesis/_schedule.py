"""Scheduling quantities: where the vertices of a hull lie, and the weights of the point at hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import scipy

from .._arrays import Array
from .._checks import quoted
from ..errors import InputError

_OUTSIDE = 1e-9  # of the range of a quantity: rounding


@dataclass(frozen=True)
class Schedule:
    """Names of the quantities and their values at the vertices, one row per vertex.

    ``axes``: values along every quantity where the vertices are a full grid, else empty.
    """

    names: tuple[str, ...]
    points: Array
    axes: tuple[Array, ...]

    def weights(self, values: Any) -> Array:
        """Weights of the vertices at a point of their hull, one per vertex, not negative, of sum one.

        On a grid those of the corners of the point's cell, multilinear; else those of its Delaunay simplex.
        """
        point = self._point(values)
        if len(self.points) == 1:
            return np.ones(1)
        return self._on_grid(point) if self.axes else self._among(point)

    def _point(self, values: Any) -> Array:
        if not isinstance(values, Mapping) or set(values) != set(self.names):
            raise InputError(f"scheduling = {quoted(values)}", where="argument scheduling",
                             expected=f"one number for each of {list(self.names)}")
        found = np.empty(len(self.names))
        for k, name in enumerate(self.names):
            own, low, high = values[name], self.points[:, k].min(), self.points[:, k].max()
            number = isinstance(own, (int, float, np.integer, np.floating)) and not isinstance(own, bool)
            spare = _OUTSIDE * max(high - low, abs(high), abs(low))
            if not number or not low - spare <= own <= high + spare:
                raise InputError(f"{name} = {quoted(own)}", where="argument scheduling",
                                 expected=f"a number from {low:g} to {high:g}, the values of the plants")
            found[k] = min(max(float(own), low), high)
        return found

    def _on_grid(self, point: Array) -> Array:
        shares = [{float(axis[0]): 1.0} if len(axis) == 1 else _between(axis, value)
                  for axis, value in zip(self.axes, point, strict=True)]
        return np.array([np.prod([share.get(float(value), 0.0) for share, value in zip(shares, row, strict=True)])
                         for row in self.points])

    def _among(self, point: Array) -> Array:
        """Least sum of w |vertex|²: the simplex of a Delaunay triangulation, in quantities scaled to their ranges."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        unit = np.where(high > low, high - low, 1.0)
        scaled, own = (self.points - low) / unit, (point - low) / unit
        found = scipy.optimize.linprog(((scaled - 0.5) ** 2).sum(axis=1), b_eq=[*own, 1.0], bounds=(0, None),
                                       A_eq=np.vstack([scaled.T, np.ones(len(scaled))]), method="highs")
        if found.x is None:
            raise InputError(f"scheduling = {quoted(dict(zip(self.names, point.tolist(), strict=True)))}",
                             where="argument scheduling", expected="a point in the convex hull of those of the plants")
        weights = np.maximum(found.x, 0.0)
        return np.asarray(weights / weights.sum(), float)


def _between(axis: Array, value: float) -> dict[float, float]:
    """Shares of the two grid values around a value."""
    k = int(np.clip(np.searchsorted(axis, value, side="right") - 1, 0, len(axis) - 2))
    upper = float((value - axis[k]) / (axis[k + 1] - axis[k]))
    return {float(axis[k]): 1.0 - upper, float(axis[k + 1]): upper}


def read_schedule(scheduling: Any, count: int) -> Schedule:
    """Values of the quantities at the plants: one per plant, or along the axes of a grid (last name fastest)."""
    where = "argument scheduling"
    if not isinstance(scheduling, Mapping) or not scheduling or not all(isinstance(name, str) for name in scheduling):
        raise InputError(f"scheduling = {quoted(scheduling)}", where=where,
                         expected='values by name, such as {"current": [0.2, 1.8]}')
    values = [_values(name, one) for name, one in scheduling.items()]
    lengths = [len(one) for one in values]
    if all(length == count for length in lengths):
        points = np.array(values).T
    elif int(np.prod(lengths)) == count:
        points = np.array(list(product(*values)))
    else:
        raise InputError(f"{lengths} values for {count} plants", where=where,
                         expected=f"{count} values of every quantity, or values along the axes of a grid of {count}")
    if len(np.unique(points, axis=0)) < count:
        raise InputError("two plants at the same values", where=where, expected="one plant for each")
    axes = tuple(np.unique(points[:, k]) for k in range(points.shape[1]))
    return Schedule(tuple(scheduling), points, axes if int(np.prod([len(one) for one in axes])) == count else ())


def _values(name: str, given: Any) -> list[float]:
    good = isinstance(given, (Sequence, np.ndarray)) and not isinstance(given, str) and len(given)
    try:
        found = [float(value) for value in given] if good else []
    except (TypeError, ValueError):
        found = []
    if not found or not np.isfinite(found).all():
        raise InputError(f"{name} = {quoted(given)}", where="argument scheduling", expected="a list of finite numbers")
    return found
