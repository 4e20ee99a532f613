"""Values of the used columns in the units that are kept, and the uninterrupted parts they fall into."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from .._plausible import check_temperature, limit_notes
from ._cells import in_si, numbers, refuse_codes
from ._columns import Channel, SystemLike, mapped_actions
from ._options import Declared
from ._parts import Part, parts_of, say_resampled
from ._samples import Rows, runs, single
from ._stamps import Clock
from ._table import Action, Array, Table


@dataclass(frozen=True)
class Values:
    """Values of the channels, file rows down, in the units that are kept."""

    channels: tuple[Channel, ...]
    kept: Array
    missing: dict[int, int]

    def of(self, *roles: str) -> tuple[Channel, ...]:
        return tuple(c for c in self.channels if c.role in roles)

    def columns(self, *roles: str) -> Array:
        return self.kept[:, [k for k, c in enumerate(self.channels) if c.role in roles]]

    def column(self, channel: Channel) -> Array:
        return self.kept[:, self.channels.index(channel)]


def read_values(table: Table, channels: tuple[Channel, ...], choice: Declared, clock: Clock) -> Values:
    table.actions.extend(mapped_actions(table, channels))
    kept = np.full((len(table.lines), len(channels)), np.nan)
    missing: dict[int, int] = {}
    for k, channel in enumerate(channels):
        header = table.headers[channel.place]
        raw = numbers(table, channel.place, choice.record)
        missing[channel.place] = int(np.isnan(raw).sum())
        if missing[channel.place] == len(raw):
            raise InputError(
                f"column {header!r} holds no value at all",
                where=table.where,
                expected="numbers",
                remedy="Leave it out, or name another column with --column.",
            )
        if channel.role != "voltage":  # a voltage may jump anywhere with its current
            refuse_codes(table, header, raw, choice.record)
        if (
            channel.unit == "K"
            and channel.unit_read is not None
            and not channel.scaled
            and channel.unit_read.name in ("K", "degC")
        ):
            there = np.isfinite(raw)
            places = _places(table, np.flatnonzero(there))
            unit = channel.unit_read.name
            check_temperature(header, raw[there], clock.seconds[there], unit, places, table.where)
        kept[:, k] = in_si(channel, raw)
    return Values(channels, kept, missing)


def _places(table: Table, rows: Rows) -> Callable[[int], str]:
    """Words for the place of some rows of a table."""
    return lambda row: table.place(int(rows[row])).rpartition(", ")[2]


def check_limits(table: Table, values: Values, system: SystemLike) -> None:
    raw = {c.name: values.column(c)[np.isfinite(values.column(c))] for c in values.channels}
    raw = {name: column for name, column in raw.items() if len(column)}
    for text in limit_notes(raw, system.current_limits, system.input_limits, table.where):
        table.actions.append(Action("glitches", 1, text))


def find_parts(table: Table, clock: Clock, values: Values, choice: Declared) -> list[Part]:
    pieces = []
    for rows in runs(table, clock, choice.record):
        kept, stamps = single(table, clock, rows, values.kept, choice.record)
        pieces.append((kept, clock.seconds[kept] if stamps is None else stamps))
    driven, read = values.columns("input", "current"), values.columns("ambient", "sensor", "voltage", "output")
    headers = tuple(
        tuple(table.headers[c.place] for c in values.of(*roles))
        for roles in (("input", "current"), ("ambient", "sensor", "voltage", "output"))
    )
    parts = parts_of(table, pieces, driven, read, choice.record, (headers[0], headers[1]))
    say_resampled(table, parts, {c.name: values.column(c) for c in values.of("ambient", "sensor")})
    return parts
