"""From rows to uninterrupted, uniformly sampled parts: gaps, missing readings, jitter, resampling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ._options import ImportOptions
from ._samples import Rows, nice
from ._table import Action, Array, Table

Flags = NDArray[np.bool_]
_GAP = 1.5  # of the median step
_NEGLIGIBLE = 1e-3  # of a step: stamps this close to the grid are on it
_EPS = 1e-6


@dataclass(frozen=True)
class Part:
    """Rows of one uninterrupted part and their grid.

    Parameters
    ----------
    rows : ndarray of int
        Of the table.
    stamps : ndarray
        Time stamps of these rows [s].
    sample_time : float
        Of the grid [s].
    samples : int
        On the grid.
    exact : bool
        Whether the rows are the grid.
    """

    rows: Rows
    stamps: Array
    sample_time: float
    samples: int
    exact: bool

    @property
    def start(self) -> float:
        """Time of the first sample [s]."""
        return float(self.stamps[0])

    @property
    def grid(self) -> Array:
        """Times of the samples [s]."""
        return self.start + self.sample_time * np.arange(self.samples, dtype=np.float64)

    def linear(self, column: Array) -> Array:
        """Readings on the grid, linear between rows; missing ones in between are interpolated."""
        values = column[self.rows]
        there = np.isfinite(values)
        if self.exact and there.all():
            return values
        return np.asarray(np.interp(self.grid, self.stamps[there], values[there]))

    def held(self, column: Array) -> Array:
        """A held signal on the grid: the row in force; a row up to half a step late counts as on time."""
        if self.exact:
            return column[self.rows]
        place = np.searchsorted(self.stamps, self.grid + 0.5 * self.sample_time, side="right") - 1
        return column[self.rows[np.clip(place, 0, len(self.rows) - 1)]]


def parts_of(
    table: Table,
    pieces: list[tuple[Rows, Array]],
    driven: Array,
    read: Array,
    options: ImportOptions,
    names: tuple[tuple[str, ...], tuple[str, ...]],
) -> list[Part]:
    """Uninterrupted parts of all runs of a file.

    Parameters
    ----------
    table : Table
        For lines, and its actions.
    pieces : list of (rows, stamps)
        Runs, increasing in time.
    driven, read : ndarray, shape (n_rows, channels)
        Inputs and currents; sensors and ambients; nan where missing.
    options : ImportOptions
        gaps, fill_up_to, shortest, jitter.
    names : tuple of (driven headers, read headers)
        Column headers that messages name.

    Raises
    ------
    InputError
        Too much jitter, gaps where they are refused, nothing left.
    """
    steps = np.concatenate([np.diff(stamps) for _, stamps in pieces]) if pieces else np.zeros(0)
    if not len(steps):
        raise InputError(f"the file has {len(table.lines)} data row", where=table.where, expected="at least two")
    median = float(np.median(steps))
    if median <= 0.0:
        raise InputError(
            "more than half of the time stamps repeat",
            where=table.where,
            expected="time that increases",
            remedy="Write more digits of the time, or sample_time = … and another time column.",
        )
    threshold = median * (max(_GAP, 1.0 + options.jitter) + _EPS)
    stop_here: Flags = np.asarray(np.isnan(driven).any(axis=1))
    lacking = _unfillable(read, options)
    if options.gaps == "refuse":
        _refuse_missing(table, stop_here, lacking, driven, read, names)
    segments: list[tuple[Rows, Array]] = []
    for rows, stamps in pieces:
        segments += _segments(table, rows, stamps, stop_here | lacking, threshold, median, driven, options)
    _say_missing(table, stop_here, lacking, driven, read, names)
    long = [
        (rows, stamps)
        for rows, stamps in segments
        if len(rows) >= 2 and round((stamps[-1] - stamps[0]) / median) + 1 >= options.shortest
    ]
    short = [(rows, stamps) for rows, stamps in segments if len(rows) and not any(rows is r for r, _ in long)]
    if short:
        gone = sum(len(rows) for rows, _ in short)
        table.actions.append(
            Action(
                "left_out",
                len(short),
                f"{len(short)} parts shorter than {options.shortest} samples left out ({gone} rows)",
                lines=[int(table.lines[rows[0]]) for rows, _ in short[:50]],
                times=[float(stamps[0]) for _, stamps in short[:50]],
                rows=gone,
            )
        )
    used = sum(len(rows) for rows, _ in long)
    if not long or 2 * used < len(table.lines):
        raise InputError(
            f"{used} of {len(table.lines)} rows are left in {len(long)} parts of at least {options.shortest} samples",
            where=table.where,
            expected="at least half of the rows",
            remedy='Repair the file, lower shortest, or write gaps = "fill".',
        )
    h = _step(long, median)
    _check_jitter(table, long, h, threshold, options)
    return [_part(rows, stamps, h) for rows, stamps in long]


def _unfillable(read: Array, options: ImportOptions) -> Flags:
    """Rows with a missing reading that ends the part: all of them, or with "fill" those of long gaps."""
    missing = np.isnan(read)
    if options.gaps != "fill":
        return np.asarray(missing.any(axis=1))
    out = np.zeros(len(read), bool)
    for column in missing.T:
        edges = np.flatnonzero(np.diff(np.concatenate([[0], column.astype(np.int8), [0]])))
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            if stop - start > options.fill_up_to or start == 0 or stop == len(column):
                out[start:stop] = True
    return out


def _segments(
    table: Table,
    rows: Rows,
    stamps: Array,
    bad: Flags,
    threshold: float,
    median: float,
    driven: Array,
    options: ImportOptions,
) -> list[tuple[Rows, Array]]:
    """Runs of good rows without a gap in time between them."""
    good = ~bad[rows]
    cut = np.zeros(len(rows), bool)  # a new part begins at this row
    for k in np.flatnonzero(np.diff(stamps) > threshold).tolist():
        lost = round(float(stamps[k + 1] - stamps[k]) / median) - 1
        lines, times = (
            [int(table.lines[rows[k]]), int(table.lines[rows[k + 1]])],
            [float(stamps[k]), float(stamps[k + 1])],
        )
        if options.gaps == "refuse":
            raise InputError(
                f"{lost} samples are missing after this row, {times[0]:.10g} s to {times[1]:.10g} s",
                where=table.place(int(rows[k])),
                expected=f"a row every {median:.6g} s",
                remedy='Write gaps = "split" or gaps = "fill".',
            )
        same = bool(np.array_equal(driven[rows[k]], driven[rows[k + 1]]))
        if options.gaps == "fill" and lost <= options.fill_up_to and good[k] and good[k + 1] and same:
            table.actions.append(
                Action("filled", lost, f"{lost} missing rows after {times[0]:.10g} s interpolated", "", lines, times)
            )
            continue
        why = "" if options.gaps == "split" or same else "; inputs change across it, so that it is not filled"
        table.actions.append(
            Action(
                "split",
                lost,
                f"{lost} samples missing after {times[0]:.10g} s; a new part begins{why}",
                "",
                lines,
                times,
            )
        )
        cut[k + 1] = True
    label = np.cumsum(cut | np.concatenate([[True], good[1:] != good[:-1]]))
    found = []
    for name in np.unique(label[good]).tolist():
        take = (label == name) & good
        found.append((rows[take], stamps[take]))
    return found


def _refuse_missing(
    table: Table,
    stop_here: Flags,
    lacking: Flags,
    driven: Array,
    read: Array,
    names: tuple[tuple[str, ...], tuple[str, ...]],
) -> None:
    wrong = np.flatnonzero(stop_here | lacking)
    if wrong.size:
        row = int(wrong[0])
        values, headers = (driven, names[0]) if stop_here[row] else (read, names[1])
        column = headers[int(np.argmax(np.isnan(values[row])))]
        raise InputError(
            f"nothing was measured ({wrong.size} such rows)",
            where=table.place(row, column),
            expected="a number in every cell",
            remedy='Write gaps = "split" or gaps = "fill".',
        )


def _say_missing(
    table: Table,
    stop_here: Flags,
    lacking: Flags,
    driven: Array,
    read: Array,
    names: tuple[tuple[str, ...], tuple[str, ...]],
) -> None:
    """One action per column whose missing cells end a part, or are interpolated."""
    told = np.zeros(len(table.lines), bool)
    for values, headers, ends in ((driven, names[0], stop_here), (read, names[1], lacking)):
        for k, header in enumerate(headers):
            missing = np.isnan(values[:, k])
            gone, kept = missing & ends, missing & ~(stop_here | lacking)
            if gone.any():
                table.actions.append(
                    Action(
                        "split",
                        int(gone.sum()),
                        f"{int(gone.sum())} rows without a value in {header!r} end the part",
                        header,
                        [int(x) for x in table.lines[gone][:50]],
                        rows=int((gone & ~told).sum()),
                    )
                )
                told |= gone
            if kept.any():
                table.actions.append(
                    Action(
                        "filled",
                        int(kept.sum()),
                        f"{int(kept.sum())} missing readings of {header!r} interpolated",
                        header,
                        [int(x) for x in table.lines[kept][:50]],
                    )
                )


def _step(long: list[tuple[Rows, Array]], median: float) -> float:
    """Step of the grid: mean over all parts, as a short decimal number where the stamps allow it."""
    spans = [(float(stamps[-1] - stamps[0]), float(np.rint(np.diff(stamps) / median).sum())) for _, stamps in long]
    duration, intervals = sum(s for s, _ in spans), sum(max(n, 1.0) for _, n in spans)
    h = duration / intervals
    worst = max(float(np.abs(np.diff(stamps) - h).max()) for _, stamps in long)
    return nice(h, worst / duration)


def _check_jitter(
    table: Table, long: list[tuple[Rows, Array]], h: float, threshold: float, options: ImportOptions
) -> None:
    """Refuse steps that deviate too far; say what is resampled."""
    worst, place, above, total = 0.0, 0, 0, 0
    for rows, stamps in long:
        steps = np.diff(stamps)
        usual = steps <= threshold
        deviation = np.where(usual, np.abs(steps - h) / h, 0.0)
        rounding = 4 * np.finfo(float).eps * float(np.abs(stamps).max()) / h
        above += int((deviation > options.jitter + _EPS + rounding).sum())
        total += len(steps)
        k = int(np.argmax(deviation))
        if deviation[k] > worst:
            worst, place = float(deviation[k]), int(rows[k])
    if above:
        suggested = min(1.0, float(np.ceil(worst * 100) / 100))
        raise InputError(
            f"the time steps deviate by up to {100 * worst:.3g} % of {h:.6g} s, worst after this row ({above} of "
            f"{total} steps above {100 * options.jitter:.3g} %)",
            where=table.place(place),
            expected=f"steps within {100 * options.jitter:.3g} % of their median",
            remedy=f"Allow it with jitter = {suggested:g}; the rows are then resampled.",
        )


def _part(rows: Rows, stamps: Array, h: float) -> Part:
    samples = int(round(float(stamps[-1] - stamps[0]) / h)) + 1
    exact = samples == len(rows) and float(np.abs(stamps - stamps[0] - h * np.arange(samples)).max()) <= _NEGLIGIBLE * h
    return Part(rows, stamps, h, samples, exact)


def say_resampled(table: Table, parts: list[Part], columns: dict[str, Array]) -> None:
    """The action of resampling: worst deviation, its line, and the error bound h²/8·max|T″| of every reading."""
    moved = [part for part in parts if not part.exact]
    if not moved:
        return
    h = parts[0].sample_time
    worst, row = 0.0, 0
    for part in moved:
        steps = np.abs(np.diff(part.stamps) / h - np.rint(np.diff(part.stamps) / h))  # of filled gaps the fraction
        k = int(np.argmax(steps))
        if steps[k] >= worst:
            worst, row = float(steps[k]), int(part.rows[k])
    if worst <= _NEGLIGIBLE:
        return
    bounds = []
    for name, column in columns.items():
        bend = max(_bend(part.stamps, column[part.rows]) for part in moved)
        bounds.append(f"{name} {h * h / 8.0 * bend:.2g}")
    text = (
        f"time steps deviate by up to {100 * worst:.3g} %; resampled to a uniform grid of {h:.10g} s (readings and "
        "ambients "
        "linear, inputs and currents held)"
        + (f"; error bound h²/8·max|T″| [K]: {', '.join(bounds[:12])}" if bounds else "")
    )
    n = sum(len(part.rows) for part in moved)
    table.actions.append(Action("resampled", n, text, lines=[int(table.lines[row])]))


def _bend(stamps: Array, values: Array) -> float:
    """Largest second divided difference [K/s²]."""
    there = np.isfinite(values)
    t, x = stamps[there], values[there]
    if len(t) < 3:
        return 0.0
    slope = np.diff(x) / np.diff(t)
    return float(np.abs(2.0 * np.diff(slope) / (t[2:] - t[:-2])).max())
