"""Logs whose values are means over a step: what their stamps say, as a record; and long logs made short by means."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ._record import Record
from ._stated import MEANS, Averaged

_ROUNDING = 1e-12  # of the largest value of an input: what a mean of equal values may be off them


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


def block_means(record: Record, samples: int) -> Record:
    """Make a long record short: means over blocks of samples, as one step each.

    Every input becomes its mean over the block and every reading the mean of those at the ends of the block's samples.
    A model of means (`averaged`) is then exact for whatever heats in proportion to inputs that hold over a block; an
    input that changes within one acts up to half a block early or late, and what a module's current is off its mean is
    kept as `ripple`. Readings that were samples have means that are half a sample late, which fits to means allow for.
    Blocks have to be short against the time constants that matter, a tenth or less where inputs change within them.

    Parameters
    ----------
    record : Record
        Rows at every sample, or means over each.
    samples : int
        Samples of a block; those at the end that fill none are left out.

    Returns
    -------
    Record
        With `averaged` set and a sample time of a block. It starts a block later: the first block has no input before
        its reading.

    Raises
    ------
    InputError
        Fewer than two samples a block, or fewer than three blocks.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> log = rt.Record(sample_time=1.0, inputs=[1, 1, 1, 3, 5, 5, 5], outputs=300.0 + np.arange(7), input_names=["q"],
    ...                 output_names=["T1"])
    >>> short = rt.signals.block_means(log, 2)
    >>> short.time.tolist(), short["q"].tolist(), short["T1"].tolist()
    ([2.0, 4.0], [2.0, 5.0], [301.5, 303.5])
    """
    if isinstance(samples, bool) or not isinstance(samples, int | np.integer) or samples < 2:
        raise InputError(f"samples is {samples!r}", where="argument samples", expected="a whole number, 2 or more")
    blocks = len(record) // samples
    if blocks < 3:
        raise InputError(f"the record has {len(record)} samples, {blocks} blocks of {samples}",
                         where="argument samples", expected="three blocks or more")
    U = _in_blocks(record.inputs[:blocks * samples], samples)
    inputs, held = U.mean(axis=1), np.zeros_like(U)
    for name, column in record.ripple.items():
        held[..., record.input_names.index(name)] = _in_blocks(column[:blocks * samples], samples)
    off = np.sqrt(np.mean((U - inputs[:, None])**2 + held**2, axis=1))
    off[off < _ROUNDING * np.abs(U).max(axis=(0, 1))] = 0.0
    outputs = _in_blocks(record.outputs[1:(blocks - 1) * samples + 1], samples).mean(axis=1)
    return record.changed(
        sample_time=samples * record.sample_time, start_time=record.start_time + samples * record.sample_time,
        inputs=inputs[1:], outputs=outputs, averaged=True,
        ripple={name: column[1:] for name, column in zip(record.input_names, off.T, strict=True) if np.any(column[1:])},
        notes=[*record.notes, f"means over {samples} samples each"])


def _in_blocks(rows: NDArray[np.float64], samples: int) -> NDArray[np.float64]:
    """(blocks, samples, ...) of (blocks samples, ...)."""
    return rows.reshape(len(rows) // samples, samples, *rows.shape[1:])
