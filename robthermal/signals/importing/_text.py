"""Delimited text files, block by block: the head decides how they are laid out, only columns that are used are read."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..._pandas import pd
from ...errors import InputError
from .._stated import KEY, of_comments
from ._decode import examine
from ._layout import Layout, find_layout
from ._options import ImportOptions
from ._rows import RowReader, count
from ._table import Action, Block, Lines, Table
from ._tokens import DECIMAL_COMMA, NUMBER, THOUSANDS, is_missing, na_values, short

_HEAD = 400_000  # characters in which the header is searched
_LONGEST = 64 * 1024  # characters of a line
BLOCK = 8_000_000  # bytes read at once


def _exact() -> dict[str, Any]:
    """Before version 3 the parser rounds the last digit unless told not to; since then it is exact and says so."""
    return {"float_precision": "round_trip"} if int(pd.__version__.split(".")[0]) < 3 else {}


class TextSource:
    """A delimited text file.

    Parameters
    ----------
    path : Path
        Delimited text file to read.
    options : ImportOptions
        What is declared.

    Raises
    ------
    InputError
        Binary files, no header, ragged rows; text in a column of numbers is left to the columns that are used.
    """

    def __init__(self, path: Path, options: ImportOptions):
        where = self._where = str(path)
        _refuse_long_line(path)
        self._encoded = examine(path, options.encoding)
        self._missing = na_values(options.missing)
        head, whole = self._head()
        lines = head.split("\n")
        layout = find_layout(lines if whole else lines[:-1], options, where)
        if not layout.decimal:  # the head has neither
            layout = replace(layout, decimal=self._decimal(layout))
        self._layout = layout
        reader = RowReader(layout, where)
        pieces = head if whole else head[: head.rfind("\n") + 1]
        blocks = [(text, numbers) for text, numbers in reader.rows(iter([pieces]))]
        if not blocks and whole:
            raise InputError("the file has a header and no data rows", where=where, expected="a row per sample")
        everything = range(len(layout.headers))
        columns, first_lines = [np.zeros(0) for _ in everything], Lines()
        for text, numbers in blocks:  # one, as the head comes in one piece
            first_lines.add(numbers)
            parsed = self._parsed(text, numbers, everything, ())
            columns = [_plain(parsed[k], layout) for k in everything]
        self.table = Table(
            where,
            layout.headers,
            columns,
            first_lines,
            layout.units,
            _actions(self._encoded.assumed, self._encoded.encoding, layout),
            {
                "encoding": self._encoded.encoding,
                "delimiter": layout.delimiter,
                "decimal": layout.decimal,
                "header_line": layout.header_line,
                "skipped_lines": len(layout.skipped),
                KEY: of_comments(lines),
            },
        )
        self.most_rows = self._encoded.most_lines

    def blocks(self, numbers: Sequence[int], texts: Sequence[int]) -> Iterator[Block]:
        """All rows of the columns that are used; the others are only asked whether they are empty.

        Parameters
        ----------
        numbers, texts : sequence of int
            Columns whose cells are to be numbers, and columns that are left as texts.
        """
        table, used = self.table, {*numbers, *texts}
        digest = hashlib.sha256()
        reader = RowReader(self._layout, table.where)
        table.lines = Lines()
        empty = {k for k, cells in enumerate(table.columns) if k not in used and _is_empty(cells)}
        for text, lines in reader.rows(self._encoded.text(digest, BLOCK)):
            parsed = self._parsed(text, lines, [*used, *empty], [*texts, *empty])
            table.lines.add(lines)
            empty = {k for k in empty if not parsed[k].notna().any()}
            columns = {k: parsed[k] if k in texts else _plain(parsed[k], self._layout) for k in used}
            yield Block(columns, lines)
        if not reader.n_rows:
            raise InputError("the file has a header and no data rows", where=table.where, expected="a row per sample")
        table.empty = empty
        table.actions.extend(reader.actions())
        table.facts |= {"sha256": digest.hexdigest(), "rows": reader.n_file()}

    def _decimal(self, layout: Layout) -> str:
        """Decimal sign of a file whose first rows have whole numbers only: one more pass."""
        d = re.escape(layout.delimiter)
        cell = re.compile(rf'(?:^|{d})[ \t"]*[+-]?\d*([.,])\d+(?:[eE][+-]?\d+)?[ \t"]*(?={d}|$)'.encode(), re.M)
        for text, _ in RowReader(layout, self._where).rows(self._encoded.text()):
            found = cell.search(text) if b"," in text or b"." in text else None
            if found is not None:
                return found[1].decode()
        return "."

    def _head(self) -> tuple[str, bool]:
        """The first characters of the file, and whether they are all."""
        head, pieces = "", self._encoded.text()
        for piece in pieces:
            head += piece
            if len(head) > _HEAD:
                return head[:_HEAD], False
        return head, True

    def _parsed(self, text: bytes, lines: Any, places: Sequence[int], texts: Sequence[int]) -> pd.DataFrame:
        layout = self._layout
        if not places:
            return pd.DataFrame(index=range(len(lines)))
        try:
            return pd.read_csv(
                io.BytesIO(text),
                sep=layout.delimiter,
                header=None,
                names=range(len(layout.headers)),
                usecols=sorted(places),
                dtype=dict.fromkeys(texts, str),
                decimal=layout.decimal,
                thousands=layout.thousands,
                na_values=self._missing,
                keep_default_na=False,
                skipinitialspace=True,
                engine="c",
                low_memory=False,
                **_exact(),
                index_col=False,
                skip_blank_lines=False,
            )
        except (pd.errors.ParserError, ValueError) as error:
            raise InputError(
                f"the rows cannot be read: {short(error, 120)}",
                where=f"{self._where}, line {lines[0]}",
                expected="one row per line",
            ) from None


def _refuse_long_line(path: Path) -> None:
    with path.open("rb") as file:
        head = file.read(_LONGEST)
    if len(head) == _LONGEST and b"\n" not in head and b"\r" not in head and b"\0" not in head:
        raise InputError(
            f"the first line is longer than {_LONGEST // 1024} KiB",
            where=str(path),
            expected="a text file with a header row and one row per sample",
        )


def _is_empty(cells: Any) -> bool:
    return bool(cells.dtype.kind == "f" and np.isnan(cells).all())


def _plain(column: pd.Series[Any], layout: Layout) -> Any:
    """Float column, or object column of trimmed text with nan for missing; numbers in the wrong decimal stay text."""
    if column.dtype.kind in "fiu":
        return column.to_numpy(np.float64)
    if column.dtype.kind == "b":
        return column.astype(str).to_numpy(object)
    cells = column.to_numpy(object)
    text = np.array([None if not isinstance(cell, str) else cell.strip() for cell in cells], object)
    if any(cell is not None and not NUMBER.fullmatch(cell) and not is_missing(cell) for cell in text):
        return np.array([np.nan if cell is None else cell for cell in text], object)
    numbers = np.full(len(text), np.nan)
    for k, cell in enumerate(text):
        if cell is None or is_missing(cell):
            continue
        if (
            layout.decimal == "."
            and DECIMAL_COMMA.fullmatch(cell)
            or layout.decimal == ","
            and "." in cell
            or (THOUSANDS.fullmatch(cell))
        ):
            return np.array([np.nan if c is None else c for c in text], object)
        numbers[k] = float(cell.replace(layout.decimal, "."))
    return numbers


def _actions(assumed: bool, encoding: str, layout: Layout) -> list[Action]:
    found = []
    if assumed:
        found.append(Action("decoded", 1, f"not UTF-8; read as {encoding}, which all its letters fit"))
    if layout.skipped:
        text = f"{count(len(layout.skipped), 'line')} before the header skipped"
        found.append(Action("skipped", len(layout.skipped), text, lines=list(layout.skipped)))
    if layout.units_line:
        found.append(Action("units_row", 1, f"line {layout.units_line} holds the units", lines=[layout.units_line]))
    return found
