"""Time stamps that the logger rounded to whole units: rows are counted on a uniform grid."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ._options import ImportOptions
from ._table import Action, Array, Table, spans

_OFTEN = 0.05  # share of uneven steps that speaks for a rounded clock, not for lost or repeated rows
_LEAST, _REGULAR = 3, 8  # uneven steps that are evidence; eight lost rows fit a grid with odds of 8!/8^8 = 0.2 %
_FEW = 20  # rows; shorter runs between gaps are no evidence
_UNITS = (3600.0, 60.0, 1.0, 0.1, 0.01, 0.001)  # s, to which clocks round
_SLACK = 1e-6
_UNSURE = 0.02  # of a step: larger doubts are no reason for a rounder number


def grid(table: Table, seconds: Array, rows: slice, options: ImportOptions) -> Array | None:
    """Times on a uniform grid, where the stamps are rounded; None where they stand as they are.

    Parameters
    ----------
    table : Table
        For lines, and its actions.
    seconds : ndarray
        Stamps of one run [s].
    rows : slice
        Its rows in the table.
    options : ImportOptions
        Import options, of which `jitter` is used.
    """
    steps = np.diff(seconds)
    if not len(steps) or steps.max() - steps.min() <= _SLACK * max(steps.max(), 1e-12):
        return None
    counted = _counted(seconds, steps)
    if counted is not None:
        times, h, unit = counted
        text = f"time stamps are rounded to {unit:g} s; rows were counted on a uniform grid of {h:.10g} s"
        table.actions.append(Action("counted", len(seconds), text, lines=[table.lines[rows.start]]))
        return times
    again = np.flatnonzero(steps == 0.0) + 1
    h = float(seconds[-1] - seconds[0]) / len(steps)
    if not again.size or options.jitter < 1.0 or max(map(abs, _off(seconds, h)[:2])) > (1.0 + _SLACK) * h:
        return None
    h = nice(h, 1.0 / len(steps))
    text = f"time stamps repeat (rounded in the file); rows were counted on a uniform grid of {h:.10g} s"
    table.actions.append(Action("counted", len(seconds), text, lines=[table.lines[rows.start + int(again[0])]]))
    return np.asarray(seconds[0] + h * np.arange(len(seconds)))


def _counted(seconds: Array, steps: Array) -> tuple[Array, float, float] | None:
    """Times on a uniform grid from which no stamp is further than its rounding, its step, and the unit; None if none.

    Steps that are more than a unit longer than the shortest are gaps: the runs between them lie on one grid.
    """
    unit = next((u for u in _UNITS if _multiples(steps[:1000], u) and _multiples(steps, u)), None)
    if unit is None:
        return None
    gaps = np.flatnonzero(steps > steps.min() + unit * (1 + _SLACK)) + 1
    runs = [slice(*pair) for pair in pairwise([0, *gaps.tolist(), len(seconds)])]
    even = len(steps) - len(gaps)
    if even < 4 or (len(gaps) and (len(gaps) > _OFTEN * len(steps) or min(_length(run) for run in runs) < _FEW)):
        return None
    short = int((steps < steps.min() + 0.5 * unit).sum())
    if min(short, even - short) < min(max(_OFTEN * even, _LEAST), _REGULAR):
        return None
    found = _common_step(seconds, runs, unit, steps.min())
    if found is None:
        return None
    longest = max(_length(run) for run in runs)
    h = nice(found, unit / longest / found)
    times = np.empty(len(seconds))
    for run in runs:
        low, high, _ = _off(seconds[run], h)
        start = seconds[run.start] + (0.5 * (low + high) if run.start else 0.0)
        times[run] = seconds[0] + h * (round(float(start - seconds[0]) / h) + np.arange(_length(run)))
    return times, h, unit


def _length(run: slice) -> int:
    return int(run.stop - run.start)


def _common_step(seconds: Array, runs: Sequence[slice], unit: float, shortest: float) -> float | None:
    """Step h for which stamps minus h·row stay within a unit in every run; bisection, as their range is convex in h."""
    low, high = float(shortest), float(shortest + unit)
    for _ in range(60):
        h = 0.5 * (low + high)
        widest, steeper = 0.0, 0.0
        for run in runs:
            least, width, later = _off(seconds[run], h)
            if (width := width - least) > widest:
                widest, steeper = width, later
        if widest <= unit * (1.0 + _SLACK):
            return h
        low, high = (h, high) if steeper > 0 else (low, h)
    return None


def _multiples(steps: Array, unit: float) -> bool:
    return all(np.abs(steps[part] / unit - np.rint(steps[part] / unit)).max() < _SLACK for part in spans(len(steps)))


def _off(seconds: Array, h: float) -> tuple[float, float, float]:
    """Least and largest distance of stamps from a uniform grid [s], and rows from the least to the largest."""
    least = largest = (0.0, 0)
    for part in spans(len(seconds)):
        off = seconds[part] - seconds[0] - h * np.arange(part.start, part.stop)
        first, last = int(np.argmin(off)), int(np.argmax(off))
        least = min(least, (float(off[first]), part.start + first))
        largest = max(largest, (float(off[last]), part.start + last))
    return least[0], largest[0], float(largest[1] - least[1])


def nice(h: float, uncertainty: float) -> float:
    """The short decimal number that the stamps cannot tell from a step, or the step itself.

    Parameters
    ----------
    h : float
        Step of a grid [s].
    uncertainty : float
        Relative uncertainty of the step [-].
    """
    for digits in range(4):
        short = float(f"{h:.{digits}e}")
        if abs(short - h) <= max(_SLACK, min(uncertainty, _UNSURE)) * h:
            return short
    return float(h)
