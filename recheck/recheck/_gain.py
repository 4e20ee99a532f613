"""Kind "gain": |J| d + b <= -rate E d for every disturbance: d_i bounds how far one unit of it moves lump i."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ._contraction import check_lines
from ._document import get, intervals, kelvin, mapping, not_negative, numbers, only
from ._exact import ZERO, Interval, Malformed, short
from ._lines import Lines
from ._result import NOT_VALID, VALID, Answer, not_covered, valid
from ._thermal import Link, Network, check_cost
from ._uncertain import read_network


@dataclass(frozen=True)
class Channel:
    """One disturbance: its name, whether it is an ambient, the most heat per unit it brings to lumps, the gains."""

    name: str
    ambient: bool
    heat: list[Fraction]
    gains: list[Fraction]


@dataclass(frozen=True)
class Problem:
    """What one gain certificate claims."""

    network: Network
    ambient: dict[str, Interval]
    rate: Fraction
    channels: list[Channel]


def read(parts: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem of the sections of a certificate."""
    region, evidence = parts["region"], parts["evidence"]
    only(parts["margin"], [], "margin")
    network = read_network(parts["system"], region)
    given = mapping(region.get("ambient", {}), "region.ambient")
    intervals(given, [name for name in network.ambients if name in given], "region.ambient")
    ambient = {name: kelvin(given[name], "region.ambient") for name in given}
    gains = mapping(get(evidence, "gains", "evidence"), "evidence.gains")
    only(gains, ["ambients", "heat"], "evidence.gains")
    channels = []
    for source in ("ambients", "heat"):
        listed = mapping(gains.get(source, {}), f"evidence.gains.{source}")
        check_cost(network, len(listed))
        for name in listed:
            values = numbers(listed[name], len(network.lumps), f"gains of {short(name)}")
            heat = _ambient_heat(network, ambient, name) if source == "ambients" else _load(network, name)
            channels.append(Channel(name, source == "ambients", heat, values))
    if not channels:
        raise Malformed("evidence.gains: no disturbance")
    return Problem(network, ambient, not_negative(get(evidence, "rate", "evidence"), "evidence.rate"), channels)


def check(problem: Problem) -> Answer:
    """Decide the rows of every disturbance."""
    undecided = ""
    for channel in problem.channels:
        answer = _check(problem, channel, channel.heat)
        if answer.status == VALID:
            continue
        if _linear(problem.network):  # least conductances and their heat go together: a member of the ranges
            least = channel.heat if not channel.ambient else [
                sum((link.conductance[0] for link in problem.network.links if set(link.nodes) == {k, channel.name}),
                    ZERO) for k in range(len(problem.network.lumps))]
            certain = _check(problem, channel, least)
            if certain.status == NOT_VALID:
                return certain
        elif min(channel.gains) <= 0:
            return answer
        undecided = undecided or channel.name
    if undecided:
        return not_covered(f"the rows of {short(undecided)} are not proven, and not refuted either")
    return valid("every row |J| d + b is bounded over the box")


def _check(problem: Problem, channel: Channel, heat: list[Fraction]) -> Answer:
    limits = [-b - problem.rate * capacity[1] * d for b, capacity, d in
              zip(heat, problem.network.capacity, channel.gains, strict=True)]
    return check_lines(Lines(problem.network, False, channel.gains), limits, strict=False)


def _linear(network: Network) -> bool:
    """Whether no link to an ambient is nonlinear: rows then attain their bounds."""
    return not any(link.nonlinear and len(link.lumps) == 1 for link in network.links)


def _load(network: Network, name: str) -> list[Fraction]:
    if name not in network.lumps:
        raise Malformed(f"evidence.gains.heat: {short(name)} is not a lump")
    return [Fraction(int(lump == name)) for lump in network.lumps]


def _ambient_heat(network: Network, ambient: dict[str, Interval], name: str) -> list[Fraction]:
    """Return the largest heat into every lump per kelvin of one ambient [W/K]."""
    if name not in network.ambients:
        raise Malformed(f"evidence.gains.ambients: {short(name)} is not an ambient")
    heat = [ZERO] * len(network.lumps)
    for link in network.links:
        for lump in link.lumps if name in link.nodes else ():
            heat[lump] += _steepest(link, network.temperature[lump], ambient.get(name))
    return heat


def _steepest(link: Link, own: Interval, far: Interval | None) -> Fraction:
    if far is None:
        if link.nonlinear:
            raise Malformed("region.ambient: the range of an ambient is missing, whose link is not linear")
        return link.conductance[1]
    return link.exchange(own, far)[1] + link.emission(far)[1]
