"""Records of a closed loop: the plant as it was measured, and beside it the reference that no noise gets into."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...identify import FrequencyResponse, closed_loop
from ...signals import Record, read_records
from ._import import ReadTable

Array = NDArray[np.float64]
_SHORTEST = 2  # samples of a part


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
