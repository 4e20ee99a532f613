"""Rows that repeat, jump back or are rounded in time: what is kept, and on which times."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ._options import ImportOptions
from ._table import Action, Array, Table, spans
from ._times import Clock

Rows = NDArray[np.intp]
Flags = NDArray[np.bool_]
_OFTEN = 0.05  # share of uneven steps that speaks for a rounded clock, not for a lost or repeated row
_UNITS = (3600.0, 60.0, 1.0, 0.1, 0.01, 0.001)  # s, to which clocks round
_SLACK = 1e-6
_UNSURE = 0.02  # of a step: larger doubts are no reason for a rounder number


def runs(table: Table, clock: Clock, options: ImportOptions) -> list[slice]:
    """Rows between jumps back of the time.

    Raises
    ------
    InputError
        Time that runs backward, unless restarts are to split.
    """
    seconds = clock.seconds
    back = np.flatnonzero(seconds[1:] < seconds[:-1]) + 1
    if back.size and options.restarts == "refuse":
        k = int(back[0])
        raise InputError(
            f"time runs backward, from {seconds[k - 1]:.10g} s to {seconds[k]:.10g} s"
            + (f" ({back.size} such places)" if back.size > 1 else ""),
            where=table.place(k),
            expected="time that increases",
            remedy='Two runs in one file? Write restarts = "split".',
        )
    for k in back.tolist():
        text = f"time jumps back to {seconds[k]:.10g} s; a new part begins"
        table.actions.append(Action("split", 1, text, lines=[table.lines[k]], times=[float(seconds[k])]))
    bounds = [0, *back.tolist(), len(seconds)]
    return [slice(start, stop) for start, stop in pairwise(bounds)]


def single(
    table: Table, stamps: Array, pieces: Sequence[slice], values: Sequence[Array], options: ImportOptions
) -> tuple[Array, Flags | None]:
    """Times counted on a grid where the clock rounds, and which rows stay where time stamps repeat.

    Parameters
    ----------
    table : Table
        For lines, and its actions.
    stamps : ndarray
        Time of every row [s].
    pieces : sequence of slice
        Rows of the runs.
    values : sequence of ndarray, shape (n_rows, channels)
        Changed in place where repeated rows are averaged.
    options : ImportOptions
        Import options, of which `duplicates` and `jitter` are used.

    Returns
    -------
    stamps : ndarray
        Time of every row, on a grid where it was counted [s].
    keep : ndarray of bool or None
        Rows that stay, None for all.

    Raises
    ------
    InputError
        Rows of one time with different values, unless one of them is chosen.
    """
    keep: Flags | None = None
    for rows in pieces:
        grid = _grid(table, stamps[rows], rows, options)
        if grid is not None:
            stamps = stamps.copy()
            stamps[rows] = grid
            continue
        again = rows.start + 1 + np.flatnonzero(stamps[rows][1:] == stamps[rows][:-1])
        if again.size:
            keep = np.ones(len(stamps), bool) if keep is None else keep
            keep[_lost(table, stamps, again, values, options.duplicates)] = False
    return stamps, keep


def _grid(table: Table, seconds: Array, rows: slice, options: ImportOptions) -> Array | None:
    """Times on a uniform grid, where the stamps are rounded; None where they stand as they are."""
    steps = np.diff(seconds)
    if not len(steps) or steps.max() - steps.min() <= _SLACK * max(steps.max(), 1e-12):
        return None
    counted = _counted(seconds, steps)
    if counted is not None:
        h, unit = counted
        text = f"time stamps are rounded to {unit:g} s; rows were counted on a uniform grid of {h:.10g} s"
        table.actions.append(Action("counted", len(seconds), text, lines=[table.lines[rows.start]]))
        return np.asarray(seconds[0] + h * np.arange(len(seconds)))
    again = np.flatnonzero(steps == 0.0) + 1
    h = float(seconds[-1] - seconds[0]) / len(steps)
    if not again.size or options.jitter < 1.0 or _off(seconds, h)[2] > (1.0 + _SLACK) * h:
        return None
    h = nice(h, 1.0 / len(steps))
    text = f"time stamps repeat (rounded in the file); rows were counted on a uniform grid of {h:.10g} s"
    table.actions.append(Action("counted", len(seconds), text, lines=[table.lines[rows.start + int(again[0])]]))
    return np.asarray(seconds[0] + h * np.arange(len(seconds)))


def _lost(table: Table, stamps: Array, again: Rows, values: Sequence[Array], policy: str) -> Rows:
    """Rows that go, among those that repeat the time of the row before."""
    other = again[~np.logical_and.reduce([_same(matrix[again], matrix[again - 1]) for matrix in values])]
    if other.size and policy == "refuse":
        k = int(other[0])
        raise InputError(
            f"time {stamps[k]:.10g} s stands twice, with other values ({other.size} such rows)",
            where=table.place(k),
            expected="one row per time",
            remedy='Write duplicates = "first", "last" or "mean".',
        )
    if policy == "mean":
        for group in np.split(again, np.flatnonzero(np.diff(again) > 1) + 1):
            for matrix in values:
                matrix[group[0] - 1] = np.mean(matrix[group[0] - 1 : group[-1] + 1], axis=0)
    lost = again - 1 if policy == "last" else again
    table.actions.append(
        Action(
            "duplicates",
            len(lost),
            f"{len(lost)} repeated rows dropped" + (f" ({policy} kept)" if other.size else " (identical)"),
            lines=table.lines.of(lost),
            times=[float(stamps[k]) for k in lost[:50]],
            rows=len(lost),
        )
    )
    return lost


def _same(a: Array, b: Array) -> Flags:
    return np.asarray(((a == b) | (np.isnan(a) & np.isnan(b))).all(axis=1))


def _counted(seconds: Array, steps: Array) -> tuple[float, float] | None:
    """Step of the uniform grid that stamps rounded to a unit lie on within that unit; None where they do not."""
    if len(steps) < 4:
        return None
    unit = next((u for u in _UNITS if _multiples(steps[:1000], u) and _multiples(steps, u)), None)
    if unit is None or steps.max() - steps.min() > unit * (1 + _SLACK):
        return None
    low = float(np.mean(steps < steps.max() - 0.5 * unit))
    if not _OFTEN <= low <= 1.0 - _OFTEN:
        return None
    h = (seconds[-1] - seconds[0]) / len(steps)
    least, largest, _ = _off(seconds, h)
    if largest - least > unit * (1.0 + _SLACK) + unit / len(steps) * 2:
        return None
    return nice(h, unit / len(steps) / h), unit


def _multiples(steps: Array, unit: float) -> bool:
    return all(np.abs(steps[part] / unit - np.rint(steps[part] / unit)).max() < _SLACK for part in spans(len(steps)))


def _off(seconds: Array, h: float) -> tuple[float, float, float]:
    """Least, largest and largest absolute distance of stamps from a uniform grid [s]."""
    ends = []
    for part in spans(len(seconds)):
        off = seconds[part] - seconds[0] - h * np.arange(part.start, part.stop)
        ends += [float(off.min()), float(off.max())]
    return min(ends), max(ends), max(abs(min(ends)), abs(max(ends)))


def nice(h: float, uncertainty: float) -> float:
    """The short decimal number that the stamps cannot tell from `h`, or `h` itself."""
    for digits in range(4):
        short = float(f"{h:.{digits}e}")
        if abs(short - h) <= max(_SLACK, min(uncertainty, _UNSURE)) * h:
            return short
    return float(h)
