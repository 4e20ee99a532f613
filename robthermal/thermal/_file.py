"""System files: TOML in, TOML out, exact round trip."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from .._celsius import HIGHEST_CELSIUS, LOWEST_KELVIN
from .._write import write
from ..errors import InputError
from ..signals import declared
from ._parameters import LISTED
from ._parts import Part
from ._system import System, build
from ._units import celsius_to_kelvin, kelvin_to_celsius

_MAX_BYTES = 200_000_000
_TEMPERATURES = {"ambients": ("temperature",), "lumps": ("initial", "condensation.dew_point"),
                 "modules": ("reference_temperature",), "sensors": ("initial",),
                 "links": ("temperature_law.reference_temperature",)}
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def read_system(path: str | Path) -> System:
    """Read a thermal system from a TOML file.

    Parameters
    ----------
    path : str or Path
        File as described in the documentation, "System file".

    Returns
    -------
    System

    Raises
    ------
    InputError
        Naming file, table, key, value and remedy.

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.systems.two_module()
    >>> rt.thermal.write_system(system, "setup.toml")
    >>> rt.read_system("setup.toml") == system
    True
    """
    path = Path(path)
    return parse_system(_text(path), str(path))


def parse_system(text: str, where: str = "system text") -> System:
    """Read a thermal system from TOML text.

    Parameters
    ----------
    text : str
        Content of a system file.
    where : str
        Name used in messages.

    Returns
    -------
    System

    Raises
    ------
    InputError
        As `read_system`.

    Examples
    --------
    >>> import robthermal as rt
    >>> text = rt.thermal.format_system(rt.systems.two_module())
    >>> rt.thermal.parse_system(text) == rt.systems.two_module()
    True
    """
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"is not valid TOML: {error}", where=where, remedy="Correct the line it names.") from None
    flat = _flat(data, where)
    declared((flat.get("record", {}), flat.get("columns", {}), where))  # refuses what no reader would take
    return build(_kelvin(flat, where), where)


def write_system(system: System, path: str | Path) -> None:
    """Write a system to a TOML file; reading it back gives an equal system.

    Parameters
    ----------
    system : System
        What to write.
    path : str or Path
        File to write, TOML.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.write_system(rt.systems.two_module(), "setup.toml")
    """
    write(path, format_system(system).encode("utf-8"))


def format_system(system: System) -> str:
    """TOML text of a system.

    Parameters
    ----------
    system : System
        What to write.

    Returns
    -------
    str

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.format_system(rt.systems.two_module()).splitlines()[0]
    '[system]'
    """
    return "\n".join(_lines(system)) + "\n"


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise InputError(f"is larger than {_MAX_BYTES // 1_000_000} MB", where=str(path),
                             remedy="Large networks: use rt.thermal.system_from_matrices.")
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=str(path), remedy="Check the path.") from None
    except UnicodeDecodeError:
        raise InputError("is not a text file in UTF-8", where=str(path), expected="a system file in TOML",
                         remedy="Is this the right file?") from None
    if not text.strip():
        raise InputError("is empty", where=str(path), expected="a system file in TOML",
                         remedy="Is this the right file?")
    return text


def _flat(data: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Move the keys of [system] to the top, as in `System`."""
    data = dict(data)
    head = data.pop("system", {})
    if not isinstance(head, dict):
        raise InputError(f"system = {head!r}", where=where, expected="a table [system]")
    for key in ("name", "temperature_unit"):
        if key in data:
            raise InputError(f"{key!r} stands outside a table", where=where, remedy="Put it under [system].")
    unknown = [key for key in head if key not in ("name", "temperature_unit")]
    if unknown:
        raise InputError(f"unknown key {unknown[0]!r}", where=f"{where} [system]", expected="name, temperature_unit",
                         remedy="Remove it, or correct its spelling.")
    if "temperature_unit" not in head:
        raise InputError("key 'temperature_unit' is missing", where=f"{where} [system]",
                         remedy='Add temperature_unit = "degC" or "K": all temperatures of the file and its records.')
    return {**data, **head}


def _kelvin(data: dict[str, Any], where: str) -> dict[str, Any]:
    """Convert the temperatures of the file, after catching Celsius declared as kelvin and the reverse."""
    unit = data.get("temperature_unit")
    if unit not in ("K", "degC"):
        raise InputError(f"temperature_unit = {unit!r}", where=f"{where} [system]", expected='"degC" or "K"',
                         remedy='Write "degC" or "K".')
    for table, keys in _TEMPERATURES.items():
        for key in keys:
            parts = data.get(table)
            if isinstance(parts, dict):
                data[table] = {name: _part_kelvin(part, key, unit, f"{where} [{table}.{name}] {key}")
                               for name, part in parts.items()}
            elif isinstance(parts, list):
                data[table] = [_part_kelvin(part, key, unit, f"{where} [[{table}]] number {number} {key}")
                               for number, part in enumerate(parts, start=1)]
    if isinstance(data.get("fit"), dict):
        data["fit"] = fit_in_kelvin(data["fit"], unit)
    return data


def _part_kelvin(part: Any, key: str, unit: str, where: str) -> Any:
    outer, _, inner = key.partition(".")
    if isinstance(part, dict) and inner and outer in part:
        return {**part, outer: _part_kelvin(part[outer], inner, unit, where)}
    if not isinstance(part, dict) or not _is_number(part.get(key)):
        return part
    value = float(part[key])
    if unit == "K" and value < LOWEST_KELVIN:
        raise InputError(f"{value} K is below {LOWEST_KELVIN:.0f} K: it looks like degrees Celsius declared as kelvin",
                         where=where, remedy='Set temperature_unit = "degC", or give kelvin. Machines colder than '
                                             f"{LOWEST_KELVIN:.0f} K are not modelled.")
    if unit == "degC" and value > HIGHEST_CELSIUS:
        raise InputError(f"{value} °C is above {HIGHEST_CELSIUS:.0f} °C: it looks like kelvin declared as Celsius",
                         where=where, remedy='Set temperature_unit = "K", or give degrees Celsius. A part that is '
                                             "so hot is given in a file in kelvin.")
    return {**part, key: _convert(value) if unit == "degC" else value}


def _convert(value: float) -> float:
    return celsius_to_kelvin(value) if value == value and abs(value) != float("inf") else value


def fit_in_kelvin(fit: Mapping[str, Any], unit: str) -> dict[str, Any]:
    """Convert the bounds of temperatures in a [fit] table to kelvin.

    Parameters
    ----------
    fit : mapping
        Parameter name to {lower, upper, sigma}, as in a system file.
    unit : {"K", "degC"}
        Unit of the file.

    Returns
    -------
    dict

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.fit_in_kelvin({"ambients.room.temperature": {"lower": 20.0, "upper": 25.0}}, "degC")
    {'ambients.room.temperature': {'lower': 293.15, 'upper': 298.15}}
    """
    return {name: _shifted(bounds, _convert) if unit == "degC" and _is_temperature(name) else bounds
            for name, bounds in fit.items()}


def _shifted(bounds: Any, convert: Any) -> Any:
    if not isinstance(bounds, dict):
        return bounds
    return {key: convert(float(v)) if key in ("lower", "upper") and _is_number(v) else v for key, v in bounds.items()}


def _is_temperature(name: str) -> bool:
    return any(name.startswith(table + ".") and name.endswith("." + key)
               for table, keys in _TEMPERATURES.items() for key in keys)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _lines(system: System) -> Iterator[str]:
    convert = kelvin_to_celsius if system.temperature_unit == "degC" else float
    yield "[system]"
    yield f"name = {_string(system.name)}"
    yield f"temperature_unit = {_string(system.temperature_unit)}"
    for table in ("ambients", "lumps", "links", "inputs", "modules", "leads", "flows", "sensors"):
        parts = getattr(system, table)
        named = [(f"[[{table}]]", part) for part in parts] if table in LISTED else [
            (f"[{table}.{_key(name)}]", part) for name, part in parts.items()]
        for header, part in named:
            yield ""
            yield header
            fields = part.model_dump(exclude_unset=True)
            for key in _TEMPERATURES.get(table, ()):
                _convert_key(fields, key, convert)
            yield from (f"{_key(key)} = {_value(value)}" for key, value in fields.items() if value is not None)
    if system.fit:
        yield ""
        yield "[fit]"
        for name, bounds in system.fit.items():
            fields = bounds.model_dump(exclude_unset=True)
            yield f"{_string(name)} = {_value(_shifted(fields, convert) if _is_temperature(name) else fields)}"
    for table in ("record", "columns"):
        if getattr(system, table):
            yield from ("", f"[{table}]")
            yield from (f"{_key(key)} = {_value(value)}" for key, value in getattr(system, table).items())


def _convert_key(fields: dict[str, Any], key: str, convert: Callable[[float], float]) -> None:
    *outer, last = key.split(".")
    for word in outer:
        fields = fields.get(word) or {}
    if fields.get(last) is not None:
        fields[last] = convert(fields[last])


def _value(value: Any) -> str:
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    if isinstance(value, Part):
        return _value(value.model_dump(exclude_unset=True))
    return repr(float(value))


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _string(name)


def _string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
