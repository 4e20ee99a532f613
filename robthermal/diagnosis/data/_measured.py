"""The data of a diagnosis, checked once on entry: records and frequency responses become data sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...errors import InputError
from ...fitting import Measured, measured_of
from ...thermal import System
from ._dataset import DataSet
from ._frequency_data import ResponseData, response_data
from ._record_data import RecordData, record_data


def as_measured(system: System, data: Measured | Sequence[Measured], where: str,
                operating_point: Mapping[str, float] | None = None) -> list[DataSet]:
    """Check records and frequency responses, records first."""
    records, responses = measured_of(data, where)
    if operating_point is not None and not responses and where == "records":  # records may validate responses
        raise InputError("operating_point is given with records", where="argument operating_point",
                         remedy="Leave it out: a record brings its own inputs.")
    checked: list[DataSet] = list(record_data(system, records, where)) if records else []
    return checked + [response_data(system, G, where, operating_point or {}) for G in responses]


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
