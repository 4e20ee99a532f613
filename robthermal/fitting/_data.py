"""Records to calibrate on: checked, with the sensors each of them holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from ..errors import InputError
from ..signals import Record
from ..thermal import System
from ._voltage_rows import refuse_voltage_of_another_row


@dataclass(frozen=True)
class Data:
    """One record and the sensors of the system that it holds.

    Parameters
    ----------
    record : Record
        Measured inputs and readings.
    sensors : tuple of str
        Sensors of the system among its outputs, in the system's order.
    columns : ndarray of int
        Their places in `System.sensor_names`.
    readings : ndarray, shape (n, n_sensors)
        What they read [K, or V].
    missing : ndarray of bool, shape (n, n_sensors), optional
        Readings that count for nothing.
    """

    record: Record
    sensors: tuple[str, ...]
    columns: NDArray[np.intp]
    readings: Floats
    missing: NDArray[np.bool_] | None = None

    def where_read(self, values: Floats) -> Floats:
        """Residuals (n, n_sensors, ...) or their derivatives, zero for the readings that count for nothing.

        Parameters
        ----------
        values : ndarray, shape (n, n_sensors, ...)
            Of every reading of the record.
        """
        if self.missing is None:
            return values
        return np.where(self.missing.reshape(*self.missing.shape, *[1] * (values.ndim - 2)), 0.0, values)

    def of_sensor(self, values: Floats, place: int) -> Floats:
        """Values (m,) of one sensor, of the readings that count.

        Parameters
        ----------
        values : ndarray, shape (n, n_sensors)
            Of every reading of the record.
        place : int
            Place of the sensor in `sensors`.
        """
        return values[:, place] if self.missing is None else values[~self.missing[:, place], place]

    @property
    def label(self) -> str:
        """Name for tables."""
        return self.record.name or "record"


def as_data(system: System, data: Record | Sequence[Record], where: str) -> list[Data]:
    """Check one record or several."""
    records = [data] if isinstance(data, Record) else data
    if not isinstance(records, Sequence) or not records or not all(isinstance(r, Record) for r in records):
        kind = type(data).__name__ if not isinstance(data, Sequence) else f"list of {len(data)}"
        raise InputError(f"{where} is a {kind}", where=f"argument {where}", expected="a Record or a list of Records",
                         remedy="Read one with rt.read_record(path, system).")
    return [_one(system, record, where) for record in records]


def _one(system: System, record: Record, where: str) -> Data:
    sensors = tuple(name for name in system.sensor_names if name in record.output_names)
    if not sensors:
        raise InputError(f"the record {record.name!r} has no column of any sensor", where=f"argument {where}",
                         expected="one of " + (", ".join(system.sensor_names) or "(the system has no sensor)"),
                         remedy="Name the output columns like the sensors of the system.")
    readings = np.column_stack([record[name] for name in sensors])
    low = np.where([system.sensors[name].quantity == "temperature" for name in sensors], readings.min(axis=0), np.inf)
    if low.min() < 150.0:
        raise InputError(f"sensor {sensors[int(low.argmin())]!r} reads {low.min():.6g} K", where=f"argument {where}",
                         expected="kelvin inside a Record", remedy="Add 273.15, or read the file with its unit.")
    refuse_voltage_of_another_row(system, record, where)
    return Data(record, sensors, np.array([system.sensor_names.index(name) for name in sensors], np.intp), readings)


def refuse_same(training: list[Data], validation: list[Data]) -> None:
    """A record validates nothing that it was fitted to."""
    for one in validation:
        for other in training:
            a, b = one.record, other.record
            if (one.sensors == other.sensors and np.array_equal(a.inputs, b.inputs)
                    and np.array_equal(one.readings, other.readings)):
                raise InputError(f"the validation record {a.name!r} is the training record",
                                 where="argument validation", expected="data the fit has not seen",
                                 remedy="Split a record with record.split(time), or measure another.")


def refuse_short(n_numbers: int, n_unknown: int) -> None:
    """More readings, and real numbers of responses, than unknowns."""
    if n_numbers <= n_unknown:
        raise InputError(f"{n_numbers} readings for {n_unknown} unknowns", where="argument data",
                         expected="more readings than parameters",
                         remedy="Use a longer record, or calibrate fewer parameters.")
