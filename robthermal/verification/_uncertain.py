"""Uncertain numbers of a system: the network with each at its worst end, or with every end as one more vertex.

Links: the least conductance stays linear, what may be on top of it is a slope between zero and the width of the range;
natural convection and radiation: the slopes reach from those of the least to those of the largest coefficient.
Capacities: the largest (the inequalities only ask for more where a capacity is larger). Modules: the Jacobian is affine
in the values and slopes of S, R and K, so the combinations of their ends suffice (proof note, 9).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any

from flint import fmpq

from robthermal.errors import InputError

from ._fields import Interval, interval, mapping
from ._hash import short_hash
from ._numbers import name_of, show
from ._system import Link, Module, ThermalSystem, link_names, say_interval, say_system

Parameters = tuple[tuple[str, Interval], ...]
_PROPERTIES = ("seebeck", "resistance", "conductance")
_WHERE = "region.parameters"
_NUMBERS = {"conductance": "conductance", "natural.gain": "gain", "radiation": "radiation"}  # of a link
_LISTED = 12  # ranges in a sentence; more are counted, with the hash of their table


def read_parameters(region: Mapping[str, Any]) -> Parameters:
    """Return the named ranges of a box; none where the box has no such key."""
    table = mapping(region.get("parameters", {}), _WHERE)
    return tuple((name, interval(table[name], f"{_WHERE}[{name_of(name)}]")) for name in table)


def say_parameters(parameters: Parameters) -> str:
    """Return for which parameters a claim holds: the nominal ones, or all of the ranges, listed where they are few."""
    if not parameters:
        return "nominal parameters"
    count = len(parameters)
    words = (": " + ", ".join(f"{name_of(name)} in {say_interval(box)}" for name, box in parameters)
             if count <= _LISTED else f" of table {short_hash(dict(parameters))}")
    return f"for all values of {count} parameter{'' if count == 1 else 's'}{words}"


def say_subject(system: ThermalSystem, parameters: Parameters, machine: str, plant: str = "continuous plant") -> str:
    """Return the subject of a claim: which machine, which plant, for which parameters."""
    return f"{say_system(system, machine)}, {plant}, {say_parameters(parameters)}"


def worst_system(system: ThermalSystem, section: Mapping[str, Any], parameters: Parameters, *,
                 nonlinear: bool = False) -> ThermalSystem:
    """Return the network whose inequalities imply those of every network in the ranges.

    ``nonlinear``: whether the claim covers ranges of natural convection and radiation.
    """
    modules = {module.name: k for k, module in enumerate(system.modules)}
    lumps = {name: k for k, name in enumerate(system.lumps)}
    links = _unique(link_names(section))
    ends: list[dict[tuple[str, int], Interval]] = [{} for _ in system.modules]
    capacity, changed = list(system.capacity), list(system.links)
    for name, (low, high) in parameters:
        where = f"{_WHERE}[{name_of(name)}]"
        table, _, rest = name.partition(".")
        part, _, key = rest.rpartition(".")
        if table == "lumps" and key == "capacity" and part in lumps:
            _at_least(low, fmpq(0), where, strict=True)
            must_contain((low, high), system.capacity[lumps[part]], where)
            capacity[lumps[part]] = high
        elif table == "links" and (place := _link_number(rest, links, nonlinear)) is not None:
            k, field = place
            _at_least(low, fmpq(0), where, strict=False)
            must_contain((low, high), getattr(system.links[k], field), where)
            changed[k] = _with_range(changed[k], field, low, high)
        elif table == "modules" and (found := _property(part, key, modules)) is not None:
            k, (prop, index) = found
            must_contain((low, high), getattr(system.modules[k], prop)[index], where)
            ends[k][prop, index] = (low, high)
        else:
            raise InputError("no such number can be uncertain", where=where,
                             expected="lumps.NAME.capacity, links.NAME.conductance (of one link)"
                                      + (", links.NAME.natural.gain, links.NAME.radiation" if nonlinear else "")
                                      + ", or modules.NAME.{seebeck,resistance,conductance}.{value,slope}")
    variants = tuple(_variants(module, own) for module, own in zip(system.modules, ends, strict=True))
    return replace(system, capacity=tuple(capacity), links=tuple(changed), variants=variants)


def _link_number(rest: str, links: Mapping[str, int], nonlinear: bool) -> tuple[int, str] | None:
    """Return which link and which of its numbers a name after "links." means."""
    for key, field in _NUMBERS.items():
        part = rest.removesuffix(f".{key}")
        if part != rest and part in links and (nonlinear or field == "conductance"):
            return links[part], field
    return None


def _with_range(link: Link, field: str, low: fmpq, high: fmpq) -> Link:
    if field == "conductance":
        return replace(link, conductance=low, spread=high - low)
    if field == "gain":
        return replace(link, gain=low, gain_spread=high - low)
    return replace(link, radiation=low, radiation_spread=high - low)


def _unique(names: list[str]) -> dict[str, int]:
    """Return the places of names that are given once."""
    counts = Counter(names)
    return {name: k for k, name in enumerate(names) if counts[name] == 1}


def must_contain(box: Interval, value: fmpq, where: str) -> None:
    """Refuse a range without the machine's own number: the claim names this machine."""
    if not box[0] <= value <= box[1]:
        raise InputError(f"the range {say_interval(box)} excludes the number of the system, {show(value)}", where=where,
                         expected="a range around it")


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


def _at_least(low: fmpq, least: fmpq, where: str, *, strict: bool) -> None:
    if low < least or (strict and low == least):
        raise InputError("the lower end is not positive" if strict else "the lower end is negative", where=where)
