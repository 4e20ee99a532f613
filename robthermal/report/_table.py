"""Tables: a data frame as a reader sees it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .._digits import in_table
from .._pandas import pd
from ..errors import InputError

MAX_ROWS = 200  # of a table on the page; a network may have 100 000 lumps, a reader has less time


@dataclass(frozen=True)
class Printed:
    """A table as it stands on the page: text in cells.

    Parameters
    ----------
    caption : str
        What it shows.
    header : sequence of str
        Titles of the columns.
    rows : sequence of sequence of str
        Text of the cells, row by row.
    numeric : sequence of bool
        Which columns hold numbers, and are set flush right.
    left_out : int, optional
        Rows that are not shown.

    Raises
    ------
    InputError
        Rows of another width than the header.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.report.Printed("Runaway limits.", ["module", "I* [A]"], [["m1", "2.301"]], [False, True]).left_out
    0
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    numeric: Sequence[bool]
    left_out: int = 0

    def __post_init__(self) -> None:
        if any(len(row) != len(self.header) for row in (self.numeric, *self.rows)):
            raise InputError("rows and header differ in width", where=f"table {self.caption!r}",
                             expected="one cell per column")


@dataclass(frozen=True)
class Table:
    """A table with a caption.

    Parameters
    ----------
    frame : pandas.DataFrame
        Contents. A default index is not shown.
    caption : str
        What it shows.
    digits : int, optional
        Significant digits of numbers that are not integers.

    Raises
    ------
    InputError
        Not a DataFrame, or no digits.

    Examples
    --------
    >>> import pandas as pd, robthermal as rt
    >>> rt.report.Table(pd.DataFrame({"module": ["m1"], "I* [A]": [2.30149]}), "Runaway limits.").rows
    [['m1', '2.301']]
    """

    frame: pd.DataFrame
    caption: str
    digits: int = 4

    def __post_init__(self) -> None:
        if not isinstance(self.frame, pd.DataFrame):
            raise InputError(f"frame is a {type(self.frame).__name__}", where=f"table {self.caption!r}",
                             expected="a pandas DataFrame")
        if self.digits < 1:
            raise InputError(f"digits is {self.digits!r}", where=f"table {self.caption!r}",
                             expected="a whole number ≥ 1")

    @cached_property
    def printed(self) -> Printed:
        """As it stands on the page, which asks for every cell: written once."""
        return Printed(self.caption, self.header, self.rows, self.numeric, self.left_out)

    @property
    def header(self) -> list[str]:
        """Column titles."""
        return [str(name) for name in self._shown().columns]

    @property
    def rows(self) -> list[list[str]]:
        """Cells as text, at most the first 200 rows."""
        shown = self._shown().head(MAX_ROWS)
        columns = [[_cell(value, self.digits) for value in shown.iloc[:, j]] for j in range(shown.shape[1])]
        return [list(row) for row in zip(*columns, strict=True)]

    @property
    def numeric(self) -> list[bool]:
        """Which columns hold numbers, and are set flush right."""
        shown = self._shown()
        types = [shown.iloc[:, j].dtype for j in range(shown.shape[1])]
        return [pd.api.types.is_numeric_dtype(kind) and not pd.api.types.is_bool_dtype(kind) for kind in types]

    @property
    def left_out(self) -> int:
        """Rows that are not shown."""
        return max(len(self.frame) - MAX_ROWS, 0)

    def _shown(self) -> pd.DataFrame:
        plain = isinstance(self.frame.index, pd.RangeIndex) and self.frame.index.name is None
        if plain:
            return self.frame
        index = self.frame.index
        levels = [pd.Series(index.get_level_values(i), name=name or "") for i, name in enumerate(index.names)]
        return pd.concat([*levels, self.frame.reset_index(drop=True)], axis=1)


def printed(table: Table | Printed) -> Printed:
    """A table as it stands on the page."""
    return table.printed if isinstance(table, Table) else table


def _cell(value: object, digits: int) -> str:
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (float, np.floating)):
        return in_table(float(value), digits)
    return "–" if value is None or value is pd.NaT or value is pd.NA else str(value)
