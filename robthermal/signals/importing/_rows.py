"""Lines of a text that are rows; what is no row is left out and remembered, a ragged row is refused."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...errors import InputError
from ._layout import Layout, cells_of, collapsed, is_content
from ._table import Action
from ._tokens import NUMBER, short

_FEED, _QUOTE = ord("\n"), ord('"')
_BLANK = np.isin(np.arange(256), [ord(letter) for letter in ' \t"'])  # what may stand before the first cell
_MOST_BLANKS = 64  # lines that begin with more are read one by one


class _Lines:
    """Lines of a text, found without taking it apart."""

    def __init__(self, text: str):
        self._text = text.encode("utf-8", "surrogatepass")
        self._bytes = np.frombuffer(self._text, np.uint8)
        self._stops = np.flatnonzero(self._bytes == _FEED)
        self._starts = np.concatenate([[0], self._stops[:-1] + 1])

    def __len__(self) -> int:
        return len(self._stops)

    def __getitem__(self, k: int) -> str:
        return self._text[self._starts[k] : self._stops[k]].decode("utf-8", "surrogatepass")

    def counts(self, delimiter: str, expected: int) -> Any:
        """How many delimiters every line has outside of quotes."""
        if not delimiter.isascii():
            return np.fromiter((len(cells_of(self[k], delimiter)) - 1 for k in range(len(self))), np.int64, len(self))
        places = np.flatnonzero(self._bytes == ord(delimiter))
        quotes = np.flatnonzero(self._bytes == _QUOTE)
        if quotes.size:
            before = np.searchsorted(quotes, self._starts)[np.searchsorted(self._stops, places)]
            places = places[(np.searchsorted(quotes, places) - before) % 2 == 0]
        found = np.diff(np.searchsorted(places, self._stops), prepend=0)
        if quotes.size:  # a quote within a cell is a letter like any other
            for k in np.flatnonzero(found != expected).tolist():
                found[k] = len(cells_of(self[k], delimiter)) - 1
        return found

    def begin_with(self, marks: bytes) -> Any:
        """Lines whose first byte, blanks and quotes apart, is one of some."""
        place = self._starts.copy()
        for _ in range(_MOST_BLANKS):
            blank = _BLANK[self._bytes[place]]
            if not blank.any():
                break
            place += blank
        return np.isin(self._bytes[place], np.frombuffer(marks, np.uint8)) | _BLANK[self._bytes[place]]

    def kept(self, keep: Any) -> bytes:
        """The text without some lines."""
        if keep.all():
            return self._text
        rows = zip(self._starts[keep].tolist(), self._stops[keep].tolist(), strict=True)
        return b"".join(self._text[start : stop + 1] for start, stop in rows)


class RowReader:
    """Lines of a text, piece by piece.

    Parameters
    ----------
    layout : Layout
        How the text is laid out.
    where : str
        File, for messages.
    """

    def __init__(self, layout: Layout, where: str):
        self._layout, self._where = layout, where
        self._headers = list(layout.headers)
        self._units = list(layout.units)
        marks = "#\n" + "".join(_first_letter(cells, layout.delimiter) for cells in (self._headers, self._units))
        self._marks = marks.encode()
        self._blank: list[int] = []
        self._repeated: list[int] = []
        self._short: tuple[int, str, int] | None = None  # the last row, if it has too few cells: line, text, cells
        self.n_rows = 0

    def rows(self, pieces: Iterator[str]) -> Iterator[tuple[bytes, Any]]:
        """UTF-8 texts that hold nothing but rows, with the line of each row.

        Raises
        ------
        InputError
            A row with another number of cells than the header, unless it is the last and too short.
        """
        number, rest = 1, ""
        for piece in pieces:
            part = rest + piece
            stop = part.rfind("\n") + 1
            part, rest = part[:stop], part[stop:]
            if self._layout.delimiter == " ":
                part = collapsed(part)
            skip = self._layout.first_line - number
            if skip > 0:  # the lines up to the header
                place = _after(part, skip)
                number += part.count("\n", 0, place)
                part = part[place:]
            if part:
                lines = _Lines(part)
                yield from self._of(lines, number)
                number += len(lines)
        if rest and number >= self._layout.first_line:
            last = collapsed(rest) if self._layout.delimiter == " " else rest
            yield from self._of(_Lines(last + "\n"), number)

    def _of(self, lines: _Lines, first: int) -> Iterator[tuple[bytes, Any]]:
        keep = self._kept(lines, first)
        numbers = first + np.flatnonzero(keep)
        if len(numbers):
            self.n_rows += len(numbers)
            yield lines.kept(keep), numbers

    def _kept(self, lines: _Lines, first: int) -> Any:
        """Which lines are rows. Most texts have no other lines, so only those that may be something else are read."""
        expected = len(self._headers) - 1
        counts = lines.counts(self._layout.delimiter, expected)
        keep = np.ones(len(lines), bool)
        for k in np.flatnonzero((counts != expected) | lines.begin_with(self._marks)).tolist():
            line = lines[k]
            if counts[k] == expected and is_content(line) and not self._is_header(line):
                continue
            keep[k] = False
            if not is_content(line):
                self._blank.append(first + k)
            elif self._is_header(line):
                self._end_of_short(first + k)
                self._repeated.append(first + k)
            else:
                self._end_of_short(first + k)
                if counts[k] > expected:
                    raise self._ragged(line, first + k, int(counts[k]) + 1)
                self._short = first + k, line, int(counts[k]) + 1  # if it is the last it is dropped
        if self._short is not None and keep.any():
            after = self._short[0] - first + 1
            if keep[max(after, 0) :].any():
                self._end_of_short(first + len(lines))
        return keep

    def _is_header(self, line: str) -> bool:
        cells = cells_of(line, self._layout.delimiter)
        cells += [""] * (len(self._headers) - len(cells))
        return cells == self._headers or bool(self._units) and cells == self._units

    def _end_of_short(self, line: int) -> None:
        """Refuse the row that was too short, as there is content below it."""
        if self._short is not None and self._short[0] < line:
            number, text, count = self._short
            raise self._ragged(text, number, count)

    def _ragged(self, line: str, number: int, count: int) -> InputError:
        n = len(self._headers)
        remedy = "Repair or remove the line."
        if self._layout.delimiter == "," and count in (2 * n, 2 * n - 1):
            remedy = 'Decimal commas between commas? Export with ";" between the cells, or with decimal points.'
        return InputError(
            f"the row has {count} cells and the header has {n}: {short(line)}",
            where=f"{self._where}, line {number}",
            expected="as many cells as the header",
            remedy=remedy,
        )

    def n_file(self) -> int:
        """Rows of the file, one that is incomplete as well."""
        return self.n_rows + (self._short is not None)

    def actions(self) -> list[Action]:
        """What is said of lines that are no rows."""
        found = []
        if self._blank:
            text = f"{count(len(self._blank), 'blank or comment line')} skipped"
            found.append(Action("skipped", len(self._blank), text, lines=self._blank[:50]))
        if self._repeated:
            text = f"the header is repeated {count(len(self._repeated), 'time')}; skipped"
            found.append(Action("skipped", len(self._repeated), text, lines=self._repeated[:50]))
        if self._short is not None:
            line = self._short[0]
            text = f"the last row, line {line}, is incomplete; dropped"
            found.append(Action("dropped_row", 1, text, lines=[line], rows=1))
        return found


def count(n: int, noun: str) -> str:
    """A number with its noun."""
    return f"{n} {noun}" + ("" if n == 1 else "s")


def _after(part: str, lines: int) -> int:
    """Place behind some lines of a text; its end where it has fewer."""
    place = 0
    for _ in range(lines):
        place = part.find("\n", place) + 1
        if not place:
            return len(part)
    return place


def _first_letter(cells: list[str], d: str) -> str:
    """Letter with which a line of these cells begins; empty where data rows begin so as well."""
    if cells and not cells[0]:
        return d
    return cells[0][:1] if cells and not NUMBER.fullmatch(cells[0]) else ""
