"""CSV: header row, comment lines, comma, semicolon or tab; what is wrong is named by line, column and text."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from ..errors import InputError
from ._checks import Array

_HEAD = 64 * 1024  # a header that does not fit here is no header
_COMMENT = re.compile(rb"(?m)^[ \t]*#[^\r\n]*(?:\r*\n|\r|\Z)")
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+([eE][+-]?\d+)?\s*")
_MISSING = {"", "na", "n/a", "nan", "-nan", "null", "none", "#n/a", "<na>"}


class CsvSource:
    """A CSV file, its header read."""

    def __init__(self, path: Path):
        self.path = path
        self._text = _checked_bytes(path)
        self._newline = "\n" if b"\n" in self._text else "\r"
        header = next(self._lines(), None)
        if header is None:
            raise InputError("the file has no header row, only comments or blank lines", where=f"{path}")
        self._header_line, text = header
        self._separator = max(",;\t", key=text.count)
        self.headers = tuple(cell.strip() for cell in self._cells(text))
        self._check_header()

    def read(self, wanted: Sequence[str]) -> dict[str, Array]:
        """The wanted columns. The parser is fast and forgiving; whatever it stumbles over, the slow walk names."""
        places = {self.headers.index(header): header for header in wanted}
        kinds = {i: np.float64 if i in places else str for i in range(len(self.headers))}
        try:
            table = pd.read_csv(
                io.BytesIO(_COMMENT.sub(b"", self._text)),
                sep=self._separator,
                header=None,
                names=range(len(self.headers)),
                index_col=False,
                skiprows=1,
                dtype=kinds,
                skipinitialspace=True,
                float_precision="round_trip",
                na_filter=False,  # an empty cell must not pass for a number, nor be filled
                on_bad_lines="error",
            )
        except (ValueError, pd.errors.ParserError):
            self._walk(places)
            raise InputError("the rows cannot be read as numbers", where=f"{self.path}") from None
        if len(table) == 0:
            raise InputError("the file has a header and no data rows", where=f"{self.path}")
        self._check_widths()
        columns = {header: table[i].to_numpy() for i, header in places.items()}
        if not all(np.isfinite(column).all() for column in columns.values()):
            self._walk(places)
        return columns

    def row(self, index: int) -> str:
        """Words for a data row: counted from 0, and the line of the file counted from 1."""
        for place, (number, _) in enumerate(self._rows()):
            if place == index:
                return f"row {index} (line {number})"
        return f"row {index}"

    def _lines(self) -> Iterator[tuple[int, str]]:
        """Line number from 1 and text of every line that is neither blank nor a comment."""
        start, number, end = 0, 0, self._newline.encode()
        while start < len(self._text):
            number += 1
            stop = self._text.find(end, start)
            stop = len(self._text) if stop < 0 else stop
            text = self._text[start:stop].decode("utf-8").strip("\r\n")
            if text.strip() and not text.lstrip(" \t").startswith("#"):
                yield number, text
            start = stop + 1

    def _rows(self) -> Iterator[tuple[int, str]]:
        lines = self._lines()
        next(lines)
        return lines

    def _cells(self, text: str) -> list[str]:
        return next(csv.reader([text], delimiter=self._separator, skipinitialspace=True))

    def _check_header(self) -> None:
        where = f"{self.path} line {self._header_line}"
        if all(_is_number(cell) for cell in self.headers):
            raise InputError("the first row holds numbers", where=where, expected="a header row with column names",
                             remedy="Add one, for example: time,heater,T1")
        for header in self.headers:
            if not header:
                raise InputError("a column has no name", where=where, remedy="Name it, or remove a trailing separator.")
            if self.headers.count(header) > 1:
                raise InputError(f"column {header!r} stands twice", where=where, remedy="Rename one of them.")

    def _check_widths(self) -> None:
        """Every row has as many cells as the header: the parser fills short rows and cuts long ones."""
        separator, quoted = self._separator.encode(), b'"' in self._text
        body = self._text if not quoted else b""
        if not quoted and body.count(separator) == self._expected_separators(body, separator):
            return
        self._walk({})

    def _expected_separators(self, body: bytes, separator: bytes) -> int:
        """Separators a sound file has, or -1 when rows must be counted one by one."""
        lengths = np.array([text.count(self._separator) for _, text in self._lines()])
        sound = bool((lengths == len(self.headers) - 1).all()) and b"#" not in body
        return int(lengths.sum()) if sound else -1

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


def _checked_bytes(path: Path) -> bytes:
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
        text = head + file.read()
    if b"\0" in text:
        raise _binary(path)
    text = text.removeprefix(b"\xef\xbb\xbf")
    try:
        text.decode("utf-8")
    except UnicodeDecodeError as error:
        line = text.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"byte {error.start} (line {line}) is no UTF-8 text",
            where=f"{path}",
            expected="a CSV file in UTF-8",
            remedy="Save it as UTF-8 (plain ASCII is UTF-8); a binary file needs its own suffix.",
        ) from None
    return text


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
