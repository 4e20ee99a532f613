"""Named parameters: read and replace any number of a system by its dotted name."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from ..errors import InputError

if TYPE_CHECKING:
    from ._parts import Part
    from ._system import System

_LINEAR = tuple(f"{p}.{k}" for p in ("seebeck", "resistance", "conductance") for k in ("value", "slope"))
_DRIVE = tuple(f"drive.{key}" for key in ("gain", "offset", "gain_slope", "cubic", "clip", "delay",
                                           "time_constant"))
FIELDS: dict[str, tuple[str, ...]] = {
    "ambients": ("temperature",),
    "lumps": ("capacity", "disturbance", "initial", "heat", "gradient", "periodic.heat", "periodic.period",
              "periodic.phase", "condensation.conductance", "condensation.dew_point"),
    "links": ("conductance", "natural.gain", "natural.exponent", "radiation", "step.relative", "step.time",
              "follow.relative", "temperature_law.exponent", "temperature_law.reference_temperature"),
    "inputs": ("gain", *_DRIVE, "drive.before", "power_slope", "feedthrough.share"),
    "modules": (*_LINEAR, "reference_temperature", "thomson", "joule_split", "hysteresis.heat",
                "hysteresis.time_constant", *_DRIVE, "drive.before"),
    "leads": ("resistance",), "flows": ("conductance",),
    "sensors": ("noise", "time_constant", "offset", "gain", "delay", "self_heating", "lead_resistance",
                "initial"),
}
_WORDS = {field: tuple(field.split(".")) for fields in FIELDS.values() for field in fields}
LISTED = ("links", "leads", "flows")  # tables that are lists of named parts
_KEPT = 4096  # names and parts that are remembered: a fit asks for the same ones thousands of times
_of_parts: dict[tuple[int, str, str], tuple[Part, tuple[tuple[str, float], ...]]] = {}


def parts_of(system: System, table: str) -> Mapping[str, Part]:
    """Parts of one table by name (those of lists too)."""
    parts = getattr(system, table)
    return {part.name: part for part in parts} if table in LISTED else parts


def parameters(system: System) -> Iterator[tuple[str, float]]:
    """Every number that is set, with its name."""
    for table in FIELDS:
        for name, part in parts_of(system, table).items():
            yield from _numbers(table, name, part)


def _numbers(table: str, name: str, part: Part) -> tuple[tuple[str, float], ...]:
    """Numbers of one part; those of the last parts are kept, for systems that differ in a few of them."""
    key = id(part), table, name
    known = _of_parts.get(key)
    if known is None:
        numbers = tuple((f"{table}.{name}.{field}", value) for field in FIELDS[table]
                        if (value := _get(part, field)) is not None)
        if len(_of_parts) >= _KEPT:
            _of_parts.clear()
        _of_parts[key] = known = part, numbers  # a part that is kept keeps its identity
    return known[1]


EFFECT_SIZES = {  # zero or absent: the effect is not there
    "lumps": ("heat", "gradient", "periodic.heat", "condensation.conductance"),
    "links": ("step.relative", "follow.relative", "temperature_law.exponent"),
    "inputs": (*_DRIVE, "power_slope", "feedthrough.share"), "leads": ("resistance",), "flows": ("conductance",),
    "sensors": ("self_heating",),
    "modules": ("thomson", "joule_split", "hysteresis.heat", *_DRIVE)}


def present_effects(system: System) -> Iterator[str]:
    """Names of the effects' sizes that are not zero."""
    for table, fields in EFFECT_SIZES.items():
        for name, part in parts_of(system, table).items():
            yield from (f"{table}.{name}.{field}" for field in fields if _get(part, field))


def locate(system: System, name: str) -> tuple[str, str, str]:
    """Split a parameter name into table, part and field; names may contain dots."""
    table, _, rest = name.partition(".")
    return _located(system, name, parts_of(system, table) if table in FIELDS else {})


def _located(system: System, name: str, parts: Mapping[str, Part]) -> tuple[str, str, str]:
    """As `locate`, with the parts of the table that the name begins with."""
    table, _, rest = name.partition(".")
    found = _split(table, rest, tuple(parts)) if table in FIELDS else None
    if found:
        return table, *found
    known = list(dict(parameters(system)))
    close = difflib.get_close_matches(name, known, n=1)
    remedy = f"Did you mean {close[0]!r}?" if close else f"For example {known[0]!r}."
    raise InputError(f"there is no parameter {name!r}", where="parameter name",
                     expected="TABLE.NAME.KEY as in the system file", remedy=remedy)


@lru_cache(_KEPT)
def _split(table: str, rest: str, parts: tuple[str, ...]) -> tuple[str, str] | None:
    """Part and field of a table's parameter."""
    for field in FIELDS[table]:
        part = rest.removesuffix("." + field)
        if part != rest and part in parts:
            return part, field
    return None


def number(system: System, name: str) -> float | None:
    """Value of one parameter, kelvin for temperatures; None if it is not set."""
    table, part, field = locate(system, name)
    return _get(parts_of(system, table)[part], field)


def read_parameter(system: System, name: str) -> float:
    """Value of one parameter, kelvin for temperatures."""
    value = number(system, name)
    if value is None:
        table, part, field = locate(system, name)
        raise InputError(f"{name!r} is not set in this system", where="parameter name",
                         remedy=f"Give {field} in [{table}.{part}] first.")
    return value


def replace_parameters(system: System, values: Mapping[str, float]) -> System:
    """Copy of the system with new values; each touched part is validated again."""
    changes: dict[str, dict[str, dict[str, float]]] = {}
    there: dict[str, Mapping[str, Part]] = {}
    for name, value in values.items():
        table = name.partition(".")[0]
        if table in FIELDS and table not in there:
            there[table] = parts_of(system, table)
        table, part, field = _located(system, name, there.get(table, {}))
        changes.setdefault(table, {}).setdefault(part, {})[field] = float(value)
    update: dict[str, Any] = {}
    for table, parts in changes.items():
        new = {name: _changed(part, parts[name], f"{table}.{name}") if name in parts else part
               for name, part in there[table].items()}
        update[table] = tuple(new.values()) if table in LISTED else new
    return system.model_copy(update=update)


def _get(part: Any, field: str) -> float | None:
    for word in _WORDS[field]:
        part = getattr(part, word) if part is not None else None
    return part


def _changed(part: Part, fields: Mapping[str, float], where: str) -> Part:
    data = _given(part)
    if "name" in type(part).model_fields:
        data["name"] = getattr(part, "name")  # noqa: B009 - only parts of lists have one
    for field, value in fields.items():
        *outer, last = _WORDS[field]
        target = data
        for word in outer:
            target[word] = target = _given(target.get(word))
        target[last] = value
    try:
        return type(part)(**data)
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        raise InputError(f"{'.'.join(map(str, fault['loc']))} = {fault['input']!r}: {fault['msg']}",
                         where=f"parameter of {where}", remedy="Keep it within what the part accepts.") from None


def _given(part: Any) -> dict[str, Any]:
    """What was given of a part: no defaults, and nothing where there is no part."""
    if part is None or isinstance(part, dict):
        return dict(part or {})
    return {key: getattr(part, key) for key in part.model_fields_set}
