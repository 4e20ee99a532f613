"""Kind "network_peak": the temperature of one lump of E x' = A x, by powers of a substochastic matrix, in integers.

With s the largest growth of a row and L at least the fastest rate, P = 1 + (A/E - s)/L has no negative entry and rows
that sum to one at most, and exp(A t/E) = exp(s t) sum_k w_k P^k with the probabilities w_k of a Poisson variable of
mean L t. Integers stand for numbers times 2**_BITS; every one of them is off by a counted number of units at most.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ._document import get, numbers, only, positive, sequence
from ._exact import ONE, ZERO, Malformed, NotCovered, power, short
from ._network import matrix_of
from ._result import Answer, not_covered, not_valid, valid

_BITS = 128
_PRODUCTS, _TERMS = 2e7, 1e7  # of the moments and of the sums
_RANGE = (Fraction(1, 10**90), Fraction(10**90))
_SERIES = sum((Fraction(1, math.factorial(k)) for k in range(60)), ZERO)
_EULER = _SERIES, _SERIES + Fraction(1, 10**80)  # below and above e


@dataclass(frozen=True)
class Problem:
    """What one certificate claims."""

    capacity: list[Fraction]
    rows: list[int]
    cols: list[int]
    values: list[Fraction]
    start: list[Fraction]
    lump: int
    horizon: Fraction
    bound: Fraction
    degree: int
    edges: list[Fraction]


@dataclass(frozen=True)
class _Powers:
    """Moments p_k = (P^k x)_l in units, how far off they may be, and numbers of the network."""

    values: list[int]
    units: int
    rate: Fraction
    growth: Fraction
    largest: int  # at least |x|


def read(parts: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem of the sections of a certificate."""
    region, evidence = parts["region"], parts["evidence"]
    only(region, ["start", "lump", "horizon", "bound"], "region")
    only(parts["margin"], [], "margin")
    capacity, rows, cols, values = matrix_of(parts["system"])
    n = len(capacity)
    start = numbers(get(region, "start", "region"), n, "region.start")
    lump, degree = get(region, "lump", "region"), get(evidence, "degree", "evidence")
    for value, where, most in ((lump, "region.lump", n - 1), (degree, "evidence.degree", 100_000)):
        if type(value) is not int or not 0 <= value <= most:
            raise Malformed(f"{where}: {short(value)} is not an integer from 0 to {most}")
    items = sequence(get(evidence, "edges", "evidence"), "evidence.edges")
    return Problem(capacity, rows, cols, values, start, lump, positive(get(region, "horizon", "region"),
                   "region.horizon"), positive(get(region, "bound", "region"), "region.bound"), degree,
                   numbers(items, len(items), "evidence.edges"))


def check(problem: Problem) -> Answer:
    """Decide the bound before the first edge and between every two edges."""
    why = _unfit(problem)
    if why:
        return not_valid(why)
    E, edges, bound, lump = problem.capacity, problem.edges, problem.bound, problem.lump
    sums, own = [ZERO] * len(E), [ZERO] * len(E)
    for i, j, value in zip(problem.rows, problem.cols, problem.values, strict=True):
        sums[i] += value
        if i == j:
            own[i] = value
    growth = max(ZERO, *(total / e for total, e in zip(sums, E, strict=True)))
    rate = max(-value / e for value, e in zip(own, E, strict=True)) + growth
    _covered(problem, rate, growth)
    warmest = max(ZERO, *problem.start)
    early = max(problem.start[lump], ZERO) + (growth - own[lump] / E[lump]) * edges[0] * warmest * _grown(
        growth * edges[0])
    if early > bound:
        return not_valid("the bound before the first edge is too large")
    size = power(sum((e * x * x for e, x in zip(E, problem.start, strict=True)), ZERO) / E[lump], Fraction(1, 2))
    powers = _powers(problem, rate, growth)
    for low, high in zip(edges, edges[1:], strict=False):
        z, slope, error, slope_error = _at(powers, (low + high) / 2)
        r, tail = (high - low) / 2, _tail(float(rate * (low + high) / 2), problem.degree + 1)
        bend = [norm * (2 / (euler * low)) ** 2 * r * r / 2 for norm, euler in zip(size, reversed(_EULER), strict=True)]
        most = z + error + (abs(slope) + slope_error) * r + bend[1]
        cut = size[1] * tail * (1 + 2 * rate * r)  # what the degree of the file leaves out
        factor = _grown(growth * high)
        if (most + cut) * factor > bound:
            least = (z - error + (abs(slope) - slope_error) * r + bend[0]) * (factor if factor > 1 else ONE)
            place = f"between {float(low):.6g} s and {float(high):.6g} s"
            if least > bound * (1 + Fraction(1, 10**9)):
                return not_valid(f"the bound {place} is too large")
            return not_covered(f"the bound {place} is neither proven nor refuted")
    return valid(f"bounded in {len(edges)} pieces of time, by powers of a substochastic matrix")


def _unfit(problem: Problem) -> str:
    """Return which condition fails for certain, empty if none."""
    entries = {}
    for i, j, value in zip(problem.rows, problem.cols, problem.values, strict=True):
        if value < 0 if i != j else value > 0:
            return f"A[{i}, {j}] has the wrong sign"
        entries[i, j] = value
    for (i, j), value in entries.items():
        if (j, i) not in entries or entries[j, i] != value:
            return f"A is not symmetric: A[{i}, {j}]"
    edges = problem.edges
    if not edges or edges[0] <= 0 or edges[-1] != problem.horizon or any(
            low >= high for low, high in zip(edges, edges[1:], strict=False)):
        return "the edges do not rise from above 0 to the horizon"
    return ""


def _covered(problem: Problem, rate: Fraction, growth: Fraction) -> None:
    """Refuse numbers of extreme size, and more work than this checker takes on."""
    E, off = problem.capacity, [(i, v) for i, j, v in zip(problem.rows, problem.cols, problem.values, strict=True)
                                if i != j and v != 0]
    sizes = [*E, rate, *(abs(value) for value in (*problem.values, *problem.start) if value != 0)]
    if not all(_RANGE[0] <= value <= _RANGE[1] for value in sizes):
        raise NotCovered("a number below 1e-90 or above 1e90")
    if not all(2 * value / (E[i] * rate) >= _RANGE[0] for i, value in off):
        raise NotCovered("an entry is too small beside the fastest rate")
    terms = _terms(rate * problem.horizon) if rate * problem.horizon < _TERMS else math.inf
    if (terms * (len(problem.values) + len(E)) > _PRODUCTS or terms * len(problem.edges) > _TERMS
            or growth * problem.horizon > 50):
        raise NotCovered("more products than this checker takes on")


def _terms(mean: Fraction) -> int:
    """Return so many powers that next to nothing of a Poisson variable is left."""
    return int(mean + 14 * math.sqrt(mean)) + 80


def _powers(problem: Problem, rate: Fraction, growth: Fraction) -> _Powers:
    """Return p_0 ... of the warmest start.

    A product with P, cut to integers, is off by one unit and by the largest |x| per entry of the row; P does not
    enlarge what was there before.
    """
    E, n = problem.capacity, len(problem.capacity)
    table: list[dict[int, Fraction]] = [{i: ONE - growth / rate} for i in range(n)]
    for i, j, value in zip(problem.rows, problem.cols, problem.values, strict=True):
        table[i][j] = table[i].get(j, ZERO) + value / (E[i] * rate)
    rows = [[(j, (value.numerator << _BITS) // value.denominator) for j, value in row.items()] for row in table]
    state = [(x.numerator << _BITS) // x.denominator for x in problem.start]
    largest = math.ceil(max(abs(x) for x in problem.start)) + 1
    steps = _terms(rate * problem.horizon) + 1
    found = [state[problem.lump]]
    for _ in range(steps):
        state = [sum(p * state[j] for j, p in row) >> _BITS for row in rows]
        found.append(state[problem.lump])
    return _Powers(found, 1 + steps * (max(map(len, rows)) * (largest + 1) + 1), rate, growth, largest)


def _at(powers: _Powers, t: Fraction) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    """Return z(t), its slope, and what they may be off by.

    The probabilities are computed relative to the largest of them, upwards and downwards by factors below one, so that
    each is off by as many units as there are steps; their sum is at least one.
    """
    mean = powers.rate * t
    a, b = mean.numerator, mean.denominator
    last, middle = _terms(mean), int(mean)
    weights = [0] * (last + 1)
    weights[middle] = 1 << _BITS
    for k in range(middle, last):
        weights[k + 1] = weights[k] * a // (b * (k + 1))
    for k in range(middle, 0, -1):
        weights[k - 1] = weights[k] * (b * k) // a
    p, total = powers.values, sum(weights)
    z = sum(w * p[k] for k, w in enumerate(weights))
    slope = sum(w * (p[k + 1] - p[k]) for k, w in enumerate(weights))
    ratio = mean / (last + 1)
    one = 1 << _BITS
    beyond = Fraction(weights[last] + last, one) * ratio / (1 - ratio)
    lost = 2 * powers.largest * (Fraction((last + 1) * last, one) + beyond)
    error = Fraction(powers.units, one) + lost
    return (Fraction(z, total << _BITS), powers.rate * Fraction(slope, total << _BITS), error, 2 * powers.rate * error)


def _tail(rho: float, first: int) -> Fraction:
    """Return what a sum over Chebyshev polynomials leaves out from `first` on: no part of the proof here."""
    rest = math.sqrt(first**2 + rho**2) - rho - first * math.asinh(first / rho) if rho > 0 else -math.inf
    return Fraction(2 * math.exp(min(rest, 700.0)))


def _grown(x: Fraction) -> Fraction:
    """Return an upper bound of exp(x), x >= 0."""
    return power(_EULER[1], x)[1]
