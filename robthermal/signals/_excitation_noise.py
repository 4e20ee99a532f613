"""Noise: Gaussian, white or in a band, and pseudo-random binary sequences."""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from .._checks import whole_number
from ..errors import InputError
from ._checks import Array, finite_number, positive_number
from ._excitation_settings import band_limits, held_samples, shifted

_ORDER = 4  # of the Butterworth filter
_SETTLED = 1e-8  # of the filter's memory that may be left at the first sample
_LONGEST = 20_000_000  # samples to let the filter settle, or of a binary sequence
_ORDERS = (2, 24)  # of the shift register


def noise(
    n_samples: int,
    *,
    sample_time: float,
    seed: int,
    rms: float,
    band: tuple[float, float] | None = None,
    offset: float | Literal["nonnegative"] = 0.0,
) -> NDArray[np.float64]:
    """Stationary Gaussian noise, white or filtered; not periodic.

    Parameters
    ----------
    n_samples : int
        Length of the signal [samples].
    sample_time : float
        Time between two samples [s].
    seed : int
        The same seed gives the same signal.
    rms : float
        Standard deviation of the process, in the unit of the signal; that of one realization scatters around it.
    band : (float, float), optional
        Lowest and highest frequency [Hz] of a Butterworth filter of order 4; lowest 0 is a low pass. Default: white.
    offset : float or "nonnegative", optional
        Mean of the process; "nonnegative" raises this realization until its lowest value is zero.

    Returns
    -------
    ndarray, shape (n_samples,)

    Raises
    ------
    InputError
        A band that is empty, reaches the Nyquist frequency, or is too narrow for the sample time.

    Examples
    --------
    >>> import robthermal as rt
    >>> u = rt.signals.noise(20000, sample_time=1.0, band=(0.0, 0.1), rms=2.0, offset=10.0, seed=3)
    >>> round(float(u.mean()), 1), round(float(u.std()), 1)
    (10.0, 2.0)
    """
    n = whole_number(n_samples, "n_samples", 2)
    h, level = positive_number(sample_time, "sample_time", "s"), positive_number(rms, "rms")
    rng = np.random.default_rng(whole_number(seed, "seed", 0))
    if band is None:
        return shifted(level * rng.normal(size=n), offset)
    sections, settling = _filter(band, h)
    impulse = np.zeros(settling)
    impulse[0] = 1.0
    # Variance of filtered white noise: the energy of the impulse response.
    energy = float(np.sum(scipy.signal.sosfilt(sections, impulse) ** 2))
    colored: Array = scipy.signal.sosfilt(sections, rng.normal(size=settling + n))[settling:]
    return shifted(level / np.sqrt(energy) * colored, offset)


def _filter(band: object, h: float) -> tuple[Array, int]:
    """Second-order sections, and samples until they have forgotten their start."""
    low, high = band_limits(band, h)
    if low == high:
        raise InputError(f"band is {(low, high)} Hz", where="argument band", expected="lowest < highest")
    limits, kind = ((low, high), "bandpass") if low > 0.0 else (high, "lowpass")
    sections = scipy.signal.butter(_ORDER, limits, kind, fs=1.0 / h, output="sos")
    memory = max(np.abs(np.roots(section[3:])).max() for section in sections)
    settling = np.log(_SETTLED) / np.log(memory) if memory < 1.0 else np.inf
    if not settling < _LONGEST:
        raise InputError(
            f"a filter for {low:g} to {high:g} Hz needs {settling:.3g} samples of {h:g} s to settle",
            where="argument band",
            expected=f"at most {_LONGEST:.0e}",
            remedy="Widen the band or sample more slowly; a multisine excites any band exactly.",
        )
    return np.asarray(sections), int(np.ceil(settling)) + 1


def prbs(
    order: int,
    *,
    sample_time: float,
    hold: float,
    low: float,
    high: float,
    seed: int,
    periods: int = 1,
) -> NDArray[np.float64]:
    """Pseudo-random binary sequence of maximum length: for a heater that is only on or off. Crest factor nearly one.

    Parameters
    ----------
    order : int
        Length of the shift register, 2 to 24: one period has 2^order - 1 bits.
    sample_time : float
        Time between two samples [s].
    hold : float
        Time each bit is held [s], a whole number of samples. Power falls with frequency, to half at 0.44 / hold [Hz].
    low, high : float
        The two levels, in the unit of the signal, low < high.
    seed : int
        Of the starting state: other seeds give the same sequence shifted in time.
    periods : int, optional
        How often the period is repeated.

    Returns
    -------
    ndarray, shape ((2^order - 1) * hold / sample_time * periods,)

    Raises
    ------
    InputError
        An order outside 2 to 24, levels that are not low < high, a hold that is not a whole number of samples.

    Examples
    --------
    >>> import robthermal as rt
    >>> u = rt.signals.prbs(3, sample_time=1.0, hold=2.0, low=0.0, high=7.0, seed=0)
    >>> float(u.mean())  # 4 of 7 bits are high
    4.0
    """
    length = whole_number(order, "order", _ORDERS[0])
    if length > _ORDERS[1]:
        raise InputError(f"order is {length}", where="argument order", expected=f"at most {_ORDERS[1]}")
    levels = np.array([finite_number(low, "low"), finite_number(high, "high")])
    if not levels[0] < levels[1]:
        raise InputError(f"low is {low!r} and high is {high!r}", where="argument high", expected="low < high")
    width = held_samples(hold, "hold", positive_number(sample_time, "sample_time", "s"))
    repeats = whole_number(periods, "periods", 1)
    if (2**length - 1) * width * repeats > _LONGEST:
        raise InputError(
            f"{2**length - 1} bits of {width} samples, {repeats} times, are too long",
            where="argument order",
            expected=f"at most {_LONGEST} samples",
        )
    # From 1: a register of zeros would stay at zero for ever.
    number = int(np.random.default_rng(whole_number(seed, "seed", 0)).integers(1, 2**length))
    bits = scipy.signal.max_len_seq(length, state=[number >> place & 1 for place in range(length)])[0]
    return np.tile(np.repeat(levels[bits], width), repeats)
