"""Linearize a model beside any data set, and find the records among what is linearized."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...errors import InputError
from ...thermal import System, Trajectory, trajectory
from ..data import DataSet, RecordData, ResponseData
from ._linearized import Linearized
from ._linearized_record import LinearizedRecord
from ._linearized_response import linearized_response


def linearize(system: System, one: DataSet, tolerance: float = 1e-4, late: float = 0.0) -> Linearized:
    """Simulate a record, or compute a frequency response, and prepare the linearization there.

    Parameters
    ----------
    system : System
        Model with its initial temperatures.
    one : DataSet
        Record or frequency response.
    tolerance : float
        Tolerance of the simulation [K].
    late : float
        Of a record of means: how many steps these are late [-].
    """
    if isinstance(one, ResponseData):
        return linearized_response(system, one)
    if isinstance(one, RecordData):
        path = linearized_record(system, one, trajectory(system, one.record, tolerance=tolerance))
        return replace(path, late=late) if late else path
    raise TypeError(f"{type(one).__name__} is neither a record nor a frequency response")


def linearized_records(paths: Sequence[Linearized]) -> tuple[LinearizedRecord, ...]:
    """The linearized records, without the frequency responses.

    Parameters
    ----------
    paths : sequence of Linearized
        Models beside all data sets of a fit.
    """
    return tuple(path for path in paths if isinstance(path, LinearizedRecord))


def linearized_record(system: System, one: RecordData, run: Trajectory | None = None) -> LinearizedRecord:
    """Simulate a record, unless it has been, and prepare its linearization."""
    run = trajectory(system, one.record) if run is None else run
    columns = [one.record[name] if name in one.record.input_names
               else np.full(len(one.record), system.ambients[name].temperature) for name in system.exogenous_names]
    if not np.isfinite(run.lumps).all():
        raise InputError("the simulation is not finite", where="argument system", remedy="Check its parameters.")
    return LinearizedRecord(system, one, np.asarray(run.lumps, np.float64), np.asarray(run.readings, np.float64),
                            np.column_stack(columns), run)
