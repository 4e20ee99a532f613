"""The certificate file as it is read: JSON without duplicates, of limited size, and typed access to its parts."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ._exact import Interval, Malformed, NotCovered, Token, exact, short

FORMAT = "robthermal-certificate/1"
SECTIONS = ("system", "region", "evidence", "margin", "made_by")
_LARGEST = 20_000_000  # bytes
_DEEPEST = 100  # nested objects and lists
# effects of a system file beyond the plain network
_EFFECTS = frozenset(("leads", "heat", "gradient", "periodic", "condensation", "step", "follow", "temperature_law",
                      "thomson", "joule_split", "hysteresis", "drive", "power_slope", "feedthrough",
                      "self_heating", "flows"))


class Unreadable(Exception):
    """There is no certificate file to judge."""


def load(path: str | os.PathLike[str]) -> Any:
    """Return the content of a certificate file; numbers stay the text they are.

    Raises
    ------
    Unreadable
        If there is no regular file.
    NotCovered
        If it is too large.
    Malformed
        If it is no JSON, has a key twice in one object, a number beyond a double, or deep nesting.
    """
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise Unreadable("not a regular file")
        if os.stat(path).st_size > _LARGEST:
            raise NotCovered(f"a file of more than {_LARGEST} bytes")
        content = Path(path).read_bytes()
    except (OSError, ValueError) as error:
        raise Unreadable(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error
    try:
        document = json.loads(content.decode("utf-8"), parse_float=_number, parse_int=_whole,
                              parse_constant=_constant, object_pairs_hook=_pairs)
    except UnicodeDecodeError as error:
        raise Malformed(f"not UTF-8 text (byte {error.start})") from error
    except RecursionError as error:
        raise Malformed("nested too deeply") from error
    except json.JSONDecodeError as error:
        raise Malformed(f"not JSON: {error.msg} (line {error.lineno}, column {error.colno})") from error
    _check_depth(document)
    return document


def sections(document: Any) -> tuple[str, str, dict[str, Mapping[str, Any]]]:
    """Return kind, claim and the sections of a document; Malformed where one is missing or of another type."""
    table = mapping(document, "the file")
    found = {name: mapping(get(table, name, "the file"), name) for name in SECTIONS}
    if table.get("format") != FORMAT:
        raise Malformed(f"format {short(table.get('format'))}, expected {FORMAT!r}")
    holds = table.get("holds", True)
    if not isinstance(holds, bool) or not isinstance(table.get("reason", ""), str):
        raise Malformed("holds is not true or false, or reason is not a text")
    kind, claim = text(get(table, "kind", "the file"), "kind"), text(get(table, "claim", "the file"), "claim")
    if not holds:
        raise Malformed("the certificate itself says that its claim does not hold")
    return kind, claim, found


def get(table: Mapping[str, Any], key: str, where: str) -> Any:
    """Return a required key."""
    if key not in table:
        raise Malformed(f"{where}: {key!r} is missing")
    return table[key]


def mapping(value: Any, where: str) -> Mapping[str, Any]:
    """Return an object."""
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise Malformed(f"{where}: {short(value)} is not an object")
    return value


def sequence(value: Any, where: str) -> Sequence[Any]:
    """Return a list."""
    if not isinstance(value, (list, tuple)):
        raise Malformed(f"{where}: {short(value)} is not a list")
    return value


def text(value: Any, where: str) -> str:
    """Return a text that is not empty."""
    if not isinstance(value, str) or isinstance(value, Token) or not value:
        raise Malformed(f"{where}: {short(value)} is not a text")
    return value


def numbers(value: Any, count: int, where: str) -> list[Any]:
    """Return a list of exactly ``count`` exact numbers."""
    items = sequence(value, where)
    if len(items) != count:
        raise Malformed(f"{where}: {len(items)} numbers, expected {count}")
    return [exact(item, f"{where}[{k}]") for k, item in enumerate(items)]


def matrix(value: Any, rows: int, columns: int, where: str) -> list[list[Any]]:
    """Return a matrix of exact numbers."""
    items = sequence(value, where)
    if len(items) != rows:
        raise Malformed(f"{where}: {len(items)} rows, expected {rows}")
    return [numbers(row, columns, f"{where}[{k}]") for k, row in enumerate(items)]


def positive(value: Any, where: str) -> Any:
    """Return a number above zero."""
    number = exact(value, where)
    if number <= 0:
        raise Malformed(f"{where}: not positive")
    return number


def not_negative(value: Any, where: str) -> Any:
    """Return a number that is zero or above."""
    number = exact(value, where)
    if number < 0:
        raise Malformed(f"{where}: negative")
    return number


def interval(value: Any, where: str) -> Interval:
    """Return [low, high] with low at most high."""
    low, high = numbers(value, 2, where)
    if low > high:
        raise Malformed(f"{where}: empty")
    return low, high


def kelvin(value: Any, where: str) -> Interval:
    """Return [low, high] of absolute temperatures [K]."""
    found = interval(value, where)
    if found[0] <= 0:
        raise Malformed(f"{where}: not above absolute zero")
    return found


def intervals(value: Any, names: Sequence[str], where: str) -> dict[str, Interval]:
    """Return one interval for every name; every one is given and nothing else."""
    table = mapping(value, where)
    only(table, names, where)
    return {name: interval(get(table, name, where), f"{where}[{short(name)}]") for name in names}


def only(table: Mapping[str, Any], keys: Sequence[str], where: str) -> None:
    """Refuse other keys than these."""
    known = set(keys)
    for key in table:
        if key not in known:
            raise Malformed(f"{where}: unknown key {short(key)}")


def no_effects(table: Mapping[str, Any], where: str, known: Sequence[str] = ()) -> None:
    """Refuse the names of effects that the claim does not take into account; other unknown keys are notes."""
    for key in table:
        if key in _EFFECTS and key not in known:
            raise Malformed(f"{where}: {key!r} is an effect that this claim does not take into account")


def margin(table: Mapping[str, Any], key: str) -> Any:
    """Return the stored margin, 0 where none is stored or where it is negative."""
    only(table, [key], "margin")
    return max(exact(table.get(key, 0), f"margin.{key}"), exact(0, ""))


def _number(token: str) -> Token:
    exact(token, "number")
    return Token(token)


def _whole(token: str) -> int:
    exact(token, "number")  # refuses what no double holds, so that int() stays short
    return int(token)


def _constant(name: str) -> Any:
    raise Malformed(f"{name} is not a number")


def _pairs(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        raise Malformed("a key is given twice in one object")
    return table


def _check_depth(document: Any) -> None:
    stack = [(document, 1)]
    while stack:
        value, depth = stack.pop()
        if depth > _DEEPEST:
            raise Malformed("nested too deeply")
        if isinstance(value, dict):
            stack.extend((item, depth + 1) for item in (*value, *value.values()))
        elif isinstance(value, list):
            stack.extend((item, depth + 1) for item in value)
        elif isinstance(value, str) and not value.isascii() and any("\ud800" <= letter <= "\udfff" for letter in value):
            raise Malformed("a text is not Unicode")
