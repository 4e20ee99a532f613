"""Text files, block by block: what is no row is left out and said, the rest becomes columns."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ...errors import InputError
from ._decode import Decoded, decode
from ._layout import Layout, cells_of, delimiter_name, find_layout, is_content
from ._options import ImportOptions
from ._table import Action, Table
from ._tokens import DECIMAL_COMMA, NUMBER, THOUSANDS, is_missing, na_values, short

_HEAD = 400_000  # characters in which the header is searched
_LONGEST = 64 * 1024  # characters of a line
_BLOCK = 16_000_000  # characters parsed at once
# Before version 3 the parser rounds the last digit unless it is told not to; since then it is exact and says so.
_EXACT: dict[str, Any] = {"float_precision": "round_trip"} if int(pd.__version__.split(".")[0]) < 3 else {}


@dataclass
class _Left:
    """Lines that are no rows."""

    blank: list[int] = field(default_factory=list)
    repeated: list[int] = field(default_factory=list)
    incomplete: list[int] = field(default_factory=list)


def read_text(path: Path, options: ImportOptions) -> Table:
    """A delimited text file as a table.

    Parameters
    ----------
    path : Path
        Delimited text file to read.
    options : ImportOptions
        What is declared.

    Raises
    ------
    InputError
        Binary files, no header, ragged rows, text in a column of numbers is left to the columns that are used.
    """
    with path.open("rb") as file:
        head = file.read(_LONGEST)
        if len(head) == _LONGEST and b"\n" not in head and b"\r" not in head and b"\0" not in head:
            raise InputError(
                f"the first line is longer than {_LONGEST // 1024} KiB",
                where=str(path),
                expected="a text file with a header row and one row per sample",
            )
        content = head + file.read()
    digest = hashlib.sha256(content).hexdigest()
    where = str(path)
    decoded = decode(content, where, options.encoding)
    del content
    layout = find_layout(decoded.text[:_HEAD].split("\n"), options, where)
    left, columns, lines = _Left(), _Columns(layout, options), []
    for text, numbers in _blocks(decoded.text, layout, left, where):
        columns.add(text, numbers, where)
        lines.append(numbers)
    if not lines:
        raise InputError("the file has a header and no data rows", where=where, expected="a row per sample")
    table = Table(
        where,
        layout.headers,
        columns.joined(),
        np.concatenate(lines),
        layout.units,
        _actions(decoded, layout, left),
        {
            "sha256": digest,
            "encoding": decoded.encoding,
            "delimiter": layout.delimiter,
            "decimal": layout.decimal,
            "header_line": layout.header_line,
            "skipped_lines": len(layout.skipped),
            "rows": sum(map(len, lines)) + len(left.incomplete),
        },
    )
    return table


def _blocks(text: str, layout: Layout, left: _Left, where: str) -> Iterator[tuple[str, Any]]:
    """Parts of the text that hold nothing but rows, with the line of each row."""
    start = 0
    for _ in range(layout.first_line - 1):
        start = text.find("\n", start) + 1
        if not start:
            return
    number = layout.first_line
    while start < len(text):
        stop = len(text) if start + _BLOCK >= len(text) else text.rfind("\n", start, start + _BLOCK) + 1 or len(text)
        part = text[start:stop]
        rows = part.split("\n")
        if rows and not rows[-1]:
            rows.pop()
        kept, numbers = _rows(part, rows, number, layout, left, where, last=stop == len(text))
        if len(numbers):
            yield (part if len(kept) == len(rows) else "\n".join(kept) + "\n"), numbers
        number += len(rows)
        start = stop


def _rows(
    part: str, rows: list[str], first: int, layout: Layout, left: _Left, where: str, *, last: bool
) -> tuple[list[str], Any]:
    """The lines that are rows, and their numbers; ragged ones are refused. Most files have no other lines: be quick."""
    d, expected = layout.delimiter, len(layout.headers) - 1
    quoted = '"' in part
    counts = np.fromiter((len(cells_of(row, d)) - 1 if quoted else row.count(d) for row in rows), np.int64, len(rows))
    odd = np.flatnonzero(counts != expected)
    doubtful = part[:1] in "# \t\n" or any(mark in part for mark in ("\n#", "\n\n", "\n ", "\n\t"))
    marked = [k for k, row in enumerate(rows) if not is_content(row)] if doubtful else []
    header = _header_text(rows, layout) if layout.headers[0] in part else ""
    again = [k for k, row in enumerate(rows) if row == header] if header else []
    drop = set(marked) | set(again)
    left.repeated += [first + k for k in again]
    left.blank += [first + k for k in marked]
    for k in odd.tolist():
        if k in drop:
            continue
        if not is_content(rows[k]) or [cell for cell in cells_of(rows[k], d)] == list(layout.headers):
            (left.repeated if is_content(rows[k]) else left.blank).append(first + k)
        elif last and counts[k] < expected and not any(is_content(row) for row in rows[k + 1 :]):
            left.incomplete.append(first + k)
        else:
            raise _ragged(rows[k], first + k, int(counts[k]) + 1, layout, where)
        drop.add(k)
    numbers = np.arange(first, first + len(rows))
    if not drop:
        return rows, numbers
    keep = np.ones(len(rows), bool)
    keep[list(drop)] = False
    return [row for k, row in enumerate(rows) if k not in drop], numbers[keep]


def _header_text(rows: list[str], layout: Layout) -> str:
    """Spelling of a repeated header in these rows, if any; empty if none."""
    first = layout.headers[0]
    if not first or NUMBER.fullmatch(first):
        return ""
    return next(
        (
            row
            for row in rows
            if row.lstrip('" \t').startswith(first) and cells_of(row, layout.delimiter) == list(layout.headers)
        ),
        "",
    )


def _ragged(line: str, number: int, count: int, layout: Layout, where: str) -> InputError:
    n = len(layout.headers)
    remedy = "Repair or remove the line."
    if layout.delimiter == "," and count in (2 * n, 2 * n - 1):
        remedy = 'Decimal commas between commas? Export with ";" between the cells, or with decimal points.'
    return InputError(
        f"the row has {count} cells and the header has {n}: {short(line)}",
        where=f"{where}, line {number}",
        expected="as many cells as the header",
        remedy=remedy,
    )


class _Columns:
    """Columns of all blocks: numbers where a column is numbers, else text."""

    def __init__(self, layout: Layout, options: ImportOptions):
        self._layout = layout
        self._missing = na_values(options.missing)
        self._parts: list[list[Any]] = [[] for _ in layout.headers]

    def add(self, text: str, numbers: Any, where: str) -> None:
        layout = self._layout
        try:
            frame = pd.read_csv(
                io.StringIO(text),
                sep=layout.delimiter,
                header=None,
                names=range(len(layout.headers)),
                decimal=layout.decimal,
                thousands=layout.thousands,
                na_values=self._missing,
                keep_default_na=False,
                skipinitialspace=True,
                engine="c",
                low_memory=False,
                **_EXACT,
                index_col=False,
                skip_blank_lines=False,
            )
        except (pd.errors.ParserError, ValueError) as error:
            raise InputError(
                f"the rows cannot be read: {short(error, 120)}",
                where=f"{where}, line {numbers[0]}",
                expected="one row per line",
            ) from None
        for k, part in enumerate(self._parts):
            part.append(_plain(frame[k], layout))

    def joined(self) -> list[Any]:
        """Every column in one piece; text as soon as one of its blocks is text."""
        found = []
        for parts in self._parts:
            if all(part.dtype.kind == "f" for part in parts):
                found.append(np.concatenate(parts))
            else:
                found.append(np.concatenate([part if part.dtype.kind == "O" else _as_text(part) for part in parts]))
        return found


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


def _as_text(part: Any) -> Any:
    return np.array([np.nan if np.isnan(value) else f"{value:.15g}" for value in part], object)


def _actions(decoded: Decoded, layout: Layout, left: _Left) -> list[Action]:
    found = []
    if decoded.assumed:
        found.append(Action("decoded", 1, f"not UTF-8; read as {decoded.encoding}, which all its letters fit"))
    if layout.skipped:
        found.append(
            Action(
                "skipped",
                len(layout.skipped),
                f"{_count(len(layout.skipped), 'line')} before the header skipped",
                lines=list(layout.skipped),
            )
        )
    if layout.units_line:
        found.append(Action("units_row", 1, f"line {layout.units_line} holds the units", lines=[layout.units_line]))
    if left.blank:
        found.append(
            Action(
                "skipped",
                len(left.blank),
                f"{_count(len(left.blank), 'blank or comment line')} skipped",
                lines=left.blank[:50],
            )
        )
    if left.repeated:
        found.append(
            Action(
                "skipped",
                len(left.repeated),
                f"the header is repeated {_count(len(left.repeated), 'time')}; skipped",
                lines=left.repeated[:50],
            )
        )
    if left.incomplete:
        found.append(
            Action(
                "dropped_row",
                len(left.incomplete),
                f"the last row, line {left.incomplete[0]}, is incomplete; dropped",
                lines=left.incomplete,
                rows=len(left.incomplete),
            )
        )
    return found


def _count(n: int, noun: str) -> str:
    return f"{n} {noun}" + ("" if n == 1 else "s")


def delimiter_in_words(table: Table) -> str:
    """Delimiter of a table for people."""
    return delimiter_name(table.facts.get("delimiter", ""))
