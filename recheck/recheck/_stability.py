"""Kind "stability": all eigenvalues of A have real parts below -rate, or absolute values below 1 - rate (sampled)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from operator import mul
from typing import Any

from ._document import get, matrix, not_negative, only, sequence, text
from ._exact import ONE, ZERO, Malformed, NotCovered, short
from ._lyapunov import decide
from ._result import Answer, not_covered, not_valid, valid

_MOST_STATES = 400
_MOST_DENSE = 150  # states of a product of matrices
_MOST_WORK = 60_000_000  # of an exact characteristic polynomial: n⁴ times the digits


@dataclass(frozen=True)
class Problem:
    """What one stability certificate claims."""

    A: list[list[Fraction]]
    inputs: int
    outputs: int
    sample_time: Fraction
    rate: Fraction
    method: str
    matrix: list[list[Fraction]]


def read(parts: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem of the sections of a certificate."""
    system, region, evidence = parts["system"], parts["region"], parts["evidence"]
    only(system, ["A", "B", "C", "D", "sample_time"], "system")
    only(region, ["rate"], "region")
    only(parts["margin"], [], "margin")
    n = len(sequence(get(system, "A", "system"), "system.A"))
    outputs = sequence(get(system, "D", "system"), "system.D")
    inputs = len(sequence(outputs[0], "system.D")) if outputs else 0
    if n > _MOST_STATES or not inputs:
        raise Malformed("system: too many states, or no input or output")
    A = matrix(system["A"], n, n, "system.A")
    for key, rows, columns in (("B", n, inputs), ("C", len(outputs), n), ("D", len(outputs), inputs)):
        matrix(get(system, key, "system"), rows, columns, f"system.{key}")
    time = not_negative(get(system, "sample_time", "system"), "system.sample_time")
    rate = not_negative(region.get("rate", 0), "region.rate")
    if time > 0 and rate >= 1:
        raise Malformed("region.rate: not below 1")
    method = text(get(evidence, "method", "evidence"), "evidence.method")
    if method not in ("polynomial", "lyapunov"):
        raise Malformed(f"evidence.method: {short(method)}")
    P = matrix(get(evidence, "matrix", "evidence"), n, n, "evidence.matrix") if method == "lyapunov" else []
    return Problem(A, inputs, len(outputs), time, rate, method, P)


def check(problem: Problem) -> Answer:
    """Decide it by the method of the evidence."""
    if problem.method == "polynomial":
        hurwitz = routh(shifted(problem))
        return valid("the Routh array has positive entries in its first column") if hurwitz else not_valid(
            "the Routh array has an entry in its first column that is not positive")
    A, P, n = problem.A, problem.matrix, len(problem.A)
    if n > _MOST_DENSE:
        raise NotCovered(f"{n} states are too many, at most {_MOST_DENSE}")
    if any(P[i][j] != P[j][i] for i in range(n) for j in range(i)):
        return not_valid("P is not symmetric")
    half = _product([list(column) for column in zip(*A, strict=True)], P)  # A'P
    if problem.sample_time > 0:
        whole, level = _product(half, A), (1 - problem.rate) ** 2
        decay = [[level * P[i][j] - whole[i][j] for j in range(n)] for i in range(n)]
    else:
        decay = [[-half[i][j] - half[j][i] - 2 * problem.rate * P[i][j] for j in range(n)] for i in range(n)]
    for name, M in (("P", P), ("the decay of x'Px", decay)):
        status = decide(M)
        if not status:
            return not_valid(f"{name} is not positive definite") if status is False else not_covered(
                f"{name} is not proven positive definite")
    return valid("P and the decay of x'Px are positive definite")


def shifted(problem: Problem) -> list[Fraction]:
    """Return a polynomial, highest power first, that is Hurwitz if and only if the claim is true."""
    falling, n = characteristic(problem.A), len(problem.A)
    if problem.sample_time > 0:  # z = (1 - rate) (1 + s)/(1 - s)
        level = 1 - problem.rate
        total = [ZERO] * (n + 1)
        for k, value in enumerate(falling):
            for power, factor in enumerate(_binomials(n - k, k)):
                total[power] += value * level ** (n - k) * factor
        return total[::-1]
    for k in range(n):  # Horner's scheme: s - rate in the place of s
        for i in range(1, n + 1 - k):
            falling[i] += falling[i - 1] * -problem.rate
    return falling


def characteristic(A: list[list[Fraction]]) -> list[Fraction]:
    """Return det(s 1 - A), highest power first, by the method of Faddeev and Le Verrier in integers."""
    n = len(A)
    scale, whole = _integers(A)
    digits = max([1, *(abs(entry).bit_length() for row in whole for entry in row)])
    if n**4 * (1 + n * digits // 500) > _MOST_WORK:
        raise NotCovered(f"{n} states with numbers of {digits} bits are too many for an exact polynomial")
    found, M = [1], [[0] * n for _ in range(n)]
    columns = list(zip(*whole, strict=True))
    for k in range(1, n + 1):
        for i in range(n):
            M[i][i] += found[-1]
        M = [[sum(map(mul, row, column)) for column in columns] for row in M]
        found.append(-sum(M[i][i] for i in range(n)) // k)
    return [Fraction(value, scale**k) for k, value in enumerate(found)]


def routh(falling: Sequence[Fraction]) -> bool:
    """Decide whether all roots lie in the open left half-plane; the degree is the number of coefficients less one."""
    if falling[0] == 0:
        return False
    above, row = [value / falling[0] for value in falling[0::2]], [value / falling[0] for value in falling[1::2]]
    while row:
        if row[0] <= 0:
            return False
        factor = above[0] / row[0]
        padded = [*row[1:], *([ZERO] * (len(above) - len(row)))]
        above, row = row, [upper - factor * lower for upper, lower in zip(above[1:], padded, strict=True)]
    return True


def _binomials(a: int, b: int) -> list[Fraction]:
    """Return (1 + s)^a (1 - s)^b, lowest power first."""
    found = [ONE]
    for sign in (*([1] * a), *([-1] * b)):
        found = [x + sign * y for x, y in zip([*found, ZERO], [ZERO, *found], strict=True)]
    return found


def _product(left: list[list[Fraction]], right: list[list[Fraction]]) -> list[list[Fraction]]:
    """Return a product, computed in integers."""
    (a, first), (b, second) = _integers(left), _integers(right)
    columns = list(zip(*second, strict=True))
    return [[Fraction(sum(map(mul, row, column)), a * b) for column in columns] for row in first]


def _integers(rows: list[list[Fraction]]) -> tuple[int, list[list[int]]]:
    scale = math.lcm(*(entry.denominator for row in rows for entry in row))
    return scale, [[entry.numerator * (scale // entry.denominator) for entry in row] for row in rows]
