"""Cells as text: numbers, time stamps, and the words that loggers write for a missing reading."""

from __future__ import annotations

import re

MISSING = (
    "",
    "nan",
    "-nan",
    "na",
    "n/a",
    "#n/a",
    "#div/0!",
    "#value!",
    "#ref!",
    "#num!",
    "#name?",
    "null",
    "none",
    "<na>",
    "ol",
    "over",
    "overload",
    "err",
    "error",
    "fault",
    "open",
    "short",
    "---",
    "--",
    "-",
    "inf",
    "-inf",
    "+inf",
    "infinity",
    "-infinity",
    "1.#inf",
    "1.#ind",
    "-1.#ind",
    "1.#qnan",
)
SWITCH = {"true": 1.0, "false": 0.0, "on": 1.0, "off": 0.0}  # of an input that is on or off
NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
DECIMAL_POINT = re.compile(r"[+-]?\d*\.\d+([eE][+-]?\d+)?")
THOUSANDS = re.compile(r"[+-]?\d{1,3}(([.]\d{3})+,\d+|(,\d{3})+[.]\d+)")
STAMP = re.compile(
    r"(\d{1,4}[-./]\d{1,2}[-./]\d{1,4}([T ]\s*\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?\s*([AaPp][Mm])?)?"
    r"|\d{1,4}:\d{2}(:\d{2}([.,]\d+)?)?\s*([AaPp][Mm])?)(\s*(Z|[+-]\d{2}:?\d{2}))?"
)
DURATION = re.compile(
    r"[+-]?\d+([.,]\d+)?\s*(s|sec|secs|second|seconds|ms|min|mins|minute|minutes|h|hr|hrs|hour|hours)"
)


def is_missing(cell: str) -> bool:
    """Whether a cell holds one of the words for a missing reading."""
    return cell.strip().lower() in MISSING


def is_value(cell: str) -> bool:
    """Whether a cell is a number, a time stamp or a duration."""
    text = cell.strip()
    return bool(
        NUMBER.fullmatch(text) or STAMP.fullmatch(text) or DURATION.fullmatch(text) or THOUSANDS.fullmatch(text)
    )


def short(text: object, most: int = 40) -> str:
    """A text of the user's file in quotes, cut."""
    words = str(text)
    return repr(words if len(words) <= most else words[: most - 3] + "...")


def thousands_of(cell: str) -> str:
    """Declaration that reads a number with a decimal and a thousands separator.

    Examples
    --------
    >>> thousands_of("1,234.5")
    'decimal = "." and thousands = ","'
    """
    decimal = max(".,", key=cell.rfind)
    return f'decimal = "{decimal}" and thousands = "{",."[decimal == ","]}"'


def na_values(extra: tuple[float | str, ...], numbers: bool = False) -> list[str]:
    """Spellings that a table parser takes as missing: each word in lower, upper and capitalized form."""
    words = [word for base in MISSING for word in (base, base.upper(), base.capitalize())]
    words += ["NaN", "-NaN", "N/a", "#N/A", "NULL", "Inf", "-Inf"]
    return list(dict.fromkeys(words + [str(code) for code in extra if numbers or isinstance(code, str)]))
