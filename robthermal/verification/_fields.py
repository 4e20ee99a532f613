"""Reading the parts of a certificate: every wrong type or missing key is an InputError that names its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from flint import fmpq

from robthermal.errors import InputError

from ._numbers import exact, name_of, show

Interval = tuple[fmpq, fmpq]
# effects of a system file beyond the plain network: claims that do not know them refuse these names
_EFFECTS = ("leads", "heat", "gradient", "periodic", "condensation", "step", "follow", "temperature_law", "thomson",
            "joule_split", "hysteresis", "drive", "power_slope", "feedthrough", "self_heating", "flows")


def get(table: Mapping[str, Any], key: str, where: str) -> Any:
    """Return a required key of an object."""
    if key not in table:
        raise InputError(f"{key!r} is missing", where=where)
    return table[key]


def mapping(value: Any, where: str) -> Mapping[str, Any]:
    """Return an object whose keys are all text."""
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise InputError(f"{name_of(value)} is not an object", where=where, expected="a JSON object")
    return value


def sequence(value: Any, where: str) -> Sequence[Any]:
    """Return a list (or a one-dimensional or two-dimensional array, row by row)."""
    if isinstance(value, np.ndarray) and value.ndim >= 1:
        return list(value)
    if not isinstance(value, (list, tuple)):
        raise InputError(f"{name_of(value)} is not a list", where=where, expected="a JSON list")
    return value


def text(value: Any, where: str) -> str:
    """Return a text that is not empty."""
    if not isinstance(value, str) or not value:
        raise InputError(f"{name_of(value)} is not a name", where=where, expected="a text that is not empty")
    return value


def numbers(value: Any, count: int, where: str) -> list[fmpq]:
    """Return a list of exactly ``count`` numbers."""
    items = sequence(value, where)
    if len(items) != count:
        raise InputError(f"{len(items)} numbers", where=where, expected=f"{count}, one per lump")
    return [exact(item, f"{where}[{k}]") for k, item in enumerate(items)]


def positive(value: Any, where: str) -> fmpq:
    """Return a number above zero."""
    number = exact(value, where)
    if number <= 0:
        raise InputError(f"{show(number)} is not positive", where=where, expected="a number above zero")
    return number


def not_negative(value: Any, where: str) -> fmpq:
    """Return a number that is zero or above."""
    number = exact(value, where)
    if number < 0:
        raise InputError(f"{show(number)} is negative", where=where, expected="zero or above")
    return number


def interval(value: Any, where: str) -> Interval:
    """Return [low, high] with low at most high: an empty interval would make every claim true."""
    items = sequence(value, where)
    if len(items) != 2:
        raise InputError(f"{len(items)} numbers", where=where, expected="two, [low, high]")
    low, high = exact(items[0], f"{where}[0]"), exact(items[1], f"{where}[1]")
    if low > high:
        raise InputError(f"[{show(low)}, {show(high)}] is empty", where=where, expected="low at most high")
    return low, high


def kelvin_interval(value: Any, where: str) -> Interval:
    """Return [low, high] of absolute temperatures [K]."""
    low, high = interval(value, where)
    if low <= 0:
        raise InputError(f"{show(low)} K is not above absolute zero", where=where, expected="temperatures in kelvin")
    return low, high


def intervals(value: Any, names: Sequence[str], where: str) -> list[Interval]:
    """Return one interval per name from an object that names every one of them and nothing else."""
    table = mapping(value, where)
    known = set(names)
    unknown = [name for name in table if name not in known]
    if unknown:
        raise InputError(f"{name_of(unknown[0])} is not in the system", where=where)
    return [interval(get(table, name, where), f"{where}[{name_of(name)}]") for name in names]


def margin_of(value: Any, key: str) -> fmpq:
    """Return the stored margin; zero where none is stored. Unknown margins are claims nobody could check."""
    table = mapping(value, "margin")
    no_other(table, [key], "margin")
    return exact(table[key], f"margin.{key}") if table else fmpq(0)


def no_other(table: Mapping[str, Any], keys: Sequence[str], where: str) -> None:
    """Refuse keys that would claim something nobody checks."""
    for name in table:
        if name not in keys:
            raise InputError(f"unknown key {name_of(name)}", where=where, expected=f"{list(keys)}")


def no_effects(table: Mapping[str, Any], where: str, known: Sequence[str] = ()) -> None:
    """Refuse effects of a system file that a claim does not take into account: other unknown keys are free, these are
    physics. ``known``: effects that the claim knows.
    """
    for key in table:
        if key in _EFFECTS and key not in known:
            raise InputError(f"{key!r} is an effect that this claim does not take into account", where=where,
                             remedy="Certify the system without it.")
