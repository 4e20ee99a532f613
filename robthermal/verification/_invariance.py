"""Kind "invariance": no trajectory leaves a temperature box, whatever currents, ambients and loads do in theirs.

On every face of the box the heat flow into its lump must not point outwards (Nagumo). Each flow is bounded over the
rest of the box in exact rational arithmetic (proof note, 5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import fmpq

from ._cost import too_many_corners
from ._fields import Interval, get, interval, intervals, kelvin_interval, mapping, margin_of
from ._heaters import Heater, read_heaters, say_heaters
from ._kind import Kind, Proof, working_precision
from ._numbers import name_of, round_down, show
from ._slopes import power
from ._system import (
    Link,
    Module,
    Quadratic,
    Region,
    ThermalSystem,
    peak,
    read_region,
    read_system,
    say_interval,
    say_region,
)
from ._uncertain import Parameters, read_parameters, say_subject, worst_system

_PIECES = 16


@dataclass(frozen=True)
class Invariance:
    """The exact problem of one invariance certificate."""

    system: ThermalSystem
    region: Region
    ambient: dict[str, Interval]
    heat: dict[int, Interval]
    margin: fmpq
    parameters: Parameters = ()
    heaters: tuple[Heater, ...] = ()


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Invariance:
    """Return the exact problem, or raise InputError."""
    nominal, table = read_system(system, heaters=True), mapping(region, "region")
    parameters = read_parameters(table)
    heaters, others = read_heaters(system, table, nominal.lumps, parameters)
    network = worst_system(nominal, system, others, nonlinear=True)
    mapping(evidence, "evidence")
    given = get(table, "ambient", "region")
    intervals(given, network.ambients, "region.ambient")
    ambient = {name: kelvin_interval(given[name], f"region.ambient[{name_of(name)}]") for name in network.ambients}
    loads = mapping(table.get("heat", {}), "region.heat")
    intervals({name: loads.get(name, [0, 0]) for name in {**dict.fromkeys(network.lumps), **loads}},
              network.lumps, "region.heat")
    heat = {k: interval(loads[name], f"region.heat[{name_of(name)}]")
            for k, name in enumerate(network.lumps) if name in loads}
    return Invariance(network, read_region(table, network), ambient, heat, margin_of(margin, "heat"), parameters,
                      heaters)


def claim(problem: Invariance, machine: str) -> str:
    """Return the one sentence the data give."""
    lumps = problem.system.lumps
    inputs = [f"ambient {name_of(name)} in {say_interval(value)} K" for name, value in problem.ambient.items()]
    inputs += [f"heat load on {name_of(lumps[k])} in {say_interval(value)} W" for k, value in problem.heat.items()]
    words = f", for all {', '.join(inputs)}" if inputs else ""
    box = say_region(problem.system, problem.region) + say_heaters(problem.heaters)
    return (f"The {say_subject(problem.system, problem.parameters, machine)}, never leaves the box of {box}, once its "
            f"temperatures are in it{words}, with no other heat.")


def prove(problem: Invariance) -> Proof:
    """Bound the heat flow on both faces of every lump."""
    many = too_many_corners(problem.system, problem.region, 4 * (_PIECES + 2))  # 2 lumps, 2 faces
    if many:
        return Proof(False, many)
    with working_precision():
        lump, face, flow = _worst(problem)
    words = (f"heat flow {'out of' if face == 'upper' else 'into'} lump {name_of(problem.system.lumps[lump])} at its "
             f"{face} face ({show(problem.region.temperature[lump][1 if face == 'upper' else 0])} K)")
    margins = {"heat": round_down(flow)}
    if flow < 0:
        return Proof(False, f"{words} can be {show(flow)} W: it must not be negative", margins)
    if problem.margin > flow:
        return Proof(False, f"stored margin {show(problem.margin)} W is larger than the recomputed {show(flow)} W: "
                            f"{words}", margins)
    return Proof(True, f"least {words} is at least {round_down(flow)!r} W", margins)


def find_margin(problem: Invariance) -> dict[str, float]:
    """Return the least inward heat flow, rounded to the safe side [W]."""
    with working_precision():
        flow = round_down(_worst(problem)[2])
    return {"heat": float(f"{flow * 0.999:.4g}") if flow > 0 else 0.0}


def _worst(problem: Invariance) -> tuple[int, str, fmpq]:
    links: list[list[Link]] = [[] for _ in problem.system.lumps]
    modules: list[list[int]] = [[] for _ in problem.system.lumps]
    for link in problem.system.links:
        for lump in (node for node in link.nodes if isinstance(node, int)):
            links[lump].append(link)
    for k, module in enumerate(problem.system.modules):
        modules[module.hot].append(k)
        modules[module.cold].append(k)
    flows = ((k, face, -_largest(problem, k, sign, links[k], modules[k]))
             for k in range(len(problem.system.lumps)) for face, sign in (("upper", 1), ("lower", -1)))
    return min(flows, key=lambda item: item[2])


def _largest(problem: Invariance, lump: int, sign: int, links: list[Link], own_modules: list[int]) -> fmpq:
    """Return the largest of sign times the heat into a lump [W], the lump at its upper (+1) or lower (-1) face."""
    upper = 1 if sign > 0 else 0
    own = problem.region.temperature[lump][upper]
    total = sign * problem.heat[lump][upper] if lump in problem.heat else fmpq(0)
    total += sum((sign * heater.heat(own)[upper] for heater in problem.heaters if heater.lump == lump), fmpq(0))
    modules: dict[int, list[int]] = {}
    for k in own_modules:
        module = problem.system.modules[k]
        modules.setdefault(module.cold if module.hot == lump else module.hot, []).append(k)
    conductance = dict.fromkeys(modules, (fmpq(0), fmpq(0)))
    for link in links:
        other = link.nodes[1] if link.nodes[0] == lump else link.nodes[0]
        far = problem.region.temperature[other] if isinstance(other, int) else problem.ambient[other]
        # Heat through a link grows with the other end's temperature: its extreme is at that end's extreme.
        total += _bent_heat(link, own, far[upper], sign)
        low, high = link.conductance, link.conductance + link.spread
        if isinstance(other, int) and other in modules:  # shares its temperature with the module: bounded together
            conductance[other] = (conductance[other][0] + low, conductance[other][1] + high)
        else:
            total += max(sign * g * (far[upper] - own) for g in (low, high))
    for partner, members in modules.items():
        total += _partner(problem, lump, partner, members, conductance[partner], own, sign)
    return total


def _bent_heat(link: Link, own: fmpq, far: fmpq, sign: int) -> fmpq:
    """Return an upper bound of sign times the heat of natural convection and radiation from ``far`` to ``own``."""
    difference = far - own
    radiated = sign * (far**4 - own**4)
    value = max(coefficient * radiated for coefficient in (link.radiation, link.radiation + link.radiation_spread))
    if not link.convects or difference == 0:
        return value
    gains = (link.gain, link.gain + link.gain_spread)
    return value + max(sign * gain * difference * bound for gain in gains
                       for bound in power(abs(difference), link.exponent))


def _partner(problem: Invariance, lump: int, partner: int, members: list[int], conductance: Interval, own: fmpq,
             sign: int) -> fmpq:
    """Return the largest sign times heat through all modules and linear links to one partner.

    Affine in every uncertain number for given temperatures and currents: the ends of their ranges suffice.
    """
    forms = [problem.system.forms(k) for k in members]
    bend = sum((min(sign * module.conductance[1] for module in own_forms) for own_forms in forms), fmpq(0))
    best: fmpq | None = None
    for far, square in _candidates(problem.region.temperature[partner], bend):
        value = max(sign * g * (far - own) for g in conductance)
        for k, own_forms in zip(members, forms, strict=True):
            value += max(_peak_heat(module, lump, own, far, square, sign, problem.region.current[k])
                         for module in own_forms)
        best = value if best is None or value > best else best
    if best is None:
        raise ValueError("an interval has at least one end")
    return best


def _peak_heat(module: Module, lump: int, own: fmpq, far: fmpq, square: fmpq, sign: int, current: Interval) -> fmpq:
    a, b, c = _heat(module, lump, own, far, square)
    return peak((sign * a, sign * b, sign * c), current)[0]


def _candidates(box: Interval, bend: fmpq) -> list[tuple[fmpq, fmpq]]:
    """Return points (x, x²) whose hull contains the partner's temperatures; the ends suffice for a convex heat."""
    low, high = box
    steps = [(low, low**2), (high, high**2)]
    if bend >= 0 or low == high:
        return steps
    marks = [low + (high - low) * k / _PIECES for k in range(_PIECES + 1)]
    return steps + [((a + b) / 2, a * b) for a, b in zip(marks[:-1], marks[1:], strict=True)]


def _heat(module: Module, lump: int, own: fmpq, far: fmpq, square: fmpq) -> Quadratic:
    """Return the heat into one face as a quadratic in the current, affine in (far, square), square for far²."""
    offset = (own + far) / 2 - module.reference
    S = module.seebeck[0] + module.seebeck[1] * offset
    R = module.resistance[0] + module.resistance[1] * offset
    constant, slope = module.conductance[0] - module.conductance[1] * module.reference, module.conductance[1]
    conduction = constant * (far - own) + slope * (square - own * own) / 2
    return conduction, (S if module.hot == lump else -S) * own, R / 2


INVARIANCE = Kind("invariance", read, claim, prove, find_margin)
