"""Rows that repeat, jump back or are rounded in time: what is kept, and on which times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ._options import ImportOptions
from ._stamps import Clock
from ._table import Action, Array, Table

Rows = NDArray[np.intp]
_OFTEN = 0.05  # share of uneven steps that speaks for a rounded clock, not for a lost or repeated row
_UNITS = (3600.0, 60.0, 1.0, 0.1, 0.01, 0.001)  # s, to which clocks round
_SLACK = 1e-6
_UNSURE = 0.02  # of a step: larger doubts are no reason for a rounder number


def runs(table: Table, clock: Clock, options: ImportOptions) -> list[Rows]:
    """Rows between jumps back of the time.

    Raises
    ------
    InputError
        Time that runs backward, unless restarts are to split.
    """
    seconds = clock.seconds
    back = np.flatnonzero(np.diff(seconds) < 0.0) + 1
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
        table.actions.append(
            Action(
                "split",
                1,
                f"time jumps back to {seconds[k]:.10g} s; a new part begins",
                lines=[int(table.lines[k])],
                times=[float(seconds[k])],
            )
        )
    return [np.asarray(part) for part in np.split(np.arange(len(seconds)), back)]


def single(table: Table, clock: Clock, rows: Rows, values: Array, options: ImportOptions) -> tuple[Rows, Array | None]:
    """Rows without repetitions of one time stamp, and times counted on a grid where the clock rounds.

    Parameters
    ----------
    table, clock
        Of the file.
    rows : ndarray of int
        Indices of the rows of one run.
    values : ndarray, shape (n_rows of the file, channels)
        Changed in place where repeated rows are averaged.
    options : ImportOptions
        Import options, of which `duplicates` is used.

    Returns
    -------
    rows : ndarray of int
        That are kept.
    stamps : ndarray or None
        Their times on a uniform grid where they were counted, else None: the clock's.
    """
    seconds = clock.seconds[rows]
    steps = np.diff(seconds)
    if len(steps) == 0:
        return rows, None
    counted = _counted(seconds, steps)
    if counted is not None:
        h, unit = counted
        table.actions.append(
            Action(
                "counted",
                len(rows),
                f"time stamps are rounded to {unit:g} s; rows were counted on a uniform grid of {h:.10g} s",
                lines=[int(table.lines[rows[0]])],
            )
        )
        return rows, seconds[0] + h * np.arange(len(rows))
    again = np.flatnonzero(steps == 0.0) + 1
    if not again.size:
        return rows, None
    h = float(seconds[-1] - seconds[0]) / len(steps)
    if options.jitter >= 1.0 and np.abs(seconds - seconds[0] - h * np.arange(len(rows))).max() <= (1.0 + _SLACK) * h:
        h = nice(h, 1.0 / len(steps))
        table.actions.append(
            Action(
                "counted",
                len(rows),
                f"time stamps repeat (rounded in the file); rows were counted on a uniform grid of {h:.10g} s",
                lines=[int(table.lines[rows[again[0]]])],
            )
        )
        return rows, seconds[0] + h * np.arange(len(rows))
    equal = np.array([_same(values[rows[k]], values[rows[k - 1]]) for k in again.tolist()])
    other = again[~equal]
    if other.size and options.duplicates == "refuse":
        k = int(other[0])
        raise InputError(
            f"time {seconds[k]:.10g} s stands twice, with other values ({other.size} such rows)",
            where=table.place(int(rows[k])),
            expected="one row per time",
            remedy='Write duplicates = "first", "last" or "mean".',
        )
    lost = _lost(seconds, again, values, rows, options.duplicates)
    table.actions.append(
        Action(
            "duplicates",
            len(lost),
            f"{len(lost)} repeated rows dropped" + (f" ({options.duplicates} kept)" if other.size else " (identical)"),
            lines=[int(table.lines[rows[k]]) for k in lost[:50]],
            times=[float(seconds[k]) for k in lost[:50]],
            rows=len(lost),
        )
    )
    keep = np.ones(len(rows), bool)
    keep[lost] = False
    return rows[keep], None


def _same(a: Array, b: Array) -> bool:
    return bool(np.all((a == b) | (np.isnan(a) & np.isnan(b))))


def _lost(seconds: Array, again: Rows, values: Array, rows: Rows, policy: str) -> list[int]:
    """Rows of a run that go, among those that repeat a time."""
    lost: list[int] = []
    starts = [k for k in (again - 1).tolist() if k == 0 or seconds[k - 1] != seconds[k]]
    for start in starts:
        stop = start + 1
        while stop < len(seconds) and seconds[stop] == seconds[start]:
            stop += 1
        group = list(range(start, stop))
        kept = group[-1] if policy == "last" else group[0]
        if policy == "mean":
            values[rows[kept]] = np.mean(values[rows[group]], axis=0)
        lost += [k for k in group if k != kept]
    return lost


def _counted(seconds: Array, steps: Array) -> tuple[float, float] | None:
    """Step of the uniform grid that stamps rounded to a unit lie on within that unit; None where they do not."""
    if steps.max() - steps.min() <= _SLACK * max(steps.max(), 1e-12) or len(steps) < 4:
        return None
    unit = next((u for u in _UNITS if np.abs(steps / u - np.rint(steps / u)).max() < _SLACK), None)
    if unit is None or steps.max() - steps.min() > unit * (1 + _SLACK):
        return None
    low = float(np.mean(steps < steps.max() - 0.5 * unit))
    if not _OFTEN <= low <= 1.0 - _OFTEN:
        return None
    h = (seconds[-1] - seconds[0]) / len(steps)
    off = seconds - seconds[0] - h * np.arange(len(seconds))
    if np.ptp(off) > unit * (1.0 + _SLACK) + unit / len(steps) * 2:
        return None
    return nice(h, unit / len(steps) / h), unit


def nice(h: float, uncertainty: float) -> float:
    """The short decimal number that the stamps cannot tell from `h`, or `h` itself."""
    for digits in range(4):
        short = float(f"{h:.{digits}e}")
        if abs(short - h) <= max(_SLACK, min(uncertainty, _UNSURE)) * h:
            return short
    return float(h)
