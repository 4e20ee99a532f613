"""What is understood of a file without a system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .._glitches import glitch_rows
from ._assemble import make_report, say_dropped
from ._clock import read_clock, time_columns
from ._columns import Channel
from ._open import open_table
from ._options import declared
from ._report import Import, ImportedColumn
from ._shorten import short_errors
from ._units import split_header, unit_of
from ._values import Values, find_parts


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
        table = open_table(source, choice.record)
        time = time_columns(table, choice.record, frozenset())
        clock = read_clock(table, time, choice.record)
        numeric = [
            k
            for k, cells in enumerate(table.columns)
            if k not in time
            and table.headers[k]
            and getattr(cells, "dtype", np.dtype(object)).kind == "f"
            and np.isfinite(cells).any()
        ]
        channels = tuple(Channel(table.headers[k], "output", k, None, "") for k in numeric)
        kept = np.column_stack([table.columns[k] for k in numeric]) if numeric else np.zeros((len(table.lines), 0))
        values = Values(channels, kept, {k: int(np.isnan(table.columns[k]).sum()) for k in numeric})
        parts = find_parts(table, clock, Values((), np.zeros((len(table.lines), 0)), {}), choice)
        say_dropped(table, values, time)
        glitches = {
            c.name: sum(
                len(glitch_rows(column[np.isfinite(column)]))
                for part in parts
                for column in (values.column(c)[part.rows],)
            )
            for c in channels
        }
        report = make_report(source, table, clock, time, values, parts, glitches, choice, None)
        return replace(report, columns=tuple(_unused(column) for column in report.columns))


def _unused(column: ImportedColumn) -> ImportedColumn:
    if column.role == "time":
        return column
    text = split_header(column.column)[1]
    known = unit_of(text) if text else None
    return replace(
        column, name="", role="unused", unit_read=known.name if known else text or "", unit=known.name if known else ""
    )
