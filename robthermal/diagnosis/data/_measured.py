"""The data of a diagnosis, checked once on entry: records and frequency responses become data sets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ...errors import InputError
from ...fitting import Measured, measured_of
from ...thermal import System
from ._dataset import DataSet
from ._frequency_data import ResponseData, response_data
from ._record_data import RecordData, record_data

_MOST = 400_000  # readings: about an hour and four gigabytes
_ENOUGH = 50_000  # minutes


def as_measured(system: System, data: Measured | Sequence[Measured], where: str,
                operating_point: Mapping[str, float] | None = None) -> list[DataSet]:
    """Check records and frequency responses, records first."""
    records, responses = measured_of(data, where)
    if operating_point is not None and not responses and where == "records":  # records may validate responses
        raise InputError("operating_point is given with records", where="argument operating_point",
                         remedy="Leave it out: a record brings its own inputs.")
    checked: list[DataSet] = list(record_data(system, records, where)) if records else []
    return checked + [response_data(system, G, where, operating_point or {}) for G in responses]


def with_recorded_units(system: System, data: Measured | Sequence[Measured]) -> System:
    """The system with the units of recorded columns that heat nothing in it, where all records agree.

    A heat in proportion to such a column makes it a heater, and the file with that effect has to say its unit.

    Parameters
    ----------
    system : System
        Nominal system to diagnose.
    data : Record, FrequencyResponse, or list of them
        Data of the fit, with the units of their columns.
    """
    records, _ = measured_of(data, "records")
    inputs = dict(system.inputs)
    for name, heater in system.inputs.items():
        units = {one.units.get(name) for one in records}
        if heater.gain == 0.0 and heater.unit is None and len(units) == 1 and (unit := units.pop()):
            inputs[name] = heater.model_copy(update={"unit": unit})
    return system.model_copy(update={"inputs": inputs})


def refuse_long(data: Measured | Sequence[Measured], where: str) -> None:
    """Refuse records whose fits would take hours and fill the memory, and say how many samples to average.

    Parameters
    ----------
    data : Record, FrequencyResponse, or list of them
        Data of a fit.
    where : str
        Argument that holds them.
    """
    records, _ = measured_of(data, where)
    readings = sum(one.outputs.size for one in records)
    if readings > _MOST:
        of = math.ceil(readings / _ENOUGH)
        raise InputError(
            f"the records hold {sum(map(len, records))} samples, {readings} readings: to search them would take hours "
            "and more memory than most computers have", where=f"argument {where}", expected=f"at most {_MOST} readings",
            remedy="Take a part of them; or, where inputs hold over many samples and the machine is slow, average "
                   f"them: means_of = {of} in [record] of the file, or rt.signals.block_means(record, {of}).")


def records_of(data: Sequence[DataSet]) -> list[RecordData]:
    """The records among data sets.

    Parameters
    ----------
    data : sequence of DataSet
        Data of a fit.
    """
    return [one for one in data if isinstance(one, RecordData)]


def responses_of(data: Sequence[DataSet]) -> list[ResponseData]:
    """The frequency responses among data sets.

    Parameters
    ----------
    data : sequence of DataSet
        Data of a fit.
    """
    return [one for one in data if isinstance(one, ResponseData)]


def without_outliers(system: System, data: Sequence[DataSet], noise: Mapping[str, float]) -> list[DataSet]:
    """Data sets with their isolated outliers marked as missing.

    Parameters
    ----------
    system : System
        Nominal model of the data.
    data : sequence of DataSet
        Data of a fit; frequency responses are left as they are.
    noise : mapping
        Standard deviation of every sensor [K].
    """
    return [one.without_outliers(system, noise) for one in data]
