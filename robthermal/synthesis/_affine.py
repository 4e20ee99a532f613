"""Matrix inequalities in unknowns that are written as matrices: an affine function becomes what the solver wants."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from .._arrays import Array
from ..conic import Inequality

Matrices = dict[str, Array]


class Unknowns:
    """Named matrices packed into one vector.

    Parameters
    ----------
    shapes : mapping
        Rows and columns by name; a name that ends in "=" is a symmetric matrix, and loses the sign.
    masks : mapping
        By name, which entries are free; the others are zero.
    """

    def __init__(self, shapes: Mapping[str, tuple[int, int]], masks: Mapping[str, Array] | None = None):
        self.places: dict[str, tuple[tuple[int, int], Array, Array, bool, int]] = {}
        count = 0
        for name, shape in shapes.items():
            symmetric = name.endswith("=")
            free = np.ones(shape, bool) if masks is None or name not in masks else masks[name].astype(bool)
            rows, columns = np.nonzero(np.triu(free) if symmetric else free)
            self.places[name.rstrip("=")] = shape, rows, columns, symmetric, count
            count += len(rows)
        self.count = count

    def matrices(self, x: Array) -> Matrices:
        """The matrices of a vector."""
        found = {}
        for name, (shape, rows, columns, symmetric, start) in self.places.items():
            value = np.zeros(shape)
            value[rows, columns] = x[start:start + len(rows)]
            if symmetric:
                value[columns, rows] = value[rows, columns]
            found[name] = value
        return found

    def inequality(self, form: Callable[[Matrices], Array], margin: float = 0.0) -> Inequality:
        """form(matrices) >= margin, of an affine form with symmetric values; its upper triangle counts."""
        zero = np.zeros(self.count)
        constant = form(self.matrices(zero))
        slopes = np.empty((self.count, *constant.shape))
        for k in range(self.count):
            zero[k] = 1.0
            slopes[k] = form(self.matrices(zero)) - constant
            zero[k] = 0.0
        return Inequality(constant, slopes, margin)

    def gradient(self, form: Callable[[Matrices], float]) -> Array:
        """Coefficients of a linear cost."""
        units = np.eye(self.count)
        start = form(self.matrices(np.zeros(self.count)))
        return np.array([form(self.matrices(unit)) - start for unit in units])


def symmetric(blocks: list[list[Array]]) -> Array:
    """Symmetric matrix from the blocks on and above its diagonal, row by row."""
    sizes = [row[0].shape[1] for row in blocks]
    ends = np.cumsum([0, *sizes])
    found = np.zeros((ends[-1], ends[-1]))
    for i, row in enumerate(blocks):
        for j, block in enumerate(row, start=i):
            found[ends[i]:ends[i + 1], ends[j]:ends[j + 1]] = block
            found[ends[j]:ends[j + 1], ends[i]:ends[i + 1]] = block.T
    return found
