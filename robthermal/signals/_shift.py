"""Logs whose commands stand a row off: inputs moved by whole steps against everything else."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..errors import InputError
from ._record import Record


def shift_inputs(record: Record, steps: int, inputs: Iterable[str] | None = None) -> Record:
    """Move inputs of a record by whole steps against its readings, as MATLAB's `nkshift`.

    A controller may log a command before it sends it, which then acts a row later, or log what it sent a row before.
    Rows that have no input, or no reading, any more are left out.

    Parameters
    ----------
    record : Record
        Rows as they stand in the log.
    steps : int
        How much later than their row the inputs act [samples]; negative: earlier.
    inputs : iterable of str, optional
        Names of those that move: commands, not recorded ambients. Default: all.

    Returns
    -------
    Record
        Shorter by as many rows.

    Raises
    ------
    InputError
        Steps that are no whole number, an unknown input, fewer than two rows left.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> log = rt.Record(sample_time=5.0, inputs=[1.0, 2.0, 3.0], outputs=[300.0, 301.0, 302.0], input_names=["q"],
    ...                 output_names=["T1"])
    >>> record = rt.signals.shift_inputs(log, -1)
    >>> record.start_time, record["q"].tolist(), record["T1"].tolist()
    (0.0, [2.0, 3.0], [300.0, 301.0])
    """
    if isinstance(steps, bool) or not isinstance(steps, int | np.integer):
        raise InputError(f"inputs are shifted by {steps!r} steps", where="argument steps",
                         expected="a whole number of samples")
    names = list(record.input_names if inputs is None else inputs)
    unknown = [name for name in names if name not in record.input_names]
    if unknown:
        raise InputError(f"{unknown[0]!r} is no input of the record", where="argument inputs",
                         expected=", ".join(record.input_names))
    n = len(record) - abs(int(steps))
    if n < 2:
        raise InputError(f"the record has {len(record)} rows", where="argument steps",
                         expected=f"two rows or more beside a shift by {abs(int(steps))}")
    stay, moved = (max(int(steps), 0), max(-int(steps), 0))  # first rows of what stays, and of what moves
    columns = [record.input_names.index(name) for name in names]
    U = np.array(record.inputs[stay:stay + n])
    U[:, columns] = record.inputs[moved:moved + n, columns]
    ripple = {name: column[moved if name in names else stay:][:n] for name, column in record.ripple.items()}
    return record.changed(inputs=U, outputs=record.outputs[stay:stay + n], ripple=ripple,
                          start_time=record.start_time + stay * record.sample_time)
