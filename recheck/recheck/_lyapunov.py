"""Method "lyapunov": P > 0 and -(P E^-1 J + J'E^-1 P + 2 rate P) > 0 over the box, at vertices of the relaxed box.

For fixed (I, I²) the matrix is affine in J, and J in the temperatures; (I, I²) lies in the hull of points on the curve
and of where their tangents meet. Where a vertex that is no point of the box fails, the currents are cut finer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from ._definite import Rows, Scaling, definite
from ._exact import ONE, ZERO, Interval, NotCovered
from ._result import Answer, not_covered, not_valid, valid
from ._thermal import Network, check_cost
from ._vertices import Entries, Vertex, add, count, groups, jacobian, vertices

PIECES = (1, 2, 4, 8)
_MOST_ENTRIES = 4_000_000  # of the shares of all vertices, some 250 MB
_MOST_WORK = 200_000_000  # vertices times n³, and what every vertex costs however small: about 20 s


Units = tuple[Rows, int]  # a share of the matrix in units, and a bound of the error of every entry


@dataclass(frozen=True)
class Share:
    """One value of a share of the matrix, and the vertex of modules it belongs to, if any."""

    rows: Rows
    error: int
    vertex: Vertex | None = None


@dataclass(frozen=True)
class Failure:
    """A joint vertex that is not proven: its modules' vertices."""

    vertices: list[Vertex]

    @property
    def real(self) -> bool:
        """Whether the modules are at a point of the box there."""
        return all(vertex.real for vertex in self.vertices)


def check(network: Network, P: list[list[Fraction]], rate: Fraction) -> Answer:
    """Decide the inequality for one rate."""
    n = len(P)
    if any(P[i][j] != P[j][i] for i in range(n) for j in range(i)):
        return not_valid("P is not symmetric")
    if any(low != high for low, high in network.capacity) or any(name.startswith("lumps.")
                                                                  for name in network.parameters):
        raise NotCovered("an uncertain capacity with method lyapunov")
    check_work(1, n)
    check_cost(network)
    status = decide(P)
    if not status:
        return not_valid("P is not positive definite") if status is False else not_covered("P > 0 is not proven")
    G = [[entry / network.capacity[j][0] for j, entry in enumerate(row)] for row in P]
    base, nonlinear = link_shares(network)
    start: Entries = {(i, j): -2 * rate * P[i][j] for i in range(n) for j in range(n)}
    for place, value in _form(G, base).items():
        add(start, place, value)

    def real_violation(found: list[Vertex]) -> bool:
        entries, is_exact = jacobian(network, found)
        matrix = _form(G, entries)
        for i in range(n):
            for j in range(n):
                add(matrix, (i, j), -2 * rate * P[i][j])
        return is_exact and decide([[matrix[i, j] for j in range(n)] for i in range(n)]) is False

    scaling = Scaling([start[k, k] for k in range(n)])
    return refine(network, (scaling.matrix(start), 1), nonlinear,
                  lambda entries: (scaling.matrix(_form(G, entries)), 1), real_violation)


def check_work(total: int, size: int) -> None:
    """Refuse more than can be decided in bearable time."""
    if total * (size**3 + 500) > _MOST_WORK:
        raise NotCovered(f"{total} joint vertices of {size} rows are too many")


def refine(network: Network, start: Units, nonlinear: Sequence[Sequence[Entries]], part: Callable[[Entries], Units],
           violated: Callable[[list[Vertex]], bool]) -> Answer:
    """Decide a matrix that is affine in J at all vertices, currents cut finer where only the relaxation fails.

    ``part`` returns the share of some entries of J, ``nonlinear`` has the ends of slopes of links that vary.
    """
    found, size = groups(network), len(start[0])
    links = [[Share(*part(entries)) for entries in ends] for ends in nonlinear]
    failed = Failure([])
    for pieces in PIECES:
        cuts = [pieces] * len(network.modules)
        counts = [count(network, group, cuts) for group in found]
        total = math.prod([*counts, *(len(ends) for ends in nonlinear)])
        check_work(total, size)
        if sum(counts) * size**2 > _MOST_ENTRIES:
            raise NotCovered(f"{sum(counts)} vertices of matrices of {size} rows are too many to keep")
        modules = [[Share(*part(vertex.entries), vertex) for vertex in vertices(network, group, cuts)]
                   for group in found]
        open_vertex = first_failure(Share(*start), [*links, *modules])
        if open_vertex is None:
            return valid(f"the matrix is positive definite at all {total} vertices of the relaxed box")
        failed = open_vertex
        if failed.real:
            break
    if failed.real and violated(failed.vertices):
        return not_valid("the matrix inequality is violated at a vertex of the box")
    return not_covered("the matrix inequality is not proven at a vertex, and not refuted either")


def first_failure(start: Share, shares: Sequence[Sequence[Share]]) -> Failure | None:
    for total, chosen in _sums(start, shares):
        if definite(total.rows, total.error) is not True:
            return Failure(chosen)
    return None


def _sums(start: Share, shares: Sequence[Sequence[Share]]) -> Iterator[tuple[Share, list[Vertex]]]:
    """Yield the sum of the start and one part of every share, for all combinations, and the vertices of modules."""
    if not shares:
        yield start, []
        return
    for share in shares[0]:
        rows = [[a + b for a, b in zip(line, other, strict=True)]
                for line, other in zip(start.rows, share.rows, strict=True)]
        for total, chosen in _sums(Share(rows, start.error + share.error), shares[1:]):
            yield total, chosen if share.vertex is None else [share.vertex, *chosen]


def decide(matrix: list[list[Fraction]]) -> bool | None:
    """Decide whether a symmetric matrix of fractions is positive definite."""
    n = len(matrix)
    scaling = Scaling([matrix[k][k] for k in range(n)])
    return definite(scaling.matrix({(i, j): matrix[i][j] for i in range(n) for j in range(n)}), 1)


def link_shares(network: Network, ambient: Mapping[str, Interval] | None = None
                ) -> tuple[Entries, list[list[Entries]]]:
    """Return the linear links at their least conductance, and the two ends of every slope that varies.

    ``ambient``: ranges of the ambients, where a claim has them.
    """
    base: Entries = {}
    nonlinear: list[list[Entries]] = []
    for link in network.links:
        lumps = link.lumps
        if not lumps:
            continue
        unit = {(i, j): ONE if i != j else -ONE for i in lumps for j in lumps}
        for place, value in unit.items():
            add(base, place, link.conductance[0] * value)
        if len(lumps) == 2:
            low, high = link.exchange(network.temperature[lumps[0]], network.temperature[lumps[1]])
        elif link.gain[1] != 0 and ambient is not None:
            name, = (node for node in link.nodes if isinstance(node, str))
            low, high = link.exchange(network.temperature[lumps[0]], ambient[name])
        elif link.gain[1] != 0:
            raise NotCovered("convection to an ambient has no bounded slope for a full matrix")
        else:
            low, high = link.conductance
        _vary(nonlinear, unit, (low - link.conductance[0], high - link.conductance[0]))
        for i in lumps if link.radiation[1] != 0 else ():
            _vary(nonlinear, {place: value for place, value in unit.items() if place[1] == i},
                  link.emission(network.temperature[i]))
    return base, nonlinear


def _vary(nonlinear: list[list[Entries]], unit: Entries, slope: Interval) -> None:
    if slope != (ZERO, ZERO):
        nonlinear.append([{place: value * s for place, value in unit.items()} for s in sorted(set(slope))])


def _form(G: list[list[Fraction]], entries: Entries) -> Entries:
    """Return -(G J + J'G') of some entries of J."""
    matrix: Entries = {}
    for (i, j), value in entries.items():
        if value:
            for k, row in enumerate(G):
                if row[i]:
                    add(matrix, (k, j), -row[i] * value)
                    add(matrix, (j, k), -row[i] * value)
    return matrix
