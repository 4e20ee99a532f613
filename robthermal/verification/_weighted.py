"""Methods "sum" and "max": weighted column or row sums of the Jacobian, bounded in exact rational arithmetic.

For lump j with weight w_j, "sum" needs w_j J_jj + sum_i w_i |J_ij| <= -rate w_j E_j and "max" the same with J_ji.
For fixed current every entry is affine in the temperatures, for fixed temperatures it is a quadratic in the current,
and |a| = max(a, -a): the largest value lies at temperature vertices, where the quadratics are maximized exactly.
Given x_j, the terms of different partners are independent, so partners are maximized one by one (proof note, 2).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from flint import fmpq

from ._contraction_problem import Contraction
from ._cost import too_many_corners
from ._kind import Proof
from ._numbers import name_of, round_down, show
from ._slopes import exchange_slope, least_ambient_slope, radiation_slope
from ._system import Link, Module, Quadratic, peak
from ._vertices import ends

_ENTRIES = {"hh": 0, "hc": 1, "cc": 2, "ch": 3}


@dataclass
class _Pair:
    """Everything between two lumps."""

    conductance: fmpq = field(default_factory=lambda: fmpq(0))
    nonlinear: list[Link] = field(default_factory=list)
    modules: list[int] = field(default_factory=list)


def prove(problem: Contraction) -> Proof:
    """Decide the inequality of every lump exactly, and the stored margin with it."""
    names = problem.system.lumps
    many = too_many_corners(problem.system, problem.region, 16, problem.weights)  # 2 lumps, 2 ends each, 2 signs
    if many:
        return Proof(False, f"method {problem.method}: {many}")
    for name, weight in zip(names, problem.weights, strict=True):
        if weight <= 0:
            return Proof(False, f"weight of lump {name_of(name)} is {show(weight)}, not positive")
    j, least, where = _worst(problem)
    line = "column" if problem.method == "sum" else "row"
    if least < 0 or (least == 0 and problem.rate == 0):
        return Proof(False, f"method {problem.method}: the weighted {line} of lump {name_of(names[j])} reaches "
                            f"{show(-least - problem.rate)} 1/s, not {'<=' if problem.rate > 0 else '<'} "
                            f"-rate = {show(-problem.rate)} 1/s, at {where}", {"rate": round_down(least)})
    if problem.margin > least:
        return Proof(False, f"stored margin {show(problem.margin)} 1/s is larger than the recomputed "
                            f"{show(least)} 1/s of the {line} of lump {name_of(names[j])}, at {where}",
                     {"rate": round_down(least)})
    return Proof(True, f"every weighted {line} is bounded exactly over the box", {"rate": round_down(least)})


def largest_margin(problem: Contraction) -> fmpq:
    """Return the least of -(weighted line)/(w_j E_j) - rate over lumps and box [1/s]."""
    return _worst(problem)[1]


def lines(problem: Contraction) -> list[tuple[fmpq, str]]:
    """Return the largest weighted line of every lump [W/K times the weights], and where it is reached."""
    losses, pairs = _collect(problem)
    found = []
    for j, weight in enumerate(problem.weights):
        value, where = _line(problem, j, pairs[j])
        found.append((value - losses[j] * weight, where))
    return found


def _worst(problem: Contraction) -> tuple[int, fmpq, str]:
    worst: tuple[int, fmpq, str] | None = None
    for j, (value, where) in enumerate(lines(problem)):
        margin = -value / (problem.weights[j] * problem.system.capacity[j]) - problem.rate
        if worst is None or margin < worst[1]:
            worst = (j, margin, where)
    if worst is None:
        raise ValueError("a system has at least one lump")
    return worst


def _collect(problem: Contraction) -> tuple[list[fmpq], list[dict[int, _Pair]]]:
    """Sort links and modules by lump and partner; the links to ambients only lose heat."""
    losses = [fmpq(0) for _ in problem.system.lumps]
    pairs: list[dict[int, _Pair]] = [{} for _ in problem.system.lumps]
    for link in problem.system.links:
        a, b = link.nodes
        if isinstance(a, int) and isinstance(b, int):
            shared = _between(pairs, a, b)
            shared.conductance += link.conductance
            if link.convects or link.radiates or link.spread != 0:
                shared.nonlinear.append(link)
        else:
            for lump in (node for node in (a, b) if isinstance(node, int)):
                losses[lump] += least_ambient_slope(link, lump, problem.region)
    for k, module in enumerate(problem.system.modules):
        _between(pairs, module.hot, module.cold).modules.append(k)
    return losses, pairs


def _between(pairs: list[dict[int, _Pair]], a: int, b: int) -> _Pair:
    """Return the one pair object that both lumps share."""
    if b not in pairs[a]:
        pairs[a][b] = pairs[b][a] = _Pair()
    return pairs[a][b]


def _line(problem: Contraction, j: int, partners: dict[int, _Pair]) -> tuple[fmpq, str]:
    """Return the largest weighted line of lump j without its ambient losses [W/K], and where it is reached."""
    quiet = fmpq(0)
    for p, pair in partners.items():
        if not pair.modules:
            quiet += _links(problem, j, p, pair, 1)
    busy = {p: pair for p, pair in partners.items() if pair.modules}
    best: tuple[fmpq, list[str]] | None = None
    for own in ends(problem.region.temperature[j]) if busy else [problem.region.temperature[j][0]]:
        total, where = quiet, [f"{name_of(problem.system.lumps[j])} = {show(own)} K"]
        for p, pair in busy.items():
            value, words = _partner(problem, j, p, pair, own)
            total, where = total + value, where + words
        if best is None or total > best[0]:
            best = (total, where)
    if best is None:
        raise ValueError("an interval has at least one end")
    return best[0], ", ".join(best[1])


def _partner(problem: Contraction, j: int, p: int, pair: _Pair, own: fmpq) -> tuple[fmpq, list[str]]:
    """Return the largest share of one partner over its temperature, the currents and the sign of J_jp."""
    best: tuple[fmpq, list[str]] | None = None
    for other in ends(problem.region.temperature[p]):
        for sign in (1, -1):
            value = _links(problem, j, p, pair, sign)
            words = [f"{name_of(problem.system.lumps[p])} = {show(other)} K"]
            for k in pair.modules:
                top, current = max((peak(_share(problem, module, j, p, own, other, sign), problem.region.current[k])
                                    for module in problem.system.forms(k)), key=lambda pair: pair[0])
                value += top
                words.append(f"current {name_of(problem.system.modules[k].name)} = {show(current)} A")
            if best is None or value > best[0]:
                best = (value, words)
    if best is None:
        raise ValueError("an interval has at least one end")
    return best


def _share(problem: Contraction, module: Module, j: int, p: int, own: fmpq, other: fmpq, sign: int) -> Quadratic:
    """Return w_j J_jj + sign w_p J_pj (sum) or J_jp (max) of one module as a quadratic in its current."""
    hot = module.hot == j
    entries = module.entries(own, other) if hot else module.entries(other, own)
    column = problem.method == "sum"
    diagonal = entries[_ENTRIES["hh" if hot else "cc"]]
    beside = entries[_ENTRIES["ch" if hot == column else "hc"]]
    w, v = problem.weights[j], sign * problem.weights[p]
    return (w * diagonal[0] + v * beside[0], w * diagonal[1] + v * beside[1], w * diagonal[2] + v * beside[2])


def _links(problem: Contraction, j: int, p: int, pair: _Pair, sign: int) -> fmpq:
    """Return the largest share of the links between j and p, the off-diagonal taken with one sign [W/K]."""
    w, v = problem.weights[j], sign * problem.weights[p]
    total = (v - w) * pair.conductance
    own, other = problem.region.temperature[j], problem.region.temperature[p]
    for link in pair.nonlinear:
        total += max((v - w) * slope for slope in exchange_slope(link, own, other))
        here, there = radiation_slope(link, own), radiation_slope(link, other)
        if problem.method == "sum":  # row p, column j also holds the slope at j
            total += max((v - w) * slope for slope in here)
        else:
            total += max(-w * slope for slope in here) + max(v * slope for slope in there)
    return total
