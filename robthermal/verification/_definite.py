"""Proofs that a symmetric matrix is positive definite: by ball or exact rational arithmetic, never by floats.

Floats serve as hints only (an elimination order, a preconditioner): a bad hint can lose a proof but cannot make one.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence

import numpy as np
from flint import arb, arb_mat, fmpq
from numpy.typing import NDArray

Rows = list[dict[int, arb]]
_MOST_UPDATES = 20_000_000  # entries changed by an elimination, some 15 s
_MOST_ENTRIES = 3_000_000  # of its rows at one time, some 500 MB


def eliminate(rows: Rows, keep: set[int]) -> int | None:
    """Eliminate all rows but ``keep`` from a sparse symmetric matrix, in place, fewest neighbors first.

    The matrix is positive definite if and only if every pivot and the Schur complement left in ``keep`` are. Returns
    None when every pivot is proven positive, else the row whose pivot is not (or where it would take too long).
    """
    queue = [(len(row), k) for k, row in enumerate(rows) if k not in keep]
    heapq.heapify(queue)
    done: set[int] = set()
    updates, entries = 0, sum(len(row) for row in rows)
    while queue:
        degree, k = heapq.heappop(queue)
        if k in done or degree != len(rows[k]):
            continue  # an old entry of the queue
        done.add(k)
        row = rows[k]
        pivot = row.pop(k, arb(0))
        updates += len(row) ** 2
        if not pivot > 0 or updates > _MOST_UPDATES or entries + len(row) ** 2 > _MOST_ENTRIES:
            return k
        before = sum(len(rows[j]) for j in row)
        _update(rows, k, pivot)
        entries += sum(len(rows[j]) for j in row) - before - len(row)
        for j in row:
            if j not in keep:
                heapq.heappush(queue, (len(rows[j]), j))
    return None


def is_positive(matrix: Sequence[Sequence[arb]]) -> bool:
    """Prove that a small symmetric matrix is positive definite: all pivots of LDL' are certainly positive."""
    work = [list(row) for row in matrix]
    n = len(work)
    for k in range(n):
        pivot = work[k][k]
        if not pivot > 0:
            return False
        for i in range(k + 1, n):
            factor = work[i][k] / pivot
            for j in range(k + 1, i + 1):
                work[i][j] -= factor * work[j][k]
    return True


def is_semidefinite(matrix: Sequence[Sequence[fmpq]]) -> bool:
    """Decide exactly whether a small symmetric rational matrix is positive semidefinite."""
    work = [list(row) for row in matrix]
    n = len(work)
    for k in range(n):
        pivot = work[k][k]
        if pivot < 0 or (pivot == 0 and any(work[i][k] != 0 for i in range(k + 1, n))):
            return False
        for i in range(k + 1, n):
            if work[i][k] == 0:
                continue  # also the only case left for a zero pivot
            factor = work[i][k] / pivot
            for j in range(k + 1, i + 1):
                work[i][j] -= factor * work[j][k]
    return True


def is_positive_preconditioned(matrix: arb_mat, hint: NDArray[np.float64]) -> bool:
    """Prove that a dense symmetric matrix M is positive definite, with a float approximation of M as the hint.

    X M X' is strictly diagonally dominant with positive diagonal for some X, hence positive definite. Then X is
    regular (X'z = 0 would give z'X M X'z = 0), and M is positive definite by congruence.
    """
    factor = _inverse_factor(hint)
    if factor is None:
        return False
    n = len(hint)
    X = arb_mat(n, n, factor.ravel().tolist())
    rows = (X * matrix * X.transpose()).tolist()
    return all(_dominates(row, k) for k, row in enumerate(rows))


def approximate(matrix: arb_mat) -> NDArray[np.float64]:
    """Return the midpoints of a matrix of balls as floats, for hints."""
    return np.array([[float(entry) for entry in row] for row in matrix.tolist()])


def _update(rows: Rows, k: int, pivot: arb) -> None:
    row = rows[k]
    neighbors = sorted(row)
    for j in neighbors:
        rows[j].pop(k, None)
    for position, i in enumerate(neighbors):
        factor = row[i] / pivot
        for j in neighbors[position:]:
            value = rows[i].get(j, arb(0)) - factor * row[j]
            rows[i][j] = value
            rows[j][i] = value


def _inverse_factor(hint: NDArray[np.float64]) -> NDArray[np.float64] | None:
    try:
        factor = np.linalg.inv(np.linalg.cholesky(hint))
    except np.linalg.LinAlgError:
        return None
    return factor if bool(np.all(np.isfinite(factor))) else None


def _dominates(row: Sequence[arb], k: int) -> bool:
    others = sum((abs(entry) for j, entry in enumerate(row) if j != k), arb(0))
    return bool(row[k] > others)
