"""Kind "polytope": one state feedback, or one scheduled controller, for every plant in the hull of some vertices.

The file holds the vertices and the gain or the controllers as they were returned; the loops are formed here, in
rational numbers. With one matrix P every inequality is affine or convex in the loop, so that the vertices decide, and
the plant may vary with time. With one matrix per vertex and a slack matrix it is constant, or its weights move no
faster than stated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from flint import arb, arb_mat, fmpq

from robthermal.errors import InputError

from . import _hinf, _stability
from ._closed_loop_measures import Region, prove_h2, prove_region
from ._fields import get, mapping, no_other, not_negative, positive, sequence
from ._kind import Kind, Proof, working_precision
from ._lti import LinearSystem, Rows, balls, expect_shape, read_matrix
from ._lyapunov import asymmetry
from ._numbers import decimal, name_of
from ._polytope_loops import Loops, read_loops

_KEYS = {"stability": ["rate", "parameter_rates"], "hinf": ["bound"], "h2": ["bound"],
         "region": ["decay", "damping", "radius"]}
_MOST_MOVING = 6  # vertices whose weights may move at stated rates: their extremes are listed


@dataclass(frozen=True)
class Polytope:
    """The exact problem of one certificate."""

    closed: Loops
    measure: str
    rate: fmpq
    bound: fmpq
    poles: Region
    moving: tuple[fmpq, ...] | None
    matrices: tuple[Rows, ...]
    slack: Rows | None

    @property
    def loops(self) -> tuple[LinearSystem, ...]:
        """The closed loop at every vertex."""
        return self.closed.at

    @property
    def states(self) -> int:
        return self.closed.states

    @property
    def discrete(self) -> bool:
        return self.loops[0].discrete


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Polytope:
    """Return the exact problem, or raise InputError."""
    table, asked, found = mapping(system, "system"), mapping(region, "region"), mapping(evidence, "evidence")
    no_other(mapping(margin, "margin"), [], "margin")
    measure = asked.get("measure", "stability")
    if not isinstance(measure, str) or measure not in _KEYS:
        raise InputError(f"measure {name_of(measure)}", where="region.measure", expected=f"one of {list(_KEYS)}")
    no_other(asked, ["measure", *_KEYS[measure]], "region")
    closed = read_loops(table, measure in ("hinf", "h2"))
    count, n, discrete = len(closed.at), closed.states, closed.at[0].discrete
    rate = not_negative(asked.get("rate", 0), "region.rate")
    if discrete and rate >= 1:
        raise InputError("rate of 1 or more", where="region.rate", expected="below 1 for sampled plants")
    bound = positive(get(asked, "bound", "region"), "region.bound") if measure in ("hinf", "h2") else fmpq(0)
    poles = _read_region(asked, discrete) if measure == "region" else Region(None, None, None)
    if "matrix" in found:
        no_other(found, ["matrix"], "evidence")
        matrices: tuple[Rows, ...] = (_square(found["matrix"], n, "evidence.matrix"),)
        slack, moving = None, None
        if "parameter_rates" in asked:
            raise InputError("rates of the weights with one matrix, which bears any rate", where="region",
                             expected="evidence.matrices and evidence.slack, or no rates")
    else:
        if measure != "stability":
            raise InputError("one matrix per vertex", where="evidence", expected="one matrix for this measure")
        no_other(found, ["matrices", "slack"], "evidence")
        listed = sequence(get(found, "matrices", "evidence"), "evidence.matrices")
        if len(listed) != count:
            raise InputError(f"{len(listed)} matrices", where="evidence.matrices", expected=f"{count}, one per vertex")
        matrices = tuple(_square(item, n, f"evidence.matrices[{k}]") for k, item in enumerate(listed))
        slack = read_matrix(get(found, "slack", "evidence"), "evidence.slack")
        expect_shape(slack, 2 * n, n, "evidence.slack")
        moving = _read_rates(asked["parameter_rates"], count, discrete) if "parameter_rates" in asked else None
    return Polytope(closed, measure, rate, bound, poles, moving, matrices, slack)


def _square(value: Any, n: int, where: str) -> Rows:
    matrix = read_matrix(value, where)
    expect_shape(matrix, n, n, where)
    return matrix


def _read_rates(value: Any, count: int, discrete: bool) -> tuple[fmpq, ...]:
    where = "region.parameter_rates"
    items = tuple(not_negative(item, where) for item in sequence(value, where))
    if discrete or len(items) != count or count > _MOST_MOVING:
        raise InputError(f"{len(items)} rates for {count} vertices", where=where,
                         expected=f"one per vertex of continuous plants, at most {_MOST_MOVING} vertices")
    return items


def _read_region(table: Mapping[str, Any], discrete: bool) -> Region:
    known = {key: positive(table[key], f"region.{key}") for key in _KEYS["region"] if key in table}
    proper = set(known) == {"radius"} and known["radius"] <= 1 if discrete else {"decay", "damping"} & set(known)
    if not proper or known.get("damping", fmpq(0)) >= 1:
        raise InputError("no region in which a loop is stable", where="region",
                         expected="decay, or a damping ratio below 1; sampled a radius of at most 1, nothing else")
    return Region(known.get("decay"), known.get("damping"), known.get("radius"))


def claim(problem: Polytope, machine: str) -> str:
    """Return the one sentence the data give."""
    closed = problem.closed
    time = f"sampled at {decimal(problem.loops[0].sample_time)} s" if problem.discrete else "continuous"
    who = f"The state feedback u = F x as given, {time},"
    sizes = (f"{_plural(closed.plant_states, 'state')}, {_plural(closed.inputs, 'input')}, the last {closed.n_ctrl} "
             "for control")
    sizes += f", {_plural(closed.outputs, 'output')}" if closed.outputs else ""
    if closed.measured:
        who = (f"The controller u = K(w) y, {time}, the average of {_plural(len(problem.loops), 'controller')} as "
               "given with the weights w of the plant,")
        sizes += (f", the last {closed.measured} measured; controllers of "
                  f"{_plural(closed.states - closed.plant_states, 'state')}; x: states of plant and controller")
    return (f"{who} stabilizes {_say_plants(problem)} in the convex hull of "
            f"{_plural(len(problem.loops), 'vertex', 'vertices')} as given ({sizes}) (machine {machine}), nominal "
            f"parameters: {_say_measure(problem)}.")


def _say_plants(problem: Polytope) -> str:
    if problem.measure == "region" or (problem.slack is not None and problem.moving is None):
        return "every constant plant"
    if problem.moving is None:
        return "every plant, constant or varying with time in any way,"
    return ("every plant, constant or varying with time, its weights of the vertices no faster than "
            f"{', '.join(decimal(rate) for rate in problem.moving)} 1/s,")


def _say_measure(problem: Polytope) -> str:
    rate, bound = problem.rate, decimal(problem.bound)
    if problem.measure == "stability":
        form = "x'Px" if problem.slack is None else "x'P(w)x, P(w) affine in the weights w,"
        if problem.discrete:
            return f"{form} " + (f"shrinks at least by the factor {decimal(1 - rate)}² per sample" if rate > 0 else
                                 "shrinks strictly with every sample")
        return f"{form} " + (f"falls at least as exp(-2 rate t), rate = {decimal(rate)} 1/s" if rate > 0 else
                             "falls strictly")
    if problem.measure == "hinf":
        return f"the H-infinity norm, of a varying plant the L2 gain, from w to z stays below {bound}"
    if problem.measure == "h2":
        return ("the H2 norm, of a varying plant the root mean square of z in the long run under white noise w of unit "
                f"intensity, stays below {bound}")
    decay, damping, radius = problem.poles.decay, problem.poles.damping, problem.poles.radius
    words = [f"real parts below {decimal(-decay)} 1/s"] if decay is not None else []
    words += [f"damping ratios above {decimal(damping)}"] if damping is not None else []
    unit = "" if problem.discrete else " 1/s"
    words += [f"absolute values below {decimal(radius)}{unit}"] if radius is not None else []
    return f"all eigenvalues of its loop have {' and '.join(words)}"


def _plural(count: int, word: str, many: str = "") -> str:
    return f"{count} {word if count == 1 else many or word + 's'}"


def prove(problem: Polytope) -> Proof:
    """Prove the inequality of the measure at every vertex, with the same matrix or with the slack matrix."""
    if problem.slack is not None:
        return _prove_slack(problem, problem.slack)
    P, words = problem.matrices[0], ""
    for i, loop in enumerate(problem.loops):
        if problem.measure == "stability":
            proof = _stability.prove(_stability.Stability(loop, problem.rate, "lyapunov", P))
        elif problem.measure == "hinf":
            proof = _hinf.prove(_hinf.Hinf(loop, problem.bound, None, None, "bounded_real", P, ""))
        elif problem.measure == "h2":
            proof = prove_h2(loop, problem.bound, P)
        else:
            proof = prove_region(loop, problem.poles, P)
        if not proof.valid:
            return Proof(False, f"vertex {i}: {proof.reason}")
        words = proof.reason
    return Proof(True, f"{words}, with one P at all {_plural(len(problem.loops), 'vertex', 'vertices')}")


def _prove_slack(problem: Polytope, slack: Rows) -> Proof:
    """P_i > 0 and [2 rate P_i + P', P_i; P_i, 0] + G [A_i, -1] + (G [A_i, -1])' < 0 at every vertex.

    Sampled: [-(1 - rate)² P_i, 0; 0, P_i] in the place of the first. Between the vertices the inequality is their
    average; on (x, x') with x' = A x the terms with G vanish. P' is what moving weights make of P(w), at its extremes.
    """
    n = problem.states
    for matrix in problem.matrices:
        if why := asymmetry(matrix):
            return Proof(False, why)
    with working_precision():
        G, forms = balls(slack, 2 * n, n), [balls(matrix, n, n) for matrix in problem.matrices]
        still = (fmpq(0),) * len(forms)
        moved = [sum((form * arb(w) for form, w in zip(forms, way, strict=True)), arb_mat(n, n))
                 for way in (extreme_ways(problem.moving) if problem.moving else [still])]
        for i, (loop, P) in enumerate(zip(problem.loops, forms, strict=True)):
            if not _stability.positive(P):
                return Proof(False, f"vertex {i}: P > 0 fails or cannot be proven")
            slopes = G * _beside(balls(loop.A, n, n), arb_mat(n, n, -1))
            both = slopes + slopes.transpose()
            for change in moved:
                if problem.discrete:
                    own = _hinf.join(P * arb(-((1 - problem.rate) ** 2)), arb_mat(n, n), P)
                else:
                    own = _hinf.join(P * arb(2 * problem.rate) + change, P, arb_mat(n, n))
                if not _stability.positive(-(own + both)):
                    return Proof(False, f"vertex {i}: the inequality with the slack matrix fails or cannot be proven")
    return Proof(True, f"P > 0 and the inequality with the slack matrix at all {len(forms)} vertices")


def extreme_ways(rates: Sequence[fmpq]) -> set[tuple[fmpq, ...]]:
    """Return points whose hull holds every w' with |w'_i| <= rates_i and sum zero: all but one at their limits."""
    found = set()
    for free in range(len(rates)):
        for signs in product((1, -1), repeat=len(rates) - 1):
            others = [sign * rate for sign, rate in zip(signs, (*rates[:free], *rates[free + 1:]), strict=True)]
            rest = -sum(others, fmpq(0))
            if abs(rest) <= rates[free]:
                found.add((*others[:free], rest, *others[free:]))
    return found


def _beside(left: arb_mat, right: arb_mat) -> arb_mat:
    return arb_mat([[*a, *b] for a, b in zip(left.tolist(), right.tolist(), strict=True)])


def find_margin(problem: Polytope) -> dict[str, float]:
    """Return no margin: rate and bound are the claim."""
    return {}


POLYTOPE = Kind("polytope", read, claim, prove, find_margin)
