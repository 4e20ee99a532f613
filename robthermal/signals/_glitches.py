"""Readings that jump away and come back: counted and said, never altered unless a median filter is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import scipy
from numpy.typing import NDArray

from .._rhythm import in_rhythm
from ..errors import InputError
from ._checks import Array, positive_number
from ._record import Record

_NEIGHBORS = 5  # a jump of up to two samples cannot move the median of five
_NOISE = 8.0  # times the noise: one false alarm in 10^15 samples of Gaussian noise
_QUANTA = 4.0  # quantization steps that a sound reading may jump
_SWING = 6.0  # times the spread of the middle three of seven neighbors
_PIECE = 1 << 20  # rows examined at once
_MAD = 1.4826  # median absolute deviation of a Gaussian, to its standard deviation


def find_glitches(record: Record) -> dict[str, NDArray[np.intp]]:
    """Single-sample outliers in the outputs: away from the median of five neighbors, and back after two samples.

    A reading counts when it differs from the median of the five samples around it by more than 8 noise standard
    deviations (from the median absolute deviation), by more than 4 quantization steps, and by more than 6 times the
    spread of its neighbors: a real swing moves them too. Excursions of one size at even distances are no glitches
    either: a thermostat or a pulsed heater makes them. Voltages (unit "V") jump with their current and are left out.

    Parameters
    ----------
    record : Record
        Its outputs are examined; nothing is changed.

    Returns
    -------
    dict of str to ndarray
        Output name to the rows of its glitches; outputs without any are left out.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> T1 = 300.0 + 0.01 * np.arange(50)
    >>> T1[20] += 30.0
    >>> record = rt.Record(sample_time=1.0, inputs=np.ones(50), outputs=T1, input_names=["Q1"], output_names=["T1"])
    >>> rt.signals.find_glitches(record)
    {'T1': array([20])}
    """
    _require_record(record)
    found = {name: glitch_rows(record[name]) for name in record.output_names if record.units.get(name) != "V"}
    return {name: rows for name, rows in found.items() if rows.size}


def median_filter(record: Record, window: float) -> Record:
    """Replace the outputs by their centered running median.

    Parameters
    ----------
    record : Record
        Its inputs stay as they are, and its voltages (unit "V"), which jump with their current.
    window : float
        Width [s]; the median is over all samples within half of it. At the ends the first and last sample are repeated.

    Returns
    -------
    Record
        With a note that says so.

    Raises
    ------
    InputError
        A window that is not positive, holds a single sample, or is longer than the record.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> T1 = np.full(50, 300.0)
    >>> T1[20] = 330.0
    >>> record = rt.Record(sample_time=1.0, inputs=np.ones(50), outputs=T1, input_names=["Q1"], output_names=["T1"])
    >>> float(rt.signals.median_filter(record, 9.0)["T1"].max())
    300.0
    """
    _require_record(record)
    samples = window_samples(window, record.sample_time, record.n_samples, "window")
    outputs = np.empty_like(record.outputs)
    for i in range(outputs.shape[1]):
        keep = record.units.get(record.output_names[i]) == "V"
        outputs[:, i] = record.outputs[:, i] if keep else filtered(record.outputs[:, i], samples)
    return record.changed(outputs=outputs, notes=(*record.notes, filter_note(window, samples)))


def glitch_rows(column: Array) -> NDArray[np.intp]:
    """Rows of the glitches of one channel; what is computed on the way has twice the size of the channel."""
    if len(column) < _NEIGHBORS:
        return np.empty(0, dtype=np.intp)
    column = np.ascontiguousarray(column)
    # On a steep stretch the median is the sample itself and hides the noise; second differences see it there too.
    noise = _MAD * max(_median_of(_residual, column, 0), _median_of(_bends, column, 2))
    rounding = 1e-9 * max(abs(float(column.min())), abs(float(column.max())))
    least = max(_NOISE * noise, _QUANTA * quantum(column), rounding)
    found = []
    for start, stop in _pieces(len(column)):
        # A fast but real swing bends its neighbors too; a glitch leaves them where they were.
        found.append(start + np.flatnonzero(_around(_excess, column, start, stop, 3) > least))
    rows = np.concatenate(found)
    return rows[~in_rhythm(rows, _sizes(column, rows))]  # what comes again and again is a thermostat, say


def _sizes(column: Array, rows: NDArray[np.intp]) -> Array:
    """How far some rows are from the median of their neighbors."""
    around = np.clip(rows[:, None] + np.arange(_NEIGHBORS) - _NEIGHBORS // 2, 0, len(column) - 1)
    return np.asarray(column[rows] - np.median(column[around], axis=1))


def _residual(column: Array) -> Array:
    # "mirror" counts the end sample once, so that a glitch in the first row does not hide itself.
    return np.asarray(np.abs(column - scipy.ndimage.median_filter(column, size=_NEIGHBORS, mode="mirror")))


def _excess(column: Array) -> Array:
    """Residual where it is large beside the spread of its neighbors, else zero."""
    residual = _residual(column)
    upper, lower = (scipy.ndimage.rank_filter(column, rank, size=7, mode="mirror") for rank in (4, 2))
    spread = upper - lower
    return np.where(residual > _SWING * spread, residual, 0.0)


def _bends(column: Array) -> Array:
    return np.asarray(np.abs(np.diff(column, 2)) / np.sqrt(6.0))


def _pieces(n: int) -> Iterator[tuple[int, int]]:
    for start in range(0, n, _PIECE):
        yield start, min(start + _PIECE, n)


def _around(what: Callable[[Array], Array], column: Array, start: int, stop: int, reach: int) -> Array:
    """What a filter says of some rows, with the rows around that it looks at."""
    first = max(start - reach, 0)
    return what(column[first : stop + reach])[start - first : stop - first]


def _median_of(what: Callable[[Array], Array], column: Array, lost: int) -> float:
    """Median of a filter's output, which is `lost` rows shorter than the column."""
    out = np.empty(len(column) - lost)
    for start, stop in _pieces(len(out)):
        if lost:
            out[start:stop] = what(column[start : stop + lost])
        else:
            out[start:stop] = _around(what, column, start, stop, 3)
    return float(np.median(out, overwrite_input=True))


def filtered(column: Array, samples: int) -> Array:
    """Running median over an odd number of samples."""
    smooth: Array = scipy.ndimage.median_filter(np.ascontiguousarray(column), size=samples, mode="nearest")
    return smooth


def window_samples(window: float, sample_time: float, n_samples: int, where: str) -> int:
    """Odd number of samples within half a window on either side."""
    width = positive_number(window, where, "s")
    samples = 2 * int(width / (2 * sample_time) + 1e-9) + 1
    if not 3 <= samples <= n_samples:
        raise InputError(
            f"{where} is {width:g} s, {samples} samples",
            where=f"argument {where}",
            expected=f"between {2 * sample_time:g} s (three samples) and {n_samples * sample_time:g} s (the record)",
        )
    return samples


def filter_note(window: float, samples: int) -> str:
    """What the filter did, in words."""
    return f"outputs replaced by their running median over {window:g} s ({samples} samples), as asked"


def quantum(column: Array) -> float:
    """Quantization step: the usual distance between neighboring values that occur."""
    gaps = np.sort(column)
    for start, stop in _pieces(len(gaps) - 1):
        gaps[start:stop] = gaps[start + 1 : stop + 1] - gaps[start:stop]
    gaps = gaps[:-1]
    n = int(np.count_nonzero(gaps))
    if not n:
        return 0.0
    middle = [len(gaps) - n + (n - 1) // 2, len(gaps) - n + n // 2]  # of those above zero
    gaps.partition(middle)
    return float(np.mean(gaps[middle]))


def _require_record(record: object) -> None:
    if not isinstance(record, Record):
        raise InputError(f"got {type(record).__name__}", where="argument record", expected="a robthermal.Record")
