"""Weights of the "sum" (cᵀJ < 0) and "max" (J d < 0) certificates by linear programming."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.sparse import block_array, coo_array, csr_array

from ._jacobian import BoxJacobian

Array = NDArray[np.float64]


def best_weights(box: BoxJacobian, method: str, *, steps: int = 14) -> tuple[Array, float] | None:
    """Weights with the largest rate, by bisection over linear programs.

    Parameters
    ----------
    box : BoxJacobian
        The network.
    method : {"sum", "max"}
        Column sums with weights c, or row sums with weights d.
    steps : int
        Bisections of the rate.

    Returns
    -------
    (ndarray, float) or None
        Weights and rate [1/s]; None when there are none.
    """
    program = _Program(box, method)
    found = program.solve(0.0)
    if found is None:
        return None
    low, high, best = 0.0, program.rate(found), found
    high = max(high, 1e-12)
    while (doubled := program.solve(2 * high)) is not None:
        low, best, high = 2 * high, doubled, 2 * high
    low, high = max(low, program.rate(best)), 2 * high
    for _ in range(steps):
        middle = 0.5 * (low + high)
        found = program.solve(middle)
        if found is None:
            high = middle
        else:
            low, best = max(middle, program.rate(found)), found
    return best, program.rate(best)


def has_weights(box: BoxJacobian, method: str) -> bool:
    """Whether weights exist with a positive rate."""
    found = _Program(box, method).solve(0.0)
    return found is not None


class _Program:
    """max s: weighted sums over the box + rate E w + s E <= 0, with Σ E w = Σ E, w >= 0.

    Each block contributes the largest of its vertices to the sums of its two lumps: one auxiliary variable each.
    """

    def __init__(self, box: BoxJacobian, method: str):
        self.E, n = box.capacity, len(box.capacity)
        base = csr_array(box.base.T if method == "sum" else box.base)
        rows, cols, data = list(base.tocoo().row), list(base.tocoo().col), list(base.tocoo().data)
        extra_rows: list[tuple[int, int, float]] = []  # vertex rows: (row, column, value)
        count, row = n, 0
        for block in box.blocks:
            V = block.vertices.transpose(0, 2, 1) if method == "sum" else block.vertices
            for line, (own, other) in enumerate(((block.a, block.b), (block.b, block.a))):
                if own < 0:
                    continue
                rows.append(own)
                cols.append(count)
                data.append(1.0)
                for entry in np.unique(V[:, line], axis=0):
                    extra_rows.append((row, own, entry[line]))
                    if other >= 0:
                        extra_rows.append((row, other, abs(entry[1 - line])))
                    extra_rows.append((row, count, -1.0))
                    row += 1
                count += 1
        self.n, self.count = n, count
        self.sums = csr_array(coo_array((data, (rows, cols)), shape=(n, count)))
        r, c, v = zip(*extra_rows, strict=True) if extra_rows else ((), (), ())
        self.vertices = csr_array(coo_array((v, (r, c)), shape=(row, count)))
        self.blocks, self.method, self.base = box.blocks, method, base

    def solve(self, rate: float) -> Array | None:
        """Weights that hold strictly at a rate, or None."""
        E, n, k = self.E, self.n, self.count
        shift = coo_array((rate * E, (range(n), range(n))), shape=(n, k))
        slack = coo_array((np.concatenate([E, np.zeros(self.vertices.shape[0])]),
                           (range(n + self.vertices.shape[0]), np.zeros(n + self.vertices.shape[0], int))),
                          shape=(n + self.vertices.shape[0], 1))
        top = csr_array(self.sums + csr_array(shift))
        upper = csr_array(block_array([[top, slack.tocsr()[:n]], [self.vertices, slack.tocsr()[n:]]]))
        equal = coo_array((E, (np.zeros(n, int), range(n))), shape=(1, k + 1))
        bounds = [(1e-9, None)] * n + [(None, None)] * (k - n) + [(None, None)]
        cost = np.zeros(k + 1)
        cost[-1] = -1.0
        result = linprog(cost, A_ub=upper, b_ub=np.zeros(upper.shape[0]), A_eq=equal.tocsr(), b_eq=[E.sum()],
                         bounds=bounds, method="highs")
        if result.status != 0 or result.x[-1] <= 1e-12:
            return None
        weights = result.x[:n]
        return weights if self.rate(weights) > rate else None

    def rate(self, weights: Array) -> float:
        """Rate that the weights reach over the vertices."""
        sums = self.base @ weights
        for block in self.blocks:
            V = block.vertices.transpose(0, 2, 1) if self.method == "sum" else block.vertices
            for line, (own, other) in enumerate(((block.a, block.b), (block.b, block.a))):
                if own >= 0:
                    far = weights[other] if other >= 0 else 0.0
                    sums[own] += np.max(V[:, line, line] * weights[own] + np.abs(V[:, line, 1 - line]) * far)
        return float(np.min(-sums / (self.E * weights)))
