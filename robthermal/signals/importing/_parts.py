"""From rows to uninterrupted, uniformly sampled parts: gaps, missing readings, jitter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ._options import ImportOptions
from ._rounded import nice
from ._startup import without_startup
from ._table import Action, Array, Table, spans

Flags = NDArray[np.bool_]
Named = Sequence[tuple[str, Array]]  # headers and their columns
_GAP = 1.5  # of the median step
_NEGLIGIBLE = 1e-3  # of a step: stamps this close to the grid are on it
_EPS = 1e-6
_ROUNDING = 1e-9  # of a mean square
_FILLABLE = '; gaps = "fill" in [record] (--record gaps=fill) interpolates such rows'


@dataclass(frozen=True)
class Part:
    """Rows of one uninterrupted part and their grid.

    Parameters
    ----------
    rows : slice
        Of the table.
    stamps : ndarray
        Time stamps of these rows [s].
    sample_time : float
        Of the grid [s].
    samples : int
        On the grid.
    exact : bool
        Whether the rows are the grid.
    means : bool
        Whether the stamps are known to be right, so that held signals act by their means over the samples.
    """

    rows: slice
    stamps: Array
    sample_time: float
    samples: int
    exact: bool
    means: bool = False

    @property
    def n_rows(self) -> int:
        """How many rows of the table."""
        return len(self.stamps)

    @property
    def start(self) -> float:
        """Time of the first sample [s]."""
        return float(self.stamps[0])

    def interpolated(self, values: Array) -> Iterator[tuple[slice, Array]]:
        """Readings of these rows on the grid; missing ones in between are interpolated."""
        there = np.isfinite(values)
        x, y = (self.stamps, values) if there.all() else (self.stamps[there], values[there])
        for part in spans(self.samples):
            yield part, (_bent if self.means else np.interp)(self._grid(part), x, y)

    def held(self, values: Array) -> Iterator[tuple[slice, Array]]:
        """A held signal on the grid: its mean, or the row in force; a row up to half a step late counts as on time."""
        for part in spans(self.samples):
            if self.means:
                yield part, self._mean(values, self._grid(part))
                continue
            place = np.searchsorted(self.stamps, self._grid(part) + 0.5 * self.sample_time, side="right") - 1
            yield part, values[np.clip(place, 0, len(values) - 1)]

    def ripple(self, values: Array) -> Iterator[tuple[slice, Array]]:
        """Rms of what a held signal is off its mean over the samples; nothing where the row in force stands."""
        for part in spans(self.samples if self.means else 0):
            grid = self._grid(part)
            mean = self._mean(values, grid)
            off = self._mean(values**2, grid) - mean**2
            yield part, np.sqrt(np.where(off > _ROUNDING * mean**2, off, 0.0))

    def _mean(self, values: Array, grid: Array) -> Array:
        """Mean of a held signal over the samples: exactly its value where that does not change."""
        end = grid + self.sample_time
        first = np.maximum(np.searchsorted(self.stamps, grid, side="right") - 1, 0)
        last = np.searchsorted(self.stamps, end, side="left") - 1
        until = np.append(self.stamps[1:], np.inf)
        mean = values[first]
        for later in range(1, int((last - first).max(initial=0)) + 1):
            row = np.minimum(first + later, last)
            share = (np.minimum(until[row], end) - self.stamps[row]) / self.sample_time
            mean = mean + np.where(first + later <= last, share * (values[row] - values[first]), 0.0)
        return mean

    def _grid(self, part: slice) -> Array:
        return self.start + self.sample_time * np.arange(part.start, part.stop, dtype=np.float64)


def _bent(at: Array, x: Array, y: Array) -> Array:
    """Between two rows the parabola of the smaller of both their bends; linear where these are of opposite signs.

    A reading with a lag bends for several rows, one without has a corner at a row where its heat jumps: there it is
    straight on one side, and stays so (Harten and Osher 1987, the limiter of essentially non-oscillatory schemes).
    """
    first, last = np.searchsorted(x, at[[0, -1]]) + (-3, 3)
    x, y = x[max(first, 0) : last], y[max(first, 0) : last]
    bend = np.zeros(len(x))
    bend[1:-1] = np.diff(np.diff(y) / np.diff(x)) / (x[2:] - x[:-2])
    left = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    a, b = bend[left], bend[left + 1]
    smaller = np.where(a * b > 0.0, np.sign(a) * np.minimum(np.abs(a), np.abs(b)), 0.0)
    inside = np.where((at >= x[0]) & (at <= x[-1]), smaller, 0.0)
    return np.asarray(np.interp(at, x, y) + inside * (at - x[left]) * (at - x[left + 1]))


def parts_of(
    table: Table, stamps: Array, pieces: Sequence[slice], driven: Named, read: Named, options: ImportOptions
) -> list[Part]:
    """Uninterrupted parts of all runs of a file.

    Parameters
    ----------
    table : Table
        For lines, and its actions.
    stamps : ndarray
        Time of every row [s].
    pieces : sequence of slice
        Runs, increasing in time.
    driven, read : sequence of (header, column)
        Inputs and currents; sensors and ambients; nan where missing.
    options : ImportOptions
        gaps, fill_up_to, shortest, jitter, averaged.

    Raises
    ------
    InputError
        Too much jitter, gaps where they are refused, nothing left.
    """
    steps = [np.diff(stamps[rows]) for rows in pieces]
    joined = steps[0] if len(steps) == 1 else np.concatenate(steps)
    if not len(joined):
        raise InputError(f"the file has {len(table.lines)} data row", where=table.where, expected="at least two")
    median = float(np.median(joined, overwrite_input=True))
    del steps, joined
    if median <= 0.0:
        raise InputError(
            "more than half of the time stamps repeat",
            where=table.where,
            expected="time that increases",
            remedy="Write more digits of the time, or sample_time = … and another time column.",
        )
    threshold = median * (max(_GAP, 1.0 + options.jitter) + _EPS)
    ends, lacking = _missing(driven, len(stamps)), _unfillable(read, len(stamps), options)
    if options.gaps == "refuse":
        _refuse_missing(table, ends, lacking, driven, read)
    good = ~(ends | lacking)
    segments: list[slice] = []
    for rows in pieces:
        segments += _segments(table, rows, stamps, good, threshold, median, driven, options)
    _say_missing(table, ends, lacking, driven, read)
    long = without_startup(
        table, _long_enough(table, segments, stamps, median, options), stamps, median, threshold, options
    )
    h = _step(long, stamps, median)
    _check_jitter(table, long, stamps, h, threshold, options)
    return [_part(rows, stamps[rows], h) for rows in long]


def _missing(columns: Named, n: int) -> Flags:
    """Rows in which one of the columns has no value."""
    out = np.zeros(n, bool)
    for _, column in columns:
        out |= np.isnan(column)
    return out


def _unfillable(read: Named, n: int, options: ImportOptions) -> Flags:
    """Rows with a missing reading that ends the part: all of them, or with "fill" those of long gaps."""
    if options.gaps != "fill":
        return _missing(read, n)
    out = np.zeros(n, bool)
    for _, column in read:
        edges = np.flatnonzero(np.diff(np.concatenate([[0], np.isnan(column).astype(np.int8), [0]])))
        for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if stop - start > options.fill_up_to or start == 0 or stop == n:
                out[start:stop] = True
    return out


def _segments(
    table: Table,
    rows: slice,
    stamps: Array,
    good: Flags,
    threshold: float,
    median: float,
    driven: Named,
    options: ImportOptions,
) -> list[slice]:
    """Runs of good rows without a gap in time between them."""
    seconds, usable = stamps[rows], good[rows]
    begins = np.zeros(len(seconds), bool)  # a new part begins at this row
    begins[0] = True
    begins[1:] = usable[1:] != usable[:-1]
    for k in np.flatnonzero(seconds[1:] - seconds[:-1] > threshold).tolist():
        first, second = rows.start + k, rows.start + k + 1
        lost = round(float(seconds[k + 1] - seconds[k]) / median) - 1
        lines, times = [table.lines[first], table.lines[second]], [float(seconds[k]), float(seconds[k + 1])]
        if options.gaps == "refuse":
            raise InputError(
                f"{lost} samples are missing after this row, {times[0]:.10g} s to {times[1]:.10g} s",
                where=table.place(first),
                expected=f"a row every {median:.6g} s",
                remedy='Write gaps = "split" or gaps = "fill".',
            )
        same = all(column[first] == column[second] for _, column in driven)
        fillable = lost <= options.fill_up_to and good[first] and good[second] and same
        if options.gaps == "fill" and fillable:
            text = f"{lost} missing row{'s' * (lost != 1)} after {times[0]:.10g} s interpolated"
            table.actions.append(Action("filled", lost, text, "", lines, times))
            continue
        why = "" if options.gaps == "split" or same else "; inputs change across it, so that it is not filled"
        if options.gaps == "split" and fillable and not any(_FILLABLE in one.text for one in table.actions):
            why = _FILLABLE
        text = f"{lost} sample{'s' * (lost != 1)} missing after {times[0]:.10g} s; a new part begins{why}"
        table.actions.append(Action("split", lost, text, "", lines, times))
        begins[k + 1] = True
    starts = np.flatnonzero(begins)
    stops = np.append(starts[1:], len(seconds))
    found = zip(starts.tolist(), stops.tolist(), strict=True)
    return [slice(rows.start + start, rows.start + stop) for start, stop in found if usable[start]]


def _refuse_missing(table: Table, ends: Flags, lacking: Flags, driven: Named, read: Named) -> None:
    wrong = np.flatnonzero(ends | lacking)
    if wrong.size:
        row = int(wrong[0])
        header = next(header for header, column in (*driven, *read) if np.isnan(column[row]))
        raise InputError(
            f"nothing was measured ({wrong.size} such rows)",
            where=table.place(row, header),
            expected="a number in every cell",
            remedy='Write gaps = "split" or gaps = "fill".',
        )


def _say_missing(table: Table, ends: Flags, lacking: Flags, driven: Named, read: Named) -> None:
    """One action per column whose missing cells end a part, or are interpolated."""
    told = np.zeros(len(ends), bool)
    for columns, stops in ((driven, ends), (read, lacking)):
        for header, column in columns:
            missing = np.isnan(column)
            if not missing.any():
                continue
            gone, kept = missing & stops, missing & ~(ends | lacking)
            if gone.any():
                n = int(gone.sum())
                text = f"{n} rows without a value in {header!r} end the part"
                new = int((gone & ~told).sum())
                table.actions.append(Action("split", n, text, header, table.lines.of(gone), rows=new))
                told |= gone
            if kept.any():
                n = int(kept.sum())
                text = f"{n} missing readings of {header!r} interpolated"
                table.actions.append(Action("filled", n, text, header, table.lines.of(kept)))


def _long_enough(
    table: Table, segments: Sequence[slice], stamps: Array, median: float, options: ImportOptions
) -> list[slice]:
    """Segments that are no shorter than allowed; the others are said."""
    long: list[slice] = []
    short: list[slice] = []
    for rows in segments:
        samples = round(float(stamps[rows.stop - 1] - stamps[rows.start]) / median) + 1
        (long if rows.stop - rows.start >= 2 and samples >= options.least else short).append(rows)
    if short:
        gone = sum(rows.stop - rows.start for rows in short)
        table.actions.append(
            Action(
                "left_out",
                len(short),
                f"{len(short)} parts shorter than {options.least} samples left out ({gone} rows)",
                lines=[table.lines[rows.start] for rows in short[:50]],
                times=[float(stamps[rows.start]) for rows in short[:50]],
                rows=gone,
            )
        )
    used = sum(rows.stop - rows.start for rows in long)
    if not long or 2 * used < len(table.lines):
        raise InputError(
            f"{used} of {len(table.lines)} rows are left in {len(long)} parts of at least {options.least} samples",
            where=table.where,
            expected="at least half of the rows",
            remedy='Repair the file, lower shortest, or write gaps = "fill".',
        )
    return long


def _steps(stamps: Array) -> Iterator[tuple[int, Array]]:
    """Steps between stamps, some at a time, and the row before the first of them."""
    for part in spans(len(stamps) - 1):
        yield part.start, np.diff(stamps[part.start : part.stop + 1])


def _step(long: Sequence[slice], stamps: Array, median: float) -> float:
    """Step of the grid: mean over all parts, as a short decimal number where the stamps allow it."""
    duration = intervals = 0.0
    for rows in long:
        duration += float(stamps[rows.stop - 1] - stamps[rows.start])
        counts = (np.ceil(steps / median - 0.5) for _, steps in _steps(stamps[rows]))  # 1.5 steps of a rounded clock: 1
        intervals += max(sum(float(count.sum()) for count in counts), 1.0)
    h = duration / intervals
    worst = max(float(np.abs(steps - h).max()) for rows in long for _, steps in _steps(stamps[rows]))
    return nice(h, worst / duration)


def _check_jitter(
    table: Table, long: Sequence[slice], stamps: Array, h: float, threshold: float, options: ImportOptions
) -> None:
    """Refuse steps that deviate too far; say what is resampled."""
    worst, place, above, total = 0.0, 0, 0, 0
    for rows in long:
        rounding = 4 * np.finfo(float).eps * max(abs(float(stamps[rows.start])), abs(float(stamps[rows.stop - 1]))) / h
        for start, steps in _steps(stamps[rows]):
            deviation = np.where(steps <= threshold, np.abs(steps - h) / h, 0.0)
            above += int((deviation > options.jitter + _EPS + rounding).sum())
            total += len(steps)
            k = int(np.argmax(deviation))
            if deviation[k] > worst:
                worst, place = float(deviation[k]), rows.start + start + k
    if above:
        suggested = min(1.0, float(np.ceil(worst * 100) / 100))
        raise InputError(
            f"the time steps deviate by up to {100 * worst:.3g} % of {h:.6g} s, worst after this row ({above} of "
            f"{total} steps above {100 * options.jitter:.3g} %)",
            where=table.place(place),
            expected=f"steps within {100 * options.jitter:.3g} % of their median",
            remedy=f"Allow it with jitter = {suggested:g}; the rows are then resampled.",
        )


def _part(rows: slice, stamps: Array, h: float) -> Part:
    samples = int(round(float(stamps[-1] - stamps[0]) / h)) + 1
    exact = samples == len(stamps) and all(
        float(np.abs(stamps[part] - stamps[0] - h * np.arange(part.start, part.stop)).max()) <= _NEGLIGIBLE * h
        for part in spans(samples)
    )
    return Part(rows, stamps, h, samples, exact)


def say_resampled(table: Table, parts: Sequence[Part], columns: dict[str, Array]) -> None:
    """The action of resampling: worst deviation, its line, and the error bound h²/8·max|T″| of every reading."""
    moved = [part for part in parts if not part.exact]
    if not moved:
        return
    h = parts[0].sample_time
    worst, row = 0.0, 0
    for one in moved:
        for start, steps in _steps(one.stamps):
            fraction = np.abs(steps / h - np.rint(steps / h))  # of filled gaps the fraction
            k = int(np.argmax(fraction))
            if fraction[k] >= worst:
                worst, row = float(fraction[k]), one.rows.start + start + k
    if worst <= _NEGLIGIBLE:
        return
    bounds = []
    for name, column in columns.items():
        bend = max(_bend(part.stamps, column[part.rows]) for part in moved)
        bounds.append(f"{name} {h * h / 8.0 * bend:.2g}")
    how = ("readings and ambients by parabolas, inputs and currents by their means" if moved[0].means else
           "readings and ambients linear, inputs and currents held")
    text = (
        f"time steps deviate by up to {100 * worst:.3g} %; resampled to a uniform grid of {h:.10g} s ({how})"
        + (f"; error bound h²/8·max|T″| [K]: {', '.join(bounds[:12])}" if bounds else "")
    )
    table.actions.append(Action("resampled", sum(part.n_rows for part in moved), text, lines=[table.lines[row]]))


def _bend(stamps: Array, values: Array) -> float:
    """Largest second divided difference [K/s²]."""
    there = np.isfinite(values)
    t, x = (stamps, values) if there.all() else (stamps[there], values[there])
    largest = 0.0
    for part in spans(len(t) - 2):
        s, y = t[part.start : part.stop + 2], x[part.start : part.stop + 2]
        slope = np.diff(y) / np.diff(s)
        largest = max(largest, float(np.abs(2.0 * np.diff(slope) / (s[2:] - s[:-2])).max()))
    return largest
