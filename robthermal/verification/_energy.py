"""Method "energy": sym J <= -rate E as a matrix inequality, V = e'Ee.

The network is eliminated once down to the lumps of the modules (Schur complement, the same for every vertex of the
box); what is left is a matrix as small as the modules, checked at the vertices of the box (proof note, 3).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import product

import numpy as np
from flint import arb, fmpq

from ._contraction_problem import Contraction
from ._cost import longest
from ._definite import eliminate, is_positive, is_semidefinite
from ._kind import Proof
from ._numbers import as_float, decimal, name_of, show
from ._slopes import exchange_slope, least_ambient_slope, radiation_slope
from ._vertices import Cluster, Point, Vertex, clusters, count, describe, endpoints, hull, vertices

Block = list[list[fmpq]]
_MOST_PER_CLUSTER = 5_000
_MOST_ENTRIES = 1_000_000  # of all vertices
_MOST_PRUNED = 200
_MOST_PRUNING = 1e6  # exact operations to find implied vertices
_LONG = 400  # bits of numbers that are too long for them
_MOST_TOGETHER = 20_000
_MOST_WORK = 3e8  # joint vertices times (lumps of modules)³
_PIECES = 8


def prover(problem: Contraction) -> Callable[[fmpq], Proof]:
    """Return the proof, for any rate, that -(sym J + rate E) is positive definite over the box.

    The vertices do not depend on the rate: they are made once, when a rate first needs them.
    """
    system = problem.system
    groups = clusters(system)
    ports = sorted(lump for group in groups for lump in group.lumps)
    points = [_points(problem, k) for k in range(len(system.modules))]
    many = _too_many(problem, groups, points, len(ports))

    @cache
    def choices() -> list[list[tuple[Block, Vertex]]]:
        return [_undominated(group, list(vertices(system, problem.region, group, points))) for group in groups]

    def prove(rate: fmpq) -> Proof:
        if many:
            return Proof(False, f"method energy: {many}")
        rows = [{j: arb(value) for j, value in row.items()} for row in _network(problem, rate)]
        failed = eliminate(rows, set(ports))
        if failed is not None:
            return Proof(False, f"method energy: sym J < -{show(rate)} E fails or cannot be proven even without the "
                                f"modules, at lump {name_of(system.lumps[failed])}")
        rest = [[rows[i].get(j, arb(0)) for j in ports] for i in ports]
        return _check(problem, rate, rest, ports, groups, choices())

    return prove


def _too_many(problem: Contraction, groups: list[Cluster], points: list[list[Point]], ports: int) -> str:
    """Return why the modules are too many, counted before any vertex is made; empty where they are not."""
    if ports**3 > _MOST_WORK:
        return f"modules at {ports} lumps are too many to check together"
    entries = 0
    for group in groups:
        total = count(problem.system, group, problem.region, points)
        entries += total * (len(group.lumps) ** 2 + 10)
        if total > _MOST_PER_CLUSTER or entries > _MOST_ENTRIES:
            return (f"too many vertices of uncertain modules, or of modules that share lumps, to check them one by one "
                    f"({min(total, _MOST_PER_CLUSTER + 1)} or more of one group, at most {_MOST_PER_CLUSTER})")
    return ""


def _network(problem: Contraction, rate: fmpq) -> list[dict[int, fmpq]]:
    """Return -(sym A + rate E) of the links: for links that are not linear, a lower bound in the matrix order."""
    system, region = problem.system, problem.region
    rows = [{k: -rate * capacity} for k, capacity in enumerate(system.capacity)]
    for link in system.links:
        a, b = link.nodes
        if isinstance(a, int) and isinstance(b, int):
            here, there = region.temperature[a], region.temperature[b]
            g = link.conductance + exchange_slope(link, here, there)[0]
            u, v = radiation_slope(link, here), radiation_slope(link, there)
            # The slope at a enters as -u z_a² + u z_a z_b; beyond its least value that is at most (u - u_min) z_b²/4.
            rows[a][a] += g + u[0] - (v[1] - v[0]) / 4
            rows[b][b] += g + v[0] - (u[1] - u[0]) / 4
            between = rows[a].get(b, fmpq(0)) - g - (u[0] + v[0]) / 2
            rows[a][b] = rows[b][a] = between
        else:
            for lump in (node for node in (a, b) if isinstance(node, int)):
                rows[lump][lump] += least_ambient_slope(link, lump, region)
    return rows


def _points(problem: Contraction, k: int) -> list[Point]:
    """Return the current points of a module: sym J is convex in the current when R' >= 0, so its ends suffice."""
    interval = problem.region.current[k]
    convex = all(module.resistance[1] >= 0 for module in problem.system.forms(k))
    return endpoints(interval) if convex else hull(interval, _PIECES)


def _block(group: Cluster, vertex: Vertex) -> Block:
    get = vertex.entries.get
    zero = fmpq(0)
    return [[(get((i, j), zero) + get((j, i), zero)) / 2 for j in group.lumps] for i in group.lumps]


def _undominated(group: Cluster, found: list[Vertex]) -> list[tuple[Block, Vertex]]:
    """Drop vertices whose block is below another's in the matrix order: they are implied."""
    pairs = [(_block(group, vertex), vertex) for vertex in found]
    if len(pairs) > _MOST_PRUNED or len(pairs) ** 2 * len(group.lumps) ** 3 > _MOST_PRUNING:
        return pairs
    if longest(entry for block, _ in pairs for row in block for entry in row) > _LONG:
        return pairs
    kept: list[tuple[Block, Vertex]] = []
    for pair in pairs:
        if any(_below(pair[0], other) for other, _ in kept):
            continue
        kept = [item for item in kept if not _below(item[0], pair[0])]
        kept.append(pair)
    return kept


def _below(lower: Block, upper: Block) -> bool:
    if any(up[i] < low[i] for i, (low, up) in enumerate(zip(lower, upper, strict=True))):
        return False  # a negative diagonal entry: not semidefinite
    return is_semidefinite([[b - a for a, b in zip(low, up, strict=True)]
                            for low, up in zip(lower, upper, strict=True)])


def _check(problem: Contraction, rate: fmpq, rest: list[list[arb]], ports: list[int], groups: list[Cluster],
           choices: list[list[tuple[Block, Vertex]]]) -> Proof:
    total = math.prod(len(choice) for choice in choices)
    if total > _MOST_TOGETHER or total * len(ports) ** 3 > _MOST_WORK:
        return _check_common_bound(rate, rest, ports, groups, choices)
    balls = [[([[arb(entry) for entry in row] for row in block], vertex) for block, vertex in choice]
             for choice in choices]
    place = {lump: k for k, lump in enumerate(ports)}
    for chosen in product(*balls):
        matrix = [list(row) for row in rest]
        for group, (block, _) in zip(groups, chosen, strict=True):
            _subtract(matrix, [place[lump] for lump in group.lumps], block)
        if not is_positive(matrix):
            where = "; ".join(describe(problem.system, group, vertex)
                              for group, (_, vertex) in zip(groups, chosen, strict=True))
            return Proof(False, f"method energy: sym J < -{show(rate)} E fails or cannot be proven at {where} "
                                f"(least eigenvalue left on the module lumps {_least(matrix):.3g} W/K)")
    return Proof(True, f"-(sym J + {decimal(rate)} E) is positive definite at every vertex of the box that is not "
                       "implied by another")


def _check_common_bound(rate: fmpq, rest: list[list[arb]], ports: list[int], groups: list[Cluster],
                        choices: list[list[tuple[Block, Vertex]]]) -> Proof:
    """With too many vertices, replace those of each cluster by one matrix above them all (sound, less sharp)."""
    place = {lump: k for k, lump in enumerate(ports)}
    matrix = [list(row) for row in rest]
    for group, choice in zip(groups, choices, strict=True):
        blocks = [block for block, _ in choice]
        above = _upper_bound(blocks)
        if above is None or not all(_below(block, above) for block in blocks):
            return Proof(False, "method energy: too many vertices to check one by one, and no common bound was proven")
        _subtract(matrix, [place[lump] for lump in group.lumps], [[arb(entry) for entry in row] for row in above])
    if is_positive(matrix):
        return Proof(True, f"-(sym J + {decimal(rate)} E) is positive definite for a common bound of all vertices")
    return Proof(False, f"method energy: too many vertices to check one by one, and sym J < -{show(rate)} E is not "
                        f"proven for their common bound (least eigenvalue {_least(matrix):.3g} W/K)")


def _upper_bound(blocks: list[Block]) -> Block | None:
    """Return a matrix that should lie above all blocks; a hint from floats, checked exactly by the caller."""
    floats = [np.array([[as_float(entry) for entry in row] for row in block]) for block in blocks]
    bound = floats[0]
    for block in floats[1:]:
        with np.errstate(all="ignore"):
            difference = block - bound
        if not bool(np.all(np.isfinite(difference))):
            return None
        values, vectors = np.linalg.eigh(difference)
        bound = bound + (vectors * np.maximum(values, 0.0)) @ vectors.T
    with np.errstate(all="ignore"):
        bound = (bound + bound.T) / 2 + 1e-12 * np.max(np.abs(bound)) * np.eye(len(bound))
    if not bool(np.all(np.isfinite(bound))):
        return None
    return [[fmpq(*entry.as_integer_ratio()) for entry in row] for row in bound.tolist()]


def _subtract(matrix: list[list[arb]], places: list[int], block: list[list[arb]]) -> None:
    for i, row in zip(places, block, strict=True):
        for j, entry in zip(places, row, strict=True):
            matrix[i][j] -= entry


def _least(matrix: list[list[arb]]) -> float:
    """Return the least eigenvalue in floats, for a message only."""
    floats = np.array([[float(entry) for entry in row] for row in matrix])
    return float(np.linalg.eigvalsh(floats)[0]) if bool(np.all(np.isfinite(floats))) else math.nan
