"""Checks that need the whole network: names, references, and a path from every lump to an ambient."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..errors import InputError
from ._parameters import read_parameter

if TYPE_CHECKING:
    from ._system import System

_TABLES = ("ambients", "lumps", "inputs", "modules", "sensors")


def check_network(system: System) -> None:
    """Refuse a network whose names or paths do not make sense."""
    if not system.lumps:
        raise InputError("there are no lumps", where="[lumps]", remedy="Add at least one [lumps.NAME] table.")
    if not system.ambients:
        raise InputError("there is no ambient", where="[ambients]", remedy="Add [ambients.room] with its temperature.")
    _names_used_once(system)
    _links_exist(system)
    _modules_exist(system)
    _effects_exist(system)
    for name, heater in system.inputs.items():
        _known(heater.lump, system.lumps, f"[inputs.{name}] lump", "a lump")
    for name, sensor in system.sensors.items():
        if sensor.module:
            _known(sensor.module, system.modules, f"[sensors.{name}] module", "a module")
        else:
            _known(sensor.lump, system.lumps, f"[sensors.{name}] lump", "a lump")
    _path_to_ambient(system)
    _fit_is_possible(system)


def _known(name: str, known: Iterable[str], where: str, expected: str) -> None:
    known = list(known)
    if name not in known:
        close = difflib.get_close_matches(name, known, n=1)
        remedy = f"Did you mean {close[0]!r}?" if close else "Add it to the file, or correct the name."
        raise InputError(f"{name!r} does not exist", where=where, expected=expected, remedy=remedy)


def _names_used_once(system: System) -> None:
    seen: dict[str, str] = {}
    for table in _TABLES:
        for name in getattr(system, table):
            if name in seen:
                raise InputError(f"the name {name!r} is used twice, in [{seen[name]}] and in [{table}]",
                                 where=f"[{table}.{name}]", remedy="Record columns go by name: rename one of them.")
            if name.lower() == "time":
                raise InputError(f"the name {name!r} is the time column of a record", where=f"[{table}.{name}]",
                                 remedy="Rename it.")
            seen[name] = table


def _once(name: str, names: set[str], where: str, kind: str, instead: str) -> None:
    """Add a name to those of a list; refuse one that is there."""
    if name in names:
        raise InputError(f"the {kind} name {name!r} is used twice", where=where,
                         remedy=f'Add name = "…" to one of them, or {instead}.')
    names.add(name)


def _links_exist(system: System) -> None:
    nodes = list(system.lumps) + list(system.ambients)
    known = set(nodes)
    names: set[str] = set()
    for number, link in enumerate(system.links, start=1):
        where = f"[[links]] number {number}"
        for end in link.between:
            if end not in known:
                _known(end, nodes, f"{where} between", "a lump or an ambient")
        if not any(end in system.lumps for end in link.between):
            raise InputError(f"joins two ambients, {link.between[0]!r} and {link.between[1]!r}", where=where,
                             remedy="At least one end must be a lump.")
        _once(link.name, names, where, "link", "join them into one link")


def _modules_exist(system: System) -> None:
    pairs: dict[frozenset[str], str] = {}
    for name, module in system.modules.items():
        where = f"[modules.{name}]"
        for face in ("hot", "cold"):
            _known(getattr(module, face), system.lumps, f"{where} {face}", "a lump")
        pair = frozenset((module.hot, module.cold))
        if pair in pairs:
            raise InputError(f"modules {pairs[pair]!r} and {name!r} join the same two lumps, {module.hot!r} and "
                             f"{module.cold!r}", where=where,
                             remedy="Describe both as one module (in series: add their Seebeck coefficients, "
                                    "resistances and conductances), or give each faces of its own.")
        pairs[pair] = name


def _effects_exist(system: System) -> None:
    for number, link in enumerate(system.links, start=1):
        if link.follow is not None:
            _known(link.follow.column, (*system.inputs, *system.modules), f"[[links]] number {number} follow.column",
                   "a heater or a module")
    names: set[str] = set()
    for number, lead in enumerate(system.leads, start=1):
        where = f"[[leads]] number {number}"
        _known(lead.module, system.modules, f"{where} module", "a module")
        _known(lead.lump, system.lumps, f"{where} lump", "a lump")
        _once(lead.name, names, where, "lead", "add up their resistances")
    _flows_exist(system)
    for name, heater in system.inputs.items():
        if heater.feedthrough is not None:
            where = f"[inputs.{name}] feedthrough"
            _known(heater.feedthrough.lump, system.lumps, where, "a lump")
            if heater.feedthrough.lump == heater.lump:
                raise InputError(f"{heater.lump!r} is the heater's own lump", where=where, expected="another lump",
                                 remedy="Name the lump that receives a share of its heat.")


def _flows_exist(system: System) -> None:
    for name, ambient in system.ambients.items():
        where = f"[ambients.{name}] coolant"
        for lump in ambient.coolant:
            _known(lump, system.lumps, where, "lumps")
            if not any(set(link.between) == {lump, name} for link in system.links):
                raise InputError(f"{lump!r} has no link to {name!r}", where=where, expected="lumps that it cools",
                                 remedy="Add the link, or leave the lump out.")
        if len(set(ambient.coolant)) < len(ambient.coolant):
            raise InputError("a lump is listed twice", where=where, expected="every lump once, in order",
                             remedy="Split a lump that the coolant passes twice.")
    names: set[str] = set()
    for number, flow in enumerate(system.flows, start=1):
        where = f"[[flows]] number {number}"
        _known(flow.upstream, system.lumps, f"{where} upstream", "a lump")
        _known(flow.downstream, system.lumps, f"{where} downstream", "a lump")
        _known(flow.ambient, system.ambients, f"{where} ambient", "an ambient")
        _once(flow.name, names, where, "flow", "add up their conductances")


def _path_to_ambient(system: System) -> None:
    names = list(system.lumps) + list(system.ambients)
    index = {name: i for i, name in enumerate(names)}
    ends = [link.between for link in system.links
            if link.conductance > 0 or link.radiation or (link.natural and link.natural.gain > 0)]
    ends += [(m.hot, m.cold) for m in system.modules.values()]
    rows = [index[a] for a, _ in ends]
    columns = [index[b] for _, b in ends]
    graph = scipy.sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(len(names), len(names)))
    _, labels = scipy.sparse.csgraph.connected_components(graph, directed=False)
    joined = set(labels[len(system.lumps):])
    stranded = [name for name, label in zip(system.lumps, labels, strict=False) if label not in joined]
    if stranded:
        shown = ", ".join(stranded[:5]) + (f" and {len(stranded) - 5} more" if len(stranded) > 5 else "")
        raise InputError(f"no heat path to an ambient from lump {shown}", where=f"[lumps.{stranded[0]}]",
                         remedy="Add a [[links]] entry that joins it, directly or through other lumps, to an ambient.")


def _fit_is_possible(system: System) -> None:
    for name, bounds in system.fit.items():
        value = read_parameter(system, name)
        if not bounds.lower <= value <= bounds.upper:
            raise InputError(f"its value {value} is outside [{bounds.lower}, {bounds.upper}]", where=f'[fit] "{name}"',
                             remedy="Widen the range, or start inside it.")
