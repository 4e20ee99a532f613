"""Columns of a least-squares problem as a descent asks for them; those that are the same everywhere are turned once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ._turned import by_triangle, triangle, turned, turned_again

Array = NDArray[np.float64]


class Columns(Protocol):
    """Derivatives J (m, p) of a model, or what stands for them."""

    def along(self, step: Array) -> Array:
        """J @ step, (m,)."""

    def turned(self, z: Array) -> tuple[Array, Array]:
        """As `turned(J, z)`."""

    def again(self, rows: Array, z: Array) -> tuple[Array, Array]:
        """The same for another right side; `rows` are those that `turned` gave before."""


@dataclass(frozen=True, eq=False)
class Plain:
    """All columns as they are.

    Parameters
    ----------
    J : ndarray, shape (m, p)
        Columns of a least-squares problem.
    """

    J: Array

    def along(self, step: Array) -> Array:
        """As `Columns.along`."""
        return np.asarray(self.J @ step, np.float64)

    def turned(self, z: Array) -> tuple[Array, Array]:
        """As `Columns.turned`."""
        return turned(self.J, z)

    def again(self, rows: Array, z: Array) -> tuple[Array, Array]:
        """As `Columns.again`."""
        found = turned_again(rows, z @ self.J, z)
        return turned(self.J, z) if found is None else (rows, found)


@dataclass(frozen=True, eq=False)
class Still:
    """Columns Q R that are the same everywhere, Q orthonormal; 0 but in some rows.

    Parameters
    ----------
    Q : ndarray, shape (m, k)
        Orthonormal columns, in all rows.
    R : ndarray, shape (k, k)
        Triangle of the columns.
    """

    Q: Array
    R: Array


def still(columns: Array) -> Still:
    """Columns (m, k) that are the same everywhere.

    Parameters
    ----------
    columns : ndarray
        At least as many rows as columns.
    """
    Q, R = scipy.linalg.qr(columns, mode="economic", check_finite=False)
    return Still(np.ascontiguousarray(Q), R)


@dataclass(frozen=True, eq=False)
class Beside:
    """Columns some of which are the same everywhere: the others, without what those explain, are all that is turned.

    Parameters
    ----------
    moving : ndarray, shape (m, p - k)
        The other columns, 0 in the rows `own`.
    still : Still
        Columns that are the same everywhere: in the first rows, and below them in the rows `own`.
    places : slice
        Where these columns stand among all.
    own : slice
        Rows in which they alone are not 0: those of their priors.
    """

    moving: Array
    still: Still
    places: slice
    own: slice

    def along(self, step: Array) -> Array:
        """As `Columns.along`."""
        return self._less(self.moving @ np.delete(step, self.places), -(self.still.R @ step[self.places]))

    def turned(self, z: Array) -> tuple[Array, Array]:
        """As `Columns.turned`."""
        M, explained, first = self.moving, self._explained(self.moving), self._explained(z)
        found = by_triangle(triangle(M.T @ M, explained.T @ explained), z @ M - first @ explained, float(z @ z),
                            float(first @ first))
        below, rest = turned(self._less(M, explained), self._less(z, first)) if found is None else found
        k = len(first)
        rows = np.zeros((k + len(below), k + below.shape[1]))
        rows[:k, self.places] = self.still.R
        rows[:k, self._others] = explained
        rows[k:, self._others] = below
        return rows, np.concatenate([first, rest])

    def again(self, rows: Array, z: Array) -> tuple[Array, Array]:
        """As `Columns.again`."""
        first = self._explained(z)
        rest = self._less(z, first)
        found = turned_again(rows[len(first):, self._others], rest @ self.moving, rest)
        return self.turned(z) if found is None else (rows, np.concatenate([first, found]))

    @property
    def _others(self) -> NDArray[np.intp]:
        return np.delete(np.arange(self.moving.shape[1] + len(self.still.R)), self.places)

    @property
    def _blocks(self) -> tuple[Array, Array]:
        """Q in the first rows, and in the rows `own`."""
        n = len(self.still.Q) - len(self.still.R)
        return self.still.Q[:n], self.still.Q[n:]

    def _explained(self, columns: Array) -> Array:
        """Coordinates (k, ...) along the columns that are the same everywhere."""
        first, own = self._blocks
        return np.asarray(first.T @ columns[:len(first)] + own.T @ columns[self.own], np.float64)

    def _less(self, columns: Array, along: Array) -> Array:
        """Columns (m, ...) less what these coordinates stand for."""
        first, own = self._blocks
        out, n = np.empty_like(columns), len(first)
        np.matmul(first, -along, out=out[:n])
        out[:n] += columns[:n]
        out[n:] = columns[n:]
        out[self.own] -= own @ along
        return out
