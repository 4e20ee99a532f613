"""Kind "network_peak": how warm one lump of a large network E x' = A x becomes, from every start below a given one.

A is symmetric without negative off-diagonals, so that the warmest start decides and its temperature is a sum over
Chebyshev polynomials of A, each computed in doubles with a bound of its error (`_chebyshev`; proof note, 14).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, fmpq

from robthermal.errors import InputError

from ._chebyshev import early, expansion, scaled
from ._fields import get, mapping, no_other, numbers, positive, sequence
from ._hash import short_hash
from ._kind import Kind, Proof, working_precision
from ._numbers import decimal, name_of, show
from ._sparse import Numbers, Sparse, moderate, one_per_lump, read_sparse

_BITS = 128
_HIGHEST = 100_000  # degree
_PRODUCTS, _EDGES, _TERMS = 1e10, 5_000, 5e6  # of entries and degree, and of the sums: less than a minute each


@dataclass(frozen=True)
class NetworkPeak:
    """The exact problem of one certificate."""

    matrix: Sparse
    start: Numbers
    table: str  # short hash of the start
    lump: int
    horizon: fmpq
    bound: fmpq
    degree: int
    edges: list[fmpq]


def read(system: Any, region: Any, evidence: Any, margin: Any) -> NetworkPeak:
    """Return the exact problem, or raise InputError."""
    matrix, table, found = read_sparse(mapping(system, "system")), mapping(region, "region"), mapping(evidence,
                                                                                                     "evidence")
    no_other(table, ["start", "lump", "horizon", "bound"], "region")
    no_other(mapping(margin, "margin"), [], "margin")
    n = len(matrix.capacity.nearest)
    start = one_per_lump(get(table, "start", "region"), n, "region.start")
    lump, degree = get(table, "lump", "region"), get(found, "degree", "evidence")
    for value, where, most in ((lump, "region.lump", n - 1), (degree, "evidence.degree", _HIGHEST)):
        if type(value) is not int or not 0 <= value <= most:
            raise InputError(name_of(value), where=where, expected=f"an integer from 0 to {most}")
    items = sequence(get(found, "edges", "evidence"), "evidence.edges")
    edges = numbers(items, len(items), "evidence.edges")
    return NetworkPeak(matrix, start, short_hash(start.source), lump, positive(get(table, "horizon", "region"),
                       "region.horizon"), positive(get(table, "bound", "region"), "region.bound"), degree, edges)


def claim(problem: NetworkPeak, machine: str) -> str:
    """Return the one sentence the data give."""
    return (f"In the thermal network of {len(problem.start.nearest)} lumps and {len(problem.matrix.rows)} entries "
            f"(machine {machine}), continuous plant, nominal parameters, without heat loads, temperatures counted from "
            f"that of the surroundings: from every start in which no lump is warmer than its entry in table "
            f"{problem.table}, lump {problem.lump} (counted from 0) never exceeds {decimal(problem.bound)} K in the "
            f"first {decimal(problem.horizon)} s.")


def prove(problem: NetworkPeak) -> Proof:
    """Prove the bound before the first edge and between every two edges."""
    why = _unfit(problem)
    if why:
        return Proof(False, why)
    with working_precision(_BITS):
        system = scaled(problem.matrix)
        if isinstance(system, str):
            return Proof(False, system)
        own, warmest = problem.start.at(problem.lump), max(map(problem.start.at, _warmest(problem.start)))
        bound, edges = arb(problem.bound), problem.edges
        first = early(problem.matrix, system, problem.lump, own, warmest, edges[0])
        if not first <= bound:
            return Proof(False, f"before {show(edges[0])} s the lump is only bounded by {_shown(first)} K")
        found = expansion(problem.matrix, system, problem.lump, problem.start.nearest, problem.degree)
        if isinstance(found, str):
            return Proof(False, found)
        for low, high in zip(edges, edges[1:], strict=False):
            z, slope = found.at(arb((low + high) / 2))
            r = arb((high - low) / 2)
            bend = found.norm * (2 / (arb(1).exp() * arb(low))) ** 2
            most = (z + abs(slope) * r + bend * r * r / 2).upper() * (found.growth * arb(high)).exp()
            if not most <= bound:
                return Proof(False, f"between {show(low)} s and {show(high)} s the lump is only bounded by "
                                    f"{_shown(most)} K, above {show(problem.bound)} K")
    return Proof(True, f"bounded in {len(edges)} pieces of time, by Chebyshev polynomials of degree {problem.degree}")


def _warmest(start: Numbers) -> list[int]:
    """Return the lumps whose doubles are largest: the largest number is among them."""
    return np.flatnonzero(start.nearest == start.nearest.max()).tolist()


def find_margin(problem: NetworkPeak) -> dict[str, float]:
    """Return no margin: the bound is the claim."""
    return {}


def _unfit(problem: NetworkPeak) -> str:
    """Return which condition of the proof fails, empty if none."""
    matrix, edges = problem.matrix, problem.edges
    rows, cols, values = matrix.rows, matrix.cols, matrix.values.nearest
    for wrong, word in (((rows != cols) & (values < 0), "negative"), ((rows == cols) & (values > 0), "positive")):
        if bool(wrong.any()):
            k = int(np.argmax(wrong))
            return f"A[{rows[k]}, {cols[k]}] = {values[k]!r} is {word}"
    if not bool((moderate(problem.start.nearest) | (problem.start.nearest == 0)).all()):
        return "a start temperature is below 1e-90 or above 1e90 in size"
    if not edges or edges[0] <= 0 or edges[-1] != problem.horizon or any(
            low >= high for low, high in zip(edges, edges[1:], strict=False)):
        return "the edges do not rise from above 0 to the horizon"
    if (len(rows) * float(problem.degree) > _PRODUCTS or len(edges) > _EDGES
            or len(edges) * float(problem.degree) > _TERMS):
        return "too many products for a check: a lower degree or fewer edges would do"
    return _asymmetry(matrix)


def _asymmetry(matrix: Sparse) -> str:
    """Return which entry differs from the one opposite, empty if A is symmetric, exactly."""
    n = np.int64(len(matrix.capacity.nearest))
    order, opposite = np.argsort(matrix.rows * n + matrix.cols), np.argsort(matrix.cols * n + matrix.rows)
    rows, cols = matrix.rows[order], matrix.cols[order]
    values, others = matrix.values.nearest[order], matrix.values.nearest[opposite]
    wrong = (rows != matrix.cols[opposite]) | (cols != matrix.rows[opposite]) | (values != others)
    if bool(wrong.any()):
        k = int(np.argmax(wrong))
        return f"A is not symmetric: entry ({rows[k]}, {cols[k]}) differs from the one opposite"
    if isinstance(matrix.values.source, np.ndarray):
        return ""
    for k, other in zip(order.tolist(), opposite.tolist(), strict=True):
        if matrix.values.source[k] != matrix.values.source[other] and matrix.values.at(k) != matrix.values.at(other):
            return f"A is not symmetric: entry ({matrix.rows[k]}, {matrix.cols[k]}) differs from the one opposite"
    return ""


def _shown(value: arb) -> str:
    return f"{float(value.upper()):.6g}"


NETWORK_PEAK = Kind("network_peak", read, claim, prove, find_margin)
