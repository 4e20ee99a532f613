"""Kind "scheduled": a network of modules under a state feedback of their currents, from an ellipsoid of starts.

I = I0 + F (x - x0). Over the box the loop contracts in V = e'Pe: the hull of its slopes J + b F is built here
(Bernstein points in two temperatures and the current of every module, the ends of links that are not linear). The
ellipsoid lies in the box, its currents in their ranges, and what is left of the heat flows at x0 is too small to push a
trajectory out (proof note, 13).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from flint import arb, arb_mat, fmpq

from robthermal.errors import InputError

from ._corners import Part, first_failure, is_positive
from ._cost import product_up_to
from ._fields import (
    Interval,
    get,
    interval,
    intervals,
    kelvin_interval,
    mapping,
    no_other,
    not_negative,
    positive,
)
from ._flow import control_points
from ._hash import short_hash
from ._kind import Kind, Proof, working_precision
from ._lti import Rows, expect_shape, read_matrix
from ._lyapunov import MOST_ROWS, MOST_WORK, Described, asymmetry, dense, link_slopes
from ._numbers import decimal, exact, name_of, show
from ._residual import Heats, residual_norm
from ._scheduled_sampled import Held, sampled_failure, sampled_gains
from ._system import Region, ThermalSystem, read_region, read_system, say_interval, say_temperatures
from ._uncertain import Parameters, read_parameters, say_subject, worst_system
from ._vertices import Entries

PIECES = (1, 2, 4)  # of every current, the hull refined in turn
_REGION = ("temperature", "current", "parameters", "ambient", "heat", "level", "rate", "offset", "sample_time",
           "sampled_rate")


@dataclass(frozen=True)
class Scheduled:
    """The exact problem of one certificate; ``table``: hash of P."""

    system: ThermalSystem
    nominal: ThermalSystem
    region: Region
    heats: Heats
    gain: Rows
    currents: tuple[fmpq, ...]
    level: fmpq
    rate: fmpq
    offset: fmpq
    matrix: Rows
    table: str
    parameters: Parameters
    held: Held | None


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Scheduled:
    """Return the exact problem, or raise InputError."""
    table, asked, found = mapping(system, "system"), mapping(region, "region"), mapping(evidence, "evidence")
    no_other(mapping(margin, "margin"), [], "margin")
    no_other(asked, _REGION, "region")
    nominal = read_system(table)
    box, parameters = read_region(asked, nominal), read_parameters(asked)
    if any(name.startswith("lumps.") for name, _ in parameters):
        raise InputError("an uncertain capacity", where="region.parameters", expected="links and modules only")
    network = worst_system(nominal, table, parameters, nonlinear=True)
    n, m = len(network.lumps), len(network.modules)
    if not m:
        raise InputError("no module", where="system.modules", expected="at least one, whose current is fed back")
    gain, P = read_matrix(get(table, "gain", "system"), "system.gain"), get(found, "matrix", "evidence")
    expect_shape(gain, m, n, "system.gain")
    matrix = read_matrix(P, "evidence.matrix")
    expect_shape(matrix, n, n, "evidence.matrix")
    temperatures, currents = _read_operating(get(table, "operating", "system"), network)
    return Scheduled(network, nominal, box, _read_heats(asked, network, temperatures), gain, currents,
                     positive(get(asked, "level", "region"), "region.level"),
                     positive(get(asked, "rate", "region"), "region.rate"),
                     not_negative(get(asked, "offset", "region"), "region.offset"), matrix, short_hash(P), parameters,
                     _read_held(asked))


def _read_held(asked: Mapping[str, Any]) -> Held | None:
    if "sample_time" not in asked and "sampled_rate" not in asked:
        return None
    time, rate = (positive(get(asked, key, "region"), f"region.{key}") for key in ("sample_time", "sampled_rate"))
    return Held(time, rate)


def _read_operating(value: Any, system: ThermalSystem) -> tuple[tuple[fmpq, ...], tuple[fmpq, ...]]:
    """Return x0 [K] and I0 [A]."""
    table, found = mapping(value, "system.operating"), []
    no_other(table, ["temperature", "current"], "system.operating")
    for key, names in (("temperature", system.lumps), ("current", tuple(one.name for one in system.modules))):
        where = f"system.operating.{key}"
        given = mapping(get(table, key, "system.operating"), where)
        no_other(given, names, where)
        found.append(tuple(exact(get(given, name, where), f"{where}[{name_of(name)}]") for name in names))
    return found[0], found[1]


def _read_heats(asked: Mapping[str, Any], system: ThermalSystem, temperatures: tuple[fmpq, ...]) -> Heats:
    given = get(asked, "ambient", "region")
    intervals(given, system.ambients, "region.ambient")
    ambient = {name: kelvin_interval(given[name], f"region.ambient[{name_of(name)}]") for name in system.ambients}
    loads = mapping(asked.get("heat", {}), "region.heat")
    no_other(loads, system.lumps, "region.heat")
    heat = {k: interval(loads[name], f"region.heat[{name_of(name)}]") for k, name in enumerate(system.lumps)
            if name in loads}
    return Heats(temperatures, ambient, heat)


def claim(problem: Scheduled, machine: str) -> str:
    """Return the one sentence the data give."""
    lumps = problem.system.lumps
    outside = [f"ambient {name_of(name)} in {say_interval(value)} K" for name, value in problem.heats.ambient.items()]
    outside += [f"heat load on {name_of(lumps[k])} in {say_interval(value)} W" for k, value in
                problem.heats.heat.items()]
    words = f", for all {', '.join(outside)}, constant or not" if outside else ""
    currents = ", ".join(f"{name_of(module.name)} in {say_interval(box)} A" for module, box in
                         zip(problem.system.modules, problem.region.current, strict=True))
    held, rate, fall = "", problem.rate, "falls"
    if problem.held is not None:
        held = f", x sampled every {decimal(problem.held.sample_time)} s and the currents held in between"
        rate, fall = problem.held.rate, "falls from sample to sample"
    return (f"The {say_subject(problem.system, problem.parameters, machine)}, with the state feedback I = I0 + F (x - "
            f"x0) as given{held}{words}, with no other heat: from every start with (x - x0)'P(x - x0) <= "
            f"{decimal(problem.level)}, P of table {problem.table}, this bound is kept for ever, and with it lump "
            f"temperatures {say_temperatures(problem.system, problem.region)} and module currents {currents}; while "
            f"ambients and heat loads are constant, (x - x*)'P(x - x*) {fall} at least as exp(-2 rate t), rate = "
            f"{decimal(rate)} 1/s, x* the only equilibrium there, within {decimal(problem.offset)} K of x0 in "
            "every lump.")


def prove(problem: Scheduled) -> Proof:
    """Prove the decay over the box, then what is inside of it."""
    n = len(problem.matrix)
    if broken := asymmetry(problem.matrix):
        return Proof(False, broken)
    if n > MOST_ROWS:
        return Proof(False, f"{n} lumps: too many, at most {MOST_ROWS}")
    with working_precision():
        P = arb_mat(n, n, [arb(entry) for row in problem.matrix for entry in row])
        if not is_positive(P):
            return Proof(False, "P > 0 fails or cannot be proven")
        try:
            W = P.inv()
        except ZeroDivisionError:
            return Proof(False, "P cannot be inverted")
        if failed := _inside(problem, W) or _held(problem, P, W):
            return Proof(False, failed)
        return _falls(problem, P)


def _inside(problem: Scheduled, W: arb_mat) -> str:
    """Return where the ellipsoid leaves the box, or its currents their ranges; empty where it is proven inside."""
    level, n = arb(problem.level), W.nrows()
    for k, (name, box, at) in enumerate(zip(problem.system.lumps, problem.region.temperature,
                                            problem.heats.temperatures, strict=True)):
        if not _within(level * W[k, k], at, box):
            return f"the ellipsoid leaves the temperatures of lump {name_of(name)}, or cannot be proven not to"
    for module, box, at, row in zip(problem.system.modules, problem.region.current, problem.currents, problem.gain,
                                    strict=True):
        F = arb_mat(1, n, [arb(entry) for entry in row])
        if not _within(level * (F * W * F.transpose())[0, 0], at, box):
            return f"the feedback leaves the currents of {name_of(module.name)}, or cannot be proven not to"
    return ""


def _within(squared: arb, at: fmpq, box: Interval) -> bool:
    room = min(at - box[0], box[1] - at)
    return bool(room >= 0 and squared <= arb(room) ** 2)


def _held(problem: Scheduled, P: arb_mat, W: arb_mat) -> str:
    """Return why the heat left at x0 may push a trajectory out of the ellipsoid, or the equilibrium away."""
    left = residual_norm(problem.nominal, problem.system, problem.heats, problem.currents, P)
    reach = left / arb(problem.rate)
    if not reach**2 <= arb(problem.level):
        return (f"the heat flows left at the operating point are too large for the level: |f(x0, I0)|_P is up to "
                f"{float(left.upper()):.4g}")
    if problem.held is not None:
        gains = sampled_gains(problem.system, problem.region, problem.heats, problem.gain, P, W)
        failed = gains if isinstance(gains, str) else sampled_failure(problem.held, problem.rate, problem.level, left,
                                                                      gains)
        if failed:
            return failed
    for k, name in enumerate(problem.system.lumps):
        if not reach**2 * W[k, k] <= arb(problem.offset) ** 2:
            away = float((reach * W[k, k].sqrt()).upper())
            return (f"the equilibrium may be {away:.4g} K away from the operating point in lump {name_of(name)}, more "
                    f"than {show(problem.offset)} K")
    return ""


def _falls(problem: Scheduled, P: arb_mat) -> Proof:
    """-(P E^-1 (J + bF) + (.)') - 2 rate P > 0 at every corner of the hull of the slopes."""
    n, system = P.nrows(), problem.system
    G = arb_mat(n, n, [arb(entry / capacity) for row in problem.matrix
                       for entry, capacity in zip(row, system.capacity, strict=True)])
    base, nonlinear, missing = link_slopes(system, problem.region, problem.heats.ambient)
    if missing:
        return Proof(False, missing)

    def part(described: Described) -> Part:
        half = G * dense(described[0], n)
        return Part(-(half + half.transpose()), *described[1:])

    start = part((base, "", True)).matrix - P * arb(2 * problem.rate)
    words = f"P E^-1 (J + bF) + (.)' < -2 ({decimal(problem.rate)}) P"
    where = ""
    for pieces in PIECES:
        groups: list[Collection[Described]] = [*nonlinear, *(slopes(problem, k, pieces) for k in
                                                             range(len(system.modules)))]
        most = int(MOST_WORK / (n**3 + 2000))
        if product_up_to([len(group) for group in groups], most) > most:
            return Proof(False, f"{where or words}: too many corners with {pieces} pieces per current")
        failed = first_failure(start, groups, part)
        if failed is None:
            count = math.prod(len(group) for group in groups)
            return Proof(True, f"the ellipsoid is inside of the box, and {words} at all {count} corners of the hull")
        where = f"{words} fails or cannot be proven at {failed.where or 'the links'}"
    return Proof(False, where)


def slopes(problem: Scheduled, k: int, pieces: int) -> list[Described]:
    """Return the shares J + b F of one module at points whose hull holds them all over the box."""
    low, high = problem.region.current[k]
    steps = [low + (high - low) * i / pieces for i in range(pieces + 1)] if low < high else [low, low]
    found: dict[tuple[fmpq, ...], Described] = {}
    for module in problem.system.forms(k):
        hot, cold = problem.region.temperature[module.hot], problem.region.temperature[module.cold]
        for a, b in dict.fromkeys(zip(steps[:-1], steps[1:], strict=True)):
            for point in control_points(module, (hot, cold, (a, b))):
                hh, hc, ch, cc, b_h, b_c = point
                h, c = module.hot, module.cold
                entries: Entries = {(h, h): hh, (h, c): hc, (c, h): ch, (c, c): cc}
                for j, factor in enumerate(problem.gain[k]):
                    for row, slope in ((h, b_h), (c, b_c)):
                        entries[row, j] = entries.get((row, j), fmpq(0)) + slope * factor
                words = f"current {name_of(module.name)} from {show(a)} to {show(b)} A"
                found.setdefault(point, (entries, words, False))
    return list(found.values())


def find_margin(problem: Scheduled) -> dict[str, float]:
    """Return no margin: rate and level are the claim."""
    return {}


SCHEDULED = Kind("scheduled", read, claim, prove, find_margin)
