"""Kind "gain": how far a disturbance of an ambient or a heat load can move every lump, at most, for ever.

For a disturbance with heat b per unit and |disturbance| <= s between two trajectories of the box, weights d > 0 with
|J| d + b <= -rate E d (diagonal of J with its sign) give |e_i(t)| <= d_i (s + exp(-rate t) max_j |e_j(0)|/d_j): d_i is
the peak gain from the disturbance to lump i (proof note, 11). Exact, with the bounds of method "max".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import fmpq

from robthermal.errors import InputError

from . import _weighted
from ._contraction_problem import Contraction
from ._cost import too_many_corners
from ._fields import Interval, get, intervals, kelvin_interval, mapping, no_other, not_negative, numbers
from ._hash import short_hash
from ._kind import Kind, Proof, working_precision
from ._numbers import decimal, name_of, round_down, show
from ._slopes import exchange_slope, radiation_slope
from ._system import Link, Region, ThermalSystem, read_region, read_system, say_interval, say_region
from ._uncertain import Parameters, read_parameters, say_subject, worst_system

_SOURCES = ("ambients", "heat")
_MOST_WORK = 5_000_000  # disturbances times links, modules and lumps


@dataclass(frozen=True)
class Channel:
    """One disturbance: an ambient or a heat load, its heat into the lumps per unit, and the gains claimed."""

    name: str
    ambient: bool
    heat: tuple[fmpq, ...]
    gains: tuple[fmpq, ...]


@dataclass(frozen=True)
class Gain:
    """The exact problem of one gain certificate; ``table``: hash of all gains."""

    system: ThermalSystem
    region: Region
    ambient: tuple[tuple[str, Interval], ...]
    parameters: Parameters
    rate: fmpq
    channels: tuple[Channel, ...]
    table: str


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Gain:
    """Return the exact problem, or raise InputError."""
    nominal = read_system(system)
    table, found = mapping(region, "region"), mapping(evidence, "evidence")
    no_other(mapping(margin, "margin"), [], "margin")
    box, parameters = read_region(table, nominal), read_parameters(table)
    network = worst_system(nominal, system, parameters)
    given = mapping(table.get("ambient", {}), "region.ambient")
    intervals(given, [name for name in network.ambients if name in given], "region.ambient")
    ambient = {name: kelvin_interval(given[name], f"region.ambient[{name_of(name)}]") for name in given}
    with working_precision():  # bounds of heats must not depend on the caller's precision
        channels = _channels(get(found, "gains", "evidence"), network, box, ambient)
    if not channels:
        raise InputError("no disturbance", where="evidence.gains", expected="at least one ambient or heat load")
    rate = not_negative(get(found, "rate", "evidence"), "evidence.rate")
    return Gain(network, box, tuple(ambient.items()), parameters, rate, tuple(channels), short_hash(found["gains"]))


def claim(problem: Gain, machine: str) -> str:
    """Return the one sentence the data give."""
    peaks = ", ".join(f"{decimal(max(channel.gains))} {'K/K' if channel.ambient else 'K/W'} from "
                      f"{'ambient' if channel.ambient else 'heat on'} {name_of(channel.name)}"
                      for channel in problem.channels)
    ambients = "".join(f", ambient {name_of(name)} in {say_interval(box)} K" for name, box in problem.ambient)
    fades = (f"what is left of their start fades as exp(-rate t), rate = {decimal(problem.rate)} 1/s"
             if problem.rate > 0 else "if they start together")
    return (f"In the {say_subject(problem.system, problem.parameters, machine)}, for all "
            f"{say_region(problem.system, problem.region)}{ambients}: two trajectories under the same currents that "
            f"differ in one disturbance, as long as both stay in this box (that they do is not part of "
            f"this claim), never part in any lump by more than that lump's peak gain times the largest difference of "
            f"the disturbance, {fades}; the largest gains are {peaks}, those of every lump are in table "
            f"{problem.table}.")


def prove(problem: Gain) -> Proof:
    """Decide |J| d + b <= -rate E d for every disturbance and lump, exactly."""
    many = too_many_corners(problem.system, problem.region, 16 * len(problem.channels))
    if many:
        return Proof(False, many)
    with working_precision():
        least: fmpq | None = None
        for channel in problem.channels:
            failed, slack = _check(problem, channel)
            if failed:
                return Proof(False, failed)
            least = slack if least is None or slack < least else least
    return Proof(True, "every row |J| d + b is bounded exactly over the box",
                 {} if least is None else {"heat": round_down(least)})


def find_margin(problem: Gain) -> dict[str, float]:
    """Return no margin: the gains are the claim."""
    return {}


def _check(problem: Gain, channel: Channel) -> tuple[str, fmpq]:
    title = f"{'ambient' if channel.ambient else 'heat on'} {name_of(channel.name)}"
    names, zero = problem.system.lumps, fmpq(0)
    for name, gain in zip(names, channel.gains, strict=True):
        if gain <= 0:
            return f"{title}: the gain to lump {name_of(name)} is {show(gain)}, not positive", zero
    rows = _weighted.lines(Contraction(problem.system, problem.region, "max", problem.rate, zero, channel.gains, ()))
    least: fmpq | None = None
    for k, (value, where) in enumerate(rows):
        needed = channel.heat[k] + problem.rate * problem.system.capacity[k] * channel.gains[k]
        slack = -value - needed
        if slack < 0:
            return (f"{title}: row {name_of(names[k])} of |J| d reaches {show(value)} W, not <= {show(-needed)} W, at "
                    f"{where}"), slack
        least = slack if least is None or slack < least else least
    return "", zero if least is None else least


def _channels(value: Any, system: ThermalSystem, box: Region, ambient: dict[str, Interval]) -> list[Channel]:
    gains = mapping(value, "evidence.gains")
    no_other(gains, _SOURCES, "evidence.gains")
    channels = []
    for source in _SOURCES:
        where = f"evidence.gains.{source}"
        listed = mapping(gains.get(source, {}), where)
        if len(listed) * (len(system.links) + len(system.modules) + len(system.lumps)) > _MOST_WORK:
            raise InputError(f"{len(listed)} disturbances of a network with {len(system.links)} links", where=where,
                             expected="fewer", remedy="Give them in several certificates.")
        for name in listed:
            values = numbers(listed[name], len(system.lumps), f"{where}[{name_of(name)}]")
            heat = (_ambient_heat(system, box, ambient, name, where) if source == "ambients"
                    else _load_heat(system, name, where))
            channels.append(Channel(name, source == "ambients", heat, tuple(values)))
    return channels


def _load_heat(system: ThermalSystem, name: str, where: str) -> tuple[fmpq, ...]:
    if name not in system.lumps:
        raise InputError(f"{name_of(name)} is not a lump", where=where)
    return tuple(fmpq(int(lump == name)) for lump in system.lumps)


def _ambient_heat(system: ThermalSystem, region: Region, ambient: dict[str, Interval], name: str,
                  where: str) -> tuple[fmpq, ...]:
    """Return the largest heat into every lump per kelvin of one ambient [W/K]."""
    if name not in system.ambients:
        raise InputError(f"{name_of(name)} is not an ambient", where=where)
    heat = [fmpq(0)] * len(system.lumps)
    for link in system.links:
        if name not in link.nodes:
            continue
        for lump in (node for node in link.nodes if isinstance(node, int)):
            heat[lump] += _steepest(link, region.temperature[lump], ambient.get(name))
    return tuple(heat)


def _steepest(link: Link, own: Interval, far: Interval | None) -> fmpq:
    if far is None:
        if link.convects or link.radiates:
            raise InputError("a link to an ambient that is not linear", where="region.ambient",
                             expected="the range of that ambient's temperature")
        return link.conductance + link.spread
    return link.conductance + exchange_slope(link, own, far)[1] + radiation_slope(link, far)[1]


GAIN = Kind("gain", read, claim, prove, find_margin)
