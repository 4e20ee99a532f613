"""What a user may declare about a file: the tables [record] and [columns], checked, merged from several places."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal
from zoneinfo import ZoneInfo

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from ...errors import InputError
from .._names import suggestion
from .._stated import Averaged
from .._thermistor import Thermistor

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Line = Annotated[int, Field(ge=1)]


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class ColumnChoice(_Table):
    """Which column of the file a name of the system stands for.

    Parameters
    ----------
    column : str
        Header in the file, with or without its unit.
    constant : float, optional
        Instead of a column: what a heater, current or ambient was throughout, in `unit` or the unit of the system.
    unit : str, optional
        Unit of the cells, where the header does not say it.
    scale, offset : float, optional
        Value = scale · cell + offset, in the unit of the system (W for heaters, A, K); ohms before a `thermistor`.
    thermistor : Thermistor, optional
        The cells are resistances, or readings of a divider, and become temperatures.
    resistance : float, optional
        The cells are the voltage or the current of a heater of this resistance [Ω], and become its power, U²/R or
        I² R; `scale` and `offset` act before.
    """

    column: str = ""
    constant: Finite | None = None
    unit: str | None = None
    scale: Finite | None = None
    offset: Finite | None = None
    thermistor: Thermistor | None = None
    resistance: Positive | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> ColumnChoice:
        if self.constant is None and not self.column.strip():
            raise ValueError("names neither a column nor a constant")
        if self.constant is not None and self.model_fields_set - {"constant", "unit"}:
            raise ValueError("a constant has a unit and nothing else: no column, scale, offset, thermistor, resistance")
        return self


class ImportOptions(_Table):
    """How a measured file is to be read; every key is optional.

    Parameters
    ----------
    time : str or tuple of str, optional
        Header of the time column, or of date and time of day.
    time_format : str, optional
        "iso", "s", "ms", "us", "ns", "min", "h", "epoch_s", "epoch_ms", "epoch_us", "epoch_ns", "excel", "elapsed", or
        a pattern such as "%d.%m.%Y %H:%M:%S".
    timezone : str, optional
        Zone of stamps without one, for example "Europe/Berlin".
    sample_time : float, optional
        Of a file without a time column [s].
    delimiter, decimal, thousands, encoding : str, optional
        Of a text file.
    header_line, units_line : int, optional
        Lines of the file, counted from 1.
    sheet, variable : str, optional
        Sheet of a workbook; variable of a MATLAB file.
    header : tuple of str, optional
        Headers of a file that has none.
    temperature_unit : {"K", "degC"}, optional
        Of temperature columns without a unit; default the system's.
    hottest : float, optional
        Largest reading of a machine that is above 250 °C in every row [degC]: else such a column looks like kelvin.
    missing : tuple of float or str
        Fault codes that stand for a missing reading.
    gaps : {"split", "fill", "refuse"}
        What is done where rows or readings are missing.
    fill_up_to : int
        With "fill": longest gap that is filled [samples]; longer ones split.
    shortest : int
        Parts shorter than this are left out [samples].
    jitter : float
        Largest deviation of a step from the median, as a fraction of it, that is resampled [-].
    clock : {"stamps", "rows"}, optional
        Which is right where stamps jitter: they are, or the rows are even. Default: what the readings follow.
    duplicates : {"refuse", "first", "last", "mean"}
        Rows with one time stamp and different values.
    restarts : {"refuse", "split"}
        Time that jumps back.
    wraps_at : float, optional
        Value at which a time column of numbers starts again from zero, in the unit of that column: 4294967296 for
        a counter of 32 bits, such as the microseconds or milliseconds of a microcontroller.
    averaged : {"before", "after", "readings"}, optional
        Every value is the mean over the step before its stamp, or after it; or readings alone are, over the step
        before, and inputs hold from the stamp on. Default: values at the stamp.
    means_of : int, optional
        Samples that become one step by their means, as `block_means` does; of a long log.
    input_shift : int
        How many rows later than theirs the inputs of a log act, as `shift_inputs` takes it; -1: a row earlier.
    """

    time: str | tuple[str, ...] | None = None
    time_format: str | None = None
    timezone: str | None = None
    sample_time: Positive | None = None
    delimiter: str | None = None
    decimal: Literal[".", ","] | None = None
    thousands: Literal[".", ",", " ", "'"] | None = None
    encoding: str | None = None
    header_line: Line | None = None
    units_line: Line | None = None
    sheet: str | None = None
    variable: str | None = None
    header: tuple[str, ...] | None = None
    temperature_unit: Literal["K", "degC"] | None = None
    hottest: Positive | None = None
    missing: tuple[float | str, ...] = ()
    gaps: Literal["split", "fill", "refuse"] = "split"
    fill_up_to: Annotated[int, Field(ge=1)] = 3
    shortest: Annotated[int, Field(ge=2)] = 2
    jitter: Fraction = 0.25
    clock: Literal["stamps", "rows"] | None = None
    duplicates: Literal["refuse", "first", "last", "mean"] = "refuse"
    restarts: Literal["refuse", "split"] = "refuse"
    wraps_at: Positive | None = None
    averaged: Averaged | None = None
    means_of: Annotated[int, Field(ge=2)] | None = None
    input_shift: int = 0

    @property
    def least(self) -> int:
        """Samples that a part needs: three blocks; where inputs are means, the first input and the last reading go."""
        means, shift = self.averaged in ("before", "after"), abs(self.input_shift)
        if self.means_of:
            return max(self.shortest, 3 * self.means_of + means + shift)
        return max(self.shortest, 2 + means + shift)

    @field_validator("delimiter")
    @classmethod
    def _delimiter(cls, value: str | None) -> str | None:
        value = {"tab": "\t", "\\t": "\t", "semicolon": ";", "comma": ","}.get(value or "", value)
        if value is not None and (len(value) != 1 or value.isalnum() or value in '"\r\n'):
            raise ValueError("must be one character such as ';', ',', '|' or a tab")
        return value

    @field_validator("encoding")
    @classmethod
    def _encoding(cls, value: str | None) -> str | None:
        try:
            if value is not None:
                "".encode(value)
        except (LookupError, ValueError):
            raise ValueError("is not an encoding that Python knows, such as 'utf-8' or 'cp1252'") from None
        return value

    @field_validator("timezone")
    @classmethod
    def _timezone(cls, value: str | None) -> str | None:
        try:
            if value is not None:
                ZoneInfo(value)
        except Exception:  # zoneinfo raises many kinds for names that are none
            raise ValueError("is not a time zone such as 'Europe/Berlin' or 'UTC'") from None
        return value

    @field_validator("time")
    @classmethod
    def _time(cls, value: str | tuple[str, ...] | None) -> str | tuple[str, ...] | None:
        if isinstance(value, tuple) and len(value) not in (1, 2):
            raise ValueError("must be one header, or those of date and time of day")
        return value[0] if isinstance(value, tuple) and len(value) == 1 else value


class Declared(_Table):
    """Options and column map together.

    Parameters
    ----------
    record : ImportOptions
        How the file is read.
    columns : dict
        Name in the system to `ColumnChoice`.
    """

    record: ImportOptions = ImportOptions()
    columns: dict[str, ColumnChoice] = {}


def declared(*places: tuple[Mapping[str, Any], Mapping[str, Any], str]) -> Declared:
    """Options merged from several places; later ones win.

    Parameters
    ----------
    places : tuple of (record table, columns table, place)
        As read from system file, project file, record entry or call; the place is named in messages.

    Returns
    -------
    Declared

    Raises
    ------
    InputError
        Unknown keys, values that are not allowed.

    Examples
    --------
    >>> import robthermal as rt
    >>> made = rt.signals.declared(({"gaps": "fill"}, {"T1": "NTC 1"}, "setup.toml"), ({"gaps": "split"}, {}, "call"))
    >>> made.record.gaps, made.columns["T1"].column
    ('split', 'NTC 1')
    """
    record: dict[str, Any] = {}
    columns: dict[str, Any] = {}
    for own_record, own_columns, place in places:
        record |= _checked(ImportOptions, own_record, f"{place} [record]")
        for name, choice in own_columns.items():
            table = {"column": choice} if isinstance(choice, str) else choice
            if not isinstance(table, Mapping):
                raise InputError(
                    f"{name} = {str(choice)[:60]!r}",
                    where=f"{place} [columns]",
                    expected=f'a header, or a table: {name} = {{ column = "I_TEC", unit = "mA" }}',
                )
            columns[name] = ColumnChoice(**_checked(ColumnChoice, table, f"{place} [columns] {name}"))
    return Declared(record=ImportOptions(**record), columns=columns)


def with_own_word(choice: Declared, asked: Declared, stated: str, where: str) -> Declared:
    """Options with what a file states of its own values: it knows better than the description of the machine.

    Parameters
    ----------
    choice : Declared
        Options from all places.
    asked : Declared
        Those beside the system file: what is asked of this file.
    stated : str
        Word of the file; empty where it has none.
    where : str
        File, for messages.

    Raises
    ------
    InputError
        Another word is asked for.
    """
    if not stated:
        return choice
    if asked.record.averaged not in (None, stated):
        raise InputError(
            f'the file states averaged = "{stated}", and averaged = "{asked.record.averaged}" is declared',
            where=where,
            expected="one of the two",
            remedy="Leave the declaration out for this file, or take the word out of the file if it is wrong.",
        )
    return choice.model_copy(update={"record": choice.record.model_copy(update={"averaged": stated})})


def _checked(schema: type[_Table], table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The keys that are given, validated; one message for the first that is wrong."""
    for key in table:
        if key not in schema.model_fields:
            raise InputError(
                f"unknown key {str(key)[:60]!r}", where=where, remedy=suggestion(str(key), tuple(schema.model_fields))
            )
    try:
        found = schema(**table)
    except ValidationError as error:
        fault: Any = error.errors(include_url=False)[0]
        key = str(fault["loc"][0]) if fault["loc"] else ""
        given = f"{key} = {str(table.get(key, ''))[:60]!r}: " if key else ""
        raise InputError(
            given + fault["msg"].removeprefix("Value error, "),
            where=where,
            remedy='The keys and their values are in the documentation, "Measured files".',
        ) from None
    return {key: getattr(found, key) for key in found.model_fields_set}


def from_text(record: Sequence[str] = (), column: Sequence[str] = ()) -> tuple[dict[str, Any], dict[str, Any]]:
    """Tables of the command line's ``--record KEY=VALUE`` and ``--column NAME=HEADER``.

    Parameters
    ----------
    record, column : sequence of str
        Command-line values, each KEY=VALUE or NAME=HEADER; for HEADER also a table of [columns], written as JSON.

    Returns
    -------
    record, columns : dict
        For `declared`.

    Raises
    ------
    InputError
        A text without "=".

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.signals.options_from_text(["gaps=fill"], ["T1=NTC 1"])
    ({'gaps': 'fill'}, {'T1': 'NTC 1'})
    """
    options: dict[str, Any] = {}
    for text in record:
        key, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"{text[:60]!r}", where="--record", expected="KEY=VALUE, for example gaps=fill")
        options[key.strip()] = _value(key.strip(), value)
    columns: dict[str, Any] = {}
    for text in column:
        name, equals, header = text.partition("=")
        if not equals or not name.strip() or not header.strip():
            raise InputError(f"{text[:60]!r}", where="--column", expected="NAME=HEADER, for example 'T1=NTC 1'")
        columns[name.strip()] = _table_or_header(name.strip(), header.strip())
    return options, columns


def _table_or_header(name: str, text: str) -> Any:
    """A header, or what stands in [columns] as a table, written as JSON."""
    if not text.startswith("{"):
        return text
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        raise InputError(f"{name}={text[:60]}", where="--column", expected="a header, or a table as JSON, for example "
                         f"""'{name}={{"column": "NTC", "unit": "ohm"}}'""") from None


def _value(key: str, text: str) -> Any:
    lists = {"missing", "header", "time"}
    if text.lstrip()[:1] in ("[", "{", '"'):
        try:
            return json.loads(text)
        except json.JSONDecodeError:
            raise InputError(
                f"{key}={text[:60]}", where="--record", expected="a value as in the project file"
            ) from None
    if key in lists and (key != "time" or "," in text):
        return [_number(part.strip()) if key == "missing" else part.strip() for part in text.split(",")]
    return text


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
