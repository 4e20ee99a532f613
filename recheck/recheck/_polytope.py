"""Kind "polytope": the loops at the vertices of a hull of plants, with one matrix or with a slack matrix."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from operator import mul
from typing import Any

from ._document import get, matrix, not_negative, numbers, only, positive, sequence
from ._exact import ZERO, Malformed, NotCovered, short
from ._lyapunov import check_work, decide
from ._polytope_loops import Loop, Loops, Matrix, plus, read_loops, times
from ._result import Answer, not_covered, not_valid, valid

MEASURES = {"stability": ("rate", "parameter_rates"), "hinf": ("bound",), "h2": ("bound",),
            "region": ("decay", "damping", "radius")}
_MOST_MOVING = 6
_MOST_ROWS = 120


@dataclass(frozen=True)
class Problem:
    """What one certificate claims."""

    closed: Loops
    sample_time: Fraction
    measure: str
    numbers: Mapping[str, Fraction]
    rates: list[Fraction] | None
    matrices: list[Matrix]
    slack: Matrix | None

    @property
    def loops(self) -> list[Loop]:
        """A, B1, C, D1 of the closed loop at every vertex."""
        return self.closed.at


def read(parts: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem of the sections of a certificate."""
    system, region, evidence = parts["system"], parts["region"], parts["evidence"]
    only(parts["margin"], [], "margin")
    measure = region.get("measure", "stability")
    if not isinstance(measure, str) or measure not in MEASURES:
        raise Malformed(f"region.measure: {short(measure)}")
    only(region, ["measure", *MEASURES[measure]], "region")
    time = not_negative(get(system, "sample_time", "system"), "system.sample_time")
    closed = read_loops(system, measure in ("hinf", "h2"))
    stated = {key: (not_negative if key == "rate" else positive)(region[key], f"region.{key}")
              for key in MEASURES[measure] if key in region and key != "parameter_rates"}
    _check_region(measure, stated, bool(time > 0))
    matrices, slack, rates = _evidence(evidence, region, len(closed.at), len(closed.at[0][0]), measure,
                                        bool(time > 0))
    return Problem(closed, time, measure, stated, rates, matrices, slack)


def _check_region(measure: str, stated: Mapping[str, Fraction], sampled: bool) -> None:
    if sampled and stated.get("rate", ZERO) >= 1:
        raise Malformed("region.rate: not below 1")
    if measure in ("hinf", "h2") and "bound" not in stated:
        raise Malformed("region: 'bound' is missing")
    if measure == "region":
        proper = set(stated) == {"radius"} and stated["radius"] <= 1 if sampled else {"decay", "damping"} & set(stated)
        if not proper or stated.get("damping", ZERO) >= 1:
            raise Malformed("region: no region in which a loop is stable")


def _evidence(evidence: Mapping[str, Any], region: Mapping[str, Any], count: int, n: int, measure: str, sampled: bool
              ) -> tuple[list[Matrix], Matrix | None, list[Fraction] | None]:
    if "matrix" in evidence:
        only(evidence, ["matrix"], "evidence")
        if "parameter_rates" in region:
            raise Malformed("region.parameter_rates: with one matrix")
        return [matrix(evidence["matrix"], n, n, "evidence.matrix")], None, None
    if measure != "stability":
        raise Malformed("evidence: one matrix is needed")
    only(evidence, ["matrices", "slack"], "evidence")
    items = sequence(get(evidence, "matrices", "evidence"), "evidence.matrices")
    if len(items) != count:
        raise Malformed("evidence.matrices: not one per vertex")
    found = [matrix(item, n, n, "evidence.matrices") for item in items]
    slack = matrix(get(evidence, "slack", "evidence"), 2 * n, n, "evidence.slack")
    if "parameter_rates" not in region:
        return found, slack, None
    rates = numbers(region["parameter_rates"], count, "region.parameter_rates")
    if sampled or count > _MOST_MOVING or any(rate < 0 for rate in rates):
        raise Malformed("region.parameter_rates: negative, of sampled plants or of too many vertices")
    return found, slack, rates


def check(problem: Problem) -> Answer:
    """Decide the inequality of the measure at every vertex."""
    n = len(problem.loops[0][0])
    if n > _MOST_ROWS:
        raise NotCovered(f"{n} states are too many")
    check_work(len(problem.loops) * (8 if problem.slack is not None else 1), n)
    for P in problem.matrices:
        if any(P[i][j] != P[j][i] for i in range(n) for j in range(i)):
            return not_valid("P is not symmetric")
        status = decide(P)
        if not status:
            return _unproven(status, "P")
    for i, loop in enumerate(problem.loops):
        P = problem.matrices[i if problem.slack is not None else 0]
        if problem.measure == "h2":
            answer = _bounded_energy(problem, loop, P)
            if answer is not None:
                return answer
        for name, form in _forms(problem, loop, P):
            status = decide(form)
            if not status:
                return _unproven(status, f"{name} at vertex {i}")
    return valid(f"P and the inequality of the measure at all {len(problem.loops)} vertices are positive definite")


def _unproven(status: bool | None, name: str) -> Answer:
    words = f"{name} is not"
    return not_valid(f"{words} positive definite") if status is False else not_covered(f"{words} proven so")


def _bounded_energy(problem: Problem, loop: Loop, P: Matrix) -> Answer | None:
    _, B, _, D = loop
    if not problem.sample_time and any(entry != 0 for row in D for entry in row):
        return not_valid("a direct path: the H2 norm is infinite")
    PB = times(P, B)
    total = sum((a * b for row, other in zip(B, PB, strict=True) for a, b in zip(row, other, strict=True)), ZERO)
    total += sum((entry**2 for row in D for entry in row), ZERO)
    return None if total < problem.numbers["bound"] ** 2 else not_valid("the trace is not below the bound squared")


def _forms(problem: Problem, loop: Loop, P: Matrix) -> Iterator[tuple[str, Matrix]]:
    """Yield what has to be positive definite at one vertex."""
    A, B, C, D = loop
    sampled, stated, n = problem.sample_time > 0, problem.numbers, len(A)
    PA = times(P, A)
    both, inner = plus(PA, turned(PA)), times(turned(A), PA)
    if problem.measure == "region":
        if "damping" in stated:
            raise NotCovered("a damping ratio")
        if "decay" in stated:
            yield "the decay", _scaled_sum((-1, both), (-2 * stated["decay"], P))
        if "radius" in stated:
            yield "the radius", _scaled_sum((stated["radius"] ** 2, P), (-1, inner))
        return
    rate = stated.get("rate", ZERO)
    if problem.measure == "stability" and problem.slack is not None:
        yield from _slack_forms(problem, A, P, problem.slack, rate)
    elif problem.measure == "stability":
        yield "the decay", (_scaled_sum(((1 - rate) ** 2, P), (-1, inner)) if sampled else
                            _scaled_sum((-1, both), (-2 * rate, P)))
    else:
        own = _scaled_sum((1, P), (-1, inner)) if sampled else _scaled_sum((-1, both))
        own = _scaled_sum((1, own), (-1, times(turned(C), C)))
        if problem.measure == "h2":
            yield "the inequality of the H2 norm", own
            return
        cross = times(turned(A), times(P, B)) if sampled else times(P, B)
        cross = _scaled_sum((-1, cross), (-1, times(turned(C), D)))
        last = _scaled_sum((-1, times(turned(D), D)))
        if sampled:
            last = _scaled_sum((1, last), (-1, times(turned(B), times(P, B))))
        last = [[entry + (stated["bound"] ** 2 if i == j else 0) for j, entry in enumerate(row)]
                for i, row in enumerate(last)]
        yield "the bounded real lemma", [*([*own[i], *cross[i]] for i in range(n)),
                                         *([*column, *row] for column, row in zip(turned(cross), last, strict=True))]


def _slack_forms(problem: Problem, A: Matrix, P: Matrix, slack: Matrix, rate: Fraction
                 ) -> Iterator[tuple[str, Matrix]]:
    n = len(A)
    minus = [[Fraction(-int(i == j)) for j in range(n)] for i in range(n)]
    half = times(slack, [[*row, *other] for row, other in zip(A, minus, strict=True)])
    both, zero = plus(half, turned(half)), [[ZERO] * n for _ in range(n)]
    sampled = problem.sample_time > 0
    for way in _ways(problem.rates) if problem.rates is not None else [[ZERO] * len(problem.matrices)]:
        change = _scaled_sum(*zip(way, problem.matrices, strict=True))
        own = _scaled_sum((-((1 - rate) ** 2), P)) if sampled else _scaled_sum((2 * rate, P), (1, change))
        cross, last = (zero, P) if sampled else (P, zero)
        whole = [[*own[i], *cross[i]] for i in range(n)] + [[*cross[i], *last[i]] for i in range(n)]
        yield "the inequality with the slack matrix", _scaled_sum((-1, whole), (-1, both))


def _ways(rates: list[Fraction]) -> Iterator[list[Fraction]]:
    """Yield the extremes of weights that move at these rates, their sum staying one: all but one at their limits."""
    for free, limit in enumerate(rates):
        for signs in product((1, -1), repeat=len(rates) - 1):
            way = list(map(mul, signs, [*rates[:free], *rates[free + 1:]]))
            rest = -sum(way, ZERO)
            if abs(rest) <= limit:
                yield [*way[:free], rest, *way[free:]]


def turned(a: Matrix) -> Matrix:
    """Return the transpose."""
    return [list(column) for column in zip(*a, strict=True)]


def _scaled_sum(*terms: tuple[Fraction | int, Matrix]) -> Matrix:
    first = terms[0][1]
    return [[sum((factor * form[i][j] for factor, form in terms), ZERO) for j in range(len(first[0]))]
            for i in range(len(first))]
