"""Which column of a file is what: time, inputs, outputs; units in the headers; names nobody knows."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..errors import InputError
from ._checks import channel_names, distinct
from ._names import misspelt, suggestion

_UNIT = re.compile(r"^(.*?)\s*\[([^\[\]]*)\]\s*$")
_SECONDS = ("s", "sec", "second", "seconds")
_KELVIN, _CELSIUS = ("K", "kelvin"), ("degC", "°C", "℃", "C", "celsius", "degree Celsius")
_TEMPERATURES = (*_KELVIN, *_CELSIUS, "degF", "°F", "F", "degR", "mK")
_AMPERE = ("A", "ampere")

Limits = tuple[float, float] | None


class SystemLike(Protocol):
    """What the reader asks of a system; `robthermal.System` has it."""

    @property
    def temperature_unit(self) -> str: ...
    @property
    def input_names(self) -> Sequence[str]: ...
    @property
    def module_names(self) -> Sequence[str]: ...
    @property
    def ambient_names(self) -> Sequence[str]: ...
    @property
    def sensor_names(self) -> Sequence[str]: ...
    @property
    def current_limits(self) -> Mapping[str, Limits]: ...
    @property
    def input_limits(self) -> Mapping[str, Limits]: ...


@dataclass(frozen=True)
class Layout:
    """Names of the record's channels and their columns in the file."""

    time: str
    headers: dict[str, str]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    temperatures: tuple[str, ...]
    interpolated_inputs: tuple[str, ...]
    units: dict[str, str]
    temperature_unit: str
    unit_declared: bool
    unknown: tuple[str, ...]


def layout_for_system(headers: Sequence[str], system: SystemLike, temperature_unit: str | None, where: str) -> Layout:
    """Heaters and module currents must be there; ambients and sensors may."""
    unit = _temperature_unit(temperature_unit, str(system.temperature_unit))
    driven = (*system.input_names, *system.module_names)
    measured = (*system.ambient_names, *system.sensor_names)
    time, named, units = _named(headers, (*driven, *measured), where)
    missing = [name for name in (*driven, *measured) if name not in named]
    unknown = tuple(name for name in named if name not in (*driven, *measured))
    for name in unknown:
        _refuse_misspelt(name, missing, where)
    for name in driven:
        if name not in named:
            kind = "heater" if name in system.input_names else "module current"
            raise InputError(
                f"there is no column {name!r} ({kind})",
                where=where,
                expected=f"a column for every heater and module: {', '.join(driven)}",
                remedy=f"Add a column {name!r}; zeros if it was off.",
            )
    ambients = tuple(name for name in system.ambient_names if name in named)
    sensors = tuple(name for name in system.sensor_names if name in named)
    for name in system.module_names:
        _check_ampere(name, units.get(name), where)
        units[name] = "A"
    for name in (*ambients, *sensors):
        _check_temperature(name, units.get(name), unit, where)
        units[name] = "K"
    return Layout(
        time, named, (*driven, *ambients), sensors, (*ambients, *sensors), ambients,
        {name: units[name] for name in (*driven, *ambients, *sensors) if name in units}, unit, True, unknown,
    )  # fmt: skip


def layout_for_names(
    headers: Sequence[str],
    inputs: Sequence[str] | None,
    outputs: Sequence[str] | None,
    temperature_unit: str | None,
    where: str,
) -> Layout:
    """Columns as the caller lists them; `temperature_unit` is that of the outputs."""
    ins, outs = channel_names(inputs or (), "inputs"), channel_names(outputs or (), "outputs")
    distinct(ins, outs)
    if not ins and not outs:
        raise InputError(
            "neither a system nor column names are given",
            where="arguments system, inputs and outputs",
            remedy="Write read_record(path, system), or inputs=['heater'], outputs=['T1'].",
        )
    unit = _temperature_unit(temperature_unit, "K")
    time, named, units = _named(headers, (*ins, *outs), where)
    for name in (*ins, *outs):
        if name not in named:
            raise InputError(f"there is no column {name!r}", where=where, remedy=suggestion(name, tuple(named)))
    temperatures = []
    for name in outs:
        if name not in units:
            temperatures.append(name)
        elif units[name] in _TEMPERATURES:
            _check_temperature(name, units[name], unit, where)
            temperatures.append(name)
        # Any other unit in the header: not a temperature, taken as it is.
    if temperature_unit is not None:
        units |= dict.fromkeys(temperatures, "K")
    elif temperatures:
        units |= {name: "K" for name in temperatures if name in units}
    unknown = tuple(name for name in named if name not in (*ins, *outs))
    return Layout(
        time, named, ins, outs, tuple(temperatures), (),
        {name: units[name] for name in (*ins, *outs) if name in units}, unit, temperature_unit is not None, unknown,
    )  # fmt: skip


def _named(headers: Sequence[str], wanted: Sequence[str], where: str) -> tuple[str, dict[str, str], dict[str, str]]:
    """Header of the time column; name to header and name to unit of the others."""
    time: list[str] = []
    named: dict[str, str] = {}
    units: dict[str, str] = {}
    for header in headers:
        name, unit = _split(header, wanted)
        if name.lower() == "time" and name not in wanted:
            time.append(header)
            if unit is not None and unit not in _SECONDS:
                raise InputError(
                    f"the time column {header!r} is in {unit}",
                    where=where,
                    expected="seconds",
                    remedy="Convert it to seconds.",
                )
            continue
        if name in named:
            raise InputError(
                f"columns {named[name]!r} and {header!r} have the same name", where=where, remedy="Rename one of them."
            )
        named[name] = header
        if unit is not None:
            units[name] = unit
    if len(time) != 1:
        what = f"there are {len(time)} time columns ({', '.join(time)})" if time else "there is no column 'time'"
        raise InputError(
            what, where=where, expected="one column 'time' [s]", remedy=f"Columns in the file: {', '.join(headers)}."
        )
    return time[0], named, units


def _split(header: str, wanted: Sequence[str]) -> tuple[str, str | None]:
    """Name and unit of a header such as ``m1 [A]``."""
    match = _UNIT.match(header)
    if header in wanted or match is None or not match[1]:
        return header, None
    return match[1], match[2].strip()


def _refuse_misspelt(name: str, missing: Sequence[str], where: str) -> None:
    meant = misspelt(name, missing)
    if meant is not None:
        raise InputError(
            f"column {name!r} is unknown and column {meant!r} is missing",
            where=where,
            remedy=f"Rename it to {meant!r}; if it is something else, give it a name less alike.",
        )


def _check_ampere(name: str, unit: str | None, where: str) -> None:
    if unit is not None and unit not in _AMPERE:
        raise InputError(
            f"the current {name!r} is in [{unit}]",
            where=where,
            expected="ampere [A]",
            remedy="Convert it to ampere (1 A = 1000 mA).",
        )


def _check_temperature(name: str, unit: str | None, declared: str, where: str) -> None:
    fitting = _KELVIN if declared == "K" else _CELSIUS
    if unit is not None and unit not in fitting:
        raise InputError(
            f"column {name!r} is in [{unit}] and temperature_unit is {declared!r}",
            where=where,
            expected=f"temperatures in {declared}",
            remedy="Set temperature_unit (of the system file, or of read_record) to the unit of the file."
            if unit in (*_KELVIN, *_CELSIUS)
            else "Convert the column.",
        )


def _temperature_unit(value: str | None, default: str) -> str:
    unit = default if value is None else value
    if unit not in ("K", "degC"):
        raise InputError(f"temperature_unit is {unit!r}", where="argument temperature_unit", expected="'K' or 'degC'")
    return unit
