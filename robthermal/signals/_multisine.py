"""Multisine: a periodic sum of sines with random phases."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..errors import InputError
from ._checks import Array, finite_number, positive_number


def multisine(
    period: int,
    *,
    sample_time: float,
    seed: int,
    band: tuple[float, float] | None = None,
    lines: Sequence[int] | None = None,
    rms: float | None = None,
    amplitude: float | None = None,
    offset: float = 0.0,
    periods: int = 1,
) -> NDArray[np.float64]:
    """Sum of sines of equal amplitude and random phase, exactly periodic; its mean is the offset.

    Parameters
    ----------
    period : int
        Length of one period [samples]. Line k has the frequency k / (period * sample_time) [Hz].
    sample_time : float
        [s].
    seed : int
        Of the random phases: the same seed gives the same signal.
    band : (float, float), optional
        Lowest and highest frequency [Hz]; every line between them is excited. Give this or `lines`.
    lines : sequence of int, optional
        Numbers of the excited lines, from 1 to below period / 2.
    rms : float, optional
        Standard deviation of the signal, in its unit. Give this or `amplitude`.
    amplitude : float, optional
        Largest deviation from the offset, in the unit of the signal.
    offset : float, optional
        Mean of the signal, in its unit.
    periods : int, optional
        How often the period is repeated.

    Returns
    -------
    ndarray, shape (period * periods,)

    Raises
    ------
    InputError
        Lines at zero, at or above the Nyquist frequency, a band without a line, both or neither of a pair of arguments.

    References
    ----------
    R. Pintelon and J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., Wiley-IEEE, 2012,
    sec. 2.2.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> u = rt.signals.multisine(100, sample_time=1.0, lines=[1, 3, 5], rms=2.0, offset=20.0, periods=3, seed=1)
    >>> u.shape, bool(np.all(u[:100] == u[200:]))
    ((300,), True)
    >>> round(float(u.mean()), 9), round(float(u.std()), 9)
    (20.0, 2.0)
    """
    n, repeats = _whole(period, "period", 3), _whole(periods, "periods", 1)
    h = positive_number(sample_time, "sample_time", "s")
    _exactly_one("band", band, "lines", lines)
    _exactly_one("rms", rms, "amplitude", amplitude)
    excited = _lines_of_band(band, n, h) if band is not None else _checked_lines(lines, n)
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    phases = np.random.default_rng(_whole(seed, "seed", 0)).uniform(0.0, 2.0 * np.pi, len(excited))
    spectrum[excited] = np.exp(1j * phases)
    wave: Array = fft.irfft(spectrum, n)
    if rms is not None:
        wave *= positive_number(rms, "rms") / np.sqrt(np.mean(wave**2))
    else:
        wave *= positive_number(amplitude, "amplitude") / np.abs(wave).max()
    return np.tile(finite_number(offset, "offset") + wave, repeats)


def _lines_of_band(band: object, n: int, h: float) -> NDArray[np.intp]:
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
        )
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


def _checked_lines(lines: object, n: int) -> NDArray[np.intp]:
    if not isinstance(lines, (Sequence, range, np.ndarray)) or isinstance(lines, (str, bytes)) or not len(lines):
        raise InputError(f"lines is {lines!r}", where="argument lines", expected="a list of line numbers")
    numbers = [_whole(line, f"lines[{k}]", 1) for k, line in enumerate(lines)]
    for line in numbers:
        if 2 * line >= n:
            raise InputError(
                f"line {line} is not below the Nyquist frequency",
                where="argument lines",
                expected=f"lines from 1 to {(n - 1) // 2} for a period of {n} samples",
            )
        if numbers.count(line) > 1:
            raise InputError(f"line {line} is given twice", where="argument lines", expected="lines given once")
    return np.array(numbers, dtype=np.intp)


def _whole(value: object, where: str, least: int) -> int:
    number = finite_number(value, where)
    if number != int(number) or number < least:
        raise InputError(f"{where} is {value!r}", where=f"argument {where}", expected=f"a whole number from {least}")
    return int(number)


def _exactly_one(first: str, a: object, second: str, b: object) -> None:
    if (a is None) == (b is None):
        raise InputError(
            f"{'neither' if a is None else 'both'} of {first} and {second} given",
            where=f"arguments {first} and {second}",
            expected="one of the two",
        )
