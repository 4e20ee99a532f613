"""Times that are numbers, durations or times of day, read block by block."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._pandas import pd
from ...errors import InputError
from ._options import ImportOptions
from ._table import Action, Array, Block, Table
from ._tokens import short
from ._units import unit_of
from ._wraps import counted_on
from ._zones import from_days, since_first

DAY = 86400.0
NUMERIC = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
CLOCK = re.compile(r"\d{1,5}:\d{2}(:\d{2}([.,]\d+)?)?")
DURATION = re.compile(r"([+-]?\d+(?:[.,]\d+)?)\s*([a-zA-Z]+)")
EPOCHS = {"epoch_s": 1.0, "epoch_ms": 1e-3, "epoch_us": 1e-6, "epoch_ns": 1e-9}
_FIRST, _LAST = 1e9, 2e9  # s after 1970: 2001 to 2033
_NO_SECONDS = 1e6  # s, eleven days: no thermal log has steps that long


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
    """

    seconds: Array
    origin: str | None
    format: str


class TimeReader(ABC):
    """Time of every row, block by block."""

    text = True  # whether the columns are to be left as texts
    places: tuple[int, ...] = ()  # columns of the table

    @abstractmethod
    def add(self, block: Block) -> None:
        """Take the times of further rows."""

    @abstractmethod
    def clock(self) -> Clock:
        """The clock of all rows; refuses cells that are no times."""


class CellReader(TimeReader):
    """Times from cells; what a kind of cell means is for subclasses to say.

    Parameters
    ----------
    table : Table
        For the lines in messages, and its list of actions.
    places : tuple of int
        Columns of the table: none, one, or date and time of day.
    most : int
        As many rows as there can be.
    """

    dtype: Any = np.float64
    expected = ""

    def __init__(self, table: Table, places: tuple[int, ...], most: int):
        self.table, self.places = table, places
        self.header = table.headers[places[0]] if places else ""
        self._values = np.empty(most, self.dtype)
        self._n = 0
        self._missing: list[int] = []  # first line without a time, and how many
        self._wrong: list[Any] = []  # first line with something else, its text, and how many

    def add(self, block: Block) -> None:
        """Take the times of further rows."""
        cells, lines = self._cells(block), block.lines
        missing = np.asarray(pd.isna(cells))
        values = self._parsed(cells)
        wrong = self._bad(values) & ~missing
        self._values[self._n : self._n + len(values)] = values
        self._n += len(values)
        if missing.any():
            self._missing = self._missing or [int(lines[np.argmax(missing)]), 0]
            self._missing[1] += int(missing.sum())
        if wrong.any():
            row = int(np.argmax(wrong))
            self._wrong = self._wrong or [int(lines[row]), str(np.asarray(cells, object)[row]), 0]
            self._wrong[2] += int(wrong.sum())

    def clock(self) -> Clock:
        """The clock of all rows.

        Raises
        ------
        InputError
            Cells that are no times.
        """
        self._refuse_faults()
        return self._finished(self._values[: self._n])

    def _cells(self, block: Block) -> Any:
        return block.columns[self.places[0]]

    @abstractmethod
    def _parsed(self, cells: Any) -> Any:
        """Values of cells; what is none of them is not finite."""

    def _bad(self, values: Any) -> NDArray[np.bool_]:
        return ~np.isfinite(values)

    @abstractmethod
    def _finished(self, values: Any) -> Clock:
        """The clock of the values of all rows."""

    def _refuse_faults(self) -> None:
        if self._missing and (not self._wrong or self._missing[0] < self._wrong[0]):
            raise InputError(
                f"is empty or no time ({self._missing[1]} of {self._n} rows)",
                where=self.table.at(self._missing[0], self.header),
                expected="a time in every row",
                remedy="Repair or remove the line.",
            )
        if self._wrong:
            line, text, n = self._wrong
            raise InputError(
                f"{short(text)} is no such time" + (f" ({n} such rows)" if n > 1 else ""),
                where=self.table.at(line, self.header),
                expected=self.expected,
                remedy="Correct time_format, or the line.",
            )


class Counted(TimeReader):
    """Rows of a file without a time column, a sample time apart."""

    def __init__(self, sample_time: float):
        self._n = 0
        self._step = sample_time

    def add(self, block: Block) -> None:
        """Count further rows."""
        self._n += len(block.lines)

    def clock(self) -> Clock:
        """The clock of all rows."""
        return Clock(np.arange(self._n, dtype=np.float64) * self._step, None, "counted")


class Numbers(CellReader):
    """Numbers of a unit of time, or since an epoch."""

    expected = "a number"

    def __init__(self, table: Table, places: tuple[int, ...], most: int, unit: str | None, options: ImportOptions):
        super().__init__(table, places, most)
        self.text = table.columns[places[0]].dtype.kind == "O"
        self._unit, self._options = unit, options

    def _parsed(self, cells: Any) -> Any:
        if getattr(cells, "dtype", None) is not None and cells.dtype.kind == "f":
            return cells
        text = texts_of(cells).str.replace(",", ".", regex=False)
        return pd.to_numeric(text, errors="coerce").to_numpy(np.float64)

    def _finished(self, values: Array) -> Clock:
        declared = self._options.time_format
        values = counted_on(self.table, self.header, values, self._options)
        if declared in NUMERIC:
            return Clock(values * NUMERIC[declared], None, declared)
        if declared == "excel":
            return Clock(*since_first(self.table, self.header, from_days(values), self._options), "excel")
        factor, name = _unit_of_time(self.table, self.header, self._unit)
        epoch = declared if declared in EPOCHS else None
        if epoch is None and declared is None and not name and len(values) > 1:
            low, high = values.min(), values.max()
            epoch = next((key for key, scale in EPOCHS.items() if _FIRST <= low * scale <= high * scale <= _LAST), None)
        if epoch is not None:
            scale = EPOCHS[epoch]
            whole, part = divmod(float(values[0]), 1.0)
            ticks = round(1e9 * scale)  # in nanoseconds; their product is no number of 53 bits
            origin = pd.Timestamp(int(whole) * ticks + round(part * ticks), tz="UTC").isoformat()
            values -= float(values[0])
            return Clock(values * scale if scale != 1.0 else values, origin, epoch)
        if declared is not None:
            raise InputError(
                f"holds numbers and time_format is {declared!r}",
                where=f"{self.table.where}, column {self.header!r}",
                expected=f"a format of numbers: {', '.join((*NUMERIC, *EPOCHS))} or excel",
            )
        if not name:
            self._refuse_long_steps(values)
        return Clock(values * factor if factor != 1.0 else values, None, name or "s")

    def _refuse_long_steps(self, values: Array) -> None:
        """Refuse a counter that nobody calls one: as seconds its steps would be weeks or years."""
        step = float(np.median(np.diff(values))) if len(values) > 1 else 0.0
        if step >= _NO_SECONDS:
            raise InputError(f"the time column {self.header!r} has no unit, and its steps are {step:.4g}",
                             where=self.table.where, expected="seconds, or a declared unit",
                             remedy='Declare it: time_format = "us" or "ns", or "s" if these are seconds.')


def _unit_of_time(table: Table, header: str, unit: str | None) -> tuple[float, str]:
    if unit is None:
        return 1.0, ""
    found = unit_of(unit)
    if found is None or found.quantity != "time":
        raise InputError(
            f"the time column {header!r} is in {short(unit)}",
            where=table.where,
            expected="s, ms, us, min or h",
            remedy='Declare what it is, for example time_format = "ms".',
        )
    return found.factor, found.name


class TimesOfDay(CellReader):
    """h:mm:ss or h:mm; times of day may pass midnight, which elapsed time does not."""

    expected = "h:mm:ss"

    def __init__(self, table: Table, places: tuple[int, ...], most: int, name: str):
        super().__init__(table, places, most)
        self._name = name

    def _parsed(self, cells: Any) -> Any:
        text = texts_of(cells).str.replace(",", ".", regex=False)
        known = text.str.fullmatch(r"\d{1,5}:\d{2}(:\d{2}(\.\d+)?)?").fillna(False).to_numpy(bool)
        brief = text.str.fullmatch(r"\d{1,5}:\d{2}").fillna(False).to_numpy(bool)
        if brief.any():
            text = text.where(~brief, text + ":00")
        spans = pd.to_timedelta(text.where(known), errors="coerce")
        return spans.dt.total_seconds().to_numpy(np.float64)

    def _finished(self, values: Array) -> Clock:
        if self._name != "elapsed" and len(values) and values.max() < DAY:
            wraps = np.flatnonzero(values[1:] - values[:-1] < -0.5 * DAY) + 1
            if wraps.size:
                text = "the time of day passes midnight; days are counted on"
                action = Action("counted", int(wraps.size), text, self.header, self.table.lines.of(wraps))
                self.table.actions.append(action)
            for row in wraps.tolist():
                values[row:] += DAY
        return Clock(values, None, self._name)


class Durations(CellReader):
    """``12 sec``: a number and a unit of time in every cell."""

    expected = "a number and s, ms, us, min or h"

    def _parsed(self, cells: Any) -> Any:
        parts = texts_of(cells).str.extract(r"^([+-]?\d+(?:[.,]\d+)?)\s*([a-zA-Z]+)$")
        units = {str(word): unit_of(str(word)) for word in parts[1].dropna().unique()}
        factors = {word: unit.factor for word, unit in units.items() if unit and unit.quantity == "time"}
        numbers = pd.to_numeric(parts[0].str.replace(",", ".", regex=False), errors="coerce").to_numpy(np.float64)
        return numbers * parts[1].map(factors).to_numpy(np.float64)

    def _finished(self, values: Array) -> Clock:
        return Clock(values, None, "duration")


def texts_of(cells: Any) -> pd.Series[Any]:
    """Cells as trimmed texts, missing ones as missing."""
    return pd.Series(cells).astype("str").str.strip()
