"""read_record and read_records: from a measured file to uniformly sampled records with a report of what was done."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from .._checks import channel_names, distinct, positive_number
from .._glitches import filter_note, filtered, glitch_rows, window_samples
from .._plausible import check_temperature, limit_notes
from .._record import Record
from ._cells import in_si, numbers, refuse_codes
from ._clock import read_clock, time_columns
from ._columns import Channel, SystemLike, channels_of_names, channels_of_system, mapped_actions
from ._open import open_table
from ._options import Declared, declared
from ._parts import Part, parts_of, say_resampled
from ._report import Import, ImportedColumn
from ._samples import runs, single
from ._stamps import Clock
from ._table import Action, Array, Table
from ._units import split_header, unit_of

_LONGEST = 600  # characters of a message
_LOUD = ("split", "filled", "resampled", "counted", "duplicates", "left_out", "dropped_row", "fault_code", "glitches", "timezone")


def read_records(source: Any, system: SystemLike | None = None, *, inputs: Sequence[str] | None = None,
                 outputs: Sequence[str] | None = None, columns: Mapping[str, Any] | None = None,
                 median_filter: float | None = None, max_bytes: float | None = None,
                 tables: Sequence[tuple[Mapping[str, Any], Mapping[str, Any], str]] = (), **options: Any) -> tuple[Record, ...]:
    """Read a measured file or table as one record per uninterrupted part.

    What the file or its declaration says unambiguously is done and reported in `Record.imported`; what would be a guess
    is an error that names the declaration to write.

    Parameters
    ----------
    source : str, Path, DataFrame, Series, mapping of name to array, or structured ndarray
        CSV or other delimited text, xlsx, ods, Parquet, MATLAB .mat (to version 7), NI .tdms, or a table in memory.
    system : System, optional
        Heaters and module currents must have a column; ambients and sensors may.
    inputs, outputs : sequence of str, optional
        Without a system: the columns to read.
    columns : mapping, optional
        Name in the system to header in the file, or to ``{"column": …, "unit": …, "scale": …, "offset": …}``.
    median_filter : float, optional
        Width of a running median over the outputs [s]; default none, glitches are only reported.
    max_bytes : float, optional
        Refuse larger data [bytes]; default 2 GiB or a quarter of the memory.
    tables : sequence of (record, columns, place), optional
        Tables [record] and [columns] of a project file; they win over the system's, `options` over them.
    **options
        Keys of [record]: time, time_format, timezone, sample_time, delimiter, decimal, thousands, encoding, header_line,
        units_line, sheet, variable, header, temperature_unit, missing, gaps, fill_up_to, shortest, jitter, duplicates,
        restarts.

    Returns
    -------
    tuple of Record
        Temperatures in kelvin, currents in ampere; the sample time is the same in all.

    Raises
    ------
    InputError
        What cannot be read without a guess: file, line, column, value, and the option to write.

    Warns
    -----
    UserWarning
        What was done to samples: split, filled, resampled, dropped; glitches; values outside declared limits.

    Examples
    --------
    >>> import pandas as pd, robthermal as rt
    >>> log = pd.DataFrame({"time": [0.0, 1.0, 2.0, 9.0, 10.0], "I [mA]": 500.0, "T1 [°C]": [20.0, 20.1, 20.2, 20.9, 21.0]})
    >>> import warnings; warnings.simplefilter("ignore")
    >>> parts = rt.read_records(log, inputs=["I"], outputs=["T1"])
    >>> [part.n_samples for part in parts], float(parts[0]["I"][0])
    ([3, 2], 0.5)
    """
    try:
        return _read(source, system, inputs, outputs, columns, median_filter, max_bytes, tables, options)
    except InputError as error:
        raise _short(error) from None


def read_record(source: Any, system: SystemLike | None = None, *, inputs: Sequence[str] | None = None,
                outputs: Sequence[str] | None = None, columns: Mapping[str, Any] | None = None,
                median_filter: float | None = None, max_bytes: float | None = None,
                tables: Sequence[tuple[Mapping[str, Any], Mapping[str, Any], str]] = (), **options: Any) -> Record:
    """Read a measured file or table that is one uninterrupted record.

    Parameters
    ----------
    source : str, Path, DataFrame, Series, mapping of name to array, or structured ndarray
        As for `read_records`.
    system : System, optional
        Heaters and module currents must have a column; ambients and sensors may.
    inputs, outputs : sequence of str, optional
        Without a system: the columns to read.
    columns : mapping, optional
        Name in the system to header in the file, or to ``{"column": …, "unit": …, "scale": …, "offset": …}``.
    median_filter : float, optional
        Width of a running median over the outputs [s].
    max_bytes : float, optional
        Refuse larger data [bytes].
    tables : sequence of (record, columns, place), optional
        Tables of a project file.
    **options
        Keys of [record], as for `read_records`.

    Returns
    -------
    Record
        Temperatures in kelvin.

    Raises
    ------
    InputError
        As `read_records`; and a file that falls into several parts.

    Examples
    --------
    >>> import tempfile, pathlib, robthermal as rt
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "run.csv"
    >>> _ = path.write_text("Time [s],Q1 [%],T1 [degC]\\n0,50,20.58\\n1,50,20.9\\n2,50,21.22\\n")
    >>> print(rt.read_record(path, inputs=["Q1"], outputs=["T1"]))
    Record 'run.csv': 3 samples of 1 s, from 0 s
              channel     min     max  unit
      input   Q1           50      50  %
      output  T1       293.73  294.37  K
    """
    found = read_records(source, system, inputs=inputs, outputs=outputs, columns=columns, median_filter=median_filter,
                         max_bytes=max_bytes, tables=tables, **options)
    if len(found) > 1:
        imported = found[0].imported
        where = imported.file if imported is not None else "source"
        first = found[1].start_time
        why = next((action["text"] for action in (imported.actions if imported else ()) if action["what"] == "split"), "")
        raise InputError(f"the record falls into {len(found)} parts, the second from {first:.10g} s ({why})", where=where,
                         expected="one uninterrupted record",
                         remedy='Take all parts with rt.read_records, or fill short gaps with gaps = "fill".')
    return found[0]


@dataclass(frozen=True)
class _Values:
    """Values of the channels, file rows down, in the units that are kept."""

    channels: tuple[Channel, ...]
    kept: Array
    missing: dict[int, int]

    def of(self, *roles: str) -> tuple[Channel, ...]:
        return tuple(c for c in self.channels if c.role in roles)

    def columns(self, *roles: str) -> Array:
        return self.kept[:, [k for k, c in enumerate(self.channels) if c.role in roles]]

    def column(self, channel: Channel) -> Array:
        return self.kept[:, self.channels.index(channel)]


def _read(source: Any, system: SystemLike | None, inputs: Sequence[str] | None, outputs: Sequence[str] | None,
          columns: Mapping[str, Any] | None, median_filter: float | None, max_bytes: float | None,
          tables: Sequence[tuple[Mapping[str, Any], Mapping[str, Any], str]], options: Mapping[str, Any]) -> tuple[Record, ...]:
    own = (getattr(system, "record", None) or {}, getattr(system, "columns", None) or {}, "system file")
    given = {key: value for key, value in options.items() if value is not None}
    choice = declared(own, *tables, (given, columns or {}, "arguments"))
    limit = None if max_bytes is None else positive_number(max_bytes, "max_bytes", "B")
    ins, outs = _names(system, inputs, outputs)
    wanted = frozenset((*ins, *outs, *(_system_names(system) if system is not None else ())))
    table = open_table(source, choice.record, limit)
    place = time_columns(table, choice.record, wanted)
    channels = channels_of_names(table, ins, outs, choice, place) if system is None else channels_of_system(
        table, system, choice, place)
    clock = read_clock(table, place, choice.record)
    values = _values(table, channels, choice, clock)
    if system is not None:
        _check_limits(table, values, system)
    parts = _parts(table, clock, values, choice)
    return _records(source, table, clock, place, values, parts, choice, median_filter, system)


def _names(system: SystemLike | None, inputs: Sequence[str] | None,
           outputs: Sequence[str] | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if system is not None:
        if inputs is not None or outputs is not None:
            raise InputError("a system and column names are given", where="arguments system, inputs and outputs",
                             expected="one of the two", remedy="Use record.select(outputs=[...]) afterwards.")
        return (), ()
    ins, outs = channel_names(inputs or (), "inputs"), channel_names(outputs or (), "outputs")
    distinct(ins, outs)
    if not ins and not outs:
        raise InputError("neither a system nor column names are given", where="arguments system, inputs and outputs",
                         remedy="Write read_record(path, system), or inputs=['heater'], outputs=['T1'].")
    return ins, outs


def _system_names(system: SystemLike) -> tuple[str, ...]:
    return (*system.input_names, *system.module_names, *system.ambient_names, *system.sensor_names)


def _values(table: Table, channels: tuple[Channel, ...], choice: Declared, clock: Clock) -> _Values:
    table.actions.extend(mapped_actions(table, channels))
    kept = np.full((len(table.lines), len(channels)), np.nan)
    missing: dict[int, int] = {}
    for k, channel in enumerate(channels):
        header = table.headers[channel.place]
        raw = numbers(table, channel.place, choice.record)
        missing[channel.place] = int(np.isnan(raw).sum())
        if missing[channel.place] == len(raw):
            raise InputError(f"column {header!r} holds no value at all", where=table.where, expected="numbers",
                             remedy="Leave it out, or name another column with --column.")
        refuse_codes(table, header, raw, choice.record)
        if channel.unit == "K" and channel.unit_read is not None and not channel.scaled and channel.unit_read.name in ("K", "degC"):
            there = np.isfinite(raw)
            rows = np.flatnonzero(there)
            check_temperature(header, raw[there], clock.seconds[there], channel.unit_read.name,
                              lambda row, rows=rows: table.place(int(rows[row])).rpartition(", ")[2], table.where)
        kept[:, k] = in_si(channel, raw)
    return _Values(channels, kept, missing)


def _check_limits(table: Table, values: _Values, system: SystemLike) -> None:
    raw = {c.name: values.column(c)[np.isfinite(values.column(c))] for c in values.channels}
    raw = {name: column for name, column in raw.items() if len(column)}
    for text in limit_notes(raw, system.current_limits, system.input_limits, table.where):
        table.actions.append(Action("glitches", 1, text))


def _parts(table: Table, clock: Clock, values: _Values, choice: Declared) -> list[Part]:
    pieces = []
    for rows in runs(table, clock, choice.record):
        kept, stamps = single(table, clock, rows, values.kept, choice.record)
        pieces.append((kept, clock.seconds[kept] if stamps is None else stamps))
    driven, read = values.columns("input", "current"), values.columns("ambient", "sensor", "output")
    headers = tuple(tuple(table.headers[c.place] for c in values.of(*roles)) for roles in
                    (("input", "current"), ("ambient", "sensor", "output")))
    parts = parts_of(table, pieces, driven, read, choice.record, (headers[0], headers[1]))
    say_resampled(table, parts, {c.name: values.column(c) for c in values.of("ambient", "sensor")})
    return parts


def _records(source: Any, table: Table, clock: Clock, time: tuple[int, ...], values: _Values, parts: list[Part],
             choice: Declared, median_filter: float | None, system: SystemLike | None) -> tuple[Record, ...]:
    driven, read = values.of("input", "current", "ambient"), values.of("sensor", "output")
    made: list[tuple[Array, Array]] = []
    glitches: dict[str, int] = {}
    notes: list[str] = []
    for part in parts:
        U = np.column_stack([part.linear(values.column(c)) if c.role == "ambient" else part.held(values.column(c)) for c in driven]
                            ) if driven else np.zeros((part.samples, 0))
        Y = np.empty((part.samples, len(read)))
        for k, c in enumerate(read):
            column = values.column(c)
            found = glitch_rows(column[part.rows][np.isfinite(column[part.rows])])
            if found.size:
                glitches[c.name] = glitches.get(c.name, 0) + int(found.size)
                table.actions.append(Action("glitches", int(found.size), f"{c.name!r} has {found.size} glitch"
                                            f"{'es' if found.size > 1 else ''} (kept; median_filter= [s] removes them)",
                                            table.headers[c.place], [int(x) for x in table.lines[part.rows[found[:50]]]],
                                            [float(part.stamps[x]) for x in found[:50]]))
            if median_filter is not None:  # before resampling: interpolation would smear a glitch over two samples
                samples = window_samples(median_filter, part.sample_time, len(part.rows), "median_filter")
                column = column.copy()
                column[part.rows] = filtered(column[part.rows], samples)
                notes = [filter_note(median_filter, samples)]
            Y[:, k] = part.linear(column)
        made.append((U, Y))
    _say_dropped(table, values, time)
    report = _report(source, table, clock, time, values, parts, glitches, choice, system)
    said = [action.text for action in table.actions if action.what in _LOUD]
    unknown = [column.column for column in report.columns if column.role == "unused" and column.column]
    if unknown:
        said.append(f"unknown columns, not read: {', '.join(map(repr, unknown[:12]))}" + (" …" if len(unknown) > 12 else ""))
    for text in said:
        if system is not None or not text.startswith("unknown"):
            warnings.warn(f"{table.where}: {text}", UserWarning, stacklevel=4)
    units = {c.name: c.unit for c in (*driven, *read) if c.unit}
    return tuple(Record(sample_time=part.sample_time, inputs=U, outputs=Y, input_names=[c.name for c in driven],
                        output_names=[c.name for c in read], start_time=part.start, units=units,
                        name=report.file if len(parts) == 1 else f"{report.file} part {k + 1}", notes=said + notes,
                        imported=report) for k, (part, (U, Y)) in enumerate(zip(parts, made, strict=True)))


def _say_dropped(table: Table, values: _Values, time: tuple[int, ...]) -> None:
    used = {*time, *(c.place for c in values.channels)}
    for k, header in enumerate(table.headers):
        if k in used:
            continue
        cells = table.columns[k]
        empty = bool(np.isnan(cells).all()) if getattr(cells, "dtype", None) is not None and cells.dtype.kind == "f" else False
        if not header or empty:
            table.actions.append(Action("dropped_column", 1, f"column {k + 1} without a name left out" if not header
                                        else f"column {header!r} without a value left out", header))


def _report(source: Any, table: Table, clock: Clock, time: tuple[int, ...], values: _Values, parts: list[Part],
            glitches: Mapping[str, int], choice: Declared, system: SystemLike | None) -> Import:
    used = sum(len(part.rows) for part in parts)
    facts = table.facts
    by_place = {c.place: c for c in values.channels}
    columns = []
    for k, header in enumerate(table.headers):
        channel = by_place.get(k)
        if channel is None:
            unit = split_header(header)[1] or ""
            columns.append(ImportedColumn(header, "", "time" if k in time else "unused", unit, unit))
            continue
        kept = values.column(channel)
        columns.append(ImportedColumn(header, channel.name, {"output": "sensor"}.get(channel.role, channel.role),
                                      channel.unit_read.name if channel.unit_read else "", channel.unit, channel.scale,
                                      channel.offset, float(np.nanmin(kept)), float(np.nanmax(kept)),
                                      values.missing[k], glitches.get(channel.name, 0)))
    names = {c.name for c in values.channels}
    absent = tuple(name for name in _system_names(system) if name not in names) if system is not None else ()
    return Import(
        file=Path(source).name if isinstance(source, str | Path) else table.where, sha256=facts.get("sha256", ""),
        encoding=facts.get("encoding", ""), delimiter=facts.get("delimiter", ""), decimal=facts.get("decimal", ""),
        header_line=facts.get("header_line", 0), skipped_lines=facts.get("skipped_lines", 0),
        time={"columns": [table.headers[k] for k in time], "format": clock.format, "timezone": choice.record.timezone,
              "origin": clock.origin or facts.get("origin")},
        sample_time=parts[0].sample_time, rows={"file": int(facts.get("rows", len(table.lines))), "used": used},
        parts=tuple({"start": part.start, "samples": part.samples, "first_line": int(table.lines[part.rows[0]]),
                     "last_line": int(table.lines[part.rows[-1]])} for part in parts),
        columns=tuple(columns), actions=tuple(action.to_dict() for action in table.actions), absent=absent)


def inspect(source: Any, tables: Sequence[tuple[Mapping[str, Any], Mapping[str, Any], str]] = (), **options: Any) -> Import:
    """What is understood of a file without a system: every column of numbers, none of them used.

    Parameters
    ----------
    source : str, Path, DataFrame, mapping
        As for `read_records`.
    tables : sequence of (record, columns, place), optional
        Tables of a project file.
    **options
        Keys of [record].

    Returns
    -------
    Import
        Role "unused" for all but the time.

    Raises
    ------
    InputError
        As `read_records`.
    """
    try:
        choice = declared(*tables, (options, {}, "arguments"))
        table = open_table(source, choice.record)
        time = time_columns(table, choice.record, frozenset())
        clock = read_clock(table, time, choice.record)
        numeric = [k for k, cells in enumerate(table.columns) if k not in time and table.headers[k]
                   and getattr(cells, "dtype", np.dtype(object)).kind == "f" and np.isfinite(cells).any()]
        channels = tuple(Channel(table.headers[k], "output", k, None, "") for k in numeric)
        kept = np.column_stack([table.columns[k] for k in numeric]) if numeric else np.zeros((len(table.lines), 0))
        values = _Values(channels, kept, {k: int(np.isnan(table.columns[k]).sum()) for k in numeric})
        parts = _parts(table, clock, _Values((), np.zeros((len(table.lines), 0)), {}), choice)
        _say_dropped(table, values, time)
        glitches = {c.name: sum(len(glitch_rows(column[np.isfinite(column)])) for part in parts
                                for column in (values.column(c)[part.rows],)) for c in channels}
        report = _report(source, table, clock, time, values, parts, glitches, choice, None)
        return replace(report, columns=tuple(_unused(column) for column in report.columns))
    except InputError as error:
        raise _short(error) from None


def _unused(column: ImportedColumn) -> ImportedColumn:
    if column.role == "time":
        return column
    text = split_header(column.column)[1]
    known = unit_of(text) if text else None
    return replace(column, name="", role="unused", unit_read=known.name if known else text or "", unit=known.name if known else "")


def _short(error: InputError) -> InputError:
    """The same error, at most 600 characters long."""
    over = len(str(error)) - _LONGEST
    if over <= 0:
        return error
    what = error.what if len(error.what) < over + 80 else error.what[:-over - 2] + " …"
    cut = InputError(what, where=error.where, expected=error.expected, remedy=error.remedy)
    over = len(str(cut)) - _LONGEST
    return cut if over <= 0 else InputError(what, where=error.where, expected=error.expected,
                                            remedy=cut.remedy[:max(20, len(cut.remedy) - over - 2)] + " …")
