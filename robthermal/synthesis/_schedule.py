"""Scheduling quantities: where the vertices of a hull lie, and the weights of the point at hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import scipy

from .._arrays import Array
from .._checks import quoted
from ..errors import InputError

_OUTSIDE = 1e-9  # of the range of a quantity: rounding
_FLAT = 1e-9  # of the ranges: thickness below which a simplex has no inside


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

    def moved_inside(self, point: Array) -> tuple[Array, bool]:
        """Weights at any point, moved to those of the vertices where it lies outside, as the C source does it.

        Only for a grid, or vertices that have simplices; every sum in the order of the source.
        """
        if self.axes:
            own = np.array([min(max(float(value), float(axis[0])), float(axis[-1]))
                            for axis, value in zip(self.axes, point, strict=True)])
            return self._on_grid(own), not np.array_equal(own, point)
        corners, shares = self.simplices
        best, most, found = np.zeros(0), -np.inf, corners[0]
        for own, table in zip(corners, shares, strict=True):
            share = table[:, -1]
            for column, value in zip(table.T, point, strict=False):
                share = share + column * value
            if share.min() > most:
                best, most, found = share, float(share.min()), own
        best = np.maximum(best, 0.0)
        weights = np.zeros(len(self.points))
        total = 0.0
        for one in best.tolist():
            total += one
        weights[found] = best / total
        return weights, most < -_OUTSIDE

    @cached_property
    def simplices(self) -> tuple[Array, Array]:
        """Delaunay's: vertices (k, d + 1), and their shares at a point, table @ (point, 1).

        None of vertices on a plane. In quantities scaled to their ranges.
        """
        d = self.points.shape[1]
        nothing = np.zeros((0, d + 1), int), np.zeros((0, d + 1, d + 1))
        low, unit = self._scale()
        scaled = (self.points - low) / unit
        try:
            corners = scipy.spatial.Delaunay(scaled).simplices
        except (scipy.spatial.QhullError, ValueError):
            return nothing
        full = [one for one in corners
                if np.linalg.matrix_rank(scaled[one][1:] - scaled[one][0], tol=_FLAT) == d]
        if not full:
            return nothing
        tables = []
        for one in full:
            share = np.linalg.inv(np.vstack([scaled[one].T, np.ones(d + 1)]))
            tables.append(np.hstack([share[:, :d] / unit, (share[:, d] - share[:, :d] @ (low / unit))[:, None]]))
        return np.array(full), np.array(tables)

    def _scale(self) -> tuple[Array, Array]:
        """Least values and ranges of the quantities."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return low, np.where(high > low, high - low, 1.0)

    def _on_grid(self, point: Array) -> Array:
        shares = [{float(axis[0]): 1.0} if len(axis) == 1 else _between(axis, value)
                  for axis, value in zip(self.axes, point, strict=True)]
        return np.array([np.prod([share.get(float(value), 0.0) for share, value in zip(shares, row, strict=True)])
                         for row in self.points])

    def _among(self, point: Array) -> Array:
        """Those of the simplex; of vertices on a plane those of the least sum of w |vertex|², which is the same."""
        if len(self.simplices[0]):
            inside, outside = self.moved_inside(point)
            if not outside:
                return inside
        low, unit = self._scale()
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
