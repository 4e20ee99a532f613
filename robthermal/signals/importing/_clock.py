"""Which column holds the time."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from ...errors import InputError
from ._dates import date_reader, stamp_reader
from ._options import ImportOptions
from ._proposals import time_headers, unnamed_stamps
from ._table import Action, Source, Table
from ._times import Counted, TimeReader
from ._tokens import short
from ._units import split_header, unit_of

_NAMES = (
    "time",
    "t",
    "timestamp",
    "timestamps",
    "time stamp",
    "datetime",
    "date time",
    "zeit",
    "zeitstempel",
    "datum zeit",
    "datum uhrzeit",
    "elapsed",
    "elapsed time",
    "seconds",
    "millis",
    "milliseconds",
    "micros",
    "microseconds",
)  # with a blank for every "/", "_", "-" and "&"
_COUNTERS = {"millis": "ms", "milliseconds": "ms", "micros": "us", "microseconds": "us"}  # their own unit
_TIMES = re.compile(r"(time|date|stamp|millis|micros|seconds|zeit)")
_FALLING = 0.2  # of the steps
_PAIRS = (("date", "time"), ("datum", "uhrzeit"), ("datum", "zeit"))


def time_columns(table: Table, options: ImportOptions, wanted: frozenset[str]) -> tuple[int, ...]:
    """Places of the time column, or of date and time of day; empty where the time is counted with sample_time.

    Parameters
    ----------
    table : Table
        Headers as written.
    options : ImportOptions
        time and sample_time.
    wanted : frozenset of str
        Names of the system, which are no time columns.

    Raises
    ------
    InputError
        None, or several that could be it.
    """
    if options.time is not None:
        asked = (options.time,) if isinstance(options.time, str) else options.time
        return tuple(_place(table, name) for name in asked)
    names = [_plain(header) for header in table.headers]
    free = [
        k
        for k, header in enumerate(table.headers)
        if header and header not in wanted and split_header(header)[0] not in wanted
    ]
    for date, clock in _PAIRS:
        both = [[k for k in free if names[k] == part] for part in (date, clock)]
        if all(len(found) == 1 for found in both):
            return (both[0][0], both[1][0])
    found = [k for k in free if names[k] in _NAMES]
    rising = [k for k in found if not _falls(table.columns[k])]
    if len(rising) == 1 and len(found) > 1:  # "elapsed" of a loop says how long each turn took
        others = ", ".join(repr(table.headers[k]) for k in found if k not in rising)
        text = f"time taken from {table.headers[rising[0]]!r}; {others} does not increase"
        table.actions.append(Action("mapped", 1, text, table.headers[rising[0]]))
        return (rising[0],)
    if len(found) == 1 and not rising:
        _refuse_falling(table, found[0], [k for k in free if _TIMES.match(names[k]) and _rises(table.columns[k])])
    if len(found) > 1:  # "T" is a temperature where anything else can be the time
        found = [k for k in found if split_header(table.headers[k])[0].strip() != "T"]
    if len(found) == 1:
        return (found[0],)
    if not found:
        return _by_its_cells(table, options, free)
    numeric = [k for k in found if table.columns[k].dtype.kind == "f" and _in_seconds(table.headers[k])]
    if len(numeric) == 1:
        table.actions.append(
            Action(
                "mapped",
                1,
                f"time taken from {table.headers[numeric[0]]!r}, the one in seconds; other "
                "columns with times: " + ", ".join(repr(table.headers[k]) for k in found if k != numeric[0]),
                table.headers[numeric[0]],
            )
        )
        return (numeric[0],)
    listed = ", ".join(repr(table.headers[k]) for k in found)
    raise InputError(
        f"there are {len(found)} time columns ({listed})",
        where=table.where,
        expected="one time column",
        remedy=f'Write time = "{table.headers[found[0]]}", or another of them.',
    )


def _refuse_falling(table: Table, place: int, others: list[int]) -> None:
    """Refuse a column called time that falls again and again, where other columns of that name rise."""
    if others:
        header, listed = table.headers[place], ", ".join(repr(table.headers[k]) for k in others)
        raise InputError(f"column {header!r} is called a time and does not increase", where=table.where,
                         expected="a time that increases",
                         remedy=f'Write time = "{table.headers[others[0]]}"; these increase: {listed[:200]}.')


def _by_its_cells(table: Table, options: ImportOptions, free: list[int]) -> tuple[int, ...]:
    """The time column where no header says it: counted, the only one in a unit of time that rises, or of stamps."""
    if options.sample_time is not None:
        return ()
    timed = [k for k in free if _timed(table.headers[k])]
    rising = [k for k in timed if _rises(table.columns[k])]
    if len(rising) == 1:
        header = table.headers[rising[0]]
        text = f"time taken from {header!r}, the only column in a unit of time that rises"
        table.actions.append(Action("mapped", 1, text, header))
        return (rising[0],)
    place = unnamed_stamps(table)
    if place is not None:
        table.actions.append(Action("mapped", 1, "time taken from the only column without a name, which holds stamps"))
        return (place,)
    listed = ", ".join(header for header in table.headers if header)[:200]
    proposed = time_headers(table) or f'time = "{table.headers[timed[0]] if timed else "HEADER"}"'
    raise InputError(
        "there is no column 'time'",
        where=table.where,
        expected="one column 'time', or a declared one",
        remedy=f"Write {proposed}, or sample_time = 1.0. Columns: {listed}.",
    )


def time_reader(source: Source, places: tuple[int, ...], options: ImportOptions) -> TimeReader:
    """Reader of the time of every row of a source, chosen by its first rows."""
    table, most = source.table, source.most_rows
    if not places:
        return Counted(float(options.sample_time or 1.0))
    if len(places) == 2:
        return date_reader(table, places, most, options)
    header = table.headers[places[0]]
    unit = table.units[places[0]] if table.units and table.units[places[0]].strip("-") else split_header(header)[1]
    if unit is None:
        unit = _COUNTERS.get(_plain(header))
    cells: Any = table.columns[places[0]]
    if cells.dtype.kind == "O" and unit is not None and unit_of(unit) is None:
        unit = None  # "Time [dd.mm.yyyy]" says how the text looks, which the text itself says
    return stamp_reader(table, places, most, unit, options)


def _plain(header: str) -> str:
    """Name of a header without its unit, with a blank for every sign between words: `millis()` is `millis`."""
    return re.sub(r"[\s_/&-]+", " ", split_header(header)[0]).strip().lower().removesuffix("()")


def _place(table: Table, name: str) -> int:
    exact = [k for k, header in enumerate(table.headers) if header == name.strip()]
    bare = [k for k, header in enumerate(table.headers) if split_header(header)[0].lower() == name.strip().lower()]
    found = exact or bare
    if len(found) == 1:
        return found[0]
    listed = ", ".join(header for header in table.headers if header)[:200]
    raise InputError(
        f"time = {short(name)}: " + ("several columns" if found else "there is no such column"),
        where=table.where,
        expected="a header of the file",
        remedy=f"Columns: {listed}.",
    )


def _timed(header: str) -> bool:
    """Whether a header says a unit of time."""
    unit = unit_of(split_header(header)[1] or "")
    return unit is not None and unit.quantity == "time"


def _rises(cells: Any) -> bool:
    """Whether the first cells are numbers, each larger than the one before."""
    if getattr(getattr(cells, "dtype", None), "kind", "") != "f":
        return False
    there = cells[np.isfinite(cells)]
    return len(there) > 1 and bool(np.all(np.diff(there) > 0))


def _falls(cells: Any) -> bool:
    """Whether many of the first cells are smaller than the one before: no time, nor a counter that starts again."""
    if getattr(getattr(cells, "dtype", None), "kind", "") != "f":
        return False
    steps = np.diff(cells[np.isfinite(cells)])
    return len(steps) > 2 and float(np.mean(steps <= 0)) > _FALLING


def _in_seconds(header: str) -> bool:
    unit = split_header(header)[1]
    bare = re.sub(r"[\W_]+", "", split_header(header)[0]).lower()
    if unit is None and bare in _COUNTERS:
        return True
    return _timed(header) or (unit is None and bare in ("time", "t", "seconds", "elapsed", "elapsedtime", "zeit"))
