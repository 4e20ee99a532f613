"""Whether the voltage of a module belongs to the current of its row: a step of the current shows in it at once.

A voltage is S ΔT + R I. From row to row ΔT moves little, so that ΔV(k) = a ΔI(k) + b ΔI(k - 1), where a is R and b
what the faces answer within a sample, less than ZT R. A program that reads before it sets the current leaves a = 0 and
b = R and more instead. Thermometers are the same, whichever way it is.
"""

from __future__ import annotations

import math

import numpy as np

from .._arrays import Floats
from ..errors import InputError
from ..signals import Record
from ..thermal import Sensor, System

STEP = 0.02  # of the range of a current: smaller changes are no steps
_STEPS = 4  # rows with a step of the current, at least
_NOT_THERE = 0.2  # of the step's voltage: what a module cannot leave out at once, nor show late
_SURE = 4.0  # standard deviations
_OWN = 0.1  # of the squares of a difference, that does not follow from the other one and from the current


def refuse_voltage_of_another_row(system: System, record: Record, where: str) -> None:
    """Refuse records whose voltages go with the currents of other rows than their sensors say.

    Parameters
    ----------
    system : System
        With its modules and sensors.
    record : Record
        Record with currents, and perhaps with voltages.
    where : str
        Argument that the record was given as.
    """
    label = f"the record {record.name!r}" if record.name else "the record"
    for name, sensor in system.sensors.items():
        if name not in record.output_names or sensor.module not in record.input_names:
            continue
        if record.averaged or _is_late(system, sensor):
            continue
        ohms, at_once = _step(record[name], record[sensor.module])
        if ohms < 0.0:
            raise InputError(
                f"the voltage {name!r} falls where the current {sensor.module!r} rises, in {label}",
                where=f"argument {where}", expected="a voltage that is positive where positive current enters",
                remedy=f"One of them has the other sign: give its column scale = -1 in [columns]. A positive current "
                       f"warms the hot face of {sensor.module}.")
        if sensor.read == "after" and at_once < _NOT_THERE:
            raise InputError(
                f"the voltage {name!r} follows a step of the current {sensor.module!r} one row later, in "
                f"{label}", where=f"argument {where}", expected="the voltage at the current of its row",
                remedy=f'If the program reads before it sets the current, say read = "before" in [sensors.{name}]. If '
                       "the current itself acts a row later than it stands, shift it: input_shift = 1 in [record]. If "
                       f"its supply is late, give [modules.{sensor.module}.drive] a delay or a time_constant.")
        if sensor.read == "before" and at_once > _NOT_THERE:
            raise InputError(
                f"the voltage {name!r} follows a step of the current {sensor.module!r} in the same row, in "
                f"{label}", where=f"argument {where}", expected="the voltage at the current of the row before",
                remedy=f'The program reads after it sets the current: leave out read = "before" in [sensors.{name}].')


def _is_late(system: System, sensor: Sensor) -> bool:
    """Whether the current itself is late, by a lag or a delay that the system has."""
    drive = system.modules[sensor.module].drive
    return bool(drive.delay or drive.time_constant)


def _step(V: Floats, current: Floats) -> tuple[float, float]:
    """Voltage of a step of 1 A [Ω], and the share of it that is there in its row; nan as far as no steps tell.

    What the current pumps meanwhile goes with the current itself. Of a slow current the differences follow from one
    another and from it, and nothing is told.
    """
    steps, moved = np.diff(current), np.diff(V)[1:]
    if len(steps) < 2:
        return math.nan, math.nan
    X = np.column_stack([steps[1:], steps[:-1], current[1:-1], np.ones(len(moved))])
    told = np.abs(X[:, :2]).max(axis=1) > STEP * np.ptp(current)
    X, y = X[told], moved[told]
    if np.count_nonzero(told) < _STEPS + X.shape[1] or not _apart(X):
        return math.nan, math.nan
    found, *_ = np.linalg.lstsq(X, y, rcond=None)
    (a, b), r = found[:2], y - X @ found
    covariance = np.linalg.inv(X.T @ X)[:2, :2] * float(r @ r) / (len(y) - len(found))
    ohms = float(a + b)
    if abs(ohms) <= _SURE * math.sqrt(float(covariance.sum())):
        return math.nan, math.nan
    slope = np.array([b, -a]) / ohms**2
    unsure = _SURE * math.sqrt(float(slope @ covariance @ slope))
    return ohms, float(a / ohms) if unsure < 0.5 * _NOT_THERE else math.nan


def _apart(X: Floats) -> bool:
    """Whether neither of the first two columns follows from the others, which are not all zero."""
    for i in range(2):
        others = np.delete(X, i, axis=1)
        left = X[:, i] - others @ np.linalg.lstsq(others, X[:, i], rcond=None)[0]
        if not left @ left > _OWN * (X[:, i] @ X[:, i]):
            return False
    return np.linalg.matrix_rank(X) == X.shape[1]
