"""Method "lyapunov": P > 0 and P E^-1 J + J' E^-1 P <= -2 rate P, V = e'Pe with a full matrix P.

Not convex in the current for a general P, so (I, I²) is relaxed to a polygon around the curve, refined where needed
(proof note, 4). Checked densely at every vertex of the box.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from flint import arb, arb_mat, fmpq
from numpy.typing import NDArray

from ._definite import approximate, is_positive_preconditioned
from ._fields import Interval
from ._kind import Proof
from ._numbers import name_of, show
from ._slopes import exchange_slope, radiation_slope
from ._vertices import Entries, clusters, count, describe, hull, vertices

if TYPE_CHECKING:
    from ._contraction import Contraction

_PIECES = (1, 2, 4, 8)
_MOST_WORK = 3e8  # vertices times n³
Part = tuple[arb_mat, NDArray[np.float64], str, bool]  # matrix, its midpoints, where, whether a point of the box
Described = tuple[Entries, str, bool]


class _Form:
    """-(P E^-1 J + J' E^-1 P) as a linear function of J."""

    def __init__(self, problem: Contraction):
        self.n = len(problem.matrix)
        self.P = arb_mat(self.n, self.n, [arb(entry) for row in problem.matrix for entry in row])
        self.G = arb_mat(self.n, self.n, [arb(entry / capacity) for row in problem.matrix
                                          for entry, capacity in zip(row, problem.system.capacity, strict=True)])

    def part(self, described: Described) -> Part:
        """Return the share of some Jacobian entries."""
        entries, where, real = described
        dense = [arb(0)] * (self.n * self.n)
        for (i, j), value in entries.items():
            dense[i * self.n + j] = arb(value)
        half = self.G * arb_mat(self.n, self.n, dense)
        matrix = -(half + half.transpose())
        return matrix, approximate(matrix), where, real


def prove(problem: Contraction, rate: fmpq) -> Proof:
    """Prove P > 0 and the inequality at every vertex of the relaxed box, refining the relaxation where it fails."""
    broken = _asymmetry(problem) or _uncertain_capacity(problem)
    if broken:
        return Proof(False, broken)
    form = _Form(problem)
    if not is_positive_preconditioned(form.P, approximate(form.P)):
        return Proof(False, "method lyapunov: P > 0 fails or cannot be proven")
    base, bent, missing = _links(problem)
    if missing:
        return Proof(False, missing)
    matrix = form.part((base, "", True))[0] - form.P * arb(2 * rate)
    start: Part = (matrix, approximate(matrix), "", True)
    links = [[form.part(item) for item in items] for items in bent]
    proof = Proof(False, "method lyapunov: too many vertices to check any")
    for pieces in _PIECES:
        total = _count(problem, pieces) * math.prod(len(items) for items in bent)
        if total * form.n**3 > _MOST_WORK:
            return Proof(False, f"{proof.reason} ({total} vertices with {pieces} pieces per current)")
        modules = [[form.part(item) for item in choice] for choice in _modules(problem, pieces)]
        failed = _first_failure(start, [*links, *modules])
        if failed is None:
            return Proof(True, f"P E^-1 J + J' E^-1 P < -2 ({show(rate)}) P at all {total} vertices of the relaxed box")
        proof = Proof(False, f"method lyapunov: P E^-1 J + J' E^-1 P < -2 ({show(rate)}) P fails or cannot be proven "
                             f"at {failed[0] or 'the links'}")
        if failed[1]:
            break  # a point of the box: no refinement helps
    return proof


def _asymmetry(problem: Contraction) -> str:
    for i, row in enumerate(problem.matrix):
        for j in range(i):
            if row[j] != problem.matrix[j][i]:
                return f"method lyapunov: P is not symmetric at [{i}][{j}]"
    return ""


def _uncertain_capacity(problem: Contraction) -> str:
    name = next((name for name, _ in problem.parameters if name.startswith("lumps.")), "")
    return f"method lyapunov: {name_of(name)} is uncertain, which needs method energy, sum or max" if name else ""


def _count(problem: Contraction, pieces: int) -> int:
    points = [hull(interval, pieces) for interval in problem.region.current]
    return math.prod(count(problem.system, group, problem.region, points) for group in clusters(problem.system))


def _modules(problem: Contraction, pieces: int) -> list[list[Described]]:
    points = [hull(interval, pieces) for interval in problem.region.current]
    groups = clusters(problem.system)
    return [[(vertex.entries, describe(problem.system, group, vertex), vertex.real)
             for vertex in vertices(problem.system, problem.region, group, points)] for group in groups]


def _first_failure(start: Part, choices: Sequence[Sequence[Part]]) -> tuple[str, bool] | None:
    """Return where the first vertex is that is not proven, and whether it is a point of the box."""
    matrix, hint, where, real = start
    if not choices:
        return None if is_positive_preconditioned(matrix, hint) else (where, real)
    for part in choices[0]:
        words = ", ".join(text for text in (where, part[2]) if text)
        below = (matrix + part[0], hint + part[1], words, real and part[3])
        failed = _first_failure(below, choices[1:])
        if failed is not None:
            return failed
    return None


def _links(problem: Contraction) -> tuple[Entries, list[list[Described]], str]:
    """Return the linear links, the two ends of every slope that varies, and what is missing to bound one."""
    names, temperature = problem.system.lumps, problem.region.temperature
    base: Entries = {}
    bent: list[list[Described]] = []
    for link in problem.system.links:
        a, b = link.nodes
        ends = [node for node in (a, b) if isinstance(node, int)]
        if len(ends) == 2:
            i, j = ends
            exchange: Entries = {(i, i): fmpq(-1), (i, j): fmpq(1), (j, j): fmpq(-1), (j, i): fmpq(1)}
            if link.gain != 0 or link.spread != 0:
                bent.append(_ends(exchange_slope(link, temperature[i], temperature[j]), exchange, "conductance"))
        elif ends and link.gain != 0:
            return base, bent, ("method lyapunov: natural convection from lump "
                                f"{name_of(names[ends[0]])} to an ambient has no bounded slope; use energy, sum or max")
        else:
            exchange = {(i, i): fmpq(-1) for i in ends}
            if ends and link.spread != 0:
                bent.append(_ends((fmpq(0), link.spread), exchange, "uncertain conductance"))
        for place, value in exchange.items():
            base[place] = base.get(place, fmpq(0)) + link.conductance * value
        if link.radiation != 0:
            for i in ends:
                column = {place: value for place, value in exchange.items() if place[1] == i}
                bent.append(_ends(radiation_slope(link, temperature[i]), column, f"radiation at {name_of(names[i])}"))
    return base, bent, ""


def _ends(slope: Interval, entries: Entries, words: str) -> list[Described]:
    return [({place: value * s for place, value in entries.items()}, f"{words} {show(s)} W/K", True) for s in slope]
