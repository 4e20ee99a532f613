"""Crest factor: how high the peak of a signal is for its power, and the phases of a multisine that keep it low."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ._checks import Array, finite_number

_CLIPPINGS = 200
_NORMS = (4, 8, 16, 32, 64, 128, 256, 512)  # p of the L_p norms descended one after the other
_STEPS = 60  # iterations per norm


def crest_factor(u: ArrayLike) -> float:
    """Largest deviation from the mean over the standard deviation: 1 for a square wave, sqrt(2) for a sine.

    Parameters
    ----------
    u : array_like, shape (n,)
        Signal, in any unit; for a periodic signal whole periods.

    Returns
    -------
    float
        [-]. Of the samples: a held (zero-order hold) signal takes no other values.

    Raises
    ------
    InputError
        A signal that is constant, empty, not finite or not one-dimensional.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.signals.crest_factor([3.0, 5.0, 5.0, 3.0])
    1.0
    """
    values = np.asarray(u)
    if values.ndim != 1 or values.dtype.kind not in "fiu" or not values.size:
        raise InputError(
            f"u has shape {values.shape} and type {values.dtype}", where="argument u", expected="numbers, shape (n,)"
        )
    for k in np.flatnonzero(~np.isfinite(values)):
        finite_number(values[k], f"u[{k}]")
    wave = values - values.mean()
    if np.abs(wave).max() <= 1e-12 * np.abs(values).max():
        raise InputError("u is constant", where="argument u", expected="a signal that varies")
    return crest_of(wave)


def crest_of(wave: Array) -> float:
    """Crest factor of a wave of mean zero."""
    return float(np.abs(wave).max() / np.sqrt(np.mean(wave**2)))


def wave_of(lines: NDArray[np.intp], amplitudes: Array, phases: Array, n: int) -> Array:
    """Sum of amplitude * cos(2 pi line i / n + phase), i = 0 ... n-1; `phases` (..., lines) give waves (..., n)."""
    spectrum = np.zeros((*phases.shape[:-1], n // 2 + 1), dtype=complex)
    spectrum[..., lines] = 0.5 * n * amplitudes * np.exp(1j * phases)
    return np.asarray(scipy.fft.irfft(spectrum, n, axis=-1))


def schroeder_phases(lines: NDArray[np.intp], amplitudes: Array) -> Array:
    """Schroeder (1970): phase_m = -2 pi sum_{l<m} (m - l) p_l, p_l the part of the power in line l."""
    order = np.argsort(lines)
    power = amplitudes[order] ** 2 / np.sum(amplitudes**2)
    phases = np.empty(lines.size)
    below = np.cumsum(power) - power  # sum_{l<m} p_l; summed once more it carries the factors m - l
    phases[order] = -2.0 * np.pi * np.cumsum(below)
    return phases


def low_crest_phases(
    lines: NDArray[np.intp], amplitudes: Array, phases: Array, n: int, turns: ArrayLike = (0.0,)
) -> Array:
    """Phases of a lower crest factor than that of the given ones, by clipping, then by descent of rising L_p norms.

    Clipping: van der Ouderaa, Schoukens and Renneboog (1988). L_p norms, here with the exact gradient: Guillaume,
    Schoukens, Pintelon and Kollar (1991). A local minimum: other starting phases end
    elsewhere, at nearly the same height.
    `turns` [rad] are added to all phases, one experiment each: the highest peak of all experiments is brought down.
    """
    rotation = np.unique(np.round(np.mod(turns, np.pi), 12))[:, None]  # half a turn is a change of sign: the same peak

    def waves(phases: Array) -> Array:
        return wave_of(lines, amplitudes, phases + rotation, n)

    best, lowest = phases, np.inf
    for step in range(_CLIPPINGS):
        wave = waves(phases)
        if (crest := crest_of(wave)) < lowest:
            best, lowest = phases, crest
        limit = (0.7 + 0.28 * step / _CLIPPINGS) * np.abs(wave).max()
        clipped = scipy.fft.rfft(np.clip(wave, -limit, limit))[:, lines] * np.exp(-1j * rotation)
        phases = np.angle(clipped.sum(axis=0))
    phases = best
    for p in _NORMS:
        phases = scipy.optimize.minimize(
            _norm_and_gradient,
            phases,
            (p, lines, amplitudes, n, rotation),
            "L-BFGS-B",
            jac=True,
            options={"maxiter": _STEPS},
        ).x
        if (crest := crest_of(waves(phases))) < lowest:
            best, lowest = phases, crest
    return best


def _norm_and_gradient(
    phases: Array, p: int, lines: NDArray[np.intp], amplitudes: Array, n: int, rotation: Array
) -> tuple[float, Array]:
    """L_p norm of the waves and its derivatives: d wave_i / d phase_k = -a_k sin(2 pi k i / n + phase_k)."""
    wave = wave_of(lines, amplitudes, phases + rotation, n)
    peak = np.abs(wave).max()
    relative = wave / peak  # powers up to 512 of numbers below one: no overflow
    mean = np.mean(relative**p)
    turned = scipy.fft.rfft(relative ** (p - 1))[:, lines].conj() * np.exp(1j * (phases + rotation))
    gradient = -amplitudes * turned.imag.sum(axis=0) * mean ** (1.0 / p - 1.0) / wave.size
    return float(peak * mean ** (1.0 / p)), gradient
