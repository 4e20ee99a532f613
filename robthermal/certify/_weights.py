"""Weights of the "sum" (cᵀJ < 0) and "max" (J d < 0) certificates: sparse solves instead of a linear program.

Every lump has its own worst vertices, chosen independently of the other lumps', and the off-diagonals count by their
absolute value: what must be negative is the largest of a family of Metzler matrices with independent rows. For it the
best rate is an eigenvalue, found by Noda's iteration (one solve a step, monotone, quadratic) with the worst vertices
chosen anew between solves (Howard's policy iteration).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.sparse.linalg import splu

from ._jacobian import BoxJacobian

Array = NDArray[np.float64]
_STEPS = 60  # of Noda's iteration; it takes about ten
_CHANGES = 30  # of the worst vertices within a step
_CLOSE = 1e-7  # relative distance between the bounds of the rate at which the search ends
_BELOW = 1e-9  # share of the rate by which a solve stays away from the singular matrix at the best rate


def best_weights(box: BoxJacobian, method: str) -> tuple[Array, float] | None:
    """Weights with the largest rate.

    Parameters
    ----------
    box : BoxJacobian
        Jacobian of the network over the box.
    method : {"sum", "max"}
        Column sums with weights c, or row sums with weights d.

    Returns
    -------
    (ndarray, float) or None
        Weights and rate [1/s]; None when there are none.
    """
    return _search(_Lines.of(box, method), np.inf)


def has_weights(box: BoxJacobian, method: str) -> bool:
    """Whether weights exist with a positive rate."""
    return _search(_Lines.of(box, method), 0.0) is not None


def _search(lines: _Lines, enough: float) -> tuple[Array, float] | None:
    """Weights with a positive rate, as large as possible or more than `enough`; None where there are none."""
    weights = np.ones(len(lines.capacity))
    rate = lines.rate(weights)
    for _ in range(_STEPS):
        if rate > enough:
            break
        found = _solve(lines, weights, rate - _BELOW * (abs(rate) + 1e-6))
        if found is None:
            break
        # Collatz and Wielandt: with -g(v) = (rate + w/v) E v the best rate lies between the least and largest of them.
        most = rate + float(np.max(weights / found))
        found = found / found.max()
        new = lines.rate(found)
        if not new > rate:
            break
        weights, rate = found, new
        if most <= 0 or most - rate <= _CLOSE * abs(most):
            break
    return (weights, rate) if rate > 0 else None


def _solve(lines: _Lines, weights: Array, rate: float) -> Array | None:
    """Positive v with -g(v) - rate E v = E w, g(v) the largest weighted lines; None where rounding prevents it."""
    v = weights
    chosen = lines.worst(v)
    for _ in range(_CHANGES):
        matrix = csc_array(lines.matrix(chosen) + diags_array(rate * lines.capacity))
        try:
            lu = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0)
        except RuntimeError:  # exactly singular
            return None
        v = lu.solve(-lines.capacity * weights)
        if not (np.isfinite(v).all() and v.min() > 0):
            return None
        before, chosen = chosen, lines.worst(v)
        if np.array_equal(before, chosen):
            break
    return np.asarray(v)


@dataclass(frozen=True)
class _Lines:
    """Weighted lines g(w)_i = Σ_j base_ij w_j + Σ over the blocks of lump i of the largest vertex.

    One entry of `own`, `other` is one block seen from one of its lumps; its vertices are `first` ... `first + count` of
    `near` (diagonal) and `far` (off-diagonal, absolute).
    """

    capacity: Array
    base: csr_array
    own: NDArray[np.int64]
    other: NDArray[np.int64]  # -1 for an ambient
    first: NDArray[np.int64]
    near: Array
    far: Array

    @classmethod
    def of(cls, box: BoxJacobian, method: str) -> _Lines:
        """The lines of a network: columns for "sum", rows for "max"."""
        own, other, first, near, far = [], [], [0], [], []
        for block in box.blocks:
            V = block.vertices.transpose(0, 2, 1) if method == "sum" else block.vertices
            for line, (a, b) in enumerate(((block.a, block.b), (block.b, block.a))):
                if a < 0:
                    continue
                pairs = np.unique(np.stack([V[:, line, line], np.abs(V[:, line, 1 - line])]), axis=1)
                own.append(a)
                other.append(b)
                first.append(first[-1] + pairs.shape[1])
                near.append(pairs[0])
                far.append(pairs[1] * (b >= 0))
        base = csr_array(box.base.T if method == "sum" else box.base)
        joined = [np.concatenate(part) if part else np.empty(0) for part in (near, far)]
        return cls(box.capacity, base, np.array(own, np.int64), np.array(other, np.int64),
                   np.array(first[:-1], np.int64), *joined)

    def _values(self, weights: Array) -> Array:
        """Share of every vertex in its line."""
        count = np.diff(np.append(self.first, len(self.near)))
        return self.near * np.repeat(weights[self.own], count) + self.far * np.repeat(weights[self.other], count)

    def worst(self, weights: Array) -> NDArray[np.int64]:
        """Number of the largest vertex of every entry."""
        if not len(self.first):
            return self.first
        values = self._values(weights)
        top = np.maximum.reduceat(values, self.first)
        count = np.diff(np.append(self.first, len(values)))
        hits = np.flatnonzero(values == np.repeat(top, count))
        return np.asarray(hits[np.searchsorted(hits, self.first)])

    def matrix(self, chosen: NDArray[np.int64]) -> csr_array:
        """The Metzler matrix of one choice of vertices."""
        inside = self.other >= 0
        rows = np.concatenate([self.own, self.own[inside]])
        columns = np.concatenate([self.own, self.other[inside]])
        values = np.concatenate([self.near[chosen], self.far[chosen[inside]]])
        return csr_array(self.base + csr_array(coo_array((values, (rows, columns)), shape=self.base.shape)))

    def rate(self, weights: Array) -> float:
        """Rate that weights reach over the vertices [1/s]."""
        sums = self.base @ weights
        np.add.at(sums, self.own, self._values(weights)[self.worst(weights)])
        return float(np.min(-sums / (self.capacity * weights)))
