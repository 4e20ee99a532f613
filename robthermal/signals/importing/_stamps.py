"""Cells of a time column as seconds: numbers, durations, times of day, dates with and without zones."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from ._options import ImportOptions
from ._table import Action, Array, Table
from ._tokens import short
from ._units import Unit, unit_of

_DAY = 86400.0
_EPOCH_S, _EPOCH_MS = (1e9, 2e9), (1e12, 2e12)
_ISO = re.compile(r"\d{4}-\d{1,2}-\d{1,2}([T ]\s*\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?)?\s*(Z|[+-]\d{2}:?\d{2})?")
_YMD = re.compile(r"\d{4}/\d{1,2}/\d{1,2}( \d{1,2}:\d{2}(:\d{2}(\.\d+)?)?)?")
_DOTS = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4}|\d{2})([T ]\s*\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?)?")
_SLASH = re.compile(
    r"(\d{1,2})([/-])(\d{1,2})\2(\d{4}|\d{2})([T ]\s*\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?\s*([AaPp][Mm])?)?"
)
_CLOCK = re.compile(r"\d{1,5}:\d{2}(:\d{2}([.,]\d+)?)?")
_DURATION = re.compile(r"([+-]?\d+(?:[.,]\d+)?)\s*([a-zA-Z]+)")
_NUMERIC = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
_CODES = re.compile(r"%[a-zA-Z%]")


@dataclass(frozen=True)
class Clock:
    """Time of every row.

    Parameters
    ----------
    seconds : ndarray, shape (n,)
        Since the first stamp for dates, else as in the file [s].
    origin : str or None
        ISO date and time of zero, where the file has dates.
    format : str
        How the cells were understood.
    resolution : float
        Unit to which stamps are rounded, 0 where they are not [s].
    """

    seconds: Array
    origin: str | None
    format: str
    resolution: float


def read_stamps(table: Table, header: str, cells: Any, unit: str | None, options: ImportOptions) -> Clock:
    """Clock of a table from the cells of its time column.

    Parameters
    ----------
    table : Table
        For the lines in messages, and its list of actions.
    header : str
        Of the column.
    cells : ndarray
        float64, text, or dates.
    unit : str or None
        Unit text of the header.
    options : ImportOptions
        time_format and timezone.

    Raises
    ------
    InputError
        Cells that are no times, dates that can be read in two ways, an hour that is repeated or missing without a zone.
    """
    if isinstance(cells, np.ndarray) and cells.dtype.kind == "M":
        return _dated(table, header, pd.DatetimeIndex(cells), "date cells", options)
    if isinstance(cells, pd.DatetimeIndex):
        return _dated(table, header, cells, "date cells", options)
    if np.asarray(cells).dtype.kind == "f":
        return _numbers(table, header, np.asarray(cells, float), unit, options)
    text = pd.Series(cells, dtype=object)
    return _texts(table, header, text, options)


def _numbers(table: Table, header: str, cells: Array, unit: str | None, options: ImportOptions) -> Clock:
    _all_there(table, header, ~np.isfinite(cells))
    declared = options.time_format
    if declared in _NUMERIC:
        return Clock(cells * _NUMERIC[declared], None, declared, 0.0)
    if declared == "excel":
        return _dated(table, header, _from_days(cells), "excel", options)
    found = _time_unit(table, header, unit)
    epoch = declared if declared in ("epoch_s", "epoch_ms") else None
    if epoch is None and declared is None and found is None and len(cells) > 1:
        epoch = next(
            (
                name
                for name, (low, high) in (("epoch_s", _EPOCH_S), ("epoch_ms", _EPOCH_MS))
                if low <= cells.min() and cells.max() <= high
            ),
            None,
        )
    if epoch is not None:
        scale = 1.0 if epoch == "epoch_s" else 1e-3
        start = float(cells[0])
        origin = pd.Timestamp(round(start * scale * 1e9), tz="UTC").isoformat()
        return Clock((cells - start) * scale, origin, epoch, 0.0)
    if declared is not None:
        raise InputError(
            f"holds numbers and time_format is {declared!r}",
            where=f"{table.where}, column {header!r}",
            expected='a format of numbers: "s", "ms", "min", "h", "epoch_s", "epoch_ms" or "excel"',
        )
    return Clock(cells if found is None else found.to_si(cells), None, found.name if found else "s", 0.0)


def _time_unit(table: Table, header: str, unit: str | None) -> Unit | None:
    if unit is None:
        return None
    found = unit_of(unit)
    if found is None or found.quantity != "time":
        raise InputError(
            f"the time column {header!r} is in {short(unit)}",
            where=table.where,
            expected="s, ms, min or h",
            remedy='Declare what it is, for example time_format = "ms".',
        )
    return found


def _from_days(cells: Array) -> pd.DatetimeIndex:
    micro = np.rint(cells * _DAY * 1e6).astype(np.int64)
    return pd.DatetimeIndex(np.datetime64("1899-12-30", "us") + micro.astype("timedelta64[us]"))


def _texts(table: Table, header: str, text: pd.Series[Any], options: ImportOptions) -> Clock:
    gone = text.isna().to_numpy()
    _all_there(table, header, gone)
    text = text.astype(str).str.strip()
    declared = options.time_format
    if declared == "elapsed" or declared is None and text.iloc[0].count(":") and _CLOCK.fullmatch(text.iloc[0]):
        return _clock_times(table, header, text, "elapsed" if declared else "h:mm:ss")
    if declared in ("%H:%M:%S", "%H:%M", "%H:%M:%S.%f"):
        return _clock_times(table, header, text, declared)
    if declared is None and _DURATION.fullmatch(text.iloc[0]):
        return _durations(table, header, text)
    if declared in (*_NUMERIC, "epoch_s", "epoch_ms", "excel"):
        numbers = pd.to_numeric(text.str.replace(",", "."), errors="coerce").to_numpy(float)
        _refuse_first(table, header, text, ~np.isfinite(numbers), f"a number ({declared})")
        return _numbers(table, header, numbers, None, options)
    pattern = declared or _pattern(table, header, text)
    stamps = _parsed(text, pattern)
    _refuse_first(table, header, text, stamps.isna(), f"a date and time as {pattern}")
    return _dated(table, header, stamps, pattern, options, fraction="." in text.iloc[0] or "," in text.iloc[0][10:])


def _parsed(text: pd.Series[Any], pattern: str) -> pd.DatetimeIndex:
    """Dates of texts; not-a-time where one does not fit the pattern."""
    if pattern == "iso":
        cleaned = text.str.replace(",", ".", regex=False)
        first = _ISO.fullmatch(text.iloc[0])
        zoned = first is not None and first[4] is not None
        return pd.DatetimeIndex(pd.to_datetime(cleaned, format="ISO8601", errors="coerce", utc=zoned))
    if "%S.%f" in pattern:
        text = text.str.replace(r"(\d)[.,](\d+)(\s*[AaPp][Mm])?$", r"\1.\2\3", regex=True)
        bare = ~text.str.contains(r":\d{2}\.\d+")
        text = text.where(~bare, text.str.replace(r"(:\d{2})(\s*[AaPp][Mm])?$", r"\1.0\2", regex=True))
    return pd.DatetimeIndex(pd.to_datetime(text, format=pattern, errors="coerce"))


def _pattern(table: Table, header: str, text: pd.Series[Any]) -> str:
    """Pattern of dates as texts, from what they look like; refused where two readings are possible."""
    first = text.iloc[0]
    if _ISO.fullmatch(first):
        return "iso"
    if _YMD.fullmatch(first):
        return "%Y/%m/%d" + _time_of_day(first)
    dots = _DOTS.fullmatch(first)
    if dots:
        return f"%d.%m.{_year(dots[3])}" + _time_of_day(first, text)
    slash = _SLASH.fullmatch(first)
    if slash:
        sign, year = slash[2], _year(slash[4])
        parts = text.str.extract(rf"^(\d{{1,2}}){re.escape(sign)}(\d{{1,2}}){re.escape(sign)}")
        numbers = parts.apply(pd.to_numeric, errors="coerce")
        day_first, month_first = bool((numbers[0] > 12).any()), bool((numbers[1] > 12).any())
        rest = _time_of_day(first, text)
        options = [f"%d{sign}%m{sign}{year}{rest}", f"%m{sign}%d{sign}{year}{rest}"]
        if day_first != month_first:
            return options[0] if day_first else options[1]
        raise InputError(
            f"{short(first)} can be day/month or month/day, and no day above 12 tells",
            where=table.place(0, header),
            expected="a declared order",
            remedy=f'Write time_format = "{options[0]}"  or  "{options[1]}".',
        )
    raise InputError(
        f"{short(first)} is no time that is known",
        where=table.place(0, header),
        expected="ISO 8601, dd.mm.yyyy hh:mm:ss, h:mm:ss, or numbers",
        remedy='Declare it, for example time_format = "%d-%b-%Y %H:%M:%S".',
    )


def _year(text: str) -> str:
    return "%Y" if len(text) == 4 else "%y"


def _time_of_day(first: str, text: pd.Series[Any] | None = None) -> str:
    clock = re.search(r"([T ])\s*\d{1,2}:\d{2}(:\d{2})?([.,]\d+)?\s*([AaPp][Mm])?$", first)
    if clock is None:
        return ""
    hour = "%I" if clock[4] else "%H"
    seconds = ":%S" if clock[2] else ""
    fraction = clock[3] or (text is not None and bool(text.str.contains(r":\d{2}[.,]\d+").any()))
    return f"{clock[1]}{hour}:%M{seconds}" + (".%f" if fraction and seconds else "") + (" %p" if clock[4] else "")


def _clock_times(table: Table, header: str, text: pd.Series[Any], name: str) -> Clock:
    """h:mm:ss or h:mm; times of day may pass midnight."""
    parts = text.str.replace(",", ".", regex=False).str.extract(r"^(\d+):(\d{2})(?::(\d{2}(?:\.\d+)?))?$")
    numbers = parts.astype(float).fillna({2: 0.0})
    _refuse_first(table, header, text, numbers[0].isna().to_numpy(), "h:mm:ss")
    seconds = (3600.0 * numbers[0] + 60.0 * numbers[1] + numbers[2]).to_numpy(float)
    wraps = np.diff(seconds, prepend=seconds[0]) < -0.5 * _DAY
    if wraps.any():
        table.actions.append(
            Action(
                "counted",
                int(wraps.sum()),
                "the time of day passes midnight; days are counted on",
                header,
                [int(k) for k in table.lines[wraps][:50]],
            )
        )
        seconds = seconds + _DAY * np.cumsum(wraps)
    fraction = bool(text.str.contains("[.,]", regex=True).any())
    return Clock(seconds, None, name, 0.0 if fraction else 1.0)


def _durations(table: Table, header: str, text: pd.Series[Any]) -> Clock:
    """``12 sec``: a number and a unit of time in every cell."""
    parts = text.str.extract(r"^([+-]?\d+(?:[.,]\d+)?)\s*([a-zA-Z]+)$")
    names = {str(word): unit_of(str(word)) for word in parts[1].dropna().unique()}
    factor = parts[1].map({word: unit.factor for word, unit in names.items() if unit and unit.quantity == "time"})
    seconds = pd.to_numeric(parts[0].str.replace(",", "."), errors="coerce").to_numpy(float) * factor.to_numpy(float)
    _refuse_first(table, header, text, ~np.isfinite(seconds), "a number and s, ms, min or h")
    return Clock(seconds, None, "duration", 0.0)


def _dated(
    table: Table, header: str, stamps: pd.DatetimeIndex, name: str, options: ImportOptions, fraction: bool = True
) -> Clock:
    """Dates as seconds since the first one."""
    _all_there(table, header, np.asarray(stamps.isna()))
    if stamps.tz is None and options.timezone is not None:
        stamps = _localized(table, header, stamps, options.timezone)
        table.actions.append(Action("timezone", 1, f"stamps taken as {options.timezone}", header))
    elif stamps.tz is None:
        _refuse_clock_change(table, header, stamps)
    origin = stamps[0].isoformat()
    whole = stamps.tz_convert("UTC").tz_localize(None) if stamps.tz is not None else stamps
    nanoseconds = whole.to_numpy().astype("datetime64[ns]").astype(np.int64)
    seconds = (nanoseconds - nanoseconds[0]) / 1e9
    return Clock(seconds, origin, name, 1.0 if not fraction or not (nanoseconds % 1_000_000_000).any() else 0.0)


def _localized(table: Table, header: str, stamps: pd.DatetimeIndex, zone: str) -> pd.DatetimeIndex:
    """Stamps in a zone; of a repeated hour the first pass is summer time."""
    key = ZoneInfo(zone)
    try:
        return stamps.tz_localize(key, ambiguous="infer")
    except Exception:  # pandas and pytz raise several kinds for hours that are missing or cannot be inferred
        pass
    for summer in (True, False):
        try:
            found = stamps.tz_localize(key, ambiguous=np.full(len(stamps), summer))
        except Exception as error:  # an hour that does not exist in this zone
            raise InputError(
                f"the stamps do not fit the zone {zone}: {short(error, 80)}",
                where=f"{table.where}, column {header!r}",
                expected="stamps that exist in this zone",
                remedy="Correct timezone.",
            ) from None
        if found.is_monotonic_increasing or not summer:
            return found
    return found


def _refuse_clock_change(table: Table, header: str, stamps: pd.DatetimeIndex) -> None:
    """A step back of an hour, or a missing hour, without a zone: summer time or a true gap, nobody knows."""
    steps = np.diff(stamps.to_numpy().astype("datetime64[ns]").astype(np.int64)) / 1e9
    if not len(steps):
        return
    median = float(np.median(steps))
    if not 0 < median < 1800.0:
        return
    slack = 0.5 * median
    back = np.flatnonzero(np.abs(steps + 3600.0 - median) <= slack)
    missing = np.flatnonzero(np.abs(steps - 3600.0 - median) <= slack)
    for found, what in ((back, "goes back by one hour"), (missing, "lacks exactly one hour")):
        if found.size:
            row = int(found[0]) + 1
            raise InputError(
                f"the time {what} (from {stamps[row - 1]} to {stamps[row]})",
                where=table.place(row, header),
                expected="a declared zone: this looks like a change to or from summer time",
                remedy='Write timezone = "Europe/Berlin" (yours), or "UTC" if the clock did not change.',
            )


def _all_there(table: Table, header: str, gone: NDArray[np.bool_]) -> None:
    if gone.any():
        row = int(np.argmax(gone))
        raise InputError(
            f"is empty or no time ({int(gone.sum())} of {len(gone)} rows)",
            where=table.place(row, header),
            expected="a time in every row",
            remedy="Repair or remove the line.",
        )


def _refuse_first(table: Table, header: str, text: pd.Series[Any], wrong: Any, expected: str) -> None:
    wrong = np.asarray(wrong, bool)
    if wrong.any():
        row = int(np.argmax(wrong))
        more = f" ({int(wrong.sum())} such rows)" if wrong.sum() > 1 else ""
        raise InputError(
            f"{short(text.iloc[row])} is no such time{more}",
            where=table.place(row, header),
            expected=expected,
            remedy="Correct time_format, or the line.",
        )
