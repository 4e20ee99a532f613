"""Gain, phase, modulus and delay margin of a sampled loop, from its frequency response."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import isfinite

import numpy as np
import scipy

from ._modules import Array
from ._sampled_loop import SampledLoop

KEYS = ("gain", "phase", "modulus", "delay")
UNITS = {"gain": "", "phase": " deg", "modulus": "", "delay": " s"}
POINTS = 300


@dataclass(frozen=True)
class Margins:
    """How far a loop is from instability.

    Parameters
    ----------
    gain : float
        Smallest factor by which its gain may be multiplied, or divided, until it is unstable [-].
    phase : float
        Smallest phase at a gain crossover that makes it unstable [deg].
    modulus : float
        Least distance of L from -1: one over the peak of the sensitivity [-].
    delay : float
        Smallest delay that makes it unstable [s].
    crossover : float
        Gain crossover of the phase margin [rad/s]; nan where there is none.
    stable : bool
        Whether the loop is stable as it is; if not, it has no margin: 1, 0, 0, 0.
    """

    gain: float
    phase: float
    modulus: float
    delay: float
    crossover: float
    stable: bool

    def to_dict(self) -> dict[str, float | bool | None]:
        """Plain values; None where a margin is infinite, or there is no crossover."""
        return {key: value if isfinite(value) else None for key, value in asdict(self).items()}


UNSTABLE = Margins(1.0, 0.0, 0.0, 0.0, float("nan"), False)


def frequencies(loop: SampledLoop, count: int = POINTS) -> Array:
    """Grid from well below the slowest mode up to half the sampling rate [rad/s].

    Parameters
    ----------
    loop : SampledLoop
        Whose modes count.
    count : int
        Number of frequencies.
    """
    h = loop.sample_time
    both = np.concatenate([np.linalg.eigvals(loop.A), loop.poles])
    rates = np.abs(np.log(both[np.abs(both) > 1e-12].astype(complex))) / h
    slowest = rates[rates > 1e-7 / h].min(initial=np.pi / h)
    return np.geomspace(min(0.05 * slowest, 1e-3 * np.pi / h), np.pi / h, count)


def margins(loop: SampledLoop, frequency: Array, response: np.ndarray) -> Margins:
    """Margins of a single loop that is stable when closed.

    Parameters
    ----------
    loop : SampledLoop
        A single loop, for values between the frequencies.
    frequency : ndarray
        Increasing, up to half the sampling rate [rad/s].
    response : ndarray
        L at these frequencies.
    """
    def at(w: float) -> complex:
        return complex(loop.response(np.array([w]))[0, 0, 0])

    crossings = [1 / abs(at(w).real) for w in _roots(frequency, response.imag, lambda w: at(w).imag)
                 if at(w).real < 0]
    if response[-1].real < 0:  # at half the sampling rate L is real
        crossings.append(1 / abs(response[-1].real))
    gain = min((max(factor, 1 / factor) for factor in crossings), default=float("inf"))
    over = _roots(frequency, np.log(np.abs(response)), lambda w: float(np.log(abs(at(w)))))
    angles = [float(np.angle(-at(w))) for w in over]  # from -1, within half a turn
    i = int(np.argmin(np.abs(angles))) if angles else -1
    lags = [(angle % (2 * np.pi)) / w for angle, w in zip(angles, over, strict=True)]
    phase = float(np.degrees(abs(angles[i]))) if angles else float("inf")
    return Margins(gain, phase, _modulus(frequency, response, at), min(lags, default=float("inf")),
                   over[i] if over else float("nan"), True)


def _roots(frequency: Array, values: Array, at: Callable[[float], float]) -> list[float]:
    """Frequencies at which a function changes its sign."""
    change = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0)
    return [float(scipy.optimize.brentq(at, frequency[k], frequency[k + 1], rtol=1e-12)) for k in change]


def _modulus(frequency: Array, response: np.ndarray, at: Callable[[float], complex]) -> float:
    """Least |1 + L|, refined between the frequencies next to it."""
    distance = np.abs(1 + response)
    k = int(np.argmin(distance))
    low, high = frequency[max(k - 1, 0)], frequency[min(k + 1, len(frequency) - 1)]
    found = scipy.optimize.minimize_scalar(lambda w: abs(1 + at(w)), bounds=(low, high), method="bounded",
                                           options={"xatol": 1e-9 * high})
    return float(min(found.fun, distance[k]))


def disk(response: np.ndarray) -> float:
    """Lower bound of the disk margin of all loops at once, from S - 1/2, and a bound of its structured singular value.

    Every loop may at the same time be multiplied by a complex factor (1 + e/2)/(1 - e/2), abs(e) below it.

    Parameters
    ----------
    response : ndarray, shape (n, m, m)
        v/w at frequencies.
    """
    m = response.shape[1]
    if m == 1:
        return float(1.0 / np.abs(1.0 / (1.0 - response) - 0.5).max())
    S = np.linalg.inv(np.eye(m) - response) - 0.5 * np.eye(m)
    return float(1.0 / max(_bound(one) for one in S))


def _bound(M: np.ndarray) -> float:
    """Upper bound of the structured singular value for complex numbers: spectral radius of abs(M), or balanced norm."""
    size = np.abs(M)
    values, vectors = np.linalg.eig(size)
    radius = float(np.abs(values).max())
    right = np.abs(vectors[:, int(np.argmax(np.abs(values)))]) + 1e-12
    left = np.linalg.eig(size.T)
    top = np.abs(left[1][:, int(np.argmax(np.abs(left[0])))]) + 1e-12
    scale = np.sqrt(top / right)  # of Perron vectors
    return min(radius, float(np.linalg.norm(scale[:, None] * M / scale, 2)))
