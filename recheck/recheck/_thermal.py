"""Thermal networks: what the sections "system" and "region" say, in exact numbers, and slopes of their links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ._document import get, interval, intervals, kelvin, mapping, no_effects, not_negative, positive, sequence, text
from ._exact import ZERO, Interval, Malformed, NotCovered, exact, power, short
from ._heaters import Heater, read_heaters

Quadratic = tuple[Fraction, Fraction, Fraction]  # a + b I + c I²
Form = tuple[tuple[Fraction, Fraction], tuple[Fraction, Fraction], tuple[Fraction, Fraction]]
_MOST_WORK = 1_000_000  # shares of links and modules
PROPERTIES = ("seebeck", "resistance", "conductance")


@dataclass(frozen=True)
class Link:
    """Heat path between two nodes (index of a lump, or name of an ambient); intervals where numbers are uncertain."""

    nodes: tuple[int | str, int | str]
    conductance: Interval
    gain: Interval
    exponent: Fraction
    radiation: Interval

    @property
    def lumps(self) -> list[int]:
        """Return the ends that are lumps."""
        return [node for node in self.nodes if isinstance(node, int)]

    @property
    def nonlinear(self) -> bool:
        """Whether natural convection or radiation goes along it."""
        return self.gain[1] != 0 or self.radiation[1] != 0

    def exchange(self, first: Interval, second: Interval, inner: bool = False) -> Interval:
        """Return bounds of the slope of conduction and convection between two ranges [W/K].

        Outer bounds; with ``inner`` each end is instead attained or exceeded by some member of the ranges.
        """
        if self.gain[1] == 0:
            return self.conductance
        low, high = first[0] - second[1], first[1] - second[0]
        near = ZERO if low <= 0 <= high else min(abs(low), abs(high))
        bottom, top = power(near, self.exponent), power(max(abs(low), abs(high)), self.exponent)
        steep = 1 + self.exponent
        return (self.conductance[0] + self.gain[0] * steep * bottom[1 if inner else 0],
                self.conductance[1] + self.gain[1] * steep * top[0 if inner else 1])

    def emission(self, temperature: Interval) -> Interval:
        """Return the bounds of 4 c T³ [W/K]."""
        return 4 * self.radiation[0] * temperature[0] ** 3, 4 * self.radiation[1] * temperature[1] ** 3

    def least_loss(self, temperature: Interval) -> Fraction:
        """Return the least slope of a link from a lump to an ambient of any temperature [W/K]."""
        still = self.gain[0] if self.exponent == 0 else ZERO
        return self.conductance[0] + still + self.emission(temperature)[0]


@dataclass(frozen=True)
class Module:
    """Thermoelectric module; ``forms`` are the combinations of the ends of its uncertain numbers."""

    name: str
    hot: int
    cold: int
    reference: Fraction
    nominal: Form
    forms: tuple[Form, ...]

    def at(self, form: Form, mean: Fraction) -> tuple[Fraction, Fraction, Fraction]:
        """Return S, R, K at a mean temperature."""
        S, R, K = (value + slope * (mean - self.reference) for value, slope in form)
        return S, R, K

    def jacobian(self, form: Form, hot: Fraction, cold: Fraction) -> dict[tuple[int, int], Quadratic]:
        """Return the four Jacobian entries as quadratics in the current [W/K]."""
        S, _, K = self.at(form, (hot + cold) / 2)
        dS, dR, dK = (slope / 2 for _, slope in form)
        h, c, flow = self.hot, self.cold, dK * (cold - hot)
        return {(h, h): (flow - K, S + dS * hot, dR / 2), (h, c): (flow + K, dS * hot, dR / 2),
                (c, c): (-flow - K, -S - dS * cold, dR / 2), (c, h): (-flow + K, -dS * cold, dR / 2)}


@dataclass(frozen=True)
class Network:
    """Lumps with the range of their capacity [J/K], links, modules and the box of the claim."""

    name: str
    lumps: tuple[str, ...]
    ambients: tuple[str, ...]
    capacity: tuple[Interval, ...]
    links: tuple[Link, ...]
    modules: tuple[Module, ...]
    temperature: tuple[Interval, ...]
    current: tuple[Interval, ...]
    parameters: Mapping[str, Interval]
    heaters: tuple[Heater, ...] = ()


def read_nominal(system: Mapping[str, Any], region: Mapping[str, Any], *, heaters: bool = False) -> Network:
    """Return network and box of a certificate, every number the one of the system.

    ``heaters``: whether the claim takes heaters into account whose power follows temperature.
    """
    no_effects(system, "system")
    if system.get("temperature_unit", "K") != "K":
        raise Malformed("system: temperatures are not in kelvin")
    _check_devices(system, heaters)
    listed = mapping(get(system, "lumps", "system"), "system.lumps")
    if not listed:
        raise Malformed("system.lumps: none")
    lumps, capacity = tuple(listed), []
    for name in lumps:
        lump = mapping(listed[name], f"lump {short(name)}")
        no_effects(lump, f"lump {short(name)}")
        value = positive(get(lump, "capacity", f"lump {short(name)}"), f"capacity of {short(name)}")
        capacity.append((value, value))
    ambients = _ambients(get(system, "ambients", "system"), lumps)
    nodes: dict[str, int | str] = {name: k for k, name in enumerate(lumps)} | {name: name for name in ambients}
    links = [_link(item, nodes, f"system.links[{k}]")
             for k, item in enumerate(sequence(get(system, "links", "system"), "system.links"))]
    tables = mapping(get(system, "modules", "system"), "system.modules")
    modules = [_module(name, tables[name], nodes) for name in tables]
    title = text(system["name"], "system.name") if "name" in system else ""
    current = intervals(get(region, "current", "region"), list(tables), "region.current")
    network = Network(title, lumps, ambients, tuple(capacity), tuple(links), tuple(modules),
                      _temperatures(get(region, "temperature", "region"), lumps), tuple(current.values()),
                      read_parameters(region), read_heaters(system, region, lumps) if heaters else ())
    return network


def read_parameters(region: Mapping[str, Any]) -> dict[str, Interval]:
    """Return the ranges of uncertain numbers."""
    table = mapping(region.get("parameters", {}), "region.parameters")
    return {name: interval(table[name], f"region.parameters[{short(name)}]") for name in table}


def peak(quadratic: Quadratic, currents: Interval) -> Fraction:
    """Return the exact maximum of a + b I + c I² over an interval."""
    a, b, c = quadratic
    points = list(currents)
    if c < 0 and currents[0] < -b / (2 * c) < currents[1]:
        points.append(-b / (2 * c))
    return max(a + x * (b + c * x) for x in points)


def _check_devices(system: Mapping[str, Any], heaters: bool) -> None:
    inputs, known = mapping(system.get("inputs", {}), "system.inputs"), ("power_slope",) if heaters else ()
    for name in inputs:
        no_effects(mapping(inputs[name], f"input {short(name)}"), f"input {short(name)}", known)
    sensors = system.get("sensors", ())
    for sensor in sensors.values() if isinstance(sensors, Mapping) else sequence(sensors, "system.sensors"):
        if isinstance(sensor, Mapping):
            no_effects(sensor, "system.sensors")


def _temperatures(value: Any, lumps: tuple[str, ...]) -> tuple[Interval, ...]:
    where = "region.temperature"
    if not isinstance(value, Mapping):
        return (kelvin(value, where),) * len(lumps)
    intervals(value, lumps, where)
    return tuple(kelvin(value[name], where) for name in lumps)


def _ambients(value: Any, lumps: tuple[str, ...]) -> tuple[str, ...]:
    names = tuple(mapping(value, "")) if isinstance(value, Mapping) else tuple(
        text(name, "system.ambients") for name in sequence(value, "system.ambients"))
    if len({*names, *lumps}) < len(names) + len(lumps):
        raise Malformed("system.ambients: a name is used twice")
    return names


def _node(value: Any, nodes: Mapping[str, int | str], where: str) -> int | str:
    name = text(value, where)
    if name not in nodes:
        raise Malformed(f"{where}: {short(name)} is neither a lump nor an ambient")
    return nodes[name]


def _link(value: Any, nodes: Mapping[str, int | str], where: str) -> Link:
    table = mapping(value, where)
    no_effects(table, where)
    between = sequence(get(table, "between", where), where)
    if len(between) != 2:
        raise Malformed(f"{where}: {len(between)} ends")
    first, second = (_node(end, nodes, where) for end in between)
    if first == second:
        raise Malformed(f"{where}: linked to itself")
    gain = exponent = radiation = ZERO
    if "natural" in table:
        natural = mapping(table["natural"], where)
        gain, exponent = (not_negative(get(natural, key, where), f"{where}.{key}") for key in ("gain", "exponent"))
        if exponent > 10:
            raise Malformed(f"{where}: exponent above 10")
    if "radiation" in table:
        radiation = not_negative(table["radiation"], f"{where}.radiation")
    conductance = not_negative(get(table, "conductance", where), f"{where}.conductance")
    return Link((first, second), (conductance, conductance), (gain, gain), exponent, (radiation, radiation))


def _module(name: str, value: Any, nodes: Mapping[str, int | str]) -> Module:
    where = f"module {short(name)}"
    table = mapping(value, where)
    no_effects(table, where)
    hot, cold = (_node(get(table, face, where), nodes, where) for face in ("hot", "cold"))
    if not isinstance(hot, int) or not isinstance(cold, int) or hot == cold:
        raise Malformed(f"{where}: its faces are not two lumps")
    form = []
    for key in PROPERTIES:
        item = mapping(get(table, key, where), f"{where}.{key}")
        form.append((exact(get(item, "value", where), where), exact(get(item, "slope", where), where)))
    nominal: Form = (form[0], form[1], form[2])
    reference = exact(get(table, "reference_temperature", where), where)
    return Module(name, hot, cold, reference, nominal, (nominal,))


def check_cost(network: Network, times: int = 1) -> None:
    """Refuse networks whose exact bounds would take more than about a minute."""
    numbers = [value for link in network.links for value in (*link.conductance, *link.gain, *link.radiation)]
    numbers += [value for module in network.modules for pair in module.nominal for value in pair]
    numbers += [value for box in (*network.temperature, *network.current) for value in box]
    numbers += [value for heater in network.heaters for value in (*heater.slope, *heater.power, heater.reference)]
    bits = max((value.numerator.bit_length() + value.denominator.bit_length() for value in numbers), default=0)
    parts = sum(40 if link.gain[1] else 2 for link in network.links)
    parts += sum(40 * len(module.forms) for module in network.modules)
    if times * parts * (1 + bits / 500) ** 2 > _MOST_WORK:
        raise NotCovered(f"{len(network.links)} links and {len(network.modules)} modules with numbers of {bits} bits "
                         "are too many")
