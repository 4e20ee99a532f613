"""What was measured: records and frequency responses, told apart once, where they come in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..identify import FrequencyResponse
from ..signals import Record

Measured = Record | FrequencyResponse


def measured_of(data: Measured | Sequence[Measured], where: str) -> tuple[list[Record], list[FrequencyResponse]]:
    """Records and frequency responses, each in their order.

    Parameters
    ----------
    data : Record, FrequencyResponse, or sequence of them
        What the user gave.
    where : str
        Name of the argument, for messages.

    Raises
    ------
    InputError
        Nothing at all, or something else, also a response that is only numbers.
    """
    items = [data] if isinstance(data, Record | FrequencyResponse) else data
    listed: list[object] = list(items) if isinstance(items, list | tuple) else [items]
    for item in listed:
        if not isinstance(item, Record | FrequencyResponse):
            raise _refusal(item, where)
    if not listed:
        raise InputError(f"{where} is an empty list", where=f"argument {where}",
                         expected="records, frequency responses or both",
                         remedy="Read one with rt.read_record(path, system) or rt.identify.read_response(path).")
    records = [item for item in listed if isinstance(item, Record)]
    return records, [item for item in listed if isinstance(item, FrequencyResponse)]


def _refusal(item: object, where: str) -> InputError:
    if hasattr(item, "frdata") or isinstance(item, np.ndarray):
        return InputError(f"{where} holds a {type(item).__name__}, a response without covariance",
                          where=f"argument {where}", expected="a Record or a FrequencyResponse",
                          remedy="Estimate the response with rt.identify.lpm or lrmp: without its covariance no misfit "
                                 "can be called large.")
    return InputError(f"{where} holds a {type(item).__name__}", where=f"argument {where}",
                      expected="a Record, a FrequencyResponse, or a list of them",
                      remedy="Read one with rt.read_record(path, system) or rt.identify.read_response(path).")
