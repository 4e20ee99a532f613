"""Power spectral density by Welch's method: what scipy.signal answers, without its import."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

Array = NDArray[np.float64]


def welch(values: Array, sample_time: float, length: int) -> tuple[Array, Array]:
    """One-sided density of a signal: mean over segments of `length` samples that overlap by half, Hann window.

    The mean of every segment is taken away first.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Samples of the signal, at least `length` of them [unit].
    sample_time : float
        Time between two samples [s].
    length : int
        Samples of a segment [-].

    Returns
    -------
    tuple of ndarray, each (length // 2 + 1,)
        Frequencies [Hz], densities [unit²/Hz].

    References
    ----------
    Welch (1967), IEEE Trans. Audio Electroacoust. 15, 70-73.

    Examples
    --------
    >>> import numpy as np
    >>> frequency, power = welch(np.random.default_rng(0).normal(size=100_000), 0.5, 64)
    >>> round(float(power[1:-1].mean()), 2)  # variance 1 over 0 to 1 Hz
    1.0
    """
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)
    segments = sliding_window_view(values, length)[:: length - length // 2]
    lines = np.fft.rfft((segments - segments.mean(axis=1, keepdims=True)) * window)
    power = np.mean(lines.real**2 + lines.imag**2, axis=0) * sample_time / np.sum(window**2)
    power[1 : (length + 1) // 2] *= 2.0  # lines of negative frequency; 0 and half the sampling rate have none
    return np.asarray(np.fft.rfftfreq(length, sample_time)), np.asarray(power)
