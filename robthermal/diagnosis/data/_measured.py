"""The data of a diagnosis, checked once on entry: records and frequency responses become data sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...errors import InputError
from ...identify import FrequencyResponse
from ...signals import Record
from ...thermal import System
from ._dataset import DataSet
from ._frequency_data import ResponseData, response_data
from ._record_data import RecordData, record_data

Measured = Record | FrequencyResponse


def as_measured(system: System, data: Measured | Sequence[Measured], where: str,
                operating_point: Mapping[str, float] | None = None) -> list[DataSet]:
    """Check records and frequency responses, records first."""
    items = [data] if isinstance(data, Record | FrequencyResponse) else data
    if not isinstance(items, Sequence) or not any(isinstance(item, FrequencyResponse) for item in items):
        if operating_point is not None and where == "records":  # records may validate what responses taught
            raise InputError("operating_point is given with records", where="argument operating_point",
                             remedy="Leave it out: a record brings its own inputs.")
        return list(record_data(system, _records(data, where), where))
    records = [item for item in items if not isinstance(item, FrequencyResponse)]
    responses = [item for item in items if isinstance(item, FrequencyResponse)]
    checked: list[DataSet] = list(record_data(system, _records(records, where), where)) if records else []
    return checked + [response_data(system, G, where, operating_point or {}) for G in responses]


def _records(data: Measured | Sequence[Measured], where: str) -> Sequence[Record]:
    """Say what is wrong with a response that is only numbers."""
    for item in data if isinstance(data, list | tuple) else [data]:
        if not isinstance(item, Record) and (hasattr(item, "frdata") or isinstance(item, np.ndarray)):
            raise InputError(f"{where} holds a {type(item).__name__}, a response without covariance",
                             where=f"argument {where}", expected="a Record or a FrequencyResponse",
                             remedy="Estimate the response with rt.identify.lpm or lrmp: without its covariance no "
                                    "misfit can be called large.")
    return data  # type: ignore[return-value]  # what else is wrong `as_data` says


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
