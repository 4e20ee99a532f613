"""Kind "invariance": on every face of a temperature box the heat into its lump does not point outwards (Nagumo)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ._document import get, interval, intervals, kelvin, mapping, margin
from ._exact import ZERO, Interval, Malformed, power, short
from ._result import Answer, not_covered, not_valid, valid
from ._thermal import Form, Link, Module, Network, check_cost, peak
from ._uncertain import read_network

_PIECES = 16  # of a partner's temperature where the heat bends the wrong way


@dataclass(frozen=True)
class Problem:
    """What one invariance certificate claims."""

    network: Network
    ambient: dict[str, Interval]
    heat: dict[int, Interval]
    margin: Fraction


def read(parts: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem of the sections of a certificate."""
    region = parts["region"]
    network = read_network(parts["system"], region, gains=True, heaters=True)
    given = get(region, "ambient", "region")
    intervals(given, network.ambients, "region.ambient")
    loads = mapping(region.get("heat", {}), "region.heat")
    for name in loads:
        if name not in network.lumps:
            raise Malformed(f"region.heat: {short(name)} is not a lump")
    heat = {k: interval(loads[name], "region.heat") for k, name in enumerate(network.lumps) if name in loads}
    return Problem(network, {name: kelvin(given[name], "region.ambient") for name in network.ambients}, heat,
                   margin(parts["margin"], "heat"))


def check(problem: Problem) -> Answer:
    """Decide both faces of every lump."""
    network, undecided = problem.network, ""
    check_cost(network)
    links: list[list[Link]] = [[] for _ in network.lumps]
    modules: list[list[int]] = [[] for _ in network.lumps]
    for link in network.links:
        for lump in link.lumps:
            links[lump].append(link)
    for k, module in enumerate(network.modules):
        modules[module.hot].append(k)
        modules[module.cold].append(k)
    for lump, name in enumerate(network.lumps):
        for sign in (1, -1):
            face = _Face(problem, lump, sign)
            if face.outward(links[lump], modules[lump], inner=False) <= -problem.margin:
                continue
            words = f"the heat at the {'upper' if sign > 0 else 'lower'} face of {short(name)}"
            if face.outward(links[lump], modules[lump], inner=True) > -problem.margin:
                return not_valid(f"{words} points outwards, or less inwards than the stored margin")
            undecided = undecided or words
    return not_covered(f"{undecided} is not bounded sharply enough") if undecided else valid(
        "the heat on every face points inwards")


class _Face:
    """One face of the box: sign +1 the upper, -1 the lower end of the temperature of a lump."""

    def __init__(self, problem: Problem, lump: int, sign: int):
        self.problem, self.lump, self.sign = problem, lump, sign
        self.side = 1 if sign > 0 else 0
        self.own = problem.network.temperature[lump][self.side]

    def outward(self, links: list[Link], modules: list[int], inner: bool) -> Fraction:
        """Return the largest outward heat [W]: a bound, or (inner) a value that is attained."""
        network = self.problem.network
        total = self.sign * self.problem.heat[self.lump][self.side] if self.lump in self.problem.heat else ZERO
        total += sum((self.sign * heater.heat(self.own)[self.side] for heater in network.heaters
                      if heater.lump == self.lump), ZERO)
        members: dict[int, list[int]] = {}
        for k in modules:
            module = network.modules[k]
            members.setdefault(module.cold if module.hot == self.lump else module.hot, []).append(k)
        shared: dict[int, list[Link]] = {p: [] for p in members}
        for link in links:
            other = link.nodes[1] if link.nodes[0] == self.lump else link.nodes[0]
            far = network.temperature[other] if isinstance(other, int) else self.problem.ambient[other]
            if isinstance(other, int) and other in shared:
                shared[other].append(link)
            else:
                total += self._linear(link, far[self.side]) + self._bent(link, far[self.side], inner)
        for p, own in members.items():
            total += self._partner(p, own, shared[p], inner)
        return total

    def _partner(self, partner: int, modules: list[int], links: list[Link], inner: bool) -> Fraction:
        """Return the share of all modules and links to one partner, which is at one temperature."""
        network = self.problem.network
        box, members = network.temperature[partner], [network.modules[k] for k in modules]
        bend = sum((min(self.sign * form[2][1] for form in module.forms) for module in members), ZERO)
        best: Fraction | None = None
        for far, square in _points(box, bend < 0 and not inner):
            total = sum((self._linear(link, far) for link in links), ZERO)
            total += sum((self._bent(link, far if inner else box[self.side], inner) for link in links), ZERO)
            for k, module in zip(modules, members, strict=True):
                total += max(peak(self._heat(module, form, far, square), network.current[k]) for form in module.forms)
            best = total if best is None or total > best else best
        if best is None:
            raise ValueError("an interval has at least one end")
        return best

    def _linear(self, link: Link, far: Fraction) -> Fraction:
        return max(self.sign * g * (far - self.own) for g in link.conductance)

    def _bent(self, link: Link, far: Fraction, inner: bool) -> Fraction:
        """Return convection and radiation from one temperature, bounded from above, or (inner) from below."""
        total = max(self.sign * c * (far**4 - self.own**4) for c in link.radiation)
        if link.gain[1] == 0 or far == self.own:
            return total
        drive = self.sign * (far - self.own)
        low, high = power(abs(far - self.own), link.exponent)
        near = low if (drive > 0) == inner else high
        return total + max(gain * drive * near for gain in link.gain)

    def _heat(self, module: Module, form: Form, far: Fraction, square: Fraction) -> tuple[Fraction, Fraction, Fraction]:
        """Return sign times the heat of a module as a quadratic in the current, ``square`` in the place of far²."""
        S, R, _ = module.at(form, (self.own + far) / 2)
        value, slope = form[2]
        conduction = (value - slope * module.reference) * (far - self.own) + slope * (square - self.own**2) / 2
        seebeck = S * self.own if module.hot == self.lump else -S * self.own
        return self.sign * conduction, self.sign * seebeck, self.sign * R / 2


def _points(box: Interval, bends: bool) -> list[tuple[Fraction, Fraction]]:
    """Return points (x, x²) whose hull contains a temperature and its square; the ends where nothing bends."""
    low, high = box
    found = [(low, low**2), (high, high**2)]
    if bends and low < high:
        marks = [low + (high - low) * k / _PIECES for k in range(_PIECES + 1)]
        found += [((a + b) / 2, a * b) for a, b in zip(marks[:-1], marks[1:], strict=True)]
    return found
