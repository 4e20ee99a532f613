"""CSV: header row, comment lines, comma, semicolon or tab; what is wrong is named by line, column and text."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ..errors import InputError
from ._checks import Array

_HEAD = 64 * 1024  # a header that does not fit here is no header
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+([eE][+-]?\d+)?\s*")
_MISSING = {"", "na", "n/a", "nan", "-nan", "null", "none", "#n/a", "<na>"}


class CsvSource:
    """A CSV file, its header read."""

    def __init__(self, path: Path):
        self.path = path
        self._text = _checked_text(path)
        self._newline = "\n" if "\n" in self._text else "\r"
        header = next(self._lines(), None)
        if header is None:
            raise InputError("the file has no header row, only comments or blank lines", where=f"{path}")
        self._header_line, text = header
        self._separator = max(",;\t", key=text.count)
        self.headers = tuple(cell.strip() for cell in self._cells(text))
        self._check_header()

    def read(self, wanted: Sequence[str]) -> dict[str, Array]:
        """The wanted columns. The parser is fast and strict; what it stumbles over, the slow walk names."""
        places = {self.headers.index(header): header for header in wanted}
        if next(self._rows(), None) is None:
            raise InputError("the file has a header and no data rows", where=f"{self.path}")
        everything = len(places) == len(self.headers)
        if not everything and not self._widths_agree():  # with columns left out, the parser does not look at widths
            self._walk(places)
        try:
            table = np.loadtxt(
                (text for _, text in self._rows()),
                delimiter=self._separator,
                comments=None,
                quotechar='"',
                usecols=None if everything else list(places),
                ndmin=2,
            )
        except ValueError:
            table = np.full((1, len(places)), np.nan)
        if table.shape[1] != len(places) or not np.isfinite(table).all():
            self._walk(places)
            raise InputError("the rows cannot be read as numbers", where=f"{self.path}")
        if everything:
            return {header: table[:, i] for i, header in places.items()}
        return {header: table[:, k] for k, header in enumerate(places.values())}

    def row(self, index: int) -> str:
        """Words for a data row: counted from 0, and the line of the file counted from 1."""
        for place, (number, _) in enumerate(self._rows()):
            if place == index:
                return f"row {index} (line {number})"
        return f"row {index}"

    def _lines(self) -> Iterator[tuple[int, str]]:
        """Line number from 1 and text of every line that is neither blank nor a comment."""
        start, number = 0, 0
        while start < len(self._text):
            number += 1
            stop = self._text.find(self._newline, start)
            stop = len(self._text) if stop < 0 else stop
            text = self._text[start:stop].strip("\r\n")
            if text.strip() and not text.lstrip().startswith("#"):
                yield number, text
            start = stop + 1

    def _rows(self) -> Iterator[tuple[int, str]]:
        lines = self._lines()
        next(lines)
        return lines

    def _cells(self, text: str) -> list[str]:
        if '"' not in text:
            return text.split(self._separator)
        try:
            return next(csv.reader([text], delimiter=self._separator, skipinitialspace=True))
        except csv.Error:  # a cell of more than 128 KiB, say: wrong in any case, and named by the caller
            return text.split(self._separator)

    def _check_header(self) -> None:
        where = f"{self.path} line {self._header_line}"
        if all(_is_number(cell) for cell in self.headers):
            raise InputError(
                "the first row holds numbers",
                where=where,
                expected="a header row with column names",
                remedy="Add one, for example: time,heater,T1",
            )
        for header in self.headers:
            if not header:
                raise InputError("a column has no name", where=where, remedy="Name it, or remove a trailing separator.")
            if self.headers.count(header) > 1:
                raise InputError(f"column {header!r} stands twice", where=where, remedy="Rename one of them.")

    def _widths_agree(self) -> bool:
        if '"' in self._text:  # a quoted separator does not count
            return all(len(self._cells(text)) == len(self.headers) for _, text in self._rows())
        return all(text.count(self._separator) == len(self.headers) - 1 for _, text in self._rows())

    def _walk(self, places: dict[int, str]) -> None:
        """Row by row, slowly: raise for the first row that is ragged, or holds anything but finite numbers."""
        clock = next((i for i, header in places.items() if header.lower().startswith("time")), None)
        for index, (number, text) in enumerate(self._rows()):
            cells = self._cells(text)
            if len(cells) != len(self.headers):
                raise self._ragged(index, number, text, cells)
            for i, header in places.items():
                if not _is_finite(cells[i]):
                    time = f", time {cells[clock]} s" if clock is not None and i != clock else ""
                    raise self._bad_cell(f"row {index}{time}", number, header, cells[i])

    def _ragged(self, index: int, number: int, text: str, cells: list[str]) -> InputError:
        comma = self._separator == "," and len(cells) == 2 * len(self.headers)
        return InputError(
            f"row {index} has {len(cells)} cells and the header has {len(self.headers)}: {_short(text)}",
            where=f"{self.path} line {number}",
            remedy="Decimal commas? Write numbers with a decimal point." if comma else "Repair or remove the line.",
        )

    def _bad_cell(self, row: str, number: int, header: str, text: str) -> InputError:
        where = f"{self.path} line {number}"
        if text.strip().lower() in _MISSING:
            what = "is empty" if not text.strip() else f"is {text.strip()} (not a number)"
            return InputError(
                f"column {header!r} {what} in {row}",
                where=where,
                expected="a number in every cell",
                remedy="Missing values are not filled: cut the file there, or repair it.",
            )
        if _DECIMAL_COMMA.fullmatch(text):
            return InputError(
                f"column {header!r} holds {_short(text)} in {row}, a decimal comma",
                where=where,
                remedy="Write numbers with a decimal point.",
            )
        kind = "is not finite" if _is_number(text) else "is not a number"
        return InputError(
            f"column {header!r} holds {_short(text)} in {row}, which {kind}", where=where, expected="a finite number"
        )


def _checked_text(path: Path) -> str:
    """Content of a text file without byte-order mark; binary files and endless lines are refused after 64 KiB."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
        if b"\0" in head:
            raise _binary(path)
        if len(head) == _HEAD and b"\n" not in head and b"\r" not in head:
            raise InputError(
                f"the first line is longer than {_HEAD // 1024} KiB",
                where=f"{path}",
                expected="a CSV file with a header row and one row per sample",
            )
        content = head + file.read()
    if b"\0" in content:
        raise _binary(path)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"byte {error.start} (line {line}) is no UTF-8 text",
            where=f"{path}",
            expected="a CSV file in UTF-8",
            remedy="Save it as UTF-8 (plain ASCII is UTF-8); a binary file needs its own suffix.",
        ) from None


def _binary(path: Path) -> InputError:
    return InputError(
        "the file is binary (it holds NUL bytes)",
        where=f"{path}",
        expected="a CSV text file in UTF-8",
        remedy="Parquet, MATLAB and TDMS files are recognised by .parquet, .mat and .tdms.",
    )


def _is_number(text: str) -> bool:
    try:
        float(text.replace("_", "x"))  # Python reads 1_000; a data file must not mean it
    except ValueError:
        return False
    return True


def _is_finite(text: str) -> bool:
    return _is_number(text) and bool(np.isfinite(float(text)))


def _short(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")
