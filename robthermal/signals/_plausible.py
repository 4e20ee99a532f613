"""Traps of units: Celsius declared kelvin, kelvin declared Celsius, milliampere, values outside the declared limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .._celsius import HIGHEST_CELSIUS, LOWEST_KELVIN
from ..errors import InputError
from ._checks import Array

RowLabel = Callable[[int], str]

_MILLI = 100.0  # a current this many times beyond its limits is in mA


def check_temperature(name: str, column: Array, stamps: Array, unit: str, row: RowLabel, where: str) -> None:
    """Refuse a column whose numbers belong to the other scale; nan is no reading."""
    wrong = np.flatnonzero(column < LOWEST_KELVIN if unit == "K" else column > HIGHEST_CELSIUS)
    if not wrong.size:
        return
    k = int(wrong[0])
    if unit == "K":
        looks, bound = "Celsius", f"below {LOWEST_KELVIN:g} K"
    else:
        looks, bound = "kelvin", f"above {HIGHEST_CELSIUS:g} °C"
    raise InputError(
        f"column {name!r} holds {column[k]:.6g} in {row(k)}, time {stamps[k]:.10g} s, declared {unit}: "
        f"{bound}, this looks like {looks} ({wrong.size} of {int(np.isfinite(column).sum())} rows)",
        where=where,
        expected=f"temperatures in {unit}",
        remedy="Correct temperature_unit, or the readings if single rows are wrong.",
    )


def limit_notes(columns: Mapping[str, Array], current_limits: Any, input_limits: Any, where: str) -> list[str]:
    """What is outside its declared limits, in words; a current in milliampere is refused."""
    notes = []
    for name, limits in (current_limits or {}).items():
        if limits is not None and name in columns:
            _refuse_milliampere(name, columns[name], limits, where)
            notes += _outside(name, columns[name], limits, " A", "; if it is in mA, divide by 1000")
    for name, limits in (input_limits or {}).items():
        if limits is not None and name in columns:
            notes += _outside(name, columns[name], limits, "", "")
    return notes


def _refuse_milliampere(name: str, column: Array, limits: tuple[float, float], where: str) -> None:
    largest = max(abs(float(np.nanmin(column))), abs(float(np.nanmax(column))))
    bound = max(abs(limits[0]), abs(limits[1]))
    if bound > 0.0 and largest > _MILLI * bound:
        raise InputError(
            f"the current {name!r} reaches {largest:.6g} A, {largest / bound:.0f} times its declared limit of "
            f"{bound:g} A: this looks like mA",
            where=where,
            expected="ampere",
            remedy='Divide the column by 1000: [columns] with unit = "mA", or with a scale, whose scale · cell is in A '
            "whatever the unit; or correct current_limits.",
        )


def _outside(name: str, column: Array, limits: tuple[float, float], unit: str, hint: str) -> list[str]:
    slack = 1e-9 * max(abs(limits[0]), abs(limits[1]))
    count = int(((column < limits[0] - slack) | (column > limits[1] + slack)).sum())
    if not count:
        return []
    return [
        f"{name!r} lies outside its declared limits {limits[0]:g} ... {limits[1]:g}{unit} in {count} of "
        f"{int(np.isfinite(column).sum())} rows (range {np.nanmin(column):.6g} ... {np.nanmax(column):.6g}{unit}{hint})"
    ]
