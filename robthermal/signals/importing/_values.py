"""Values of the used columns in the units that are kept, and the uninterrupted parts they fall into."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .._plausible import check_temperature, limit_notes
from ._cells import (
    NumberReader,
    from_thermistor,
    mapped_actions,
    refuse_faults,
    take_codes,
    to_si,
    words_taken,
)
from ._channel import Channel
from ._codes import refuse_codes
from ._columns import SystemLike
from ._jitter import settled
from ._options import Declared
from ._parts import Part, parts_of, say_resampled
from ._samples import runs, single
from ._table import Action, Array, Lines, Source, Table
from ._times import Clock, TimeReader

_INPUTS = ("input", "current", "ambient")


@dataclass
class Values:
    """Values of the channels, file rows down, in the units that are kept.

    Parameters
    ----------
    channels : tuple of Channel
        Inputs, currents and ambients, then sensors and other outputs.
    inputs, outputs : ndarray, shape (n_rows, channels)
        Where a large file lies in memory, once; nan where missing.
    missing : dict of int to int
        Cells without a value, by column of the table.
    ranges : dict of str to (float, float)
        Least and largest value of every channel.
    """

    channels: tuple[Channel, ...]
    inputs: Array
    outputs: Array
    missing: dict[int, int]
    ranges: dict[str, tuple[float, float]]

    def of(self, *roles: str) -> tuple[Channel, ...]:
        """Channels of some roles."""
        return tuple(c for c in self.channels if c.role in roles)

    def column(self, channel: Channel) -> Array:
        """All values of a channel."""
        return _column(self.channels, self.inputs, self.outputs, channel)

    def keep(self, rows: NDArray[np.bool_]) -> None:
        """Forget the other rows."""
        self.inputs, self.outputs = self.inputs[rows], self.outputs[rows]


def _column(channels: Sequence[Channel], inputs: Array, outputs: Array, channel: Channel) -> Array:
    n_in = inputs.shape[1]
    k = channels.index(channel)
    return inputs[:, k] if k < n_in else outputs[:, k - n_in]


def read_values(
    source: Source, channels: Sequence[Channel], choice: Declared, times: TimeReader
) -> tuple[Values, Clock]:
    """Values of the channels and the time of every row, on one pass through the rows.

    Parameters
    ----------
    source : Source
        File or table whose rows are read.
    channels : sequence of Channel
        Columns that are used.
    choice : Declared
        What is declared.
    times : TimeReader
        Reader of the time column.

    Raises
    ------
    InputError
        Cells that are no numbers or times, columns without a value, undeclared fault codes, the wrong unit.
    """
    table = source.table
    ordered = tuple(c for inputs in (True, False) for c in channels if (c.role in _INPUTS) == inputs)
    n_in = sum(c.role in _INPUTS for c in ordered)
    U, Y = np.empty((source.most_rows, n_in)), np.empty((source.most_rows, len(ordered) - n_in))
    readers = [NumberReader(table, c.place, choice.record, c) for c in ordered]
    n = fill(source, times, readers, [_column(ordered, U, Y, c) for c in ordered])
    U, Y = U[:n], Y[:n]
    clock = times.clock()
    refuse_faults(readers)
    table.actions.extend(words_taken(readers))
    table.actions.extend(mapped_actions(table, ordered, choice.record.averaged in ("before", "after")))
    values = Values(ordered, U, Y, {}, {})
    for channel in ordered:
        raw = values.column(channel)
        take_codes(table, channel.place, raw, choice.record)
        if channel.thermistor is not None:
            from_thermistor(table, channel, raw)
        values.missing[channel.place] = int(np.isnan(raw).sum())
        _check(table, channel, raw, choice, clock)
        if channel.thermistor is None:
            to_si(channel, raw)
        values.ranges[channel.name] = float(np.nanmin(raw)), float(np.nanmax(raw))
    return values, clock


def fill(source: Source, times: TimeReader, readers: Sequence[NumberReader], columns: Sequence[Array]) -> int:
    """Cells of all blocks into the columns; how many rows."""
    n = 0
    clock = {"texts": times.places, "numbers": ()} if times.text else {"texts": (), "numbers": times.places}
    for block in source.blocks([*clock["numbers"], *(r.place for r in readers)], clock["texts"]):
        times.add(block)
        stop = n + len(block.lines)
        for reader, column in zip(readers, columns, strict=True):
            column[n:stop] = reader.read(block)
        n = stop
    return n


def _check(table: Table, channel: Channel, raw: Array, choice: Declared, clock: Clock) -> None:
    header = table.headers[channel.place]
    if len(raw) and np.isnan(raw).all():
        raise InputError(
            f"column {header!r} holds no value at all",
            where=table.where,
            expected="numbers",
            remedy="Leave it out, or name another column with --column.",
        )
    if channel.thermistor is not None:
        return  # its faults are already out, and a resistance or count may have any number
    if channel.role != "voltage":  # a voltage may jump anywhere with its current
        refuse_codes(table, channel, raw, choice.record)
    unit = channel.unit_read.name if channel.unit_read is not None else ""
    if channel.unit == "K" and not channel.scaled and unit in ("K", "degC"):
        def words(row: int) -> str:
            return table.place(row).rpartition(", ")[2]

        check_temperature(header, raw, clock.seconds, unit, words, table.where, choice.record.hottest)


def check_limits(table: Table, values: Values, system: SystemLike) -> None:
    """Say what is outside of declared limits; a current in milliampere and a heat in milliwatt are refused."""
    raw, units = {c.name: values.column(c) for c in values.channels}, {c.name: c.unit for c in values.channels}
    for text in limit_notes(raw, units, system.current_limits, system.input_limits, table.where):
        table.actions.append(Action("glitches", 1, text))


def find_parts(table: Table, clock: Clock, values: Values, choice: Declared) -> list[Part]:
    """Uninterrupted parts of a file; rows that repeat a time leave the values and the table's lines."""
    pieces, stamps = runs(table, clock, choice.record), clock.seconds
    stamps, keep = single(table, stamps, pieces, (values.inputs, values.outputs), choice.record)
    if keep is not None:
        values.keep(keep)
        before = np.concatenate([[0], np.cumsum(keep)])
        pieces = [slice(int(before[rows.start]), int(before[rows.stop])) for rows in pieces]
        table.lines, stamps = Lines(table.lines.numbers()[keep]), stamps[keep]
    named = {c: (table.headers[c.place], values.column(c)) for c in values.channels}
    driven = [named[c] for c in values.of("input", "current")]
    read = [named[c] for c in values.of("ambient", "sensor", "voltage", "output")]
    parts = parts_of(table, stamps, pieces, driven, read, choice.record)
    if not choice.record.averaged:
        parts = settled(table, parts, [values.column(c) for c in values.of("sensor", "output")], choice.record.clock)
    say_resampled(table, parts, {c.name: values.column(c) for c in values.of("ambient", "sensor")})
    return parts
