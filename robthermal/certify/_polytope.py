"""Matrices base + Σ one part of every block, and one quadratic form for all of them by cutting planes.

The linear matrix inequality is solved for a few vertices; those it violates are added, until it violates none. What is
found is rounded and proven elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..conic import Form, largest_margin
from ._jacobian import BoxJacobian

Array = NDArray[np.floating[Any]]
MOST = 50_000  # joint vertices that are looked at one by one
_CHUNK = 4_000_000  # entries held at a time
_ROUNDS = 25
_ADDED = 6  # vertices per round
_ENOUGH = 0.5  # share of the solver's margin that must be left at the vertices it did not see


@dataclass(frozen=True)
class Polytope:
    """Hull of base + parts[0][i] + parts[1][j] + …

    Parameters
    ----------
    base : ndarray, shape (n, n)
        Part that all vertices share.
    parts : tuple of ndarray, shape (k, n, n)
        What the vertices of every block add.
    """

    base: Array
    parts: tuple[Array, ...]

    @property
    def count(self) -> int:
        """Number of joint vertices."""
        return math.prod(len(part) for part in self.parts)

    def matrices(self, numbers: NDArray[np.intp]) -> Array:
        """Matrices of some joint vertices, (len(numbers), n, n)."""
        total = np.repeat(self.base[None], len(numbers), axis=0)
        rest = numbers
        for part in self.parts:
            rest, own = np.divmod(rest, len(part))
            total += part[own]
        return total

    def chunks(self) -> Iterator[tuple[NDArray[np.intp], Array]]:
        """All joint vertices, a few thousand at a time."""
        step = max(1, _CHUNK // self.base.size)
        for first in range(0, self.count, step):
            numbers = np.arange(first, min(first + step, self.count))
            yield numbers, self.matrices(numbers)

    def largest(self, value: Callable[[Array], Array]) -> float:
        """Largest value over the joint vertices; ``value`` takes a stack of matrices."""
        return max(float(value(M).max()) for _, M in self.chunks())


def polytope(box: BoxJacobian) -> Polytope:
    """E^-½ J E^-½ over a box: similar to E⁻¹J, and symmetric where J is."""
    n, scale = len(box.capacity), 1 / np.sqrt(box.capacity)
    outer = np.outer(scale, scale)
    parts = []
    for block in box.blocks:
        part = np.zeros((len(block.vertices), n, n))
        nodes = [block.a] if block.b < 0 else [block.a, block.b]
        part[np.ix_(range(len(part)), nodes, nodes)] = block.vertices[:, :len(nodes), :len(nodes)]
        parts.append(np.unique(part * outer, axis=0))
    return Polytope(box.base.toarray() * outer, tuple(parts))


@dataclass
class Cuts:
    """Vertices in use: kept from one search to the next, where the numbering of the vertices stays."""

    numbers: list[int] = field(default_factory=list)
    solves: int = 0


def common_form(vertices: Polytope, form: Callable[[Array], Form], pattern: NDArray[np.bool_],
                cuts: Cuts) -> tuple[Array, float]:
    """Q with least I <= Q <= I and form(M) > 0 at every vertex M.

    Parameters
    ----------
    vertices : Polytope
        Polytope of the matrices M.
    form : callable
        M to the linear function of Q that must be positive definite.
    pattern : ndarray of bool, shape (n, n)
        Entries of Q that may differ from zero.
    cuts : Cuts
        Vertices to begin with; those that were needed are added.

    Returns
    -------
    (ndarray, float)
        Q, and the least eigenvalue of the forms over all vertices: not positive where nothing was found.
    """
    if not cuts.numbers:
        _add(cuts, _violations(vertices, form, np.eye(len(pattern))))
    for _ in range(_ROUNDS):
        found = largest_margin([form(M) for M in vertices.matrices(np.array(cuts.numbers))], pattern)
        cuts.solves += 1
        left = _violations(vertices, form, found.matrix)
        if left[0][0] > 0 and left[0][0] >= _ENOUGH * found.margin:
            break
        if not found.margin > 0 or not _add(cuts, left):
            break
    return found.matrix, left[0][0]


def _violations(vertices: Polytope, form: Callable[[Array], Form], Q: Array) -> list[tuple[float, int]]:
    """Least eigenvalues of the forms at the vertices, with the vertices' numbers, least first."""
    found: list[tuple[float, int]] = []
    for numbers, matrices in vertices.chunks():
        least = np.linalg.eigvalsh(np.array([form(M).at(Q) for M in matrices]))[:, 0]
        first = np.argsort(least)[:4 * _ADDED]
        found += [(float(least[i]), int(numbers[i])) for i in first]
    return sorted(found)


def _add(cuts: Cuts, found: Sequence[tuple[float, int]]) -> bool:
    new = [number for _, number in found if number not in cuts.numbers][:_ADDED]
    cuts.numbers += new
    return bool(new)
