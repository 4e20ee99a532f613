"""Heat that depends on no temperature, as ranges beside a network without it: of heaters as they are, leads, constant.

Claims about a network state ranges of heat into its lumps. What a heater makes of its column, and heats of the system's
own that are constant or periodic, are somewhere in such a range; in what order they come does not matter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from ..thermal import System
from ._heaters import LATE, MORE, OWN, following, is_of_lead, is_own_heat
from ._sections import must_hold, named_ranges

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
    for name, lump, value in _own(system):
        low, high = ranges.get(name, (value, value))
        if name.endswith("periodic.heat"):
            low, high = -max(-low, high), max(-low, high)
        add(total, lump, (low, high))
    if current is not None:
        for lump, module, resistance in leads_of(system, ranges):
            heats = [R * square for R, square in product(resistance, squares_of(current[module]))]
            add(total, lump, (min(heats), max(heats)))
    for name in ranges:
        if is_own_heat(name) or is_of_lead(name) or name.endswith(tuple(f".{field}" for field in (*MORE, *LATE))):
            must_hold(system, name, ranges[name])
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
        resistance = parameters.get(f"leads.{lead.name}.resistance", (lead.resistance,) * 2)
        if any(resistance):
            yield lead.lump, lead.module, resistance


def squares_of(current: Sequence[float]) -> Interval:
    """Least and largest square of a current in a range [A²]."""
    low, high = current
    return (0.0 if low <= 0.0 <= high else min(low * low, high * high)), max(low * low, high * high)


def of_leads(parameters: Ranges | None) -> dict[str, Interval]:
    """Ranges of the resistances of leads, among others."""
    return {name: pair for name, pair in (parameters or {}).items() if is_of_lead(name)}


def through(system: System, name: str, heat: Interval, parameters: Ranges | None = None
            ) -> Iterator[tuple[str, Interval]]:
    """Lumps that a heater heats, and the range of the heat into each of them [W]."""
    heater = system.inputs[name]
    if heater.feedthrough is None:
        yield heater.lump, heat
        return
    share = (parameters or {}).get(f"inputs.{name}.feedthrough.share", (heater.feedthrough.share,) * 2)
    for lump, parts in ((heater.lump, [1.0 - part for part in share]), (heater.feedthrough.lump, share)):
        found = [part * end for part, end in product(parts, heat)]
        yield lump, (min(found), max(found))


def add(heat: dict[str, Interval], lump: str, more: Interval) -> None:
    """Add a range of heat into a lump."""
    low, high = heat.get(lump, (0.0, 0.0))
    if any(more):
        heat[lump] = (low + more[0], high + more[1])


def _own(system: System) -> Iterator[tuple[str, str, float]]:
    """Parameter name, lump and value [W] of every heat of the system's own."""
    known = system.parameters
    for table, field in OWN:
        for part, item in getattr(system, table).items():
            name = f"{table}.{part}.{field}"
            if name in known:
                yield name, part if table == "lumps" else item.lump, known[name]
