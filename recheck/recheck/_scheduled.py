"""Kind "scheduled": currents fed back from the temperatures, I = I0 + F (x - x0), from an ellipsoid of starts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

from ._definite import Scaling
from ._document import get, interval, intervals, kelvin, mapping, matrix, not_negative, only, positive
from ._exact import ONE, ZERO, Interval, Malformed, NotCovered, ends, exact, power, short
from ._lyapunov import Share, check_work, decide, first_failure, link_shares
from ._result import Answer, not_covered, not_valid, valid
from ._scheduled_sampled import held_gains, held_holds
from ._thermal import Form, Link, Module, Network, check_cost
from ._uncertain import read_network
from ._vertices import Entries, add

_REGION = ("temperature", "current", "parameters", "ambient", "heat", "level", "rate", "offset", "sample_time",
           "sampled_rate")
_PIECES = (1, 2, 4)
_MOST_LUMPS = 60
Matrix = list[list[Fraction]]


@dataclass(frozen=True)
class Problem:
    """What one certificate claims."""

    network: Network
    ambient: dict[str, Interval]
    heat: dict[int, Interval]
    gain: Matrix
    temperatures: list[Fraction]
    currents: list[Fraction]
    level: Fraction
    rate: Fraction
    offset: Fraction
    matrix: Matrix
    sample_time: Fraction | None
    sampled_rate: Fraction | None


def read(parts: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem of the sections of a certificate."""
    system, region, evidence = parts["system"], parts["region"], parts["evidence"]
    only(parts["margin"], [], "margin")
    only(region, _REGION, "region")
    network = read_network(system, region, gains=True)
    if any(name.startswith("lumps.") for name in network.parameters):
        raise Malformed("region.parameters: an uncertain capacity")
    n, m = len(network.lumps), len(network.modules)
    if not m:
        raise Malformed("system.modules: none")
    given = mapping(get(region, "ambient", "region"), "region.ambient")
    intervals(given, network.ambients, "region.ambient")
    loads = mapping(region.get("heat", {}), "region.heat")
    only(loads, network.lumps, "region.heat")
    operating = mapping(get(system, "operating", "system"), "system.operating")
    only(operating, ["temperature", "current"], "system.operating")
    points = []
    for key, names in (("temperature", network.lumps), ("current", tuple(one.name for one in network.modules))):
        where = f"system.operating.{key}"
        table = mapping(get(operating, key, "system.operating"), where)
        only(table, names, where)
        points.append([exact(get(table, name, where), f"{where}[{short(name)}]") for name in names])
    held = "sample_time" in region or "sampled_rate" in region
    time, claimed = ((positive(get(region, key, "region"), f"region.{key}") if held else None)
                     for key in ("sample_time", "sampled_rate"))
    return Problem(network, {name: kelvin(given[name], "region.ambient") for name in network.ambients},
                   {k: interval(loads[name], "region.heat") for k, name in enumerate(network.lumps) if name in loads},
                   matrix(get(system, "gain", "system"), m, n, "system.gain"), points[0], points[1],
                   positive(get(region, "level", "region"), "region.level"),
                   positive(get(region, "rate", "region"), "region.rate"),
                   not_negative(get(region, "offset", "region"), "region.offset"),
                   matrix(get(evidence, "matrix", "evidence"), n, n, "evidence.matrix"), time, claimed)


def check(problem: Problem) -> Answer:
    """Decide P > 0, what is inside of the box, the heat left at x0, and the decay."""
    P, n = problem.matrix, len(problem.matrix)
    if n > _MOST_LUMPS:
        raise NotCovered(f"{n} lumps are too many")
    check_cost(problem.network)
    if any(P[i][j] != P[j][i] for i in range(n) for j in range(i)):
        return not_valid("P is not symmetric")
    status = decide(P)
    if not status:
        return not_valid("P is not positive definite") if status is False else not_covered("P > 0 is not proven")
    for name, vector, room in _reaches(problem):
        if room < 0:
            return not_valid(f"the operating point is outside of the range of {short(name)}")
        status = _shorter(P, vector, room**2 / problem.level)
        if not status:
            words = f"the ellipsoid leaves the range of {short(name)}"
            return not_valid(words) if status is False else not_covered(f"{words}, or not")
    left = _left(problem)
    reach = left / problem.rate
    if reach**2 > problem.level:
        return not_covered("the heat left at the operating point is not bounded sharply enough")
    if not _sampled(problem, left):
        return not_covered("what a held current adds is not bounded sharply enough")
    for k in range(n):
        if reach and not _shorter(P, [Fraction(int(k == j)) for j in range(n)], (problem.offset / reach) ** 2):
            return not_covered("how far the equilibrium is away is not bounded sharply enough")
    return _falls(problem)


def _sampled(problem: Problem, left: Fraction) -> bool:
    if problem.sample_time is None or problem.sampled_rate is None:
        return True
    network = problem.network
    base, nonlinear = link_shares(network, problem.ambient)
    groups, inputs = [[base], *nonlinear], []
    for k, module in enumerate(network.modules):
        h, c = module.hot, module.cold
        box = network.temperature[h], network.temperature[c], network.current[k]
        points = [point for form in module.forms for point in _bernstein(module, form, box)]
        groups.append([dict(zip(((h, h), (h, c), (c, h), (c, c)), point[:4], strict=True)) for point in points])
        inputs.append((h, c, [(point[4], point[5]) for point in points]))
    gains = held_gains(problem.matrix, [own[0] for own in network.capacity], problem.gain, groups, inputs)
    return held_holds(problem.sample_time, problem.sampled_rate, problem.rate, problem.level, left, gains)


def _reaches(problem: Problem) -> Iterator[tuple[str, list[Fraction], Fraction]]:
    """Yield every temperature and current as a linear function of x - x0, and its room to both sides."""
    network, n = problem.network, len(problem.matrix)
    for k, name in enumerate(network.lumps):
        low, high = network.temperature[k]
        at = problem.temperatures[k]
        yield name, [Fraction(int(k == j)) for j in range(n)], min(at - low, high - at)
    for module, at, (low, high), row in zip(network.modules, problem.currents, network.current, problem.gain,
                                            strict=True):
        yield module.name, row, min(at - low, high - at)


def _shorter(P: Matrix, vector: Sequence[Fraction], limit: Fraction) -> bool | None:
    """Decide v'P^-1 v < limit: whether [P, v; v', limit] is positive definite."""
    if not any(vector):
        return limit >= 0
    return decide([*([*row, value] for row, value in zip(P, vector, strict=True)), [*vector, limit]])


def _length(P: Matrix, vector: Sequence[Fraction]) -> Fraction:
    """Return an upper bound of √(v'Pv)."""
    squared = sum((a * entry * b for a, row in zip(vector, P, strict=True)
                   for entry, b in zip(row, vector, strict=True) if a and b), ZERO)
    return power(max(squared, ZERO), Fraction(1, 2))[1]


def _left(problem: Problem) -> Fraction:
    """Return a bound of √(r'Pr), r = E^-1 f(x0, I0): what links, modules and loads give, each around its middle."""
    network, P, n = problem.network, problem.matrix, len(problem.matrix)
    total, spread = [ZERO] * n, ZERO

    def put(way: Sequence[Fraction], low: Fraction, high: Fraction) -> Fraction:
        for i, entry in enumerate(way):
            total[i] += entry * (low + high) / 2
        return (high - low) / 2 * _length(P, way) if high > low else ZERO

    for link in network.links:
        if link.lumps:
            way = [ZERO] * n
            for sign, node in zip((1, -1), link.nodes, strict=True):
                if isinstance(node, int):
                    way[node] = sign / network.capacity[node][0]
            spread += put(way, *_flow(problem, link))
    for k, box in problem.heat.items():
        spread += put([ONE / network.capacity[i][0] if i == k else ZERO for i in range(n)], *box)
    for module, current in zip(network.modules, problem.currents, strict=True):
        middle = _heats(problem, module, module.nominal, current)
        total = [a + b for a, b in zip(total, middle, strict=True)]
        spread += max(_length(P, [a - b for a, b in zip(_heats(problem, module, form, current), middle, strict=True)])
                      for form in module.forms)
    return _length(P, total) + spread


def _flow(problem: Problem, link: Link) -> Interval:
    """Return bounds of the heat into the first node of a link [W]."""
    points = [[problem.temperatures[node]] if isinstance(node, int) else ends(problem.ambient[node])
              for node in link.nodes]
    found: list[Fraction] = []
    for a, b, g, k, c in product(*points, ends(link.conductance), ends(link.gain), ends(link.radiation)):
        steady = g * (b - a) + c * (b**4 - a**4)
        found += [steady + k * (b - a) * factor for factor in power(abs(b - a), link.exponent)]
    return min(found), max(found)


def _heats(problem: Problem, module: Module, form: Form, current: Fraction) -> list[Fraction]:
    hot, cold = problem.temperatures[module.hot], problem.temperatures[module.cold]
    S, R, K = module.at(form, (hot + cold) / 2)
    found = [ZERO] * len(problem.matrix)
    capacity = problem.network.capacity
    found[module.hot] = (S * hot * current + R * current**2 / 2 + K * (cold - hot)) / capacity[module.hot][0]
    found[module.cold] = (-S * cold * current + R * current**2 / 2 + K * (hot - cold)) / capacity[module.cold][0]
    return found


def _falls(problem: Problem) -> Answer:
    """Decide -(P E^-1 (J + bF) + (.)') - 2 rate P > 0 at corners of the hull, currents cut finer where it fails."""
    network, P, n = problem.network, problem.matrix, len(problem.matrix)
    G = [[entry / network.capacity[j][0] for j, entry in enumerate(row)] for row in P]
    base, nonlinear = link_shares(network, problem.ambient)
    start: Entries = {(i, j): -2 * problem.rate * P[i][j] for i in range(n) for j in range(n)}
    _spread(start, G, base)
    scaling = Scaling([start[k, k] for k in range(n)])

    def share(entries: Entries) -> Share:
        form: Entries = {}
        _spread(form, G, entries)
        return Share(scaling.matrix(form), 1)

    links = [[share(entries) for entries in both] for both in nonlinear]
    for pieces in _PIECES:
        points = [list(dict.fromkeys(_corners(problem, k, pieces))) for k in range(len(network.modules))]
        total = math.prod([len(own) for own in points]) * math.prod([len(both) for both in links])
        check_work(total, n)
        modules = [[share(_entries(problem, k, point)) for point in own] for k, own in enumerate(points)]
        if first_failure(Share(scaling.matrix(start), 1), [*links, *modules]) is None:
            return valid(f"the ellipsoid is inside of the box, and V falls at all {total} corners of the hull")
    return not_covered("the decay is not proven at a corner of the hull")


def _spread(form: Entries, G: Matrix, entries: Entries) -> None:
    """Add -(G J + J'G') of some entries of J."""
    for (i, j), value in entries.items():
        if value:
            for k, row in enumerate(G):
                if row[i]:
                    add(form, (k, j), -row[i] * value)
                    add(form, (j, k), -row[i] * value)


def _entries(problem: Problem, k: int, point: tuple[Fraction, ...]) -> Entries:
    """Return J + b F of one module."""
    module = problem.network.modules[k]
    h, c = module.hot, module.cold
    found: Entries = dict(zip(((h, h), (h, c), (c, h), (c, c)), point[:4], strict=True))
    for row, slope in ((h, point[4]), (c, point[5])):
        for j, factor in enumerate(problem.gain[k]):
            add(found, (row, j), slope * factor)
    return found


def _corners(problem: Problem, k: int, pieces: int) -> Iterator[tuple[Fraction, ...]]:
    """Yield Bernstein coefficients of J and ∂f/∂I of one module over its box, the currents cut into pieces."""
    network = problem.network
    module, (low, high) = network.modules[k], network.current[k]
    marks = [low + (high - low) * i / pieces for i in range(pieces + 1)]
    for form in module.forms:
        for piece in dict.fromkeys(zip(marks[:-1], marks[1:], strict=True)):
            yield from _bernstein(module, form, (network.temperature[module.hot], network.temperature[module.cold],
                                                 piece))


def _bernstein(module: Module, form: Form, box: Sequence[Interval]) -> Iterator[tuple[Fraction, ...]]:
    """Yield the values of the polar form at all pairs of ends: p(a, b) = 2 p(mean) - (p(a) + p(b))/2 in every axis."""
    pairs = [((low, low), (low, high), (high, high)) if low < high else ((low, low),) for low, high in box]
    for chosen in product(*pairs):
        terms: list[tuple[Fraction, list[Fraction]]] = [(ONE, [])]
        for a, b in chosen:
            parts = [(ONE, a)] if a == b else [(Fraction(2), (a + b) / 2), (Fraction(-1, 2), a), (Fraction(-1, 2), b)]
            terms = [(w * weight, [*place, at]) for w, place in terms for weight, at in parts]
        values = [[weight * value for value in _slopes(module, form, *place)] for weight, place in terms]
        yield tuple(sum(column, ZERO) for column in zip(*values, strict=True))


def _slopes(module: Module, form: Form, hot: Fraction, cold: Fraction, current: Fraction) -> list[Fraction]:
    S, R, _ = module.at(form, (hot + cold) / 2)
    h, c, slopes = module.hot, module.cold, module.jacobian(form, hot, cold)
    found = [a + current * (b + current * q) for a, b, q in (slopes[h, h], slopes[h, c], slopes[c, h], slopes[c, c])]
    return [*found, S * hot + R * current, R * current - S * cold]
