"""Logs whose values are means over a step: what their stamps say, as a record."""

from __future__ import annotations

from ..errors import InputError
from ._record import Record
from ._stated import MEANS, Averaged


def as_means(record: Record, averaged: Averaged) -> Record:
    """Take the values of a log as means over a step instead of as readings at their stamps.

    Readings then stand where their step ends, inputs where theirs begins: rows of `Record`.

    Parameters
    ----------
    record : Record
        Rows as they stand in the log.
    averaged : {"before", "after", "readings"}
        All values are means over the step before their stamp, or after it (the first input and the last reading go);
        or readings alone are means over the step before, and inputs hold from their stamp on.

    Returns
    -------
    Record
        With `averaged` set.

    Raises
    ------
    InputError
        A record of means already, another word, fewer than three rows.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> log = rt.Record(sample_time=60.0, inputs=[1.0, 2.0, 3.0], outputs=[300.0, 301.0, 302.0], input_names=["q"],
    ...                 output_names=["T1"])
    >>> record = rt.signals.as_means(log, "after")
    >>> record.start_time, record["q"].tolist(), record["T1"].tolist()
    (60.0, [2.0, 3.0], [300.0, 301.0])
    """
    if averaged not in MEANS:
        raise InputError(f"averaged is {averaged!r}", where="argument averaged", expected=" or ".join(map(repr, MEANS)))
    if record.averaged:
        raise InputError("the record holds means already", where="argument record", expected="rows as in the log")
    if averaged == "readings":
        return record.changed(averaged=True)
    if len(record) < 3:
        raise InputError(f"the record has {len(record)} rows", where="argument record", expected="three or more",
                         remedy="The first input and the last reading have no other half.")
    start = record.start_time + record.sample_time * (averaged == "after")
    return record.changed(inputs=record.inputs[1:], outputs=record.outputs[:-1], start_time=start, averaged=True)
