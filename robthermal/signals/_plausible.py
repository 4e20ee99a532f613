"""Traps of units: Celsius declared kelvin, kelvin declared Celsius, milliampere, milliwatt, values outside limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .._celsius import HIGHEST_CELSIUS, LOWEST_KELVIN
from ..errors import InputError
from ._checks import Array

RowLabel = Callable[[int], str]

_COLD = 60.0  # °C: what a furnace begins at; in kelvin only liquid helium makes it
_STEP = 100.0  # K from a row to the next: a change of the unit is 273
_VALUES, _SHARE = 3, 0.1  # of a column: at most so many values, in so many rows, may be a code for nothing
_MILLI = 100.0  # a current this many times beyond its limits is in mA, a heat in mW
_WORDS = {"A": "ampere", "W": "watt", "V": "volt"}


def check_temperature(name: str, column: Array, stamps: Array, unit: str, row: RowLabel, where: str,
                      hottest: float | None = None) -> None:
    """Refuse a column whose numbers belong to the other scale; nan is no reading, `hottest` [°C] has been declared."""
    highest = HIGHEST_CELSIUS if hottest is None else hottest
    wrong = np.flatnonzero(column < LOWEST_KELVIN if unit == "K" else column > highest)
    if not wrong.size or (unit != "K" and hottest is None and _heats_up(column)):
        return
    k = int(wrong[0])
    remedy = "Correct temperature_unit, or the readings if single rows are wrong" + _as_missing(column, wrong) + "."
    if unit == "K":
        looks, bound = "Celsius", f"below {LOWEST_KELVIN:g} K"
        remedy += f" Machines colder than {LOWEST_KELVIN:g} K are not modelled."
    else:
        looks, bound = "kelvin", f"above {highest:g} °C"
        remedy += " If the machine is so hot, say how hot it gets: hottest = … in [record], in °C."
    raise InputError(
        f"column {name!r} holds {column[k]:.6g} in {row(k)}, time {stamps[k]:.10g} s, declared {unit}: "
        f"{bound}, this looks like {looks} ({wrong.size} of {int(np.isfinite(column).sum())} rows)",
        where=where,
        expected=f"temperatures in {unit}",
        remedy=remedy,
    )


def _as_missing(column: Array, wrong: Any) -> str:
    """What to declare where few cells of few values are wrong: a logger may so say that nothing was measured."""
    values = np.unique(column[wrong])
    if len(values) > _VALUES or len(wrong) > _SHARE * np.isfinite(column).sum():
        return ""
    return f"; if they mean that nothing was measured: missing = [{', '.join(f'{value:.10g}' for value in values)}]"


def _heats_up(column: Array) -> bool:
    """Whether a column is of a machine that gets as warm as kelvin look: it passes what is between, row by row.

    No reading in kelvin is that low, and rows in the other unit, zeros and spikes jump across what is between.
    """
    read = column[np.isfinite(column)]
    with np.errstate(over="ignore"):
        steps = np.abs(np.diff(read))
    return all(bool((steps[np.diff(read > bound)] <= _STEP).any()) for bound in (_COLD, LOWEST_KELVIN, HIGHEST_CELSIUS))


def limit_notes(columns: Mapping[str, Array], units: Mapping[str, str], current_limits: Any, input_limits: Any,
                where: str) -> list[str]:
    """What is outside its declared limits, in words; a current in milliampere and a heat in milliwatt are refused."""
    notes = []
    for name, limits in (current_limits or {}).items():
        if limits is not None and name in columns:
            if _largest(columns[name]) > _MILLI * _bound(limits):
                raise _milli(f"the current {name!r}", columns[name], limits, "A", "current_limits", where)
            notes += _outside(name, columns[name], limits, " A", "; if it is in mA, divide by 1000")
    for name, limits in (input_limits or {}).items():
        if limits is not None and name in columns:
            if _largest(columns[name]) > _MILLI * _bound(limits) and _mostly_outside(columns[name], limits):
                raise _milli(f"the heater {name!r}", columns[name], limits, units.get(name, ""),
                             f"limits in [inputs.{name}]", where)
            notes += _outside(name, columns[name], limits, "", "")
    return notes


def _largest(column: Array) -> float:
    return float(np.nanmax(np.abs(column)))


def _bound(limits: tuple[float, float]) -> float:
    return max(abs(limits[0]), abs(limits[1])) or np.inf


def _mostly_outside(column: Array, limits: tuple[float, float]) -> bool:
    """Whether half of a heater's rows with power are beyond its limits; single misread cells are left out elsewhere."""
    power = np.abs(column[np.isfinite(column) & (column != 0.0)])
    return bool(np.median(power) > _bound(limits))


def _milli(what: str, column: Array, limits: tuple[float, float], unit: str, key: str, where: str) -> InputError:
    """Refusal of a column in thousandths of its unit; the unit is empty where nobody says it."""
    largest, bound, known = _largest(column), _bound(limits), unit in _WORDS
    return InputError(
        f"{what} reaches {largest:.6g} {unit}".rstrip() + f", {largest / bound:.0f} times its declared limit of "
        + f"{bound:g} {unit}".rstrip() + f": this looks like {f'm{unit}' if known else 'another unit'}",
        where=where,
        expected=_WORDS.get(unit, "the unit of its limits"),
        remedy=(f'Divide the column by 1000: [columns] with unit = "m{unit}", or with a scale, whose scale · cell is '
                f"in {unit} whatever the unit; or correct {key}." if known else
                f"Give the column a scale in [columns]; or correct {key}."),
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
