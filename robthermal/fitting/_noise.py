"""Weights and losses: what a residual of one kelvin, or one volt, is worth."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Literal

import numpy as np

from .._arrays import Floats
from ..errors import InputError
from ..thermal import System
from ._data import Data

Loss = Literal["linear", "soft_l1", "huber"]
LOSSES = ("linear", "soft_l1", "huber")
_SMALLEST = {"K": 1e-4, "V": 1e-6}  # the simulation's own truncation (of modules of 10 mV/K): nothing is known better
_STILL = 0.1  # part of the readings that equal the one before, where readings are rounded to steps
_SOON = 10  # samples from one resting reading to the next: farther apart, the temperature has moved
_STEPS = 5  # of them at least
_TUNING = 1.345  # Huber (1964): 95 % efficient for Gaussian noise


def declared_noise(system: System, data: list[Data], noise: Mapping[str, float] | float | None) -> dict[str, float]:
    """Standard deviation of every sensor in the data [K or V]; 0 where it has to be estimated."""
    used = [name for name in system.sensor_names if any(name in one.sensors for one in data)]
    given = _given(used, noise)
    out = {}
    for name in used:
        out[name] = given.get(name, system.sensors[name].noise)
        if name not in given and out[name]:
            out[name] = max(out[name], floor(data, name, smallest_noise(system, name)))
    return out


def _given(used: list[str], noise: Mapping[str, float] | float | None) -> dict[str, float]:
    if noise is None:
        return {}
    given = dict(noise) if isinstance(noise, Mapping) else dict.fromkeys(used, noise)
    for name, value in given.items():
        if name not in used:
            raise InputError(f"there is no sensor {name!r} in the data", where="argument noise",
                             expected="one of " + ", ".join(used))
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value <= 0:
            raise InputError(f"the noise of {name!r} is {value!r}", where="argument noise",
                             expected="a positive standard deviation [K, or V of a voltage]",
                             remedy="Leave it out to have it estimated from the residuals.")
    return given


def quantum(readings: Floats) -> float:
    """Step of a quantized reading [K or V], 0 if it is not quantized."""
    rounded = np.round(readings, 9)
    return _step_between_rests(rounded) or _usual_gap(rounded)


def _step_between_rests(readings: Floats) -> float:
    """Step from one resting reading to the next, 0 where they are neither even nor between the same few readings.

    A log with jitter is interpolated to its grid: where two neighbors are equal they are still what was read.
    """
    still = np.flatnonzero(readings[1:] == readings[:-1]) + 1
    if still.size < _STILL * readings.size:
        return 0.0
    steps = np.abs(np.diff(readings[still]))
    steps = steps[(steps > 0.0) & (np.diff(still) <= _SOON)]
    if steps.size < _STEPS:
        return 0.0
    step = float(np.quantile(steps, 0.25, method="lower"))
    even = np.allclose(steps / step, np.round(steps / step), atol=1e-4)
    return step if even or 2 * np.unique(readings[still]).size <= steps.size + 1 else 0.0


def _usual_gap(readings: Floats) -> float:
    """Usual gap between neighboring values, each counted as often as it was read; 0 where few values repeat."""
    levels, counts = np.unique(readings, return_counts=True)
    if levels.size < 2 or 4 * levels.size > readings.size:
        return 0.0
    gaps = np.diff(levels)
    weights = np.minimum(counts[1:], counts[:-1])  # a fast rise skips levels: a gap there is no step
    order = np.argsort(gaps)
    total = np.cumsum(weights[order])
    return float(gaps[order][np.searchsorted(total, 0.5 * total[-1])])


def smallest_noise(system: System, name: str) -> float:
    """Below this, the simulation's own error is larger than the noise of a sensor [K or V]."""
    return _SMALLEST[system.sensors[name].unit]


def floor(data: list[Data], name: str, smallest: float) -> float:
    """Least credible noise of a sensor [K or V]: rounding to steps q is an error of q/√12."""
    steps = [quantum(one.readings[:, one.sensors.index(name)]) for one in data if name in one.sensors]
    return max(max(steps) / math.sqrt(12.0), smallest)


def estimated_noise(data: list[Data], residuals: list[Floats], name: str, loss: Loss, smallest: float) -> float:
    """Noise of a sensor from its residuals [K or V]: root mean square, or its robust equivalent under a robust loss."""
    own = [one.of_sensor(r, one.sensors.index(name)) for one, r in zip(data, residuals, strict=True)
           if name in one.sensors]
    e = np.concatenate(own)
    scale = math.sqrt(float(np.mean(e**2))) if loss == "linear" else 1.4826 * float(np.median(np.abs(e)))
    return max(scale, floor(data, name, smallest))


def score(e: Floats, loss: Loss) -> Floats:
    """Derivative ψ of the loss at weighted residuals."""
    if loss == "linear":
        return e
    if loss == "huber":
        return np.clip(e, -_TUNING, _TUNING)
    return e / np.sqrt(1.0 + (e / _TUNING) ** 2)


def score_slope(e: Floats, loss: Loss) -> Floats:
    """Derivative of `score`."""
    if loss == "linear":
        return np.ones_like(e)
    if loss == "huber":
        return (np.abs(e) <= _TUNING).astype(float)
    return (1.0 + (e / _TUNING) ** 2) ** -1.5


def scipy_loss(loss: Loss, n_readings: int) -> str | Callable[[Floats], Floats]:
    """Loss for `scipy.optimize.least_squares` that leaves the priors, which follow the readings, quadratic."""
    if loss == "linear":
        return "linear"

    def rho(z: Floats) -> Floats:
        out = np.array([z, np.ones_like(z), np.zeros_like(z)])
        y = z[:n_readings] / _TUNING**2
        root = np.sqrt(1.0 + y) if loss == "soft_l1" else np.sqrt(np.maximum(y, 1.0))
        out[0, :n_readings] = 2.0 * _TUNING**2 * (root - 1.0) if loss == "soft_l1" \
            else np.where(y <= 1.0, z[:n_readings], _TUNING**2 * (2.0 * root - 1.0))
        out[1, :n_readings] = 1.0 / root
        far = -0.5 / (root**3 * _TUNING**2)
        out[2, :n_readings] = far if loss == "soft_l1" else np.where(y <= 1.0, 0.0, far)
        return out

    return rho
