"""What the excitation signals ask of their settings: lines, amplitude spectrum, level, offset."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._checks import whole_number
from ..errors import InputError
from ._checks import Array, finite_number, positive_number

Lines = NDArray[np.intp]


def exactly_one(first: str, a: object, second: str, b: object) -> None:
    """Refuse both or neither of two arguments."""
    if (a is None) == (b is None):
        raise InputError(
            f"{'neither' if a is None else 'both'} of {first} and {second} given",
            where=f"arguments {first} and {second}",
            expected="one of the two",
        )


def one_of(value: object, where: str, words: Sequence[str]) -> str:
    """`value` as one of a few words."""
    if not isinstance(value, str) or value not in words:
        raise InputError(
            f"{where} is {value!r}", where=f"argument {where}", expected=f"one of {', '.join(map(repr, words))}"
        )
    return value


def given_lines(band: object, lines: object, n: int, h: float) -> Lines:
    """Numbers of the excited lines of a period of `n` samples."""
    exactly_one("band", band, "lines", lines)
    return _lines_of_band(band, n, h) if band is not None else _checked_lines(lines, n)


def band_limits(band: object, h: float) -> tuple[float, float]:
    """(lowest, highest) frequency [Hz], below the Nyquist frequency."""
    if not isinstance(band, (tuple, list, np.ndarray)) or len(band) != 2:
        raise InputError(f"band is {band!r}", where="argument band", expected="(lowest, highest) frequency [Hz]")
    low, high = finite_number(band[0], "band[0]", "Hz"), finite_number(band[1], "band[1]", "Hz")
    if not 0.0 <= low <= high:
        raise InputError(f"band is {(low, high)} Hz", where="argument band", expected="0 <= lowest <= highest")
    if high >= 0.5 / h:
        raise InputError(
            f"band reaches {high:g} Hz",
            where="argument band",
            expected=f"frequencies below the Nyquist frequency, {0.5 / h:g} Hz",
            remedy=f"Lower it, or sample faster than every {h:g} s.",
        )
    return low, high


def _lines_of_band(band: object, n: int, h: float) -> Lines:
    low, high = band_limits(band, h)
    # 1e-9: a limit such as 0.03 Hz lies on a line although 0.03 * n * h is not a whole number in floating point.
    slack = 1e-9 * max(1.0, high * n * h)
    first, last = max(1, int(np.ceil(low * n * h - slack))), int(np.floor(high * n * h + slack))
    if last < first:
        raise InputError(
            f"no line lies between {low:g} Hz and {high:g} Hz",
            where="argument band",
            expected=f"a band that holds a multiple of {1.0 / (n * h):g} Hz, above zero",
            remedy="Widen the band, or lengthen the period.",
        )
    return np.arange(first, last + 1)


def _checked_lines(lines: object, n: int) -> Lines:
    if not isinstance(lines, (Sequence, range, np.ndarray)) or isinstance(lines, (str, bytes)) or not len(lines):
        raise InputError(f"lines is {lines!r}", where="argument lines", expected="a list of line numbers")
    numbers = [whole_number(line, f"lines[{k}]", 1) for k, line in enumerate(lines)]
    seen: set[int] = set()
    for line in numbers:
        if 2 * line >= n:
            raise InputError(
                f"line {line} is not below the Nyquist frequency",
                where="argument lines",
                expected=f"lines from 1 to {(n - 1) // 2} for a period of {n} samples",
            )
        if line in seen:
            raise InputError(f"line {line} is given twice", where="argument lines", expected="lines given once")
        seen.add(line)
    return np.array(numbers, dtype=np.intp)


def line_amplitudes(spectrum: object, lines: Lines) -> Array:
    """Relative amplitudes of the lines: equal, falling as 1/sqrt(frequency) (equal power per octave), or given."""
    expected = f"'linear', 'logarithmic', or {lines.size} positive numbers, one per line"
    if isinstance(spectrum, str):
        if one_of(spectrum, "spectrum", ("linear", "logarithmic")) == "linear":
            return np.ones(lines.size)
        return 1.0 / np.sqrt(lines)
    if not isinstance(spectrum, (Sequence, np.ndarray)) or np.ndim(spectrum) != 1:
        raise InputError(f"spectrum is {spectrum!r}", where="argument spectrum", expected=expected)
    if len(spectrum) != lines.size:
        raise InputError(
            f"spectrum has {len(spectrum)} numbers for {lines.size} lines", where="argument spectrum", expected=expected
        )
    return np.array([positive_number(value, f"spectrum[{k}]") for k, value in enumerate(spectrum)])


def per_input(value: Any, where: str, n_inputs: int) -> list[Any]:
    """One value for all inputs, or a list with one for each."""
    if isinstance(value, (list, tuple, np.ndarray)) and np.ndim(value) > 0:
        if len(value) != n_inputs:
            raise InputError(
                f"{where} has {len(value)} values for {n_inputs} inputs",
                where=f"argument {where}",
                expected="one value, or one per input",
            )
        return list(value)
    return [value] * n_inputs


def scaled(waves: Array, rms: object, amplitude: object) -> Array:
    """`waves` of mean zero (several experiments of one input) with the rms, or the largest peak of all, asked for."""
    exactly_one("rms", rms, "amplitude", amplitude)
    if rms is not None:
        return np.asarray(waves * (positive_number(rms, "rms") / np.sqrt(np.mean(waves**2))))
    return np.asarray(waves * (positive_number(amplitude, "amplitude") / np.abs(waves).max()))


def shifted(waves: Array, offset: object) -> Array:
    """`waves` raised by the offset, or until the lowest of all values is zero."""
    if isinstance(offset, str):
        one_of(offset, "offset", ("nonnegative",))
        return np.asarray(waves - waves.min())
    return np.asarray(finite_number(offset, "offset") + waves)


def held_samples(time: float, where: str, h: float) -> int:
    """`time` [s] as a whole number of samples of `h` [s]."""
    width = positive_number(time, where, "s")
    samples = round(width / h)
    if samples < 1 or abs(samples * h - width) > 1e-6 * h * samples:
        raise InputError(
            f"{where} is {width!r} s and sample_time is {h!r} s",
            where=f"argument {where}",
            expected="a whole number of samples",
            remedy=f"Use {where}={max(samples, 1) * h:.10g}.",
        )
    return samples
