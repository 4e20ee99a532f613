"""Uncertain numbers of a system: the network with each at its worst end, or with every end as one more vertex.

Links: the least conductance stays linear, what may be on top of it is a slope between zero and the width of the range.
Capacities: the largest (the inequalities only ask for more where a capacity is larger). Modules: the Jacobian is affine
in the values and slopes of S, R and K, so the combinations of their ends suffice (proof note, 9).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any

from flint import fmpq

from robthermal.errors import InputError

from ._fields import Interval, interval, mapping
from ._numbers import name_of
from ._system import Module, ThermalSystem, say_interval

Parameters = tuple[tuple[str, Interval], ...]
_PROPERTIES = ("seebeck", "resistance", "conductance")
_WHERE = "region.parameters"


def read_parameters(region: Mapping[str, Any]) -> Parameters:
    """Return the named ranges of a box; none where the box has no such key."""
    table = mapping(region.get("parameters", {}), _WHERE)
    return tuple((name, interval(table[name], f"{_WHERE}[{name_of(name)}]")) for name in table)


def say_parameters(parameters: Parameters) -> str:
    """Return the ranges for a claim, empty where nothing is uncertain."""
    words = ", ".join(f"{name_of(name)} in {say_interval(box)}" for name, box in parameters)
    return f" and for all parameters {words}" if words else ""


def worst_system(system: ThermalSystem, section: Mapping[str, Any], parameters: Parameters) -> ThermalSystem:
    """Return the network whose inequalities imply those of every network in the ranges."""
    ends: list[dict[tuple[str, int], Interval]] = [{} for _ in system.modules]
    modules = {module.name: k for k, module in enumerate(system.modules)}
    links = _link_names(section, system)
    capacity, changed = list(system.capacity), list(system.links)
    for name, (low, high) in parameters:
        where = f"{_WHERE}[{name_of(name)}]"
        table, _, rest = name.partition(".")
        part, _, key = rest.rpartition(".")
        if table == "lumps" and key == "capacity" and part in system.lumps:
            _at_least(low, fmpq(0), where, strict=True)
            capacity[system.lumps.index(part)] = high
        elif table == "links" and key == "conductance" and links.count(part) == 1:
            _at_least(low, fmpq(0), where, strict=False)
            k = links.index(part)
            changed[k] = replace(changed[k], conductance=low, spread=high - low)
        elif table == "modules" and (found := _property(part, key, modules)) is not None:
            k, place = found
            ends[k][place] = (low, high)
        else:
            raise InputError("no such number can be uncertain", where=where,
                             expected="lumps.NAME.capacity, links.NAME.conductance (of one link), or "
                                      "modules.NAME.{seebeck,resistance,conductance}.{value,slope}")
    variants = tuple(_variants(module, own) for module, own in zip(system.modules, ends, strict=True))
    return replace(system, capacity=tuple(capacity), links=tuple(changed), variants=variants)


def _property(part: str, key: str, modules: Mapping[str, int]) -> tuple[int, tuple[str, int]] | None:
    name, _, prop = part.rpartition(".")
    if name not in modules or prop not in _PROPERTIES or key not in ("value", "slope"):
        return None
    return modules[name], (prop, ("value", "slope").index(key))


def _variants(module: Module, ends: Mapping[tuple[str, int], Interval]) -> tuple[Module, ...]:
    found = []
    for chosen in product(*(sorted(set(pair)) for pair in ends.values())):
        at = dict(zip(ends, chosen, strict=True))
        S, R, K = ((at.get((prop, 0), value), at.get((prop, 1), slope)) for prop, (value, slope) in
                   zip(_PROPERTIES, (module.seebeck, module.resistance, module.conductance), strict=True))
        found.append(replace(module, seebeck=S, resistance=R, conductance=K))
    return tuple(found)


def _link_names(section: Mapping[str, Any], system: ThermalSystem) -> list[Any]:
    if len(section["links"]) != len(system.links):
        raise ValueError("a section and the system read from it have the same links")
    return [link.get("name", "-".join(link["between"])) for link in section["links"]]


def _at_least(low: fmpq, least: fmpq, where: str, *, strict: bool) -> None:
    if low < least or (strict and low == least):
        raise InputError("the lower end is not positive" if strict else "the lower end is negative", where=where)
