"""Multisine: a periodic sum of sines, for one input."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._checks import whole_number
from ._checks import Array, positive_number
from ._crest import low_crest_phases, schroeder_phases, wave_of
from ._excitation_settings import Lines, given_lines, line_amplitudes, one_of, scaled, shifted

PHASES = ("random", "schroeder", "low_crest")


def multisine(
    period: int,
    *,
    sample_time: float,
    seed: int,
    band: tuple[float, float] | None = None,
    lines: Sequence[int] | None = None,
    rms: float | None = None,
    amplitude: float | None = None,
    offset: float | Literal["nonnegative"] = 0.0,
    periods: int = 1,
    spectrum: Literal["linear", "logarithmic"] | ArrayLike = "linear",
    phases: Literal["random", "schroeder", "low_crest"] = "random",
) -> NDArray[np.float64]:
    """Sum of sines with chosen amplitudes and random phases, exactly periodic; its mean is the offset. Evers (2.1).

    Parameters
    ----------
    period : int
        Length of one period [samples]. Line k has the frequency k / (period * sample_time) [Hz].
    sample_time : float
        Time between two samples [s].
    seed : int
        Of the random phases: the same seed gives the same signal.
    band : (float, float), optional
        Lowest and highest frequency [Hz]; every line between them is excited. Give this or `lines`.
    lines : sequence of int, optional
        Numbers of the excited lines, from 1 to below period / 2.
    rms : float, optional
        Standard deviation of the signal, in its unit. Give this or `amplitude`.
    amplitude : float, optional
        Largest deviation from the mean, in the unit of the signal.
    offset : float or "nonnegative", optional
        Mean of the signal, in its unit; "nonnegative" is the smallest mean for which no value is below zero.
    periods : int, optional
        How often the period is repeated.
    spectrum : {"linear", "logarithmic"} or array_like, optional
        Amplitudes of the lines: "linear" equal, power spread evenly over a linear frequency axis; "logarithmic"
        proportional to 1/sqrt(frequency), power spread evenly over a logarithmic axis; or relative amplitudes [-], one
        per line.
    phases : {"random", "schroeder", "low_crest"}, optional
        "random" are independent and uniform, as the best linear approximation assumes. "schroeder" follow from the
        amplitudes (the seed has no effect). "low_crest" start at random and are changed until the peak is low.

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
    Evers (2021), (2.1), with f_k in Hz.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> u = rt.signals.multisine(100, sample_time=1.0, lines=[1, 3, 5], rms=2.0, offset=20.0, periods=3, seed=1)
    >>> u.shape, bool(np.all(u[:100] == u[200:]))
    ((300,), True)
    >>> round(float(u.mean()), 9), round(float(u.std()), 9)
    (20.0, 2.0)

    A heater can only heat, and its mean heat is the price of the peaks:

    >>> common = dict(sample_time=1.0, band=(0.001, 0.1), rms=1.0, offset="nonnegative", seed=1)
    >>> [round(float(rt.signals.multisine(1000, phases=p, **common).mean()), 1) for p in ("random", "low_crest")]
    [2.6, 1.4]
    """
    n, repeats = whole_number(period, "period", 3), whole_number(periods, "periods", 1)
    excited = given_lines(band, lines, n, positive_number(sample_time, "sample_time", "s"))
    amplitudes = line_amplitudes(spectrum, excited)
    rng = np.random.default_rng(whole_number(seed, "seed", 0))
    chosen = chosen_phases(phases, excited, amplitudes, rng.uniform(0.0, 2.0 * np.pi, excited.size), n)
    wave = scaled(wave_of(excited, amplitudes, chosen, n), rms, amplitude)
    return np.tile(shifted(wave, offset), repeats)


def chosen_phases(
    kind: object, lines: Lines, amplitudes: Array, random: Array, n: int, turns: ArrayLike = (0.0,)
) -> Array:
    """The phases of one of the three kinds; `random` are uniform, `turns` are added to all, one per experiment."""
    word = one_of(kind, "phases", PHASES)
    if word == "schroeder":
        return schroeder_phases(lines, amplitudes)
    return random if word == "random" else low_crest_phases(lines, amplitudes, random, n, turns)
