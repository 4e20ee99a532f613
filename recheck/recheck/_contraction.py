"""Kind "contraction": E x' = f(x, I) contracts in one norm over a box of temperatures and currents."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from . import _energy, _lyapunov
from ._document import get, margin, matrix, not_negative, numbers, text
from ._exact import Malformed, short
from ._lines import Lines
from ._result import Answer, not_covered, not_valid, valid
from ._thermal import Network, check_cost
from ._uncertain import read_network, with_rises

METHODS = ("sum", "max", "energy", "lyapunov")


@dataclass(frozen=True)
class Problem:
    """What one contraction certificate claims."""

    network: Network
    method: str
    rate: Fraction
    margin: Fraction
    weights: list[Fraction]
    matrix: list[list[Fraction]]


def read(parts: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem of the sections of a certificate."""
    network = with_rises(read_network(parts["system"], parts["region"], gains=True, heaters=True))
    evidence, n = parts["evidence"], len(network.lumps)
    method = text(get(evidence, "method", "evidence"), "evidence.method")
    if method not in METHODS:
        raise Malformed(f"evidence.method: {short(method)}")
    rate = not_negative(get(evidence, "rate", "evidence"), "evidence.rate")
    weights = numbers(get(evidence, "weights", "evidence"), n, "evidence.weights") if method in ("sum", "max") else []
    P = matrix(get(evidence, "matrix", "evidence"), n, n, "evidence.matrix") if method == "lyapunov" else []
    return Problem(network, method, rate, margin(parts["margin"], "rate"), weights, P)


def check(problem: Problem) -> Answer:
    """Decide the inequality of the method, the stored margin added to the rate."""
    rate = problem.rate + problem.margin
    if problem.method == "energy":
        return _energy.check(problem.network, rate)
    if problem.method == "lyapunov":
        return _lyapunov.check(problem.network, problem.matrix, rate)
    check_cost(problem.network)
    lines = Lines(problem.network, problem.method == "sum", problem.weights)
    limits = [-rate * capacity[1] * weight
              for capacity, weight in zip(problem.network.capacity, problem.weights, strict=True)]
    return check_lines(lines, limits, strict=rate == 0)


def check_lines(lines: Lines, limits: list[Fraction], strict: bool) -> Answer:
    """Decide whether every weighted line stays at or (strict) below its limit."""
    names = lines.network.lumps
    for name, weight in zip(names, lines.weights, strict=True):
        if weight <= 0:
            return not_valid(f"the weight of {short(name)} is not positive")
    open_line = ""
    for j, limit in enumerate(limits):
        if not _stays(lines.largest(j, inner=False), limit, strict):
            if not _stays(lines.largest(j, inner=True), limit, strict):
                return not_valid(f"the weighted line of {short(names[j])} exceeds its limit at a point of the box")
            open_line = open_line or names[j]
    if open_line:
        return not_covered(f"the line of {short(open_line)} is not bounded sharply enough: its links are not linear")
    return valid("every weighted line is bounded over the box")


def _stays(value: Fraction, limit: Fraction, strict: bool) -> bool:
    return value < limit or (value == limit and not strict)
