"""Voltages that were read while the current of their module changed: they belong to neither of two currents.

After a step the current is held, and what a model has wrong goes on smoothly from row to row; the reading of the row
of the step stands apart where the voltmeter averages over it, or the channels of a logger are read one by one. A part
of the module that follows within a row, and is not in the model, does the same; the model cannot use that reading.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .._residual import residual
from ..errors import Diverged
from ..thermal import System, trajectory
from ._data import Data
from ._voltage_rows import STEP

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_FAR = 8.0  # standard deviations of a difference of three readings
_NORMAL = 1.4826  # standard deviations in the median of the size of what is normally distributed
_MOSTLY = 0.5  # of the steps of a current: then of none the reading is trusted
_FASTER = 2.0  # times the next difference: an answer that decays by more than two thirds from row to row


def steps_of_current(system: System, one: Data) -> Mask:
    """Rows (n, n_sensors) of voltages in which their current has just changed, the first one among them.

    Parameters
    ----------
    system : System
        With the modules of its voltages.
    one : Data
        Record with currents and voltages.
    """
    out = np.zeros(one.readings.shape, bool)
    for i, name in enumerate(one.sensors):
        sensor = system.sensors[name]
        if sensor.module in one.record.input_names:
            late, current = int(sensor.read == "before"), one.record[sensor.module]
            moves = np.abs(np.diff(current, prepend=0.0))  # before the record it was off, as far as is known
            out[late:, i] = (moves > STEP * np.ptp(current, axis=0))[:len(out) - late]
    return out


def between_currents(system: System, one: Data, r: Array, noise: Array) -> Mask:
    """Rows (n, n_sensors) of voltages that were read while their current changed.

    Parameters
    ----------
    system : System
        With the modules of its voltages.
    one : Data
        Record with currents and voltages.
    r : ndarray, shape (n, n_sensors)
        Measured less modelled readings [K or V].
    noise : ndarray, shape (n_sensors,)
        Standard deviation of every sensor [K or V], as far as it is known.
    """
    steps = steps_of_current(system, one)
    held = steps[:-2] & ~steps[1:-1] & ~steps[2:]
    first, second = r[:-2] - r[1:-1], r[1:-1] - r[2:]
    bends, own = np.abs(first - second), np.abs(np.diff(one.readings - r, 2, axis=0))
    usual = np.maximum(np.sqrt(6.0) * noise, _NORMAL * np.median(bends, axis=0)) if len(bends) else noise
    apart = bends > _FAR * usual + _FASTER * np.abs(second) + own
    found = np.concatenate([held & apart, np.zeros((min(2, len(r)), r.shape[1]), bool)])
    mostly = found.sum(axis=0) > _MOSTLY * np.maximum(held.sum(axis=0), 1)
    return np.where(mostly, steps, found)  # the others are of small steps, or soon followed by another one


def without_steps(system: System, one: Data, noise: Mapping[str, float]) -> Data:
    """The record with voltages that were read while their current changed marked as missing.

    Parameters
    ----------
    system : System
        Model that is subtracted before.
    one : Data
        Record with currents and voltages.
    noise : mapping
        Standard deviation of sensors [K or V]; 0 where it is unknown.
    """
    if not steps_of_current(system, one).any():
        return one
    try:
        model = np.asarray(trajectory(system, one.record).readings[:, one.columns], np.float64)
    except Diverged:  # the fit will say so
        return one
    levels = np.array([noise.get(name, 0.0) for name in one.sensors])
    missing = between_currents(system, one, residual(one.readings, model), levels)
    return replace(one, missing=missing) if missing.any() else one


def read_while_changing(system: System, data: Sequence[Data]) -> list[str]:
    """Of which voltages readings were left out because their current changed meanwhile, a sentence each.

    Parameters
    ----------
    system : System
        Nominal system of the records.
    data : sequence of Data
        Records without their outliers.
    """
    rows = dict.fromkeys(system.sensors, 0)
    for one in data:
        if one.missing is not None:
            for name, n in zip(one.sensors, (one.missing & steps_of_current(system, one)).sum(axis=0), strict=True):
                rows[name] += int(n)
    return [f"{name} stands apart in {n} row{'s' * (n > 1)} in which the current of {system.sensors[name].module} "
            "changes, as if read meanwhile: left out." for name, n in rows.items() if n]
