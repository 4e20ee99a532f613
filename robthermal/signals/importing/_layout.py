"""Where a text file's header is, and what separates its cells; two possible answers are refused."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass

from ...errors import InputError
from ._options import ImportOptions
from ._tokens import DECIMAL_COMMA, DECIMAL_POINT, NUMBER, THOUSANDS, is_missing, is_value, short, thousands_of
from ._units import unit_of

DELIMITERS = (";", "\t", ",", "|")
_ROWS = 5  # that must follow a header
_SEARCHED = 1000  # lines


@dataclass(frozen=True)
class Layout:
    """How a text file is laid out.

    Parameters
    ----------
    delimiter, decimal : str
        Between cells, within numbers; decimal is empty where the head has whole numbers only.
    thousands : str or None
        Within numbers, where declared.
    headers : tuple of str
        One per cell of a row; "" for a column without a name.
    header_line : int
        Counted from 1; 0 where the headers were declared.
    units : tuple of str
        Of the units row; empty without one.
    units_line : int
        Counted from 1; 0 without a units row.
    first_line : int
        Line from which data rows are read, counted from 1.
    skipped : tuple of int
        Lines before the header that are neither blank nor comments.
    """

    delimiter: str
    decimal: str
    thousands: str | None
    headers: tuple[str, ...]
    header_line: int
    units: tuple[str, ...]
    units_line: int
    first_line: int
    skipped: tuple[int, ...]


def cells_of(line: str, delimiter: str) -> list[str]:
    """Cells of a line, quotes taken off, blanks trimmed; a blank as delimiter stands for any number of blanks."""
    if delimiter == " ":
        line = collapsed(line)
    if '"' in line:
        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]
        except (csv.Error, StopIteration):
            pass
    return [cell.strip() for cell in line.split(delimiter)]


def collapsed(text: str) -> str:
    """Lines with one blank where there were several blanks or tabs, and none at their ends."""
    return re.sub(r"(?m)^ +| +$", "", re.sub(r"[ \t]+", " ", text))


def is_content(line: str) -> bool:
    """Whether a line is neither blank nor a comment."""
    text = line.strip()
    return bool(text) and not text.startswith("#")


def find_layout(lines: Sequence[str], options: ImportOptions, where: str) -> Layout:
    """Layout of a text file from its first lines.

    Parameters
    ----------
    lines : sequence of str
        The beginning of the file.
    options : ImportOptions
        What is declared.
    where : str
        File, for messages.

    Raises
    ------
    InputError
        No header, or several places that could be it.
    """
    content = [k for k, line in enumerate(lines) if is_content(line)]
    if not content:
        raise InputError(
            "the file has no header row, only comments or blank lines",
            where=where,
            expected="a header row and data rows",
        )
    tried = (options.delimiter,) if options.delimiter else DELIMITERS
    if options.header is not None:
        return _declared(lines, content, tried, options, where)
    found = [place for d in tried for place in _candidates(lines, content, d, options)]
    lines_found = sorted({place[0] for place in found})
    if not found:
        raise _no_header(lines, content, tried, options, where)
    if len(lines_found) > 1:
        listed = ", ".join(str(k + 1) for k in lines_found[:4])
        raise InputError(
            f"lines {listed} could all be the header: {short(lines[lines_found[0]])} and "
            f"{short(lines[lines_found[1]])}",
            where=where,
            expected="one header row",
            remedy=f"Write header_line = {lines_found[0] + 1}.",
        )
    header, delimiter, width = found[0]
    return _layout(lines, content, header, delimiter, width, options, where)


def _candidates(lines: Sequence[str], content: list[int], d: str, options: ImportOptions) -> list[tuple[int, str, int]]:
    """Lines that could be the header with this delimiter: (line, delimiter, cells per row)."""
    found: list[tuple[int, str, int]] = []
    split = {k: cells_of(lines[k], d) for k in content[: _SEARCHED + _ROWS + 2]}
    for place, k in enumerate(content[:_SEARCHED]):
        if options.header_line is not None and k + 1 != options.header_line:
            continue
        cells = split[k]
        least = 1 if options.header_line is not None and options.sample_time else 2
        if len(cells) < least or not _names(cells) and options.header_line is None:
            continue
        after = content[place + 1 :]
        if options.units_line is not None:
            after = [j for j in after if j >= options.units_line]
        elif after and _is_units(split.get(after[0], []), split.get(after[1], []) if len(after) > 1 else []):
            after = after[1:]
        rows = [split[j] for j in after[:_ROWS] if j in split]
        enough = len(rows) == _ROWS or (place == 0 or options.header_line is not None) and rows
        width = len(rows[0]) if rows else 0
        if enough and all(_fits(row, width, cells) for row in rows):
            if found and (
                _is_units(cells, rows[0]) or cells == split[found[0][0]]
            ):  # its units row, or it stands there again
                continue
            found.append((k, d, width))
    return found


def _names(cells: list[str]) -> bool:
    """Whether cells are more names than numbers."""
    filled = [cell for cell in cells if cell]
    return len(filled) > 0 and sum(is_value(cell) for cell in filled) * 2 < len(filled)


def _fits(row: list[str], width: int, header: list[str]) -> bool:
    """As many cells as the header, apart from a trailing delimiter on either side, and mostly numbers or stamps."""
    n = len(header)
    same = width == n or (width == n + 1 and not row[-1]) or (width == n - 1 and not header[-1])
    filled = [cell for cell in row if not is_missing(cell)]
    values = sum(is_value(cell) for cell in filled)
    return len(row) == width and same and values * 2 >= len(filled) and values > 0


def _is_units(cells: list[str], row: list[str]) -> bool:
    """Whether most cells above numbers are units and none is a number; above stamps and words anything may stand."""
    filled = [cell for cell in cells if cell and cell not in ("-", "--")]
    above = [cell for cell, value in zip(cells, row, strict=False) if cell in filled and NUMBER.fullmatch(value)]
    units = sum(unit_of(cell) is not None for cell in above)
    return units * 2 > len(above) and not any(is_value(cell) for cell in filled) and len(cells) > 1


def _declared(
    lines: Sequence[str], content: list[int], tried: Sequence[str], options: ImportOptions, where: str
) -> Layout:
    """Layout of a file whose headers are declared: its first line of numbers and stamps only is data."""
    header = options.header or ()
    for d in tried:
        start = _first_values(lines, content, d)
        rows = [cells_of(lines[k], d) for k in content[start : start + _ROWS]]
        if rows and all(_fits(row, len(rows[0]), list(header)) for row in rows):
            names = (*header, *("" for _ in range(len(rows[0]) - len(header))))
            return Layout(
                d,
                _decimal(lines, content[start:], d, options, where),
                options.thousands,
                names[: len(rows[0])],
                0,
                (),
                0,
                content[start] + 1,
                tuple(k + 1 for k in content[:start]),
            )
    raise InputError(
        f"header has {len(header)} names and the first row reads {short(lines[content[0]])}",
        where=f"{where}, line {content[0] + 1}",
        expected="one name per cell",
        remedy="Correct header = [...].",
    )


def _first_values(lines: Sequence[str], content: list[int], d: str) -> int:
    """Number of content lines before the first that holds nothing but numbers, stamps and missing readings."""
    for place, k in enumerate(content[:_SEARCHED]):
        cells = cells_of(lines[k], d)
        if len(cells) > 1 and any(map(is_value, cells)) and all(is_value(cell) or is_missing(cell) for cell in cells):
            return place
    return 0


def _layout(
    lines: Sequence[str], content: list[int], header: int, d: str, width: int, options: ImportOptions, where: str
) -> Layout:
    place = content.index(header)
    cells = cells_of(lines[header], d)
    names = tuple((cells + [""] * width)[:width])
    after = content[place + 1 :]
    units: tuple[str, ...] = ()
    units_line = 0
    if options.units_line is not None or (
        len(after) > 1 and _is_units(cells_of(lines[after[0]], d), cells_of(lines[after[1]], d))
    ):
        row = options.units_line - 1 if options.units_line is not None else after[0]
        if row not in content or row <= header:
            raise InputError(
                f"units_line = {row + 1}", where=where, expected=f"a line after the header, line {header + 1}"
            )
        units, units_line = tuple((cells_of(lines[row], d) + [""] * width)[:width]), row + 1
    start = max(header + 1, units_line) + 1
    return Layout(
        d,
        _decimal(lines, [k for k in content if k >= start - 1], d, options, where),
        options.thousands,
        names,
        header + 1,
        units,
        units_line,
        start,
        tuple(k + 1 for k in content[:place]),
    )


def _decimal(lines: Sequence[str], rows: list[int], d: str, options: ImportOptions, where: str) -> str:
    if options.decimal is not None:
        return options.decimal
    comma: tuple[int, int] | None = None
    point: tuple[int, int] | None = None
    for k in rows[:_SEARCHED]:
        for place, cell in enumerate(cells_of(lines[k], d)):
            if THOUSANDS.fullmatch(cell) and options.thousands is None:
                raise InputError(
                    f"{short(cell)} has a decimal and a thousands separator",
                    where=f"{where}, line {k + 1}",
                    expected="plain numbers",
                    remedy=f"Declare both: {thousands_of(cell)}.",
                )
            if d != "," and DECIMAL_COMMA.fullmatch(cell):
                comma = comma or (k, place)
            elif DECIMAL_POINT.fullmatch(cell):
                point = point or (k, place)
    if comma is not None and point is not None:
        raise InputError(
            f"numbers with a decimal comma (line {comma[0] + 1}) and with a decimal point (line {point[0] + 1})",
            where=where,
            expected="one of the two",
            remedy='Write decimal = "," or decimal = ".".',
        )
    return "," if comma is not None else "." if point is not None or d == "," else ""


def _no_header(
    lines: Sequence[str], content: list[int], tried: Sequence[str], options: ImportOptions, where: str
) -> InputError:
    """Why no header was found, most telling reason first."""
    first = content[0]
    if options.header_line is not None:
        return InputError(
            f"line {options.header_line} is no header of the rows below it",
            where=where,
            expected="names, then rows with as many cells",
            remedy="Correct header_line, or delimiter.",
        )
    for d in tried:
        rows = [cells_of(lines[k], d) for k in content[:_ROWS]]
        if len(rows[0]) >= 2 and all(is_value(cell) or is_missing(cell) for cell in rows[0]):
            return InputError(
                "the first row holds numbers",
                where=f"{where}, line {first + 1}",
                expected="a header row with column names",
                remedy='Add one, or declare it: header = ["time", "heater", "T1"].',
            )
    if len(content) == 1:
        return InputError("the file has a header and no data rows", where=where, expected="a row per sample")
    for k, after in zip(content, content[1:], strict=False):
        names, row = cells_of(lines[k], ","), cells_of(lines[after], ",")
        if len(names) >= 2 and _names(names) and len(row) in (2 * len(names), 2 * len(names) - 1) and "," in tried:
            return InputError(
                f"the row has {len(row)} cells and the header {len(names)}: decimal commas between commas?",
                where=f"{where}, line {after + 1}",
                expected="as many cells as the header",
                remedy='Export with ";" between the cells, or with decimal points.',
            )
    for d in tried:
        names = cells_of(lines[first], d)
        if len(names) >= 2 and _names(names):
            for k in content[1 : _ROWS + 1]:
                row = cells_of(lines[k], d)
                if len(row) != len(names):
                    named = [name for name in names if name]
                    of_rows = len(named) == len(row)
                    return InputError(
                        f"the row has {len(row)} cells and the header has {len(names)}: {short(lines[k])}",
                        where=f"{where}, line {k + 1}",
                        expected="as many cells as the header",
                        remedy=f"Write header = {json.dumps(named, ensure_ascii=False)}."
                        if of_rows
                        else "Repair or remove the line.",
                    )
    if options.delimiter is None and (blank := _blanks_between(lines, content, options)):
        return InputError(
            f"blanks are between the cells; line {first + 1} reads {short(lines[first])}",
            where=where,
            expected='cells separated by ";", tab, "," or "|", or a declared delimiter',
            remedy=f"Write {blank}.",
        )
    return InputError(
        f"no line is followed by rows of as many cells with numbers; line {first + 1} reads {short(lines[first])}",
        where=where,
        expected='a header row; cells separated by ";", tab, "," or "|"',
        remedy='Write header_line = N, or delimiter = "…".',
    )


def _blanks_between(lines: Sequence[str], content: list[int], options: ImportOptions) -> str:
    """Declaration that reads a file whose cells are separated by blanks; empty where that does not help."""
    if _candidates(lines, content, " ", options):
        return 'delimiter = " "'
    rows = [cells_of(lines[k], " ") for k in content[: _ROWS + 1]]
    values = all(is_value(cell) or is_missing(cell) for row in rows for cell in row)
    if not values or len({len(row) for row in rows}) > 1 or len(rows[0]) < 2:
        return ""
    return f'delimiter = " " and header = ["time", …], {len(rows[0])} names'
