"""A single period in what is left, faster than periodic heats that are tried: something cycles and is not recorded."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..effects import effects
from ..fit import Refit
from ..path import LinearizedRecord

Array = NDArray[np.float64]
_TRIED = "periodic_load"  # slower ones are tried as periodic heats
_LOBE = 2  # bins on each side that a sine fills behind a Hann window
_MOST = 0.5  # of the power of what is left at a thermometer
_DRIVEN = 0.02  # of the power of an input: it cycles as often


@dataclass(frozen=True)
class Line:
    """A single period that holds most of what is left at a thermometer.

    Parameters
    ----------
    sensor : str
        Thermometer with most of it.
    period : float
        Period of the sine in the residual [s].
    share : float
        Part of the power of the residual at that thermometer [-].
    """

    sensor: str
    period: float
    share: float

    def __str__(self) -> str:
        period = float(f"{self.period:.3g}")  # three digits, without an exponent
        return (f"{100 * self.share:.0f} % of what is left at {self.sensor} has a single period, {period:g} s, "
                "which no recorded input has: look for what switches or swings so often (a chiller, a thermostat, a "
                "pump), and record it.")


def single_period(fit: Refit) -> Line | None:
    """The period that holds most of what is left at one thermometer, in the longest record; None if there is none.

    Parameters
    ----------
    fit : Refit
        Fit whose residuals are examined.
    """
    path = max(fit.records, key=lambda one: len(one.residual))
    found = [line for name, r in zip(path.one.sensors, path.residual.T, strict=True)
             if name in fit.system.thermometers and (line := _of_sensor(path, name, r)) is not None]
    return max(found, key=lambda line: line.share, default=None)


def _of_sensor(path: LinearizedRecord, name: str, r: Array) -> Line | None:
    power, first = _spectrum(r), _cycles_tried(path)
    if power.size < 2 * first or not power.any():
        return None
    peak = first + int(np.argmax(power[first:power.size - _LOBE]))
    own = slice(peak - _LOBE, peak + _LOBE + 1)
    share = float(power[own].sum() / power.sum())
    if share < _MOST or any(_share(u, own) > _DRIVEN for u in path.one.record.inputs.T):
        return None
    bins = np.arange(power.size)[own]
    return Line(name, len(r) * path.h / float(power[own] @ bins / power[own].sum()), share)


def _cycles_tried(path: LinearizedRecord) -> int:
    """Cycles in the record beyond which no periodic heat is tried."""
    grid = effects()[_TRIED].quantities[1].grid
    periods = grid(path, ()) if callable(grid) else grid
    return math.ceil(path.span / min(periods))


def _share(u: Array, own: slice) -> float:
    """Part of the power of an input at these frequencies; nothing of one that stands still."""
    power = _spectrum(u)
    return float(power[own].sum() / power.sum()) if np.ptp(u) > 0.0 else 0.0


def _spectrum(x: Array) -> Array:
    return np.asarray(np.abs(np.fft.rfft((x - x.mean()) * np.hanning(len(x)))) ** 2, np.float64)
