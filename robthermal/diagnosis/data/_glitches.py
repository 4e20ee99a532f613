"""Isolated outliers among the readings: found on the record, and left out of every fit.

A spike of a thousand standard deviations would decide any sum of squares. It is told from physics by its neighbors:
heat seldom makes a reading leave and come back within three samples; where it does so in a rhythm (a thermostat, a
pulsed heater), or where the model itself bends as fast, nothing is called a spike, nor a jump of a few steps of the
converter. Voltages that are read while their current changes are left out too, however many they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ..._residual import residual
from ..._rhythm import in_rhythm
from ...errors import Diverged, InputError
from ...fitting import Data, between_currents, quantum, steps_of_current
from ...thermal import System, trajectory

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_WIDTH = 7  # samples: up to three outliers side by side
_FAR = 8.0  # standard deviations
_STEPS = 4.0  # of the converter, which a sound reading may jump
_STEEP = 2.5  # times the spread of the middle three: a bend of the residual
_CURVED = 0.5  # times the largest second difference of the model nearby: where inputs switch, the model may be late
_PASSES = 5
MOST = 0.05
_BESIDE, _HALF = 2, 0.5  # rows from a step of an input, over so much of its range
_MOSTLY = 0.9  # of more outliers than that: they come of the input, which the model follows with the wrong size or late


def counted(system: System, data: Sequence[Data]) -> dict[str, int]:
    """Number of outliers of every sensor that has any; refuse more than a few per cent.

    Voltages that were read while their current changed are not among them.
    """
    readings: dict[str, int] = {}
    found: dict[str, int] = {}
    for one in data:
        if one.missing is not None:
            alone = one.missing & ~steps_of_current(system, one)
            for name, n in zip(one.sensors, alone.sum(axis=0).tolist(), strict=True):
                found[name] = found.get(name, 0) + n
                readings[name] = readings.get(name, 0) + len(one.missing)
    for name, n in found.items():
        if n > MOST * readings[name]:
            raise InputError(f"{n} of {readings[name]} readings of sensor {name!r} are isolated outliers",
                             where="argument records", expected=f"at most {MOST:.0%}",
                             remedy="Mend the sensor or its cable, or leave its column out.")
    return {name: n for name, n in found.items() if n}


def cleaned(system: System, one: Data, noise: Array) -> Data:
    """The record with its isolated outliers marked as missing, and interpolated for display.

    Parameters
    ----------
    system : System
        Nominal model; its simulation is subtracted before outliers are looked for.
    one : Data
        Record with its readings.
    noise : ndarray, shape (n_sensors,)
        Standard deviation of every sensor [K].
    """
    try:
        model = np.asarray(trajectory(system, one.record).readings[:, one.columns], np.float64)
    except Diverged:  # the refit will say so
        return one
    r = residual(one.readings, model)
    steps = np.array([_STEPS * quantum(y) for y in one.readings.T])
    allowed: Array = np.maximum(_FAR * noise, steps) + _CURVED * _curvature(model)
    changing = between_currents(system, one, r, noise)
    missing = changing.copy()
    for _ in range(_PASSES):
        _bridge(r, missing)
        new = outliers(r, allowed) & ~missing
        if not new.any():
            break
        missing |= new
    _bridge(r, missing)
    own = residual(one.readings, model)
    for i in np.flatnonzero(missing.any(axis=0)):
        rows = np.flatnonzero(missing[:, i] & ~changing[:, i])
        kept = rows[in_rhythm(rows, own[rows, i] - r[rows, i])]
        if rows.size > MOST * len(r) and _follow_steps(one, rows):
            kept = rows
        missing[kept, i], r[kept, i] = False, own[kept, i]
    if not missing.any():
        return one
    readings = model + r
    columns = [one.record.output_names.index(name) for name in one.sensors]
    outputs = np.array(one.record.outputs, float)
    outputs[:, columns] = readings
    return replace(one, record=one.record.with_outputs(outputs), readings=readings, missing=missing)


def _follow_steps(one: Data, rows: NDArray[np.intp]) -> bool:
    """Whether most of some rows stand at one distance from steps of one input in one direction."""
    for column in np.asarray(one.record.inputs, float).T:
        moves = np.diff(column, prepend=column[:1]) / max(float(np.ptp(column)), 1e-300)
        for steps in (moves > _HALF, moves < -_HALF):
            near = (steps[np.clip(rows + late, 0, len(steps) - 1)] for late in range(-_BESIDE, _BESIDE + 1))
            if any(float(np.mean(one_distance)) >= _MOSTLY for one_distance in near):
                return True
    return False


def _bridge(r: Array, missing: Mask) -> None:
    """Interpolate residuals (n, n_sensors) over missing readings."""
    time = np.arange(len(r))
    for i in np.flatnonzero(missing.any(axis=0)):
        good = ~missing[:, i]
        r[:, i] = np.interp(time, time[good], r[good, i])


def outliers(r: Array, allowed: Array) -> Mask:
    """Where residuals (n, n_sensors) leave the median of their neighbors by more than is allowed."""
    window = np.sort(_windows(r), axis=2)
    middle, half = window[..., _WIDTH // 2], _WIDTH // 2
    return np.asarray(np.abs(r - middle) > allowed + _STEEP * (window[..., half + 1] - window[..., half - 1]))


def _curvature(model: Array) -> Array:
    """Largest second difference of a model nearby, (n, n_sensors) [K]."""
    bend = np.abs(np.diff(model, 2, axis=0, prepend=model[:1], append=model[-1:]))
    return np.asarray(_windows(bend).max(axis=2))


def _windows(signal: Array) -> Array:
    """Neighbors of every sample, (n, n_sensors, width)."""
    half = _WIDTH // 2
    return np.asarray(sliding_window_view(np.pad(signal, ((half, half), (0, 0)), mode="reflect"), _WIDTH, axis=0))
