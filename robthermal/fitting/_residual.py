"""Root mean squares of residuals, and which sensors they count."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from ..thermal import System


def rmse(residuals: Iterable[Floats]) -> float:
    """Root mean square [K] over all readings of one residual or several; infinite where a model ran away (NaN).

    Parameters
    ----------
    residuals : iterable of ndarray
        Residuals of any shapes [K], at least one.
    """
    e = np.concatenate([np.ravel(r) for r in residuals])
    mean_square = float(np.mean(e**2))
    return math.inf if math.isnan(mean_square) else math.sqrt(mean_square)


def counted(system: System, sensors: Iterable[str], all_sensors: Iterable[str]) -> NDArray[np.bool_]:
    """Which sensors an rms over all of them counts: thermometers; voltages only where there is nothing else.

    Parameters
    ----------
    system : System
        System with the sensors.
    sensors : iterable of str
        Names of the sensors of one record.
    all_sensors : iterable of str
        Names of the sensors of all records that are counted together.

    Returns
    -------
    ndarray of bool, shape (n_sensors,)
    """
    warm = np.array([name in system.thermometers for name in sensors], bool)
    return warm if any(name in system.thermometers for name in all_sensors) else ~warm


def rmse_by_sensor(records: Iterable[Mapping[str, Floats]]) -> dict[str, float]:
    """Root mean square residual of every sensor over all records that hold it [K].

    Parameters
    ----------
    records : iterable of mapping
        One {sensor: residual (n,) [K]} per record.
    """
    pooled: dict[str, list[Floats]] = {}
    for record in records:
        for name, values in record.items():
            pooled.setdefault(name, []).append(values)
    return {name: rmse(parts) for name, parts in pooled.items()}
