"""What is understood of a file without a system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._glitches import glitch_rows
from .._stated import KEY
from ._assemble import make_report, say_declared, say_dropped
from ._cells import NumberReader, take_codes
from ._channel import Channel
from ._clock import time_columns, time_reader
from ._open import open_source
from ._options import Declared, declared, with_own_word
from ._report import Import, ImportedColumn
from ._shorten import short_errors
from ._table import Source
from ._times import Clock, TimeReader
from ._units import split_header, unit_of
from ._values import Values, fill, find_parts


def inspect(
    source: Any, tables: Sequence[tuple[Mapping[str, Any], Mapping[str, Any], str]] = (), **options: Any
) -> Import:
    """What is understood of a file without a system: every column of numbers, none of them used.

    Parameters
    ----------
    source : str, Path, DataFrame, mapping
        As for `read_records`.
    tables : sequence of (record, columns, place), optional
        Tables of a project file.
    **options
        Keys of the table [record].

    Returns
    -------
    Import
        Role "unused" for all but the time.

    Raises
    ------
    InputError
        As `read_records`.

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.signals.inspect_file({"time": [0.0, 1.0, 2.0], "T1 [°C]": [20.0, 20.1, 20.2]})
    >>> [(column.column, column.role, column.unit) for column in found.columns]
    [('time', 'time', ''), ('T1 [°C]', 'unused', 'degC')]
    """
    with short_errors():
        choice = declared(*tables, (options, {}, "arguments"))
        opened = open_source(source, choice.record)
        table = opened.table
        choice = with_own_word(choice, choice, table.facts.get(KEY, ""), table.where)
        time = time_columns(table, choice.record, frozenset())
        numeric = [
            k
            for k, cells in enumerate(table.columns)
            if k not in time and table.headers[k] and getattr(cells, "dtype", np.dtype(object)).kind == "f"
        ]
        clock, values = _values(opened, numeric, choice, time_reader(opened, time, choice.record))
        alone = Values((), np.zeros((len(table.lines), 0)), np.zeros((len(table.lines), 0)), {}, {})
        before = table.lines
        parts = find_parts(table, clock, alone, choice)
        if table.lines is not before:  # rows that repeat a time are gone
            values.keep(np.isin(before.numbers(), table.lines.numbers()))
        say_declared(table, len(parts), choice)
        say_dropped(table, values, time)
        glitches = {c.name: sum(_glitches(values.column(c)[part.rows]) for part in parts) for c in values.channels}
        report = make_report(source, table, clock, time, values, parts, glitches, choice, None)
        return replace(report, columns=tuple(_unused(column) for column in report.columns))


def _values(source: Source, numeric: Sequence[int], choice: Declared, times: TimeReader) -> tuple[Clock, Values]:
    """Columns of numbers; those that turn out to be no numbers further down are left aside."""
    table = source.table
    readers = [NumberReader(table, k, choice.record) for k in numeric]
    matrix = np.empty((source.most_rows, len(numeric)))
    n = fill(source, times, readers, list(matrix.T))
    clock, matrix = times.clock(), matrix[:n]
    kept = [k for k, r in enumerate(readers) if r.fault is None and not np.isnan(matrix[:, k]).all()]
    for k in kept:
        take_codes(table, numeric[k], matrix[:, k], choice.record)
    columns = {k: matrix[:, k] for k in kept}
    channels = tuple(Channel(table.headers[numeric[k]], "output", numeric[k], None, "") for k in kept)
    missing = {numeric[k]: int(np.isnan(column).sum()) for k, column in columns.items()}
    ranges = {table.headers[numeric[k]]: (float(np.nanmin(x)), float(np.nanmax(x))) for k, x in columns.items()}
    whole = matrix if len(kept) == len(numeric) else matrix[:, kept]
    return clock, Values(channels, np.empty((n, 0)), whole, missing, ranges)


def _glitches(column: NDArray[np.float64]) -> int:
    there = np.isfinite(column)
    return len(glitch_rows(column if there.all() else column[there]))


def _unused(column: ImportedColumn) -> ImportedColumn:
    if column.role == "time":
        return column
    text = split_header(column.column)[1] or column.unit_read
    known = unit_of(text) if text else None
    return replace(
        column, name="", role="unused", unit_read=known.name if known else text or "", unit=known.name if known else ""
    )
