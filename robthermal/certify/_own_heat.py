"""Heat that depends on no temperature, as ranges beside a network without it: of heaters as they are, leads, constant.

Claims about a network state ranges of heat into its lumps. What a heater makes of its column, and heats of the system's
own that are constant or periodic, are somewhere in such a range; in what order they come does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from ..errors import InputError
from ..thermal import System
from ._heaters import LATE, MORE, OWN, following, is_of_lead, is_own_heat
from ._sections import named_ranges

Interval = tuple[float, float]
Ranges = Mapping[str, Interval]


@dataclass(frozen=True)
class Driven:
    """A network without heats of its own, and the ranges of heat into its lumps that stand for them.

    Parameters
    ----------
    system : System
        Without them: its effects of this kind are zero.
    heat : dict
        {lump: (lower, upper)} [W], of heaters and loads and of what was left out.
    parameters : dict
        Ranges of uncertain numbers but those that are counted in `heat`.
    """

    system: System
    heat: dict[str, Interval]
    parameters: dict[str, Interval]


def driven(system: System, heat: Ranges, parameters: Ranges | None, current: Mapping[str, Any] | None = None) -> Driven:
    """Count heats of the system's own as ranges of heat.

    Parameters
    ----------
    system : System
        Network with its heaters, constant and periodic heats, and sensors that heat.
    heat : mapping
        {lump: (lower, upper)} [W], heaters and loads.
    parameters : mapping, optional
        Ranges of uncertain numbers of the system.
    current : mapping, optional
        {module: (lower, upper)} [A]: the heat of leads is counted too. Without it they are left as they are.

    Raises
    ------
    InputError
        Names that are no parameters, or ranges that are none.
    """
    named = named_ranges(parameters or {}, system.parameter_names, "parameters", "parameter")
    ranges, total = {name: (low, high) for name, (low, high) in named.items()}, dict(heat)
    for name, lump in _own(system):
        low, high = _range(system, name, ranges)
        if name.endswith("periodic.heat"):
            low, high = -max(-low, high), max(-low, high)
        add(total, lump, (low, high))
    if current is not None:
        for lump, module, resistance in leads_of(system, ranges):
            heats = [R * square for R, square in product(resistance, squares_of(current[module]))]
            add(total, lump, (min(heats), max(heats)))
    heaters = [name for name in system.inputs if name not in following(system, ranges)]
    counted = tuple(f"inputs.{name}.{field}" for name in heaters for field in (*MORE, *LATE))
    kept = {name: pair for name, pair in ranges.items() if name not in counted and not is_own_heat(name)
            and not (current is not None and is_of_lead(name))}
    if not any(name in counted or is_own_heat(name) or is_of_lead(name) for name in system.effects):
        return Driven(system, total, kept)
    plain = {
        "lumps": {name: {**dict(lump), "heat": 0.0, "periodic": None} for name, lump in system.lumps.items()},
        "sensors": {name: {**dict(sensor), "self_heating": 0.0} for name, sensor in system.sensors.items()},
        "inputs": {name: {**dict(heater), **({"drive": {}, "feedthrough": None} if name in heaters else {})}
                   for name, heater in system.inputs.items()}}
    leads = () if current is not None else system.leads
    return Driven(System(**{**dict(system), **plain, "leads": leads, "fit": {}}), total, kept)


def leads_of(system: System, parameters: Ranges) -> Iterator[tuple[str, str, Interval]]:
    """Lump, module and resistance [Ω] of every lead that heats."""
    for lead in system.leads:
        resistance = _range(system, f"leads.{lead.name}.resistance", parameters)
        if any(resistance):
            yield lead.lump, lead.module, resistance


def squares_of(current: Sequence[float]) -> Interval:
    """Least and largest square of a current in a range [A²]."""
    low, high = current
    return (0.0 if low <= 0.0 <= high else min(low * low, high * high)), max(low * low, high * high)


def of_leads(parameters: Ranges | None) -> dict[str, Interval]:
    """Ranges of the resistances of leads, among others."""
    return {name: pair for name, pair in (parameters or {}).items() if is_of_lead(name)}


def heater_range(system: System, name: str, parameters: Ranges | None = None) -> Interval:
    """Heat of a heater [W], whatever its column is within the declared limits, in the ranges of its numbers."""
    heater, ranges = system.inputs[name], parameters or {}
    if heater.limits is None:
        raise InputError(f"heater {name!r} has no limits", where=f"[inputs.{name}] limits",
                         remedy="Give limits = [lower, upper], or pass heat={lump: (lower, upper)}.")

    def ends(field: str) -> Interval:
        return _range(system, f"inputs.{name}.{field}", ranges)

    linear = [(1.0 + gain) * v + offset for gain, v, offset in product(ends("drive.gain"), heater.limits,
                                                                      ends("drive.offset"))]
    shaped = list(_shaped(min(linear), max(linear), ends("drive.gain_slope"), ends("drive.cubic")))
    clips = ends("drive.clip") if heater.drive.clip is not None else (math.inf,)
    values = [min(max(value, -clip), clip) for value, clip in product((min(shaped), max(shaped)), clips)]
    heats = [gain * value for gain, value in product(ends("gain"), values)]
    return min(heats), max(heats)


def through(system: System, name: str, heat: Interval, parameters: Ranges | None = None
            ) -> Iterator[tuple[str, Interval]]:
    """Lumps that a heater heats, and the range of the heat into each of them [W]."""
    heater = system.inputs[name]
    if heater.feedthrough is None:
        yield heater.lump, heat
        return
    share = _range(system, f"inputs.{name}.feedthrough.share", parameters or {})
    for lump, parts in ((heater.lump, [1.0 - part for part in share]), (heater.feedthrough.lump, share)):
        found = [part * end for part, end in product(parts, heat)]
        yield lump, (min(found), max(found))


def add(heat: dict[str, Interval], lump: str, more: Interval) -> None:
    """Add a range of heat into a lump."""
    low, high = heat.get(lump, (0.0, 0.0))
    if any(more):
        heat[lump] = (low + more[0], high + more[1])


def _shaped(low: float, high: float, slopes: Interval, cubics: Interval) -> Iterator[float]:
    """Values of (1 + k |l|) l - c l³ at the ends of l and where it turns within, for the ends of k and c."""
    for k, c, sign in product(slopes, cubics, (-1.0, 1.0)):
        places = [low, high]
        if c:  # 1 + 2 k |l| - 3 c l² = 0
            inside = k * k + 3.0 * c
            places += [sign * (k + way * math.sqrt(inside)) / (3.0 * c) for way in (-1.0, 1.0)] if inside >= 0 else []
        elif k:
            places.append(-sign / (2.0 * k))
        yield from ((1.0 + k * abs(v)) * v - c * v**3 for v in places if low <= v <= high)


def _own(system: System) -> Iterator[tuple[str, str]]:
    """Parameter name and lump of every heat of the system's own."""
    for table, field in OWN:
        for part, item in getattr(system, table).items():
            name = f"{table}.{part}.{field}"
            if name in system.parameters:
                yield name, part if table == "lumps" else item.lump


def _range(system: System, name: str, ranges: Ranges) -> Interval:
    if name in ranges:
        return ranges[name]
    value = system.parameters.get(name, 0.0)
    return value, value
