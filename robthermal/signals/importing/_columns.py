"""Which column of a file is what in the system, in which unit it is read and kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from ...errors import InputError
from .._names import suggestion
from .._thermistor import Thermistor
from ._channel import Channel
from ._heater import heater_channel
from ._missing import KINDS, Sought, missing, refuse_misspelt
from ._options import ColumnChoice, Declared
from ._table import Table
from ._tokens import short
from ._units import LISTED, Unit, split_header, unit_of

Limits = tuple[float, float] | None
_SI = {"temperature": "K", "current": "A", "power": "W", "voltage": "V", "resistance": "ohm", "percent": "%"}


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


def channels_of_system(table: Table, system: SystemLike, choice: Declared, time: Sequence[int]) -> tuple[Channel, ...]:
    """Channels of a system that the file has: heaters and currents must be there, ambients and sensors may.

    Raises
    ------
    InputError
        A heater or current without a column, a mapped name that the system does not have, units that do not fit.
    """
    volts = dict(getattr(system, "sensor_units", {}))
    roles = {
        **dict.fromkeys(system.input_names, "input"),
        **dict.fromkeys(system.module_names, "current"),
        **dict.fromkeys(system.ambient_names, "ambient"),
        **{name: "voltage" if volts.get(name) == "V" else "sensor" for name in system.sensor_names},
    }
    for name, picked in choice.columns.items():
        if name not in roles:
            swapped = picked.column in roles and f'The name of the system comes first: {picked.column} = "{name}".'
            raise InputError(
                f"columns has {name!r}, which is no name of the system",
                where=table.where,
                remedy=swapped or suggestion(name, tuple(roles)),
            )
    units = dict(getattr(system, "input_units", {}))
    gains = dict(getattr(system, "input_gains", {}))
    sought = [Sought(name, role, choice.columns.get(name), units.get(name), gains.get(name, 1.0))
              for name, role in roles.items()]
    places = match(table, sought, time)
    free = _free(table, places, time)
    for one in sought:
        if one.name not in places:
            refuse_misspelt(table, one, free)
            if one.role in ("input", "current"):
                raise missing(table, one, free)
    found = []
    for name, role in roles.items():
        if name in places:
            unit, gain = units.get(name), gains.get(name, 1.0)
            found.append(_channel(table, name, role, places[name], choice, system.temperature_unit, unit, gain))
    return tuple(found)


def channels_of_names(
    table: Table, inputs: Sequence[str], outputs: Sequence[str], choice: Declared, time: Sequence[int]
) -> tuple[Channel, ...]:
    """Channels as the caller lists them; outputs without a unit are temperatures."""
    sought = [Sought(name, picked=choice.columns.get(name)) for name in (*inputs, *outputs)]
    places = match(table, sought, time)
    found = []
    for one in sought:
        if one.name not in places:
            raise missing(table, one, _free(table, places, time))
        name, place = one.name, places[one.name]
        picked = choice.columns.get(name)
        if picked is not None and picked.resistance is not None:
            found.append(_channel(table, name, "input" if name in inputs else "output", place, choice, "K", None, 1.0))
            continue
        written = split_header(table.headers[place])[1]
        own = written is not None and unit_of(written) is None and (picked is None or picked.unit is None)
        unit = None if own else _unit(table, name, place, picked)
        resistive = picked is not None and picked.thermistor is not None
        sensor = name in outputs and not own and (unit is None or unit.quantity == "temperature" or resistive)
        if sensor and (resistive or unit is not None or choice.record.temperature_unit is not None):
            found.append(
                _channel(table, name, "sensor", place, choice, choice.record.temperature_unit or "K", None, 1.0)
            )
        else:  # a unit that is not known, or none at all: numbers as they are
            kept = written if own else _SI.get(unit.quantity, unit.name) if unit else ""
            found.append(
                Channel(
                    name,
                    "sensor" if sensor else "output" if name in outputs else "input",
                    place,
                    unit,
                    kept or "",
                    *_scaling(picked),
                )
            )
    return tuple(found)


def match(table: Table, wanted: Sequence[Sought], time: Sequence[int]) -> dict[str, int]:
    """Name to column: as declared, else by exact header, else by header without unit, else without case."""
    free = [k for k, header in enumerate(table.headers) if header and k not in time]
    exact: dict[str, list[int]] = {}
    for k in free:
        exact.setdefault(table.headers[k], []).append(k)
    bare: dict[str, list[int]] = {}
    for k in free:
        bare.setdefault(split_header(table.headers[k])[0], []).append(k)
    folded: dict[str, list[int]] = {}
    for k in free:
        folded.setdefault(split_header(table.headers[k])[0].casefold(), []).append(k)
    places: dict[str, int] = {}
    columns = {one.name: one.picked for one in wanted if one.picked is not None}
    absent: list[Sought] = []
    for one in wanted:
        name = one.name
        asked = columns[name].column.strip() if name in columns else name
        name_only = split_header(asked)[0] if name in columns else asked
        found = (
            exact.get(asked)
            or bare.get(asked)
            or (exact.get(name_only) or bare.get(name_only) if name in columns else None)
            or folded.get(asked.casefold())
        )
        if not found:
            absent += [one] if name in columns else []
            continue
        if len(found) > 1:
            listed = ", ".join(repr(table.headers[k]) for k in found[:4])
            raise InputError(
                f"columns {listed} have the same name {asked!r}",
                where=table.where,
                expected="one column",
                remedy=f'Write columns {name} = "HEADER" exactly, or rename one.',
            )
        places[name] = found[0]
    if absent:
        others = {one.name for one in wanted} - {absent[0].name}
        left = [k for k in _free(table, places, time) if split_header(table.headers[k])[0] not in others]
        raise missing(table, absent[0], left)
    used: dict[int, str] = {}
    for name, place in places.items():
        if place in used and name not in columns and used[place] not in columns:
            raise InputError(
                f"{used[place]!r} and {name!r} both match column {table.headers[place]!r}",
                where=table.where,
                expected="a column for each",
                remedy=f"Write --column '{name}=HEADER'.",
            )
        used[place] = name
    return places


def _channel(
    table: Table, name: str, role: str, place: int, choice: Declared, default: str, own: str | None, gain: float
) -> Channel:
    picked = choice.columns.get(name)
    header, scaling = table.headers[place], _scaling(picked)
    where = f"{table.where}, column {header!r}"
    text = _unit_of_its_own(table, name, place, picked, own, gain) if role == "input" else None
    if text is not None:
        return Channel(name, role, place, None, text, *scaling)
    unit = _unit(table, name, place, picked, role, own)
    resistance = None if picked is None else picked.resistance
    if resistance is not None and role != "input":
        raise InputError(f"{name!r} is a {KINDS.get(role, role)}, and a resistance is declared for it", where=where,
                         expected="a heater, cells in V or A", remedy="Remove resistance.")
    if picked is not None and picked.thermistor is not None:
        return _thermistor(name, role, place, unit, picked.thermistor, scaling, where)
    if role in ("sensor", "ambient"):
        unit = unit or unit_of(choice.record.temperature_unit or default)
        if unit is None or unit.quantity != "temperature":
            if not scaling[2]:
                raise InputError(
                    f"{name!r} is a temperature and the column is in {unit.name if unit else '?'}",
                    where=where,
                    expected="K, mK, °C or °F",
                    remedy=f"Convert it with scale and offset: {name} = {{ column = "
                    f'"{header}", scale = 1.0, offset = 0.0 }}.',
                )
            unit = unit_of(choice.record.temperature_unit or default)
        return Channel(name, role, place, unit, "K", *scaling)
    if role in ("current", "voltage"):
        kept = _SI[role]
        if unit is not None and unit.quantity != role and not scaling[2]:
            raise InputError(
                f"the {role} {name!r} is in [{unit.name}]",
                where=where,
                expected=f"{kept} or m{kept}",
                remedy=f"Another column? Write --column '{name}=HEADER'.",
            )
        return Channel(name, role, place, unit, kept, *scaling)
    return heater_channel(name, place, unit, own, gain, scaling, where, resistance)


def _thermistor(name: str, role: str, place: int, unit: Unit | None, characteristic: Thermistor,
                scaling: tuple[float, float, bool], where: str) -> Channel:
    """A temperature whose cells are ohms, or volts or counts of a divider."""
    wanted = "ohm" if characteristic.divider is None else "V, mV, or counts without a unit"
    fits = unit is None or unit.quantity == ("resistance" if characteristic.divider is None else "voltage")
    if role not in ("sensor", "ambient") or not fits:
        what = f"{name!r} is a {KINDS.get(role, role)}" if role not in ("sensor", "ambient") else (
            f"the column is in {unit.name if unit else '?'}")
        raise InputError(f"{what}, and a thermistor is declared for it", where=where,
                         expected=f"a sensor or ambient, cells in {wanted}", remedy="Remove thermistor, or the unit.")
    return Channel(name, role, place, unit, "K", *scaling, characteristic)


def _written(table: Table, name: str, place: int, picked: ColumnChoice | None) -> str | None:
    """Unit that the header or the units row says, as it is written there."""
    return table.unit_text(place, name if picked is None else "")


def _unit_of_its_own(table: Table, name: str, place: int, picked: ColumnChoice | None, own: str | None,
                     gain: float) -> str | None:
    """A unit that is not known, such as l/min, of an input that is kept in it: the system says so, or it is no heat."""
    written = _written(table, name, place, picked)
    text = written if picked is None or picked.unit is None else picked.unit.strip()
    if text is None or any(unit_of(one or "") is not None for one in (text, written)):
        return None
    return text if text == own or own is None and gain == 0.0 else None


def _unit(table: Table, name: str, place: int, picked: ColumnChoice | None, role: str = "",
          own: str | None = None) -> Unit | None:
    """Unit of a used column, from its header, the units row or the declaration; two that differ are refused."""
    header = table.headers[place]
    where = f"{table.where}, column {header!r}"
    written, known = _written(table, name, place, picked), None
    if written is not None:
        known = unit_of(written)
        if known is None and not (picked is not None and picked.unit is not None):
            raise InputError(
                f"its unit {short(written)} is not known",
                where=where,
                expected="a known unit",
                remedy=(f'Write unit = "{written}" in [inputs.{name}]; or ' if role == "input" else "Write ")
                + f'[columns] {name} = {{ column = "{header}", unit = "{own or "…"}" }}; known: {LISTED}.',
            )
    asked = picked.unit if picked is not None and picked.unit is not None else None
    if picked is not None and asked is None and picked.column.strip() != header:
        asked = split_header(picked.column.strip())[1]
    if asked is None:
        return known
    declared = unit_of(asked)
    if declared is None and known is None:
        own_too = f'Write unit = "{asked.strip()}" in [inputs.{name}] too; or one of: ' if role == "input" else "Write "
        raise InputError(f"the declared unit {short(asked)} is not known", where=where, expected="a known unit",
                         remedy=f"{own_too}{LISTED}.")
    if known is not None and not known.same_as(declared):
        raise InputError(
            f"the header says {known.name} and the declaration {declared.name if declared else short(asked)}",
            where=where,
            expected="one unit",
            remedy="Remove the declaration, or correct it.",
        )
    return declared


def _scaling(picked: ColumnChoice | None) -> tuple[float, float, bool]:
    if picked is None or picked.scale is None and picked.offset is None:
        return 1.0, 0.0, False
    return (1.0 if picked.scale is None else picked.scale), picked.offset or 0.0, True


def _free(table: Table, places: Mapping[str, int], time: Sequence[int]) -> list[int]:
    """Columns with a header that nobody uses."""
    used = {*places.values(), *time}
    return [k for k, header in enumerate(table.headers) if header and k not in used]
