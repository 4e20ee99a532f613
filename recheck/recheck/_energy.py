"""Method "energy": -(sym J + rate E) is positive definite over the box, V = e'Ee.

Decided at vertices. Links that are not linear: convection at its least slope; radiation at its least slopes u, v at the
two ends, with a quarter of the range of each charged to the other end, because for d = u - u_min >= 0
d (-z_a² + z_a z_b) = -d (z_a - z_b/2)² + d z_b²/4.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import product

from ._definite import Factor, Scaling, definite, finish
from ._exact import ZERO, NotCovered
from ._result import Answer, not_covered, not_valid, valid
from ._thermal import Network, check_cost
from ._vertices import Entries, Group, Vertex, add, count, groups, jacobian, vertices

_PIECES = 8  # of a current whose module has a resistance that falls with temperature
_MOST_LUMPS = 400
_MOST_OF_GROUP = 5_000
_MOST_TOGETHER = 20_000
_MOST_WORK = 40_000_000  # joint vertices times (lumps of modules)³

Block = list[list[Fraction]]


def check(network: Network, rate: Fraction) -> Answer:
    """Decide the inequality for one rate, parameters included."""
    n = len(network.lumps)
    if n > _MOST_LUMPS:
        raise NotCovered(f"{n} lumps are too many for a dense matrix, at most {_MOST_LUMPS}")
    check_cost(network)
    found = groups(network)
    listed = [_undominated(network, group) for group in found]
    ports = sorted(lump for group in found for lump in group.lumps)
    total = math.prod(len(choice) for choice in listed)
    if total > _MOST_TOGETHER or total * len(ports) ** 3 > _MOST_WORK:
        raise NotCovered(f"{total} joint vertices of {len(ports)} lumps are too many to check one by one")
    failed = _first_failure(network, rate, found, listed, ports)
    if failed is None:
        return valid(f"-(sym J + rate E) is positive definite at all {total} vertices that no other implies")
    entries, _ = jacobian(network, failed)
    if all(vertex.real for vertex in failed) and not _possible(network, entries, rate):
        return not_valid("sym J <= -rate E is violated at a vertex of the box")
    return not_covered("sym J < -rate E is not proven at a vertex, and not refuted either")


def _first_failure(network: Network, rate: Fraction, found: list[Group], listed: list[list[tuple[Block, Vertex]]],
                   ports: list[int]) -> list[Vertex] | None:
    """Return the first combination of vertices that is not proven, None when all are."""
    rows = _links(network, rate)
    order = [k for k in range(len(network.lumps)) if k not in set(ports)] + ports
    place = {lump: k for k, lump in enumerate(order)}
    arranged = {(place[i], place[j]): value for (i, j), value in rows.items()}
    first = [choice[0][1] for choice in listed]
    scaling = Scaling([arranged.get((k, k), ZERO) for k in range(len(order))])
    start = len(order) - len(ports)
    units, most = [], 0
    for group, choice in zip(found, listed, strict=True):
        where = [place[lump] for lump in group.lumps]
        blocks = [[[scaling.units(entry, i, j) for j, entry in zip(where, line, strict=True)]
                   for i, line in zip(where, block, strict=True)] for block, _ in choice]
        most = max([most, *(abs(line[k]) for block in blocks for k, line in enumerate(block))])
        units.append([([i - start for i in where], block) for block in blocks])
    matrix = scaling.matrix(arranged)
    factor = Factor(matrix, 1 + len(found), start, others=max(row[k] for k, row in enumerate(matrix)) + most)
    if factor.failed is not None:
        return first
    rest = factor.rest(matrix)
    for joint in product(*(range(len(choice)) for choice in listed)):
        if not finish(rest, [parts[k] for parts, k in zip(units, joint, strict=True)]):
            return [choice[k][1] for choice, k in zip(listed, joint, strict=True)]
    return None


def _links(network: Network, rate: Fraction) -> Entries:
    """Return -(sym A + rate E) of the links, a lower bound in the matrix order."""
    rows: Entries = {(k, k): -rate * capacity[1] for k, capacity in enumerate(network.capacity)}
    for link in network.links:
        if len(link.lumps) == 2:
            a, b = link.lumps
            here, there = network.temperature[a], network.temperature[b]
            g, u, v = link.exchange(here, there)[0], link.emission(here), link.emission(there)
            add(rows, (a, a), g + u[0] - (v[1] - v[0]) / 4)
            add(rows, (b, b), g + v[0] - (u[1] - u[0]) / 4)
            for place in ((a, b), (b, a)):
                add(rows, place, -g - (u[0] + v[0]) / 2)
        elif link.lumps:
            lump = link.lumps[0]
            add(rows, (lump, lump), link.least_loss(network.temperature[lump]))
    return rows


def _possible(network: Network, entries: Entries, rate: Fraction) -> bool:
    """Whether -(sym J + rate E) may be positive definite at a point, the entries of J rounded to its favour."""
    n = len(network.lumps)
    rows: Entries = {(k, k): -rate * capacity[1] for k, capacity in enumerate(network.capacity)}
    for (i, j), value in entries.items():
        add(rows, (i, j), -value / 2)
        add(rows, (j, i), -value / 2)
    scaling = Scaling([rows[k, k] for k in range(n)])
    return definite(scaling.matrix(rows), 1) is not False


def _undominated(network: Network, group: Group) -> list[tuple[Block, Vertex]]:
    """Return the symmetric blocks of a group; those of two lumps that lie below another's are dropped."""
    pieces = [0 if all(form[1][1] >= 0 for form in module.forms) else _PIECES for module in network.modules]
    total = count(network, group, pieces)
    if total > _MOST_OF_GROUP:
        raise NotCovered(f"{total} vertices of modules that share lumps, or of uncertain modules, are too many")
    kept: list[tuple[Block, Vertex]] = []
    for vertex in vertices(network, group, pieces):
        get = vertex.entries.get
        block = [[(get((i, j), ZERO) + get((j, i), ZERO)) / 2 for j in group.lumps] for i in group.lumps]
        if len(block) == 2:
            if any(_below(block, other) for other, _ in kept):
                continue
            kept = [item for item in kept if not _below(item[0], block)]
        kept.append((block, vertex))
    return kept


def _below(lower: Block, upper: Block) -> bool:
    """Whether upper - lower, 2 by 2, is positive semidefinite."""
    a, b, c = upper[0][0] - lower[0][0], upper[0][1] - lower[0][1], upper[1][1] - lower[1][1]
    return a >= 0 and c >= 0 and a * c >= b * b
