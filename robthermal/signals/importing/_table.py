"""What every kind of source gives: headers, columns as they were written, and the line of every row."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass
class Action:
    """Something that was done to the data, and is said.

    Parameters
    ----------
    what : str
        "decoded", "skipped", "mapped", "converted", "units_row", "dropped_row", "dropped_column", "duplicates",
        "fault_code", "split", "filled", "resampled", "counted", "timezone", "left_out" or "glitches".
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


@dataclass
class Table:
    """A measured file as columns.

    Parameters
    ----------
    where : str
        File or kind of source, for messages.
    headers : tuple of str
        As written; "" for a column without a name.
    columns : list of ndarray
        Equally long: float64 with nan for missing, or text (dtype object) where a column is no numbers.
    lines : ndarray of int
        Line of every row, counted from 1; for sources without lines the row, counted from 0.
    units : tuple of str
        Of a units row; empty without one.
    actions : list of Action
        What reading did.
    facts : dict
        encoding, delimiter, decimal, header_line, skipped_lines, sha256, origin where they apply.
    """

    where: str
    headers: tuple[str, ...]
    columns: list[Any]
    lines: NDArray[np.int64]
    units: tuple[str, ...] = ()
    actions: list[Action] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)

    def place(self, row: int, header: str = "") -> str:
        """Words for a row, with its column."""
        number = int(self.lines[row])
        words = f"line {number}" if self.facts.get("delimiter") else f"row {number}"
        return f"{self.where}, {words}" + (f", column {header!r}" if header else "")
