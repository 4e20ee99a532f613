"""Method "lyapunov": P > 0 and P E^-1 J + J' E^-1 P <= -2 rate P, V = e'Pe with a full matrix P.

Not convex in the current for a general P, so (I, I²) is relaxed to a polygon around the curve, refined where needed
(proof note, 4). Checked densely at every vertex of the box.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from flint import arb, arb_mat, fmpq

from ._contraction_problem import Contraction
from ._corners import Part, first_failure, is_positive
from ._cost import product_up_to
from ._fields import Interval
from ._kind import Proof
from ._numbers import decimal, name_of, show
from ._slopes import exchange_slope, radiation_slope
from ._system import Region, ThermalSystem
from ._vertices import Cluster, Entries, Point, clusters, count, describe, hull, vertices

PIECES = (1, 2, 4, 8)  # per current, the relaxation refined in turn
MOST_ROWS = 400  # of a dense matrix: it and its products fill some 100 MB
MOST_WORK = 3e8  # vertices times n³, and what every vertex costs however small
Described = tuple[Entries, str, bool]


class _Form:
    """-(P E^-1 J + J' E^-1 P) as a linear function of J."""

    def __init__(self, problem: Contraction):
        self.n = len(problem.matrix)
        self.P = arb_mat(self.n, self.n, [arb(entry) for row in problem.matrix for entry in row])
        self.G = arb_mat(self.n, self.n, [arb(entry / capacity) for row in problem.matrix
                                          for entry, capacity in zip(row, problem.system.capacity, strict=True)])

    def matrix(self, entries: Entries) -> arb_mat:
        """Return the share of some Jacobian entries."""
        half = self.G * dense(entries, self.n)
        return -(half + half.transpose())

    def part(self, described: Described) -> Part:
        """Return the same, with where it comes from."""
        return Part(self.matrix(described[0]), *described[1:])


def prove(problem: Contraction, rate: fmpq) -> Proof:
    """Prove P > 0 and the inequality at every vertex of the relaxed box, refining the relaxation where it fails."""
    broken = asymmetry(problem.matrix) or _uncertain_capacity(problem)
    if broken:
        return Proof(False, f"method lyapunov: {broken}")
    n = len(problem.matrix)
    base, nonlinear, missing = link_slopes(problem.system, problem.region)
    if missing:
        return Proof(False, f"method lyapunov: {missing}; use energy, sum or max")
    missing = too_much(problem.system, problem.region, nonlinear, PIECES[0], n)
    if missing:
        return Proof(False, f"method lyapunov: {missing}")
    form = _Form(problem)
    if not is_positive(form.P):
        return Proof(False, "method lyapunov: P > 0 fails or cannot be proven")
    start = form.matrix(base) - form.P * arb(2 * rate)
    words = f"P E^-1 J + J' E^-1 P < -2 ({decimal(rate)}) P"
    proof = Proof(False, "method lyapunov: too many vertices to check any")
    for pieces in PIECES:
        more = too_much(problem.system, problem.region, nonlinear, pieces, n)
        if more:
            return Proof(False, f"{proof.reason} ({more})")
        groups: list[Collection[Described]] = [*nonlinear, *module_slopes(problem.system, problem.region, pieces)]
        failed = first_failure(start, groups, form.part)
        if failed is None:
            return Proof(True, f"{words} at all {math.prod(map(len, groups))} vertices of the relaxed box")
        proof = Proof(False, f"method lyapunov: {words} fails or cannot be proven at {failed.where or 'the links'}")
        if failed.real:
            break  # a point of the box: no refinement helps
    return proof


def too_much(system: ThermalSystem, region: Region, nonlinear: Sequence[Collection[Described]], pieces: int,
             rows: int) -> str:
    """Return why the vertices would take minutes or the matrices gigabytes, counted before any is made; else empty."""
    n = len(system.lumps)
    if rows > MOST_ROWS:
        return f"{n} lumps need dense matrices with {rows} rows, too large to check: at most {MOST_ROWS}"
    groups = [*map(len, nonlinear), *map(len, module_slopes(system, region, pieces))]
    most = int(MOST_WORK / (n**3 + 2000))
    if sum(groups) + product_up_to(groups, most) > most:
        return (f"too many vertices of the modules and of the links that are not linear, with pieces per current: "
                f"{pieces} (at most {most} for {n} lumps)")
    return ""


def dense(entries: Entries, n: int) -> arb_mat:
    """Return a few exact entries as a matrix of balls."""
    values = [arb(0)] * (n * n)
    for (i, j), value in entries.items():
        values[i * n + j] = arb(value)
    return arb_mat(n, n, values)


def asymmetry(matrix: Sequence[Sequence[fmpq]]) -> str:
    """Return where P is not symmetric, empty where it is."""
    for i, row in enumerate(matrix):
        for j in range(i):
            if row[j] != matrix[j][i]:
                return f"P is not symmetric at [{i}][{j}]"
    return ""


def _uncertain_capacity(problem: Contraction) -> str:
    name = next((name for name, _ in problem.parameters if name.startswith("lumps.")), "")
    return f"{name_of(name)} is uncertain, which needs method energy, sum or max" if name else ""


@dataclass(frozen=True)
class ModuleSlopes:
    """The Jacobian entries of one group of modules at its vertices: counted at once, made one by one."""

    system: ThermalSystem
    region: Region
    group: Cluster
    points: Sequence[Sequence[Point]]

    def __len__(self) -> int:
        return count(self.system, self.group, self.region, self.points)

    def __iter__(self) -> Iterator[Described]:
        for vertex in vertices(self.system, self.region, self.group, self.points):
            yield vertex.entries, describe(self.system, self.group, vertex), vertex.real

    def __contains__(self, item: object) -> bool:
        return any(item == other for other in self)


def module_slopes(system: ThermalSystem, region: Region, pieces: int) -> list[ModuleSlopes]:
    """Return the Jacobian entries of every group of modules at its vertices, currents relaxed to a polygon."""
    points = [hull(interval, pieces) for interval in region.current]
    return [ModuleSlopes(system, region, group, points) for group in clusters(system)]


def link_slopes(system: ThermalSystem, region: Region, ambient: Mapping[str, Interval] | None = None
                ) -> tuple[Entries, list[list[Described]], str]:
    """Return the linear links, the two ends of every slope that varies, and what is missing to bound one.

    ``ambient``: ranges of the ambients, where a claim has them.
    """
    names, temperature = system.lumps, region.temperature
    base: Entries = {}
    nonlinear: list[list[Described]] = []
    for link in system.links:
        a, b = link.nodes
        ends = [node for node in (a, b) if isinstance(node, int)]
        if len(ends) == 2:
            i, j = ends
            exchange: Entries = {(i, i): fmpq(-1), (i, j): fmpq(1), (j, j): fmpq(-1), (j, i): fmpq(1)}
            if link.convects or link.spread != 0:
                nonlinear.append(_ends(exchange_slope(link, temperature[i], temperature[j]), exchange, "conductance"))
        elif ends and link.convects and ambient is not None:
            name, = (node for node in (a, b) if isinstance(node, str))
            exchange = {(ends[0], ends[0]): fmpq(-1)}
            slope = exchange_slope(link, temperature[ends[0]], ambient[name])
            nonlinear.append(_ends(slope, exchange, "convection"))
        elif ends and link.convects:
            return base, nonlinear, (f"natural convection from lump {name_of(names[ends[0]])} to an ambient has no "
                                     "bounded slope, because this claim states no range of the ambient")
        else:
            exchange = {(i, i): fmpq(-1) for i in ends}
            if ends and link.spread != 0:
                nonlinear.append(_ends((fmpq(0), link.spread), exchange, "uncertain conductance"))
        for place, value in exchange.items():
            base[place] = base.get(place, fmpq(0)) + link.conductance * value
        if link.radiates:
            for i in ends:
                column = {place: value for place, value in exchange.items() if place[1] == i}
                words = f"radiation at {name_of(names[i])}"
                nonlinear.append(_ends(radiation_slope(link, temperature[i]), column, words))
    return base, nonlinear, ""


def _ends(slope: Interval, entries: Entries, words: str) -> list[Described]:
    return [({place: value * s for place, value in entries.items()}, f"{words} {show(s)} W/K", True)
            for s in dict.fromkeys(slope)]
