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
    for name, sensor in system.sensors.items():
        if name not in record.output_names or sensor.module not in record.input_names:
            continue
        if record.averaged or _is_late(system, sensor):
            continue
        at_once = _at_once(record[name], record[sensor.module])
        if sensor.read == "after" and at_once < _NOT_THERE:
            raise InputError(
                f"the voltage {name!r} follows a step of the current {sensor.module!r} one row later, in the record "
                f"{record.name!r}", where=f"argument {where}", expected="the voltage at the current of its row",
                remedy=f'If the program reads before it sets the current, say read = "before" in [sensors.{name}]. If '
                       "the current itself acts a row later than it stands, shift it: input_shift = 1 in [record].")
        if sensor.read == "before" and at_once > _NOT_THERE:
            raise InputError(
                f"the voltage {name!r} follows a step of the current {sensor.module!r} in the same row, in the record "
                f"{record.name!r}", where=f"argument {where}", expected="the voltage at the current of the row before",
                remedy=f'The program reads after it sets the current: leave out read = "before" in [sensors.{name}].')


def _is_late(system: System, sensor: Sensor) -> bool:
    """Whether the current itself is late, by a lag or a delay that the system has."""
    drive = system.modules[sensor.module].drive
    return bool(drive.delay or drive.time_constant)


def _at_once(V: Floats, current: Floats) -> float:
    """Share of the voltage of a step that is there in its row, as far as it is sure; nan where no steps tell."""
    steps, moved = np.diff(current), np.diff(V)
    X = np.column_stack([steps[1:], steps[:-1], np.ones(len(steps) - 1)]) if len(steps) > 1 else np.zeros((0, 3))
    told = np.abs(X[:, :2]).max(axis=1, initial=0.0) > STEP * np.ptp(current)
    if np.count_nonzero(told) < _STEPS or np.linalg.matrix_rank(X[told]) < 3:
        return math.nan
    X, y = X[told], moved[1:][told]
    (a, b, c), *_ = np.linalg.lstsq(X, y, rcond=None)
    r = y - X @ (a, b, c)
    if not a + b or len(y) < 4:
        return math.nan
    covariance = np.linalg.inv(X.T @ X)[:2, :2] * float(r @ r) / (len(y) - 3)
    share = a / (a + b)
    slope = np.array([b, -a]) / (a + b) ** 2
    unsure = _SURE * math.sqrt(float(slope @ covariance @ slope))
    return math.nan if unsure > 0.5 * _NOT_THERE else float(share)
