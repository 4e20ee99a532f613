"""Dates written as texts, read block by block: ISO 8601, and patterns; two possible orders of day and month."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._pandas import pd
from ...errors import InputError
from ._options import ImportOptions
from ._proposals import time_format_of
from ._table import Block, Table
from ._times import (
    CLOCK,
    DURATION,
    EPOCHS,
    NUMERIC,
    CellReader,
    Clock,
    Durations,
    Numbers,
    TimeReader,
    TimesOfDay,
    texts_of,
)
from ._tokens import NUMBER, short
from ._zones import since_first

_ISO = re.compile(r"\d{4}-\d{1,2}-\d{1,2}([T ]\s*\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?)?\s*(Z|[+-]\d{2}:?\d{2})?")
_ZONE = r"(?:Z|\d[+-]\d{2}:?\d{2})$"
_YMD = re.compile(r"\d{4}/\d{1,2}/\d{1,2}( \d{1,2}:\d{2}(:\d{2}(\.\d+)?)?)?")
_DOTS = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4}|\d{2})([T ]\s*\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?)?")
_SLASH = re.compile(
    r"(\d{1,2})([/-])(\d{1,2})\2(\d{4}|\d{2})([T ]\s*\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?\s*([AaPp][Mm])?)?"
)
_NONE = np.iinfo(np.int64).min  # not a time


def stamp_reader(
    table: Table, places: tuple[int, ...], most: int, unit: str | None, options: ImportOptions
) -> TimeReader:
    """Reader of one time column, chosen by its first cell and what is declared.

    Parameters
    ----------
    table : Table
        Its first rows.
    places : tuple of int
        Place of the time column.
    most : int
        As many rows as there can be.
    unit : str or None
        Unit text of the header.
    options : ImportOptions
        time_format and timezone.

    Raises
    ------
    InputError
        A first cell that is no time.
    """
    cells, declared = table.columns[places[0]], options.time_format
    if isinstance(cells, pd.DatetimeIndex):
        return DateCells(table, places, options)
    pattern = declared is not None and "%" in declared
    if cells.dtype.kind == "f" and not pattern or declared in (*NUMERIC, *EPOCHS, "excel"):
        return Numbers(table, places, most, unit, options)
    first = _first(cells, declared)
    if declared is None and NUMBER.fullmatch(first):  # numbers, but for some cells
        return Numbers(table, places, most, unit, options)
    if declared == "elapsed" or declared is None and CLOCK.fullmatch(first):
        return TimesOfDay(table, places, most, "elapsed" if declared else "h:mm:ss")
    if declared in ("%H:%M:%S", "%H:%M", "%H:%M:%S.%f"):
        return TimesOfDay(table, places, most, str(declared))
    if declared is None and DURATION.fullmatch(first):
        return Durations(table, places, most)
    return Dates(table, places, most, options, first)


def date_reader(table: Table, places: tuple[int, ...], most: int, options: ImportOptions) -> TimeReader:
    """Reader of a date column and a column with the time of day."""
    date, time = (table.columns[k] for k in places)
    if not isinstance(date, pd.DatetimeIndex) and ":" in (own := _first(texts_of(date), None)):
        headers = [table.headers[k] for k in places]
        raise InputError(
            f"{headers[0]!r} holds times of day already ({short(own, 30)}), and {headers[1]!r} may be the time too",
            where=table.where,
            expected="one time column",
            remedy=f'Write time = "{headers[0]}", or time = "{headers[1]}".',
        )
    joined = _joined(date, time)
    return Dates(table, places, most, options, _first(joined, options.time_format))


def _first(cells: Any, declared: str | None) -> str:
    there = pd.Series(cells).dropna()
    return str(there.iloc[0]).strip() if len(there) else declared or ""


def _joined(date: Any, time: Any) -> Any:
    """Date and time of day in one text; date cells of a workbook as ISO text."""
    days = pd.Series(date.strftime("%Y-%m-%d") if isinstance(date, pd.DatetimeIndex) else texts_of(date), dtype="str")
    return days + " " + texts_of(time).set_axis(days.index)


class DateCells(TimeReader):
    """Dates that the source holds as such."""

    text = False

    def __init__(self, table: Table, places: tuple[int, ...], options: ImportOptions):
        self.places = places
        self._table, self._options = table, options
        self._stamps = pd.DatetimeIndex([])

    def add(self, block: Block) -> None:
        """Take the dates, which come in one block."""
        self._stamps = block.columns[self.places[0]]

    def clock(self) -> Clock:
        """The clock of all rows."""
        header = self._table.headers[self.places[0]]
        return Clock(*since_first(self._table, header, self._stamps, self._options), "date cells")


class Dates(CellReader):
    """Dates as texts.

    Parameters
    ----------
    table, places, most
        As for `CellReader`.
    options : ImportOptions
        time_format and timezone.
    first : str
        First cell, from which the pattern is concluded where none is declared.
    """

    dtype = np.int64

    def __init__(self, table: Table, places: tuple[int, ...], most: int, options: ImportOptions, first: str):
        super().__init__(table, places, most)
        self._options, self._example = options, first
        declared = options.time_format
        self._patterns = [declared] if declared is not None else _patterns(table, self.header, first)
        self._other = np.empty(most if len(self._patterns) > 1 else 0, np.int64)
        self._zoned = self._patterns == ["iso"] and re.search(_ZONE, first) is not None or "%z" in self._patterns[0]
        self._fraction = False

    @property
    def expected(self) -> str:  # type: ignore[override]
        """What a cell should have been."""
        zone = (" with a zone" if self._zoned else " without a zone") + ", as in the first row"
        return f"a date and time as {self._patterns[0]}" + zone * (self._patterns == ["iso"])

    def _cells(self, block: Block) -> Any:
        if len(self.places) == 2:
            return _joined(*(block.columns[k] for k in self.places))
        return block.columns[self.places[0]]

    def _parsed(self, cells: Any) -> Any:
        text = texts_of(cells)
        missing = text.isna().to_numpy(bool)
        found = [self._stamps(text, pattern) for pattern in self._patterns]
        if len(found) == 2:
            first = [_first_true(self._bad(one) & ~missing) for one in found]
            self._other[self._n : self._n + len(text)] = found[1]
            if first[0] != first[1]:  # a day above 12 tells
                right = int(first[0] < first[1])
                if right:
                    self._values[: self._n] = self._other[: self._n]
                self._patterns, self._other, found = [self._patterns[right]], np.empty(0, np.int64), [found[right]]
        return found[0]

    def _stamps(self, text: pd.Series[Any], pattern: str) -> NDArray[np.int64]:
        """Nanoseconds of dates; not-a-time where one does not fit the pattern."""
        if pattern == "iso":
            zoned = text.str.contains(_ZONE, regex=True).fillna(self._zoned).to_numpy(bool)
            text = text.str.replace(",", ".", regex=False).where(zoned == self._zoned)
            found = pd.to_datetime(text, format="ISO8601", errors="coerce", utc=self._zoned)
        else:
            if "%S" in pattern and "%f" not in pattern:  # a declared order of day and month says nothing of decimals
                if text.str.contains(r":\d{2}[.,]\d", regex=True).any():
                    self._fraction = True
                    pattern = pattern.replace("%S", "%S.%f")
            if "%S.%f" in pattern:
                text = _with_fractions(text)
            found = pd.to_datetime(text, format=pattern, errors="coerce", utc="%z" in pattern)
        stamps = pd.DatetimeIndex(found)
        bare = stamps.tz_convert("UTC").tz_localize(None) if stamps.tz is not None else stamps
        return bare.to_numpy().astype("datetime64[ns]").view(np.int64)

    def _bad(self, values: Any) -> NDArray[np.bool_]:
        return np.asarray(values == _NONE)

    def _finished(self, values: NDArray[np.int64]) -> Clock:
        if len(self._patterns) == 2:
            raise InputError(
                f"{short(self._example)} can be day/month or month/day, and no day above 12 tells",
                where=self.table.place(0, self.header),
                expected="a declared order",
                remedy=f'Write time_format = "{self._patterns[0]}"  or  "{self._patterns[1]}".',
            )
        stamps = pd.DatetimeIndex(values.view("datetime64[ns]"), tz="UTC" if self._zoned else None)
        name = self._patterns[0].replace("%S", "%S.%f") if self._fraction else self._patterns[0]
        return Clock(*since_first(self.table, self.header, stamps, self._options), name)


def _first_true(flags: NDArray[np.bool_]) -> int:
    return int(np.argmax(flags)) if flags.any() else len(flags)


def _with_fractions(text: pd.Series[Any]) -> pd.Series[Any]:
    """Seconds with a decimal point and at least one decimal."""
    text = text.str.replace(r"(\d)[.,](\d+)(\s*[AaPp][Mm])?$", r"\1.\2\3", regex=True)
    bare = ~text.str.contains(r":\d{2}\.\d+", regex=True).fillna(True).to_numpy(bool)
    return text.where(~bare, text.str.replace(r"(:\d{2})(\s*[AaPp][Mm])?$", r"\1.0\2", regex=True))


def _patterns(table: Table, header: str, first: str) -> list[str]:
    """Patterns that dates can have, from what the first looks like: one, or two orders of day and month."""
    if _ISO.fullmatch(first):
        return ["iso"]
    if _YMD.fullmatch(first):
        return ["%Y/%m/%d" + _time_of_day(first)]
    dots = _DOTS.fullmatch(first)
    if dots:
        return [f"%d.%m.{_year(dots[3])}" + _time_of_day(first)]
    slash = _SLASH.fullmatch(first)
    if slash:
        sign, year, rest = slash[2], _year(slash[4]), _time_of_day(first)
        return [f"%d{sign}%m{sign}{year}{rest}", f"%m{sign}%d{sign}{year}{rest}"]
    proposed = time_format_of(first)
    raise InputError(
        f"{short(first)} is no time that is known" if first else "is empty or no time",
        where=table.place(0, header) if len(table.lines) else f"{table.where}, column {header!r}",
        expected="ISO 8601, dd.mm.yyyy hh:mm:ss, h:mm:ss, or numbers",
        remedy=f'Write time_format = "{proposed}".'
        if proposed
        else 'Declare it, for example time_format = "%d-%b-%Y %H:%M:%S".',
    )


def _year(text: str) -> str:
    return "%Y" if len(text) == 4 else "%y"


def _time_of_day(first: str) -> str:
    clock = re.search(r"([T ])\s*\d{1,2}:\d{2}(:\d{2})?([.,]\d+)?\s*([AaPp][Mm])?$", first)
    if clock is None:
        return ""
    return f"{clock[1]}{'%I' if clock[4] else '%H'}:%M" + ":%S" * bool(clock[2]) + " %p" * bool(clock[4])
