"""Columns beside the plant: the reference of a closed loop, a second sensor of a noisy input."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...identify import FrequencyResponse, closed_loop, errors_in_variables
from ...signals import Import, Record, read_records
from ...thermal import System
from ._import import ReadTable

Array = NDArray[np.float64]
_SHORTEST = 2  # samples of a part


@contextmanager
def beside_reference(names: Sequence[str]) -> Iterator[None]:
    """Notes of reading the plant, without the columns that are read as reference: only to the plant they are unknown.

    Parameters
    ----------
    names : sequence of str
        Columns of the reference.
    """
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        yield
    for one in said:
        text = _without(str(one.message), names)
        if text:
            warnings.warn(text, one.category, stacklevel=3)


def _without(note: str, names: Sequence[str]) -> str:
    """A note on unknown columns without some of them; empty where none is left, any other note as it is."""
    file, unknown, columns = note.partition("unknown columns, not read: ")
    if not unknown:
        return note
    left = [one for one in columns.split(", ") if re.sub(r"\s*[\[(].*", "", one.strip("'\"")) not in names]
    return f"{file}{unknown}{', '.join(left)}" if left else ""


def import_report_beside(path: Path, system: System | None, tables: Sequence[ReadTable], *, inputs: Sequence[str],
                         outputs: Sequence[str], beside: Sequence[str]) -> Import:
    """How a file of a response was read: the columns of the plant, and those that are read beside it.

    Parameters
    ----------
    path : Path
        Measured file of the response.
    system : System or None
        Names the columns of the plant; None: `inputs` and `outputs` are all of them.
    tables : sequence
        How the file is read.
    inputs, outputs : sequence of str
        Columns of the plant, where there is no system.
    beside : sequence of str
        Columns of a reference, or of second instruments.

    Returns
    -------
    Import

    Raises
    ------
    InputError
        As `rt.read_records`.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> _ = Path("loop.csv").write_text("time,u,y,r\\n0,1,20,1\\n1,2,21,2\\n2,3,22,3\\n3,3,22,2\\n4,2,23,1\\n")
    >>> found = import_report_beside(Path("loop.csv"), None, (), inputs=["u"], outputs=["y"], beside=["r"])
    >>> [(column.column, column.role) for column in found.columns]
    [('time', 'time'), ('u', 'input'), ('y', 'sensor'), ('r', 'input')]
    """
    plant: dict[str, Any] = {"system": system} if system is not None else {"inputs": inputs, "outputs": outputs}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # estimating the response has said all of it
        report = _import_of(read_records(path, tables=tables, **plant))
        also = {one.column: one for one in _import_of(read_records(path, inputs=list(beside), tables=tables)).columns
                if one.name in beside} if beside else {}
    return replace(report, columns=tuple(also.get(one.column, one) if one.role == "unused" else one
                                         for one in report.columns))


def _import_of(parts: Sequence[Record]) -> Import:
    return cast(Import, parts[0].imported)  # of a file there always is one


def with_reference(path: Path, records: Sequence[Record], names: Sequence[str],
                   tables: Sequence[ReadTable]) -> Iterator[tuple[Record, Array]]:
    """Every stretch of a file in which plant and reference were both measured.

    Parameters
    ----------
    path : Path
        Measured file of a closed loop.
    records : sequence of Record
        Uninterrupted parts of the plant's columns.
    names : sequence of str
        Columns of the reference, which the system need not know; in any unit.
    tables : sequence
        How the file is read.

    Yields
    ------
    record : Record
        Plant inputs and outputs.
    reference : ndarray, shape (n, n_r)
        Reference at the same samples.
    """
    found = False
    for reference in read_records(path, inputs=list(names), tables=tables):
        for record in records:
            offset = round((reference.start_time - record.start_time) / record.sample_time)
            first, stop = max(0, offset), min(len(record), offset + len(reference))
            if stop - first >= _SHORTEST:
                found = True
                yield record[first:stop], reference.inputs[first - offset:stop - offset]
    if not found:
        raise InputError("the reference and the plant were never measured together", where=str(path),
                         expected=f"rows with {', '.join(names)} and every column of the plant")


def closed_loop_response(pairs: Sequence[tuple[Record, Array]], names: Sequence[str], *, degree: int, half_width: int
                         ) -> FrequencyResponse:
    """Plant of a closed loop, by way of the responses to the reference.

    Parameters
    ----------
    pairs : sequence of tuple
        Records with their references.
    names : sequence of str
        Columns of the reference.
    degree : int
        Degree of the local polynomials [-].
    half_width : int
        Bins on either side of the center of a window.

    Returns
    -------
    FrequencyResponse
    """
    records = [record for record, _ in pairs]
    inputs = records[0].input_names
    if len(names) != len(inputs):
        raise InputError(f"{len(names)} reference(s) ({', '.join(names)}) for {len(inputs)} changing input(s) "
                         f"({', '.join(inputs)})", where=records[0].name,
                         expected="one external signal per input: its response from them is inverted",
                         remedy="Select inputs (inputs = [...] or --input), or excite every loop with one of its own.")
    constant = [name for i, name in enumerate(names) if all(np.ptp(r[:, i]) == 0.0 for _, r in pairs)]
    if constant:
        raise InputError(f"the reference never changes: {', '.join(constant)}", where=records[0].name,
                         expected="set-points that step, or an excitation added to the input",
                         remedy="Name the column that was excited; robthermal excitation designs such a signal.")
    return closed_loop(records, [reference for _, reference in pairs], degree=degree, half_width=half_width)


def noisy_input_response(records: Sequence[Record], beside: Sequence[Array], instruments: Mapping[str, str],
                         noise: Mapping[str, float], *, degree: int, half_width: int) -> FrequencyResponse:
    """Response where some inputs are measured with noise.

    Parameters
    ----------
    records : sequence of Record
        Measured inputs and outputs.
    beside : sequence of ndarray
        Columns of the instruments at the same samples, in the order of `instruments`; unused with `noise`.
    instruments : mapping
        Noisy input: name of its instrument.
    noise : mapping
        Noisy input: standard deviation of its noise [unit of the input].
    degree : int
        Degree of the local polynomials [-].
    half_width : int
        Bins on either side of the center of a window.

    Returns
    -------
    FrequencyResponse
    """
    signals: dict[str, Any] = {name: [z[:, i] for z in beside] for i, name in enumerate(instruments)}
    return errors_in_variables(list(records), instruments=signals, noise=noise, degree=degree, half_width=half_width)


def instruments_from_text(texts: Sequence[str]) -> dict[str, str]:
    """Instruments of noisy inputs from "INPUT=COLUMN".

    Parameters
    ----------
    texts : sequence of str
        One text for each noisy input.

    Returns
    -------
    dict
        Input: name of the column.

    Raises
    ------
    InputError
        For a text without one of the two, and an input named twice.

    Examples
    --------
    >>> instruments_from_text(["room=room 2"])
    {'room': 'room 2'}
    """
    found: dict[str, str] = {}
    for text in texts:
        name, _, column = text.partition("=")
        if not name or not column or name in found:
            raise InputError(f"{text!r} {'repeats an input' if name in found else 'names no input or no column'}",
                             where="--instrument", expected="INPUT=COLUMN, every input once")
        found[name] = column
    return found


def noise_from_text(texts: Sequence[str]) -> dict[str, float]:
    """Noise of inputs from "INPUT=VALUE".

    Parameters
    ----------
    texts : sequence of str
        One text for each noisy input, its standard deviation in the unit of the input.

    Returns
    -------
    dict
        Input: standard deviation of its noise [its unit].

    Raises
    ------
    InputError
        For a text without name or number, and an input named twice.

    Examples
    --------
    >>> noise_from_text(["room=0.02"])
    {'room': 0.02}
    """
    found: dict[str, float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            number = float(value)
        except ValueError:
            number = float("nan")
        if not name or not number > 0.0 or name in found:
            raise InputError(f"{text!r} {'repeats an input' if name in found else 'names no input or no noise'}",
                             where="--input-noise", expected="INPUT=VALUE, a deviation above 0, every input once")
        found[name] = number
    return found
