"""What every kind of source gives: headers, columns as they were written, and the line of every row."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ._units import split_header

Array = NDArray[np.float64]


@dataclass
class Action:
    """Something that was done to the data, and is said.

    Parameters
    ----------
    what : str
        "decoded", "skipped", "mapped", "converted", "units_row", "dropped_row", "dropped_column", "duplicates",
        "fault_code", "split", "filled", "resampled", "clock", "counted", "timezone", "left_out", "shifted",
        "averaged" or "glitches".
    n : int
        How many lines, rows, cells or columns.
    text : str
        One sentence that says what was done.
    column : str
        Column it concerns; empty for the whole file.
    lines : list of int
        Lines of the file, or rows of a source without lines, the first ones.
    times : list of float
        Times on the record's own axis [s], the first ones.
    rows : int
        Rows of the file that are in no record because of it.
    """

    what: str
    n: int
    text: str
    column: str = ""
    lines: list[int] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    rows: int = 0

    def to_dict(self) -> dict[str, Any]:
        """As in a report."""
        return {
            "what": self.what,
            "n": self.n,
            "column": self.column,
            "lines": self.lines[:50],
            "times": self.times[:50],
            "text": self.text,
            "rows": self.rows,
        }


class Lines:
    """Line of every row: runs of neighboring lines, of which even large files have few.

    Parameters
    ----------
    numbers : ndarray of int, optional
        Lines of the first rows.
    """

    def __init__(self, numbers: NDArray[np.int64] | None = None):
        self._rows: list[int] = []  # first row of every run
        self._firsts: list[int] = []  # its line
        self._n = 0
        if numbers is not None:
            self.add(numbers)

    def add(self, numbers: NDArray[np.int64]) -> None:
        """Lines of further rows, increasing."""
        if not len(numbers):
            return
        starts = np.concatenate([[0], np.flatnonzero(np.diff(numbers) != 1) + 1])
        if self._n and numbers[0] == self[self._n - 1] + 1:
            starts = starts[1:]
        self._rows += (self._n + starts).tolist()
        self._firsts += numbers[starts].tolist()
        self._n += len(numbers)

    def __len__(self) -> int:
        return self._n

    def __getitem__(self, row: int) -> int:
        run = bisect_right(self._rows, row) - 1
        return self._firsts[run] + int(row) - self._rows[run]

    def of(self, rows: NDArray[Any]) -> list[int]:
        """Lines of the first fifty of some rows, given by number or by a mask."""
        if rows.dtype == bool:
            rows = np.flatnonzero(rows)
        return [self[int(row)] for row in rows[:50]]

    def numbers(self) -> NDArray[np.int64]:
        """Line of every row."""
        runs = np.searchsorted(self._rows, np.arange(self._n), side="right") - 1
        return np.asarray(np.asarray(self._firsts)[runs] + np.arange(self._n) - np.asarray(self._rows)[runs])


@dataclass
class Table:
    """What is known of a measured file, and its first rows; a table in memory is known whole.

    Parameters
    ----------
    where : str
        File or kind of source, for messages.
    headers : tuple of str
        As written; "" for a column without a name.
    columns : list of ndarray
        First rows, equally long: float64 with nan for missing, or text (dtype object) where a column is no numbers.
    lines : Lines
        Line of every row, counted from 1; for sources without lines the row, counted from 0. Of a text file those of
        the rows that were read.
    units : tuple of str
        Of a units row; empty without one.
    actions : list of Action
        What reading did.
    facts : dict
        encoding, delimiter, decimal, header_line, skipped_lines, sha256, origin where they apply.
    empty : set of int
        Columns that are not used and hold no value.
    """

    where: str
    headers: tuple[str, ...]
    columns: list[Any]
    lines: Lines
    units: tuple[str, ...] = ()
    actions: list[Action] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)
    empty: set[int] = field(default_factory=set)

    def unit_text(self, place: int, name: str = "") -> str | None:
        """Unit of a column as its header says it, else as the units row does; a header that is `name` says none."""
        header = self.headers[place]
        written = None if header == name else split_header(header)[1]
        return self.units[place] if written is None and self.units and self.units[place].strip("- ") else written

    def place(self, row: int, header: str = "") -> str:
        """Words for a row, with its column."""
        return self.at(self.lines[row], header)

    def at(self, line: int, header: str = "") -> str:
        """Words for a line, with its column."""
        words = f"line {line}" if self.facts.get("delimiter") else f"row {line}"
        return f"{self.where}, {words}" + (f", column {header!r}" if header else "")


@dataclass(frozen=True)
class Block:
    """Rows that follow each other.

    Parameters
    ----------
    columns : dict of int to ndarray or Series
        Cells of the columns that were asked for, by place.
    lines : ndarray of int
        Line of every row.
    """

    columns: dict[int, Any]
    lines: NDArray[np.int64]


def spans(n: int, size: int = 1 << 20) -> Iterator[slice]:
    """Slices that cover `n` rows, so that what is computed on the way stays small."""
    for start in range(0, n, size):
        yield slice(start, min(start + size, n))


class Source(Protocol):
    """A measured file or table whose rows come block by block."""

    table: Table
    most_rows: int  # at least as many as it has

    def blocks(self, numbers: Sequence[int], texts: Sequence[int]) -> Iterator[Block]:
        """All rows: columns that are to be numbers, and columns that are left as texts where they are texts."""
        ...


class Whole:
    """A table that is in memory."""

    def __init__(self, table: Table):
        self.table = table
        self.most_rows = len(table.lines)
        table.empty = {
            k for k, cells in enumerate(table.columns)
            if isinstance(cells, np.ndarray) and cells.dtype.kind == "f" and bool(np.isnan(cells).all())
        }

    def blocks(self, numbers: Sequence[int], texts: Sequence[int]) -> Iterator[Block]:
        """All rows at once."""
        yield Block(dict(enumerate(self.table.columns)), self.table.lines.numbers())
