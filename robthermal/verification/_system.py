"""The thermal network of a certificate in exact numbers, and the Jacobian entries of its modules."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flint import fmpq

from robthermal.errors import InputError

from ._fields import (
    Interval,
    get,
    intervals,
    kelvin_interval,
    mapping,
    no_effects,
    not_negative,
    positive,
    sequence,
    text,
)
from ._numbers import decimal, exact, name_of, show

Quadratic = tuple[fmpq, fmpq, fmpq]  # a + b I + c I²
_EXPONENT_LIMIT = 10
_PROPERTIES = ("seebeck", "resistance", "conductance")


@dataclass(frozen=True)
class Link:
    """Heat path between two nodes; a node is a lump's index or an ambient's name.

    The conductance is anything between ``conductance`` and ``conductance + spread``, constant in time or not; so are
    the gain of natural convection and the coefficient of radiation with their own spreads.
    """

    nodes: tuple[int | str, int | str]
    conductance: fmpq
    gain: fmpq
    exponent: fmpq
    radiation: fmpq
    spread: fmpq = fmpq(0)
    gain_spread: fmpq = fmpq(0)
    radiation_spread: fmpq = fmpq(0)

    @property
    def convects(self) -> bool:
        """Whether natural convection may be part of it."""
        return bool(self.gain != 0 or self.gain_spread != 0)

    @property
    def radiates(self) -> bool:
        """Whether radiation may be part of it."""
        return bool(self.radiation != 0 or self.radiation_spread != 0)


@dataclass(frozen=True)
class Module:
    """Thermoelectric module: S, R, K affine in the mean of its two temperatures."""

    name: str
    hot: int
    cold: int
    seebeck: tuple[fmpq, fmpq]
    resistance: tuple[fmpq, fmpq]
    conductance: tuple[fmpq, fmpq]
    reference: fmpq

    def entries(self, hot: fmpq, cold: fmpq) -> tuple[Quadratic, Quadratic, Quadratic, Quadratic]:
        """Return the Jacobian entries hh, hc, cc, ch at two temperatures [W/K], each as a quadratic in the current.

        The derivatives of S(T) x_h I + R(T) I²/2 + K(T) (x_c - x_h) into the hot lump and of
        -S(T) x_c I + R(T) I²/2 + K(T) (x_h - x_c) into the cold one, T = (x_h + x_c)/2 (errata, Evers (5.16) ff.).
        Every coefficient is affine in (x_h, x_c): the proofs rest on it.
        """
        offset = (hot + cold) / 2 - self.reference
        S, K = self.seebeck[0] + self.seebeck[1] * offset, self.conductance[0] + self.conductance[1] * offset
        dS, dR, dK = self.seebeck[1] / 2, self.resistance[1] / 4, self.conductance[1] / 2
        gain = dK * (cold - hot)
        return ((gain - K, S + dS * hot, dR), (gain + K, dS * hot, dR),
                (-gain - K, -S - dS * cold, dR), (-gain + K, -dS * cold, dR))


@dataclass(frozen=True)
class ThermalSystem:
    """Lumps, links and modules of a certificate, exactly; ``variants`` are the vertices of uncertain modules."""

    name: str
    lumps: tuple[str, ...]
    capacity: tuple[fmpq, ...]
    ambients: tuple[str, ...]
    links: tuple[Link, ...]
    modules: tuple[Module, ...]
    variants: tuple[tuple[Module, ...], ...] = ()

    def forms(self, k: int) -> tuple[Module, ...]:
        """Return the vertices of module k: itself where nothing is uncertain."""
        return self.variants[k] if self.variants else (self.modules[k],)


@dataclass(frozen=True)
class Region:
    """The box: one temperature interval per lump [K], one current interval per module [A]."""

    temperature: tuple[Interval, ...]
    current: tuple[Interval, ...]


def read_system(value: Any, *, heaters: bool = False) -> ThermalSystem:
    """Return the exact system of a certificate; InputError for anything missing, of another type or impossible.

    ``heaters``: whether the claim takes heaters into account whose power is linear in the temperature of their lump.
    """
    table = mapping(value, "system")
    _only_known(table, heaters)
    lumps = mapping(get(table, "lumps", "system"), "system.lumps")
    if not lumps:
        raise InputError("no lumps", where="system.lumps", expected="at least one")
    capacity = [_capacity(lumps[name], f"system.lumps[{name_of(name)}]") for name in lumps]
    ambients = _ambients(get(table, "ambients", "system"), lumps)
    nodes: dict[str, int | str] = {name: k for k, name in enumerate(lumps)}
    nodes.update({name: name for name in ambients})
    links = sequence(get(table, "links", "system"), "system.links")
    modules = mapping(get(table, "modules", "system"), "system.modules")
    return ThermalSystem(
        name=text(table["name"], "system.name") if "name" in table else "",
        lumps=tuple(lumps), capacity=tuple(capacity), ambients=ambients,
        links=tuple(_link(link, nodes, f"system.links[{k}]") for k, link in enumerate(links)),
        modules=tuple(_module(name, modules[name], nodes) for name in modules))


def read_region(value: Any, system: ThermalSystem) -> Region:
    """Return the exact box of a certificate."""
    table = mapping(value, "region")
    temperature = get(table, "temperature", "region")
    names = [module.name for module in system.modules]
    current = intervals(get(table, "current", "region"), names, "region.current")
    return Region(temperature=_temperatures(temperature, system.lumps), current=tuple(current))


def link_names(section: Mapping[str, Any]) -> list[str]:
    """Return the names of the links of a section that was read: "a-b" where none is given."""
    given = [(link.get("name"), link["between"]) for link in section["links"]]
    return [name if isinstance(name, str) and name else "-".join(ends) for name, ends in given]


def peak(quadratic: Quadratic, currents: Interval) -> tuple[fmpq, fmpq]:
    """Return the exact maximum of a + b I + c I² over an interval and the current at which it is reached."""
    a, b, c = quadratic
    points = list(currents)
    if c < 0 and currents[0] < -b / (2 * c) < currents[1]:
        points.append(-b / (2 * c))
    return max(((a + b * x + c * x * x, x) for x in points), key=lambda pair: pair[0])


def say_system(system: ThermalSystem, machine: str) -> str:
    """Return the subject of a claim: name, size and hash of the network."""
    title = f" {name_of(system.name)}" if system.name else ""
    modules = f"{len(system.modules)} module" + ("" if len(system.modules) == 1 else "s")
    lumps = f"{len(system.lumps)} lump" + ("" if len(system.lumps) == 1 else "s")
    return f"thermal network{title} ({lumps}, {modules}, machine {machine})"


def say_region(system: ThermalSystem, region: Region) -> str:
    """Return the box of a claim in words."""
    currents = ", ".join(f"{name_of(module.name)} in {say_interval(current)} A"
                         for module, current in zip(system.modules, region.current, strict=True))
    words = f"lump temperatures {say_temperatures(system, region)}"
    return words + (f" and module currents {currents}, each independent of the others" if currents else "")


def say_interval(value: Interval) -> str:
    """Return an interval for a claim, exactly."""
    return f"[{decimal(value[0])}, {decimal(value[1])}]"


def say_temperatures(system: ThermalSystem, region: Region) -> str:
    """Return the range of every lump, once where all are the same."""
    if all(box == region.temperature[0] for box in region.temperature):
        return f"in {say_interval(region.temperature[0])} K"
    return ", ".join(f"{name_of(name)} in {say_interval(box)} K"
                     for name, box in zip(system.lumps, region.temperature, strict=True))


def _temperatures(value: Any, lumps: tuple[str, ...]) -> tuple[Interval, ...]:
    where = "region.temperature"
    if not isinstance(value, Mapping):
        return (kelvin_interval(value, where),) * len(lumps)
    intervals(value, lumps, where)
    return tuple(kelvin_interval(value[name], f"{where}[{name_of(name)}]") for name in lumps)


def _capacity(value: Any, where: str) -> fmpq:
    table = mapping(value, where)
    no_effects(table, where)
    return positive(get(table, "capacity", where), f"{where}.capacity")


def _ambients(value: Any, lumps: Mapping[str, Any]) -> tuple[str, ...]:
    where = "system.ambients"
    names = tuple(mapping(value, where)) if isinstance(value, Mapping) else tuple(
        text(name, where) for name in sequence(value, where))
    seen = set(lumps)
    for name in names:
        if name in seen:
            raise InputError(f"the name {name_of(name)} is used twice", where=where)
        seen.add(name)
    return names


def _link(value: Any, nodes: Mapping[str, int | str], where: str) -> Link:
    table = mapping(value, where)
    no_effects(table, where)
    ends = sequence(get(table, "between", where), f"{where}.between")
    if len(ends) != 2:
        raise InputError(f"{len(ends)} names", where=f"{where}.between", expected="two")
    first, second = (_node(end, nodes, f"{where}.between") for end in ends)
    if first == second:
        raise InputError(f"{name_of(ends[0])} is linked to itself", where=where)
    gain = exponent = radiation = fmpq(0)
    if "natural" in table:
        natural = mapping(table["natural"], f"{where}.natural")
        gain = not_negative(get(natural, "gain", f"{where}.natural"), f"{where}.natural.gain")
        exponent = not_negative(get(natural, "exponent", f"{where}.natural"), f"{where}.natural.exponent")
        if exponent > _EXPONENT_LIMIT:
            raise InputError(f"exponent {show(exponent)}", where=f"{where}.natural",
                             expected=f"at most {_EXPONENT_LIMIT}")
    if "radiation" in table:
        radiation = not_negative(table["radiation"], f"{where}.radiation")
    conductance = not_negative(get(table, "conductance", where), f"{where}.conductance")
    return Link((first, second), conductance, gain, exponent, radiation)


def _only_known(table: Mapping[str, Any], heaters: bool) -> None:
    """Refuse physics that the claim does not know: heaters that are not just heat, sensors that heat; and Celsius."""
    no_effects(table, "system")
    if table.get("temperature_unit", "K") != "K":
        raise InputError(f"temperature_unit {name_of(table['temperature_unit'])}", where="system", expected="'K'")
    for name, heater in mapping(table.get("inputs", {}), "system.inputs").items():
        place = f"system.inputs[{name_of(name)}]"
        no_effects(mapping(heater, place), place, known=("power_slope",) if heaters else ())
    sensors = table.get("sensors", ())
    for sensor in sensors.values() if isinstance(sensors, Mapping) else sequence(sensors, "system.sensors"):
        if isinstance(sensor, Mapping):  # what a sensor reads matters to an observer only, which looks closer
            no_effects(sensor, "system.sensors")


def _node(value: Any, nodes: Mapping[str, int | str], where: str) -> int | str:
    name = text(value, where)
    if name not in nodes:
        raise InputError(f"{name_of(name)} is neither a lump nor an ambient", where=where)
    return nodes[name]


def _module(name: str, value: Any, nodes: Mapping[str, int | str]) -> Module:
    where = f"system.modules[{name_of(name)}]"
    table = mapping(value, where)
    no_effects(table, where)
    faces = []
    for face in ("hot", "cold"):
        node = _node(get(table, face, where), nodes, f"{where}.{face}")
        if not isinstance(node, int):
            raise InputError(f"{name_of(node)} is an ambient", where=f"{where}.{face}", expected="a lump")
        faces.append(node)
    if faces[0] == faces[1]:
        raise InputError("hot and cold are the same lump", where=where)
    seebeck, resistance, conductance = (_affine(table, key, where) for key in _PROPERTIES)
    return Module(name, faces[0], faces[1], seebeck, resistance, conductance,
                  exact(get(table, "reference_temperature", where), f"{where}.reference_temperature"))


def _affine(table: Mapping[str, Any], key: str, where: str) -> tuple[fmpq, fmpq]:
    place = f"{where}.{key}"
    item = mapping(get(table, key, where), place)
    return exact(get(item, "value", place), f"{place}.value"), exact(get(item, "slope", place), f"{place}.slope")
