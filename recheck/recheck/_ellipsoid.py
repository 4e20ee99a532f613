"""Kind "ellipsoid": the loops of a hull of plants with one controller, in fractions, and what keeps x'Px <= level."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

from ._document import get, mapping, matrix, not_negative, numbers, only, positive, sequence
from ._exact import ONE, ZERO, Malformed, NotCovered
from ._lyapunov import check_work, decide
from ._polytope import turned
from ._polytope_loops import times
from ._result import Answer, not_covered, not_valid, valid

Matrix = list[list[Fraction]]
Table = Mapping[str, Any]
_MOST_ROWS = 120


@dataclass(frozen=True)
class Problem:
    """What one certificate claims; ``vertices``: A, B of the plants, the controls last."""

    vertices: list[tuple[Matrix, Matrix]]
    seen: tuple[Matrix, Matrix]
    controller: dict[str, Matrix] | None
    performance: tuple[Matrix, Matrix] | None
    sample_time: Fraction
    level: Fraction
    rate: Fraction
    disturbance: list[Fraction] | None
    joint: bool
    bound: Fraction | None
    saturation: list[Fraction] | None
    limits: tuple[Matrix, Matrix, list[Fraction]] | None
    cost: tuple[Matrix, Matrix] | None
    P: Matrix
    decay: Fraction
    multipliers: list[Fraction]
    held: Matrix

    @property
    def states(self) -> int:
        """States of the plant."""
        return len(self.vertices[0][0])

    @property
    def controls(self) -> int:
        """Controls, the last inputs of the plant."""
        return len(self.controller["D"]) if self.controller else 0

    @property
    def hidden(self) -> int:
        """States of the controller."""
        return len(self.controller["A"]) if self.controller else 0

    @property
    def inputs(self) -> int:
        """All inputs of the plant."""
        return len(self.vertices[0][1][0])


def read(parts: Mapping[str, Table]) -> Problem:
    """Return the problem of the sections of a certificate."""
    system, region, evidence = parts["system"], parts["region"], parts["evidence"]
    only(parts["margin"], [], "margin")
    only(system, ["vertices", "measured", "controller", "performance", "sample_time"], "system")
    time = not_negative(get(system, "sample_time", "system"), "system.sample_time")
    own = _of(system, "controller", "system") if "controller" in system else None
    k = len(sequence(get(own, "D", "system.controller"), "system.controller.D")) if own is not None else 0
    if (own is None and "measured" in system) or (own is not None and not k):
        raise Malformed("system.controller: missing or without controls")
    vertices = _vertices(system, k)
    n, m = len(vertices[0][0]), len(vertices[0][1][0]) if vertices[0][1] else 0
    w = m - k
    seen = _seen(system, n, w)
    controller = None if own is None else _controller(own, k, len(seen[0]))
    q = len(controller["A"]) if controller else 0
    if len(vertices) * (2**k if "saturation" in region else 1) * (n + q + m + len(seen[0])) ** 3 > 100_000_000:
        raise Malformed("system.vertices: too many")
    performance = _performance(system, n, m)
    way = "disturbance" if "disturbance" in region else "bound" if "bound" in region else ""
    free = not way and "saturation" not in region
    only(region, ["level", "saturation", "limits", *([way] if way else ["rate"]), *(["cost"] if free else [])],
         "region")
    if (w > 0) != bool(way) or (performance is not None) != (way == "bound"):
        raise Malformed("region: disturbances or performance outputs that no key of it is about")
    rate = not_negative(region.get("rate", 0), "region.rate")
    if time > 0 and rate >= 1:
        raise Malformed("region.rate: not below 1")
    if "saturation" in region and not k:
        raise Malformed("region.saturation: without a controller")
    joint = way == "disturbance" and not isinstance(region["disturbance"], (list, tuple))
    disturbance = None
    if way == "disturbance":
        given = [region["disturbance"]] if joint else region["disturbance"]
        disturbance = _above(given, 1 if joint else w, "region.disturbance")
    keys = ["matrix", *(["feedback"] if "saturation" in region else []), *(["decay"] if disturbance else []),
            *(["multipliers"] if disturbance and not joint else [])]
    only(evidence, keys, "evidence")
    decay = positive(get(evidence, "decay", "evidence"), "evidence.decay") if disturbance else ZERO
    if time > 0 and decay >= 1:
        raise Malformed("evidence.decay: not below 1")
    level = positive(get(region, "level", "region"), "region.level")
    return Problem(
        vertices, seen, controller, performance, time, level, rate, disturbance, joint,
        positive(region["bound"], "region.bound") if way == "bound" else None,
        _above(region["saturation"], k, "region.saturation") if "saturation" in region else None,
        _limits(region["limits"], n, k, "saturation" in region) if "limits" in region else None,
        _cost(region["cost"], n, k) if "cost" in region else None,
        matrix(get(evidence, "matrix", "evidence"), n + q, n + q, "evidence.matrix"), decay,
        _above(get(evidence, "multipliers", "evidence"), w, "evidence.multipliers")
        if disturbance and not joint else [],
        matrix(get(evidence, "feedback", "evidence"), k, n + q, "evidence.feedback")
        if "saturation" in region else [])


def _of(table: Table, key: str, where: str) -> Table:
    return mapping(table[key], f"{where}.{key}")


def _above(value: Any, count: int, where: str) -> list[Fraction]:
    found: list[Fraction] = numbers(value, count, where)
    if any(one <= 0 for one in found):
        raise Malformed(f"{where}: not positive")
    return found


def _vertices(system: Table, k: int) -> list[tuple[Matrix, Matrix]]:
    found, sizes = [], set()
    for i, item in enumerate(sequence(get(system, "vertices", "system"), "system.vertices")):
        where = f"system.vertices[{i}]"
        part = mapping(item, where)
        only(part, ["A", "B"], where)
        rows, lines = (sequence(get(part, key, where), f"{where}.{key}") for key in "AB")
        n, m = len(rows), len(sequence(lines[0], f"{where}.B")) if lines else 0
        sizes.add((n, m))
        if not n or m < k or len(sizes) > 1:
            raise Malformed(f"{where}: no state, fewer inputs than controls, or sizes that differ")
        found.append((matrix(rows, n, n, f"{where}.A"), matrix(lines, n, m, f"{where}.B")))
    if not found:
        raise Malformed("system.vertices: none")
    return found


def _seen(system: Table, n: int, w: int) -> tuple[Matrix, Matrix]:
    if "measured" not in system:
        return [[Fraction(int(i == j)) for j in range(n)] for i in range(n)], [[ZERO] * w for _ in range(n)]
    part = _of(system, "measured", "system")
    only(part, ["C", "D"], "system.measured")
    p = len(sequence(get(part, "C", "system.measured"), "system.measured.C"))
    return (matrix(part["C"], p, n, "system.measured.C"),
            matrix(get(part, "D", "system.measured"), p, w, "system.measured.D"))


def _performance(system: Table, n: int, m: int) -> tuple[Matrix, Matrix] | None:
    if "performance" not in system:
        return None
    part = _of(system, "performance", "system")
    only(part, ["C", "D"], "system.performance")
    p = len(sequence(get(part, "C", "system.performance"), "system.performance.C"))
    if not p:
        raise Malformed("system.performance: no output")
    return (matrix(part["C"], p, n, "system.performance.C"),
            matrix(get(part, "D", "system.performance"), p, m, "system.performance.D"))


def _controller(part: Table, k: int, p: int) -> dict[str, Matrix]:
    where = "system.controller"
    only(part, ["A", "B", "C", "D", "windup"], where)
    q = len(sequence(get(part, "A", where), f"{where}.A"))
    shapes = {"A": (q, q), "B": (q, p), "C": (k, q), "D": (k, p)}
    found = {key: matrix(get(part, key, where), *shape, f"{where}.{key}") for key, shape in shapes.items()}
    found["windup"] = (matrix(part["windup"], q, k, f"{where}.windup") if "windup" in part
                       else [[ZERO] * k for _ in range(q)])
    return found


def _limits(value: Any, n: int, k: int, limited: bool) -> tuple[Matrix, Matrix, list[Fraction]]:
    where = "region.limits"
    table = mapping(value, where)
    only(table, ["state", "bound", *(["control"] if k and not limited else [])], where)
    count = len(sequence(get(table, "bound", where), f"{where}.bound"))
    if not count:
        raise Malformed(f"{where}: none")
    bounds = _above(table["bound"], count, f"{where}.bound")
    rows = matrix(get(table, "state", where), count, n, f"{where}.state")
    return rows, (matrix(table["control"], count, k, f"{where}.control") if "control" in table
                  else [[ZERO] * k for _ in range(count)]), bounds


def _cost(value: Any, n: int, k: int) -> tuple[Matrix, Matrix]:
    where = "region.cost"
    table = mapping(value, where)
    only(table, ["state", *(["control"] if k else [])], where)
    found = tuple(matrix(table[key], size, size, f"{where}.{key}") if key in table else [[ZERO] * size] * size
                  for key, size in (("state", n), ("control", k)))
    if any(one != [list(column) for column in zip(*one, strict=True)] for one in found):
        raise Malformed(f"{where}: not symmetric")
    return found[0], found[1]


def check(problem: Problem) -> Answer:
    """Decide P > 0, what holds inside, and the inequality of every loop."""
    P, N = problem.P, len(problem.P)
    sets = 2**problem.controls if problem.saturation is not None else 1
    if N > _MOST_ROWS:
        raise NotCovered(f"{N} states are too many")
    check_work(len(problem.vertices) * sets, N + problem.inputs)
    if any(P[i][j] != P[j][i] for i in range(N) for j in range(i)):
        return not_valid("P is not symmetric")
    if problem.multipliers and problem.disturbance is not None:
        paid = sum((one * size**2 for one, size in zip(problem.multipliers, problem.disturbance, strict=True)), ZERO)
        if paid > problem.decay * problem.level:
            return not_valid("the multipliers of the disturbances are too large")
    for name, form in [("P", P), *_inside(problem), *_forms(problem)]:
        status = decide(form)
        if status is False:
            return not_valid(f"{name} is not positive definite")
        if status is None:
            return not_covered(f"{name} is not proven positive definite")
    return valid(f"P, the limits and the inequality at {len(problem.vertices)} vertices are positive definite")


def _law(problem: Problem) -> tuple[Matrix, Matrix]:
    """Return F and D_v of v = F xi + D_v w."""
    own, w = problem.controller, problem.inputs - problem.controls
    if own is None:
        return [], []
    C, D = problem.seen
    seen, direct = _product(own["D"], C, problem.states), _product(own["D"], D, w)
    return [[*a, *b] for a, b in zip(seen, own["C"], strict=True)], direct


def _inside(problem: Problem) -> Iterator[tuple[str, Matrix]]:
    """Yield [P/level, r'; r, b²] of every row that stays within its bound."""
    rows = list(zip(problem.held, problem.saturation or [], strict=True))
    if problem.limits is not None:
        F, direct = _law(problem)
        G, H, bounds = problem.limits
        if any(entry != 0 for row in _product(H, direct, problem.inputs - problem.controls) for entry in row):
            raise Malformed("region.limits: controls that depend on the disturbance")
        through = _product(H, F, len(problem.P))
        rows += [([a + b for a, b in zip([*own, *[ZERO] * problem.hidden], more, strict=True)], bound)
                 for own, more, bound in zip(G, through, bounds, strict=True)]
    for k, (row, bound) in enumerate(rows):
        yield f"row {k} of limits", [*([*(entry / problem.level for entry in line), row[i]]
                                       for i, line in enumerate(problem.P)), [*row, bound**2]]


def _forms(problem: Problem) -> Iterator[tuple[str, Matrix]]:
    """Yield what has to be positive definite at every vertex and set of limited controls."""
    F, direct = _law(problem)
    k, w = problem.controls, problem.inputs - problem.controls
    for i, (A, B) in enumerate(problem.vertices):
        for limited in product((False, True), repeat=k) if problem.saturation is not None else [(False,) * k]:
            U = [problem.held[j] if one else F[j] for j, one in enumerate(limited)]
            V = [[ZERO] * w if one else direct[j] for j, one in enumerate(limited)]
            loop = _loop(problem, A, B, U, V, F, direct)
            for name, form in _inequalities(problem, *loop, F):
                yield f"{name} at vertex {i}", form


def _loop(problem: Problem, A: Matrix, B: Matrix, U: Matrix, V: Matrix, F: Matrix, direct: Matrix
          ) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Return A, B, C, D of the loop from w to z with u = U xi + V w; its states are those of plant and controller."""
    n, q, N = problem.states, problem.hidden, len(problem.P)
    w = problem.inputs - problem.controls
    into = [row[w:] for row in B]
    top = _plus([[*row, *[ZERO] * q] for row in A], _product(into, U, N))
    driven = _plus([row[:w] for row in B], _product(into, V, w))
    own = problem.controller
    if own is not None and q:
        C, D = problem.seen
        back, pushed = _product(own["windup"], _minus(F, U), N), _product(own["windup"], _minus(direct, V), w)
        seen = _product(own["B"], C, n)
        top = top + _plus([[*a, *b] for a, b in zip(seen, own["A"], strict=True)], back)
        driven = driven + _plus(_product(own["B"], D, w), pushed)
    if problem.performance is None:
        return top, driven, [], []
    C, D = problem.performance
    through = [row[w:] for row in D]
    return (top, driven, _plus([[*row, *[ZERO] * q] for row in C], _product(through, U, N)),
            _plus([row[:w] for row in D], _product(through, V, w)))


def _inequalities(problem: Problem, A: Matrix, B: Matrix, C: Matrix, D: Matrix, F: Matrix
                  ) -> Iterator[tuple[str, Matrix]]:
    P, N, sampled = problem.P, len(problem.P), problem.sample_time > 0
    PA = times(P, A)
    moved = times(turned(A), PA) if sampled else _plus(PA, turned(PA))
    start = P if sampled else [[ZERO] * N for _ in range(N)]
    w = problem.inputs - problem.controls
    if not w:
        kept = [[entry * ((1 - problem.rate) ** 2 if sampled else -2 * problem.rate) for entry in row] for row in P]
        yield "the inequality of x'Px", _minus(kept, moved)
        if problem.cost is not None:
            yield "that of the cost", _minus(_minus(start, moved), _paid(problem, F))
        return
    PB = times(P, B)
    cross = times(turned(A), PB) if sampled else PB
    inner = times(turned(B), PB) if sampled else [[ZERO] * w for _ in range(w)]
    if problem.bound is not None:
        share = ONE / problem.bound**2
        z, zw, ww = times(turned(C), C), times(turned(C), D), times(turned(D), D)
        own = _minus(_minus(start, moved), [[entry * share for entry in row] for row in z])
        cross = _plus(cross, [[entry * share for entry in row] for row in zw])
        inner = _plus(inner, [[entry * share for entry in row] for row in ww])
        weights = [ONE] * w
    else:
        factor = 1 - problem.decay if sampled else -problem.decay
        own = _minus([[entry * factor for entry in row] for row in P], moved)
        weights = problem.multipliers
        if problem.joint and problem.disturbance is not None:
            weights = [problem.decay * problem.level / problem.disturbance[0] ** 2] * w
    last = [[(weights[i] if i == j else ZERO) - inner[i][j] for j in range(w)] for i in range(w)]
    yield "the inequality of x'Px and w", [*([*row, *(-entry for entry in beside)]
                                             for row, beside in zip(own, cross, strict=True)),
                                           *([*(-row[j] for row in cross), *last[j]] for j in range(w))]


def _paid(problem: Problem, F: Matrix) -> Matrix:
    """Return the matrix of x'Qx + u'Ru over all states."""
    if problem.cost is None:
        return []
    Q, R = problem.cost
    n, N = problem.states, len(problem.P)
    found = [[Q[i][j] if i < n and j < n else ZERO for j in range(N)] for i in range(N)]
    return _plus(found, times(turned(F), times(R, F))) if F else found


def _product(a: Matrix, b: Matrix, columns: int) -> Matrix:
    """Return a product, also of matrices without rows."""
    return times(a, b) if b else [[ZERO] * columns for _ in a]


def _plus(a: Matrix, b: Matrix) -> Matrix:
    return [[x + y for x, y in zip(row, other, strict=True)] for row, other in zip(a, b, strict=True)]


def _minus(a: Matrix, b: Matrix) -> Matrix:
    return [[x - y for x, y in zip(row, other, strict=True)] for row, other in zip(a, b, strict=True)]
