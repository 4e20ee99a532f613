"""Checks of temperatures and other arguments of thermal systems, one message each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .._celsius import HIGHEST_CELSIUS, LOWEST_KELVIN
from .._checks import finite_number
from ..errors import InputError
from ._units import celsius_to_kelvin


def non_negative(value: Any, where: str, unit: str) -> float:
    """A finite number, zero or above."""
    number = finite_number(value, where, unit)
    if number < 0:
        raise InputError(f"{number:g} {unit} is negative", where=where, expected=f"0 or more [{unit}]",
                         remedy="Check the sign and the unit.")
    return number


def kelvin(value: Any, where: str) -> float:
    """A temperature that is neither Celsius nor Fahrenheit by its size."""
    number = finite_number(value, where, "K")
    if number < LOWEST_KELVIN:
        raise InputError(f"{number:g} K is below {LOWEST_KELVIN:g} K: it looks like Celsius", where=where,
                         expected="kelvin", remedy="Add 273.15 to a temperature in degrees Celsius.")
    if number > celsius_to_kelvin(HIGHEST_CELSIUS):
        raise InputError(f"{number:g} K is above {celsius_to_kelvin(HIGHEST_CELSIUS):g} K", where=where,
                         expected="kelvin", remedy="Was 273.15 added twice?")
    return number


def by_lump(values: Mapping[str, float], names: Sequence[str], argument: str) -> list[float]:
    """Temperatures of all lumps, in order."""
    missing = [name for name in names if name not in values]
    if missing:
        raise InputError(f"{argument} has no temperature for lump {missing[0]!r}", where=f"argument {argument}",
                         remedy="Give every lump a temperature [K].")
    return [values[name] for name in names]
