"""Kind "network": E x' = A x with off-diagonals that are not negative, weighted rows or columns of A, exactly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ._document import get, margin, not_negative, numbers, sequence, text
from ._exact import ZERO, Malformed, NotCovered, exact, short
from ._result import Answer, not_valid, valid

_MOST = 1_000_000  # entries


@dataclass(frozen=True)
class Problem:
    """What one network certificate claims."""

    capacity: list[Fraction]
    rows: list[int]
    cols: list[int]
    values: list[Fraction]
    method: str
    rate: Fraction
    weights: list[Fraction]
    margin: Fraction
    uncertainty: Fraction


def read(parts: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem of the sections of a certificate."""
    system, region, evidence = parts["system"], parts["region"], parts["evidence"]
    spread = not_negative(region.get("uncertainty", 0), "region.uncertainty")
    capacity, rows, cols, values = matrix_of(system)
    n = len(capacity)
    method = text(evidence.get("method", "max"), "evidence.method")
    if method not in ("max", "sum"):
        raise Malformed(f"evidence.method: {short(method)}")
    if spread >= 1 or (spread > 0 and method != "max"):
        raise Malformed("region.uncertainty: must be below 1, with method max")
    weights = numbers(get(evidence, "weights", "evidence"), n, "evidence.weights")
    rate = not_negative(get(evidence, "rate", "evidence"), "evidence.rate")
    return Problem(capacity, rows, cols, values, method, rate, weights, margin(parts["margin"], "rate"), spread)


def matrix_of(system: Mapping[str, Any]) -> tuple[list[Fraction], list[int], list[int], list[Fraction]]:
    """Return capacities, and rows, columns and values of all entries of A."""
    capacity = _numbers(get(system, "capacity", "system"), "system.capacity")
    if not capacity or min(capacity) <= 0:
        raise Malformed("system.capacity: missing or not positive")
    n = len(capacity)
    rows, cols = (_indices(get(system, key, "system"), n, f"system.{key}") for key in ("rows", "cols"))
    values = _numbers(get(system, "values", "system"), "system.values")
    if not len(rows) == len(cols) == len(values):
        raise Malformed("system: rows, cols and values differ in number")
    if len(set(zip(rows, cols, strict=True))) < len(rows):
        raise Malformed("system.rows, system.cols: an entry is given twice")
    return capacity, rows, cols, values


def check(problem: Problem) -> Answer:
    """Decide every row (max) or column (sum), the stored margin added to the rate."""
    rate, weights, spread = problem.rate + problem.margin, problem.weights, problem.uncertainty
    for i, j, value in zip(problem.rows, problem.cols, problem.values, strict=True):
        if i != j and value < 0:
            return not_valid(f"A[{i}, {j}] is negative")
    for i, weight in enumerate(weights):
        if weight <= 0:
            return not_valid(f"the weight of lump {i} is not positive")
    sums, losses = [ZERO] * len(weights), [ZERO] * len(weights)
    for i, j, value in zip(problem.rows, problem.cols, problem.values, strict=True):
        line, other = (i, j) if problem.method == "max" else (j, i)
        sums[line] += value * weights[other]
        if spread:
            losses[i] += value
            if i != j:
                sums[i] += spread * value * abs(weights[j] - weights[i])
    for i, total in enumerate(sums):
        value = total + spread * abs(losses[i]) * weights[i]
        limit = -rate * problem.capacity[i] * weights[i]
        if value > limit or (value == limit and rate == 0):
            return not_valid(f"the weighted {'row' if problem.method == 'max' else 'column'} {i} exceeds its limit")
    return valid("every weighted line is bounded exactly")


def _numbers(value: Any, where: str) -> list[Fraction]:
    items = sequence(value, where)
    if len(items) > _MOST:
        raise NotCovered(f"{len(items)} numbers are too many, at most {_MOST}")
    return [exact(item, f"{where}[{k}]") for k, item in enumerate(items)]


def _indices(value: Any, n: int, where: str) -> list[int]:
    items = sequence(value, where)
    for item in items:
        if type(item) is not int or not 0 <= item < n:
            raise Malformed(f"{where}: {short(item)} is not an index from 0 to {n - 1}")
    return list(items)
