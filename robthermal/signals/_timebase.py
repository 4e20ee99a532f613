"""From time stamps to a uniform grid: small jitter is resampled and said, gaps and repeated stamps are refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ._checks import Array, finite_number

_NEGLIGIBLE = 1e-3  # of a step: time stamps this close to the grid are on it
_NICE = 1e-6  # relative: 1.0000003 s is 1 s
_GAP = 1.5  # of the median step
_LISTED = 5

RowLabel = Callable[[int], str]


@dataclass(frozen=True)
class TimeBase:
    """A uniform grid and how the rows of the file get onto it."""

    sample_time: float
    start_time: float
    n_samples: int
    stamps: Array
    resampled: bool
    note: str

    @property
    def grid(self) -> Array:
        """Times of the grid [s]."""
        times: Array = np.arange(self.n_samples, dtype=np.float64)
        return self.start_time + self.sample_time * times

    def interpolated(self, column: Array) -> Array:
        """Readings on the grid, linear between rows."""
        return np.interp(self.grid, self.stamps, column) if self.resampled else column

    def held(self, column: Array) -> Array:
        """A held signal on the grid: the row in force. A row up to half a step late counts as on time.

        Taking strictly the previous row would delay an input by a whole sample wherever its stamp is a little late.
        """
        if not self.resampled:
            return column
        rows = np.searchsorted(self.stamps, self.grid + 0.5 * self.sample_time, side="right") - 1
        return column[np.clip(rows, 0, len(column) - 1)]


def uniform(stamps: Array, *, jitter: float, row: RowLabel, where: str) -> TimeBase:
    """Time base of the stamps [s]; `jitter` is the largest deviation of a step, relative to the median step."""
    allowed = finite_number(jitter, "jitter")
    if not 0.0 <= allowed <= 1.0:
        raise InputError(f"jitter is {jitter!r}", where="argument jitter", expected="a fraction of a step, from 0 to 1")
    if len(stamps) < 2:
        raise InputError(f"the file has {len(stamps)} data row", where=where, expected="at least two")
    steps = np.diff(stamps)
    _refuse_backward(stamps, steps, row, where)
    median = float(np.median(steps))
    _refuse_repeated(stamps, steps, allowed, row, where)
    _refuse_gaps(stamps, steps, median, allowed, row, where)
    worst = _refuse_jitter(stamps, steps, median, allowed, row, where)
    # Missing samples are counted (only an explicit jitter above one half gets here with any).
    intervals = int(np.rint(steps / median).sum()) if worst > 0.5 else len(steps)
    h = _nice((stamps[-1] - stamps[0]) / intervals, worst * median / (stamps[-1] - stamps[0]))
    return _on_grid(stamps, h, intervals + 1, worst, bool((steps == 0.0).any()), where)


def _on_grid(stamps: Array, h: float, n: int, worst: float, repeated: bool, where: str) -> TimeBase:
    base = TimeBase(h, float(stamps[0]), n, stamps, False, "")
    if n == len(stamps):
        off = float(np.abs(stamps - base.grid).max()) / h
        if off <= _NEGLIGIBLE:
            return base
        if repeated and off <= 1.0 + _NICE:
            note = f"time stamps repeat (rounded in the file); rows were counted on a uniform grid of {h:.10g} s"
            return TimeBase(h, base.start_time, n, stamps, False, note)
    if repeated:
        raise InputError(
            "time stamps repeat, and the rows do not fit a uniform grid either",
            where=where,
            expected="one row per time",
        )
    lost = f", {n - len(stamps)} missing samples filled" if n > len(stamps) else ""
    note = (
        f"time steps deviate by up to {100 * worst:.3g} %; resampled to a uniform grid of {h:.10g} s "
        f"(outputs and ambient temperatures interpolated linearly, inputs and currents held{lost})"
    )
    return TimeBase(h, base.start_time, n, stamps, True, note)


def _nice(h: float, uncertainty: float) -> float:
    """The short decimal number that the stamps cannot tell from `h`, or `h` itself."""
    for digits in range(4):
        short = float(f"{h:.{digits}e}")
        if abs(short - h) <= max(_NICE, min(uncertainty, _NEGLIGIBLE)) * h:
            return short
    return float(h)


def _refuse_backward(stamps: Array, steps: Array, row: RowLabel, where: str) -> None:
    back = np.flatnonzero(steps < 0.0)
    if back.size:
        k = int(back[0]) + 1
        raise InputError(
            f"time runs backward, from {stamps[k - 1]:.10g} s to {stamps[k]:.10g} s, in {row(k)}"
            + (f"; {back.size} such places" if back.size > 1 else ""),
            where=where,
            expected="time that increases",
            remedy="Two runs in one file? Split it there.",
        )


def _refuse_repeated(stamps: Array, steps: Array, allowed: float, row: RowLabel, where: str) -> None:
    same = np.flatnonzero(steps == 0.0)
    if not same.size or (allowed == 1.0 and 2 * same.size < len(steps)):
        return
    k = int(same[0]) + 1
    raise InputError(
        f"time {stamps[k]:.10g} s stands twice (duplicate), again in {row(k)}"
        + (f"; {same.size} such rows" if same.size > 1 else ""),
        where=where,
        expected="time that increases",
        remedy=f"{_rounding_hint(stamps)}Remove the copies.",
    )


def _rounding_hint(stamps: Array) -> str:
    grid = np.linspace(stamps[0], stamps[-1], len(stamps))
    h = (stamps[-1] - stamps[0]) / (len(stamps) - 1)
    if h == 0.0 or np.abs(stamps - grid).max() > (1.0 + _NICE) * h:
        return ""
    return (
        f"The rows would fit a uniform grid of {h:.6g} s with rounded time stamps: write the time with more digits, "
        "or say so with jitter=1.0. Otherwise: "
    )


def _refuse_gaps(stamps: Array, steps: Array, median: float, allowed: float, row: RowLabel, where: str) -> None:
    gaps = np.flatnonzero(steps > median * (max(_GAP, 1.0 + allowed) + _NICE))
    if not gaps.size:
        return
    told = [
        f"{row(int(k))}, {stamps[k]:.10g} s to {stamps[k + 1]:.10g} s ({round(steps[k] / median) - 1} samples missing)"
        for k in gaps[:_LISTED]
    ]
    more = f"; and {gaps.size - _LISTED} more" if gaps.size > _LISTED else ""
    raise InputError(
        f"{gaps.size} gap{'s' if gaps.size > 1 else ''} in time, after {'; after '.join(told)}{more}",
        where=where,
        expected=f"a row every {median:.6g} s",
        remedy="Split the file at the gaps and read the parts as separate records"
        + ("; jitter=1.0 fills single missing samples." if steps[gaps].max() <= (2 + _NICE) * median else "."),
    )


def _refuse_jitter(stamps: Array, steps: Array, median: float, allowed: float, row: RowLabel, where: str) -> float:
    """Largest deviation of a step, relative to the median step; refused above `allowed`."""
    deviation: NDArray[np.float64] = np.abs(steps - median) / median
    k = int(np.argmax(deviation))
    worst = float(deviation[k])
    suggested = min(1.0, float(np.ceil(worst * 100) / 100))
    rounding = 4 * np.finfo(float).eps * float(np.abs(stamps).max()) / median
    if worst > allowed + _NICE + rounding:
        above = int((deviation > allowed + _NICE + rounding).sum())
        raise InputError(
            f"the time steps jitter by up to {100 * worst:.3g} % of {median:.6g} s, worst after {row(k)}, "
            f"time {stamps[k]:.10g} s ({above} of {len(steps)} steps above {100 * allowed:.3g} %)",
            where=where,
            expected=f"steps within {100 * allowed:.3g} % of their median",
            remedy=f"Allow it with jitter={suggested:g}; the rows are then resampled.",
        )
    return worst
