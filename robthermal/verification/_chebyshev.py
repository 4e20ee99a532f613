"""z(t) of one lump by Chebyshev polynomials of a sparse matrix, with a bound of every error (proof note, 14).

z(t) = sum_k a_k(Lambda t) mu_k with mu_k = delta' T_k(B) x and the probabilities a_k of the absolute difference of two
Poisson variables. The moments mu_k are computed in doubles; everything after them in ball arithmetic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from flint import arb, fmpq

from ._sparse import UNIT, Floats, Indices, Sparse, moderate

_ABOVE = 1.0 + 2.0**-48  # more than the roundings of a few operations on positive numbers


@dataclass(frozen=True)
class Scaled:
    """2 B = 2 (1 + (A/E - s)/Lambda) in doubles: entries off the diagonal, and the diagonal."""

    rows: Indices
    cols: Indices
    values: Floats
    diagonal: Floats
    rate: float  # Lambda [1/s]
    growth: float  # s [1/s]
    entries: int  # in a row, at most

    def twice(self, vector: Floats) -> Floats:
        """Return 2 B times a vector, the sums of each row in any order."""
        return np.bincount(self.rows, self.values * vector[self.cols], len(vector)) + self.diagonal * vector


def scaled(matrix: Sparse) -> Scaled | str:
    """Return 2 B, or why it cannot be had in doubles; off-diagonals are not negative and A is symmetric."""
    E, rows, cols, values = matrix.capacity.nearest, matrix.rows, matrix.cols, matrix.values.nearest
    n = len(E)
    if not bool(moderate(E).all() and (moderate(values) | (values == 0)).all()):
        return "a capacity or an entry is below 1e-90 or above 1e90"
    off = (rows != cols) & (values != 0)
    count = np.bincount(rows, minlength=n)
    sums = np.bincount(rows, values, n) + np.bincount(rows, np.abs(values), n) * (count + 16.0) * UNIT
    growth = max(0.0, float(np.max(sums / E))) * _ABOVE
    loss = np.bincount(rows[~off], np.abs(values[~off]), n) / E
    rate = (float(np.max(loss)) * _ABOVE + growth) * _ABOVE
    if not moderate(np.float64(rate)):
        return f"the fastest rate is {rate!r} 1/s"
    entries = 2.0 * (values[off] / (E[rows[off]] * rate))
    if not bool(moderate(entries).all()):
        return "an entry is too small beside the fastest rate"
    return Scaled(rows[off], cols[off], entries, 2.0 * (1.0 - (loss + growth) / rate), rate, growth, int(count.max()))


@dataclass(frozen=True)
class Expansion:
    """Moments of one lump, and what is needed to bound their errors."""

    moments: list[arb]  # mu_0 ... mu_(degree + 1), the doubles exactly
    slopes: list[arb]  # g_0 ... g_degree
    norm: arb  # N, an upper bound [K]
    step: arb  # phi
    rate: arb
    growth: arb

    @property
    def degree(self) -> int:
        """Highest k of both sums."""
        return len(self.slopes) - 1

    def at(self, t: arb) -> tuple[arb, arb]:
        """Return z(t) and z'(t) as balls that hold their errors."""
        rho = self.rate * t
        root = rho.sqrt()
        last = int(min(self.degree, math.sqrt(80.0 * float(rho.mid())) + 40.0))
        z, slope = _sums(rho, self.moments, self.slopes, last)
        tail = _tail(rho, last + 1)
        error = self.norm * (UNIT + self.step * (rho + root) / 2 + tail)
        slope_error = self.norm * (2 * arb(UNIT) + self.step * (rho + 3 * root + 2) + 2 * tail)
        return z + _plus_minus(error), self.rate * (slope + _plus_minus(slope_error))


def expansion(matrix: Sparse, system: Scaled, lump: int, start: Floats, degree: int) -> Expansion | str:
    """Return the moments of a lump from a start, or why their errors are not bounded.

    `start` holds the doubles nearest to the numbers of the certificate, moderate or zero.
    """
    energy = float(np.sum(matrix.capacity.nearest * start * start)) * (1.0 + (len(start) + 16.0) * UNIT)
    norm = (arb(energy) / arb(matrix.capacity.at(lump))).sqrt()
    step = arb(8 * (system.entries + 16)) * arb(UNIT)
    if not UNIT + step * (degree + 1) * (degree + 2) / 2 <= 1:
        return f"degree {degree} is too high for double precision"
    before, now = start, 0.5 * system.twice(start)
    found = [float(before[lump]), float(now[lump])]
    for _ in range(degree):
        before, now = now, system.twice(now) - before
        found.append(float(now[lump]))
    moments = [arb(value) for value in found]
    slopes = [moments[1] - moments[0]]
    slopes += [(moments[k - 1] + moments[k + 1]) / 2 - moments[k] for k in range(1, degree + 1)]
    return Expansion(moments, slopes, norm.upper(), step, arb(system.rate), arb(system.growth))


def early(matrix: Sparse, system: Scaled, lump: int, own: fmpq, warmest: fmpq, until: fmpq) -> arb:
    """Return what the lump, at `own` in the beginning, cannot exceed up to a time, by its own rate alone [K]."""
    diagonal = np.flatnonzero((matrix.rows == lump) & (matrix.cols == lump))
    zero, growth = fmpq(0), arb(system.growth)
    loss = abs(sum((matrix.values.at(int(k)) for k in diagonal), zero)) / matrix.capacity.at(lump)
    gain = (arb(loss) + growth) * arb(until) * arb(max(warmest, zero)) * (growth * arb(until)).exp()
    return arb(max(own, zero)) + gain


def _sums(rho: arb, moments: list[arb], slopes: list[arb], last: int) -> tuple[arb, arb]:
    """Return sum a_k mu_k and sum a_k g_k up to k = last: I_k downwards by recursion, all of its terms positive."""
    above, now, factor = rho.bessel_i(last + 1, scaled=True), rho.bessel_i(last, scaled=True), 2 / rho
    z, slope = arb(0), arb(0)
    for k in range(last, 0, -1):
        z += now * moments[k]
        slope += now * slopes[k]
        above, now = now, above + now * factor * k
    return 2 * z + now * moments[0], 2 * slope + now * slopes[0]


def _tail(rho: arb, first: int) -> arb:
    """Return an upper bound of the sum of a_k from k = first on."""
    m = arb(first)
    return 2 * ((m * m + rho * rho).sqrt() - rho - m * (m / rho).asinh()).exp()


def _plus_minus(size: arb) -> arb:
    return arb(0, size.upper())
