"""What a message proposes to write, found from the cells themselves: never applied, only offered for pasting."""

from __future__ import annotations

import re
from datetime import datetime

from ._table import Table
from ._tokens import NUMBER, STAMP, is_missing, short

_MONTHS = "jan feb mar apr may jun jul aug sep oct nov dec".split()
_FULL = "january february march april june july august september october november december".split()
_DAYS = "mon tue wed thu fri sat sun".split()
_PART = re.compile(r"\d+|[A-Za-z]+|[^0-9A-Za-z]")


def time_format_of(text: str) -> str | None:
    """Pattern that reads a date and time; None where none is found or day and month can be exchanged.

    Parameters
    ----------
    text : str
        First cell of the time column.

    Examples
    --------
    >>> time_format_of("24-Oct-2026 23:58:30")
    '%d-%b-%Y %H:%M:%S'
    >>> time_format_of("10/24/2026 23:58:30:120")
    '%m/%d/%Y %H:%M:%S:%f'
    >>> time_format_of("20261024T235830")
    '%Y%m%dT%H%M%S'
    >>> time_format_of("03/04/2026 at 10:00") is None
    True
    """
    clock = re.search(r"(\d{1,2}):(\d{2})(:\d{2}([.,:]\d{1,6})?)?(\s*)([AaPp][Mm])?", text)
    compact = re.fullmatch(r"\d{8}([T_ -]?)\d{6}", text)
    if compact:
        found = [f"%Y%m%d{compact[1]}%H%M%S"]
    elif clock:
        seconds = "" if not clock[3] else ":%S" + (f"{clock[4][0]}%f" if clock[4] else "")
        hour = f"%I:%M{seconds}{clock[5]}%p" if clock[6] else f"%H:%M{seconds}" + clock[5]
        found = [
            before + hour + after
            for before in _date_patterns(text[: clock.start()])
            for after in _date_patterns(text[clock.end() :])
        ]
    else:
        found = _date_patterns(text)
    read = [pattern for pattern in dict.fromkeys(found) if _reads(text, pattern)]
    return read[0] if len(read) == 1 else None


def _date_patterns(text: str) -> list[str]:
    """Patterns of the part of a stamp without time of day: both orders where two numbers can be day and month."""
    parts = _PART.findall(text)
    if any(part.lower() in (*_MONTHS, *_FULL) for part in parts):
        orders = [["%d"]]
    elif parts and len(parts[0]) == 4 and parts[0].isdigit():
        orders = [["%m", "%d"]]
    else:
        orders = [["%d", "%m"], ["%m", "%d"]]
    return ["".join([_directive(part, numbers) for part in parts]) for numbers in orders]


def _directive(part: str, numbers: list[str]) -> str:
    """Directive of one part of a date; `numbers` are those of day and month that are still to come."""
    low = part.lower()
    if part.isdigit():
        return "%Y" if len(part) == 4 else numbers.pop(0) if numbers else "%y"
    if low in _MONTHS:
        return "%b"
    return "%B" if low in _FULL else "%a" if low in _DAYS else part


def _reads(text: str, pattern: str) -> bool:
    try:
        return datetime.strptime(text, pattern).year > 1970
    except (ValueError, re.error):  # re.error: a directive twice, of a text with two dates
        return False


def time_headers(table: Table) -> str | None:
    """Declaration of the column, or the two columns, whose first cells are dates or times of day; None without one."""
    dates: list[tuple[str, str]] = []
    clocks: list[tuple[str, str]] = []
    both: list[tuple[str, str]] = []
    for header, cells in zip(table.headers, table.columns, strict=True):
        text = _first_text(cells)
        if header and text is not None and (STAMP.fullmatch(text) or time_format_of(text)):
            date = re.search(r"\d\D+\d+\D+\d{2,4}|\d{4}\D+\d+|[A-Za-z]{3}|\d{8}", text.split(":")[0]) is not None
            (both if date and ":" in text else dates if date else clocks).append((header, text))
    if both:
        return f'time = "{both[0][0]}", whose first cell reads {short(both[0][1], 30)}'
    if dates and clocks:
        return f'time = ["{dates[0][0]}", "{clocks[0][0]}"]'
    for header, text in clocks + dates:
        return f'time = "{header}", whose first cell reads {short(text, 30)}'
    return None


def unnamed_stamps(table: Table) -> int | None:
    """Place of the only column without a name, if its first cell is a date with a time of day."""
    places = [k for k, header in enumerate(table.headers) if not header]
    text = _first_text(table.columns[places[0]]) if len(places) == 1 else None
    return places[0] if text is not None and ":" in text and STAMP.fullmatch(text) and "-" in text[:11] else None


def _first_text(cells: object) -> str | None:
    """First cell that is a text and no number and no word for a missing reading."""
    if getattr(getattr(cells, "dtype", None), "kind", "") != "O":
        return None
    for cell in cells[:50]:  # type: ignore[index]
        if isinstance(cell, str) and not is_missing(cell):
            return None if NUMBER.fullmatch(cell.strip()) else cell.strip()
    return None
