"""Matrices in fixed point with one error bound for all entries, and the exponential of one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from operator import mul

BITS = 512
UNIT = 1 << BITS


@dataclass(frozen=True)
class Ball:
    """Entries in units of 2**-BITS, each off by at most ``error`` units."""

    rows: list[list[int]]
    error: int

    @property
    def largest(self) -> int:
        """Return the largest absolute entry, in units."""
        return max((abs(entry) for row in self.rows for entry in row), default=0)

    def __add__(self, other: Ball) -> Ball:
        rows = [[a + b for a, b in zip(row, line, strict=True)] for row, line in
                zip(self.rows, other.rows, strict=True)]
        return Ball(rows, self.error + other.error)

    def __mul__(self, other: Ball) -> Ball:
        columns = list(zip(*other.rows, strict=True))
        rows = [[sum(map(mul, row, column)) >> BITS for column in columns] for row in self.rows]
        spread = self.largest * other.error + other.largest * self.error + self.error * other.error
        return Ball(rows, 1 + (len(other.rows) * spread >> BITS) + 1)

    def divided(self, number: int) -> Ball:
        """Return the matrix divided by a positive integer."""
        return Ball([[entry // number for entry in row] for row in self.rows], self.error // number + 2)


def fixed(entries: Mapping[tuple[int, int], Fraction], rows: int, columns: int) -> Ball:
    """Return a matrix given by some of its entries."""
    found = [[0] * columns for _ in range(rows)]
    for (i, j), value in entries.items():
        found[i][j] = (value.numerator << BITS) // value.denominator
    return Ball(found, 1)


def exponential(F: Mapping[tuple[int, int], Fraction], n: int, time: Fraction) -> tuple[Ball, Ball]:
    """Return exp(F T) and the integral of exp(F s) from 0 to T.

    Taylor's series over a step short enough that |F| t is below 1/2, then doubling: exp(2 F t) = exp(F t)², and the
    integral to 2 t is (1 + exp(F t)) times that to t.
    """
    norm = max((sum((abs(value) for (i, _), value in F.items() if i == k), Fraction(0)) for k in range(n)),
               default=Fraction(0)) * time
    doublings = max(0, (int(2 * norm) + 1).bit_length())
    step = time / 2**doublings
    one = fixed({(k, k): Fraction(1) for k in range(n)}, n, n)
    small = fixed({place: value * step for place, value in F.items()}, n, n)
    term, power, integral = one, one, one  # the integral in units of the step
    k = 0
    while term.largest > term.error:
        k += 1
        term = (term * small).divided(k)
        power, integral = power + term, integral + term.divided(k + 1)
    rest = 2 * (term.largest + term.error) * n  # |F| t < 1/2: what is left out is below the last term, row by row
    power, integral = Ball(power.rows, power.error + rest), Ball(integral.rows, integral.error + rest)
    integral = integral * fixed({(k, k): step for k in range(n)}, n, n)
    for _ in range(doublings):
        integral, power = integral + power * integral, power * power
    return power, integral
