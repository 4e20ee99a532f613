"""Positive definite matrices, decided in integers.

A symmetric matrix is scaled by powers of two on both sides, so that its diagonal is near one, and written in units of
2**-BITS: integers M with an error of at most e units an entry. The Cholesky factor C of M - d 1 in integers leaves
remainders that are known exactly: 2**BITS (M - d 1) = C C' + R, 0 <= R_ij <= 2 max C. With d larger than the row sums
of R and of the errors, d 1 + R is diagonally dominant with positive diagonal, so the matrix is positive definite.
Where a pivot is not positive, a vector z with z'(M + n e 1) z < 0 shows that it is not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import product
from operator import mul

BITS = 256
ONE = 1 << BITS
_LIFT = 1 << (BITS // 2)
Rows = list[list[int]]
Entries = Mapping[tuple[int, int], Fraction]


class Scaling:
    """Powers of two, one per row, that bring a diagonal near one; and the units of a matrix scaled by them."""

    def __init__(self, diagonal: Sequence[Fraction]):
        self.shifts = [_half_exponent(value) for value in diagonal]

    def units(self, value: Fraction, i: int, j: int) -> int:
        """Return an entry in units, rounded to nearest: at most one unit off."""
        shift = BITS - self.shifts[i] - self.shifts[j]
        if shift >= 0:
            return (value.numerator << shift) // value.denominator
        return value.numerator // (value.denominator << -shift)

    def matrix(self, entries: Entries) -> Rows:
        """Return a symmetric matrix in units, given by some of its entries."""
        n = len(self.shifts)
        rows = [[0] * n for _ in range(n)]
        for (i, j), value in entries.items():
            rows[i][j] = self.units(value, i, j)
        return rows


def definite(rows: Rows, error: int) -> bool | None:
    """Decide whether every symmetric matrix within ``error`` units an entry is positive definite.

    Parameters
    ----------
    rows : list of list of int
        Symmetric matrix in units of 2**-BITS; its lower half is read.
    error : int
        Bound of the error of every entry, in units.

    Returns
    -------
    bool or None
        True: all are. False: none is. None: not decided.

    Examples
    --------
    >>> unit = Scaling([Fraction(2), Fraction(1)])
    >>> matrix = unit.matrix({(0, 0): Fraction(2), (1, 0): Fraction(1), (0, 1): Fraction(1), (1, 1): Fraction(1)})
    >>> definite(matrix, 1), definite(unit.matrix({(0, 0): Fraction(2), (1, 1): Fraction(-1)}), 1)
    (True, False)
    """
    factor = Factor(rows, error, len(rows))
    if factor.failed is None:
        return True
    if _negative_direction(rows, error, factor):
        return False
    # the pivot is about zero: a later one may be negative, once this one is lifted a little
    lifted = [[*row[:k], row[k] + _LIFT, *row[k + 1:]] for k, row in enumerate(rows)]
    factor = Factor(lifted, error, len(rows))
    return False if factor.failed is not None and _negative_direction(rows, error, factor) else None


class Factor:
    """Cholesky factor of the leading columns of a matrix that is shifted down by the bound of all remainders."""

    def __init__(self, rows: Rows, error: int, columns: int, others: int = 0):
        n = len(rows)
        top = max([1, *(row[k] for k, row in enumerate(rows)), others])
        most = math.isqrt(top << BITS) + 1  # of an entry of C
        self.shift = n * (error + 2 * (most >> BITS) + 2)
        self.count, self.columns = columns, list[list[int]]()
        self.failed: int | None = None
        for i, row in enumerate(rows):
            found: list[int] = []
            self.columns.append(found)
            for j in range(min(i, columns)):
                beside = self.columns[j]
                found.append(((row[j] << BITS) - sum(map(mul, found, beside))) // beside[j])
            if i < columns:
                pivot = ((row[i] - self.shift) << BITS) - sum(map(mul, found, found))
                if pivot <= 0:
                    self.failed = i
                    return
                found.append(math.isqrt(pivot))
                if found[-1] == 0:
                    self.failed = i
                    return

    def rest(self, rows: Rows) -> Rows:
        """Return what is left of the other rows, in units squared, lower half."""
        found = []
        for i in range(self.count, len(rows)):
            own = self.columns[i]
            line = [(rows[i][j] << BITS) - sum(map(mul, own, self.columns[j])) for j in range(self.count, i + 1)]
            line[-1] -= self.shift << BITS
            found.append(line)
        return found


def finish(rest: Rows, blocks: Sequence[tuple[Sequence[int], Rows]]) -> bool:
    """Go on with a Cholesky factor: what is left, minus blocks at some places, in units."""
    work = [list(row) for row in rest]
    for places, block in blocks:
        for a, b in product(range(len(places)), repeat=2):
            if places[b] <= places[a]:
                work[places[a]][places[b]] -= block[a][b] << BITS
    factor: Rows = []
    for i, row in enumerate(work):
        found: list[int] = []
        factor.append(found)
        for j in range(i):
            found.append((row[j] - sum(map(mul, found, factor[j]))) // factor[j][j])
        pivot = row[i] - sum(map(mul, found, found))
        root = math.isqrt(pivot) if pivot > 0 else 0
        if root == 0:
            return False
        found.append(root)
    return True


def _negative_direction(rows: Rows, error: int, factor: Factor) -> bool:
    """Whether the direction of the failing pivot shows that no such matrix is positive definite."""
    k = factor.failed
    if k is None:
        raise ValueError("no pivot has failed")
    y = [0] * (k + 1)
    y[k] = -ONE
    for i in range(k - 1, -1, -1):  # C11' y = -c, so that z = (y, 1) up to its sign
        c = factor.columns
        below = sum(c[j][i] * y[j] for j in range(i + 1, k))
        y[i] = (c[k][i] * ONE - below) // c[i][i]
    total: int = len(rows) * error * sum(map(mul, y, y))
    for i in range(k + 1):
        total += y[i] * sum(map(mul, rows[i][:i], y)) * 2 + rows[i][i] * y[i] * y[i]
    return total <= 0


def _half_exponent(value: Fraction) -> int:
    if value <= 0:
        return 0
    return (value.numerator.bit_length() - value.denominator.bit_length()) // 2
