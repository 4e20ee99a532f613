"""Cells of the used columns as SI numbers; what is missing is nan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..._celsius import ZERO_CELSIUS
from ...errors import InputError
from ._channel import Channel, kept_as_read, kept_factor
from ._options import ImportOptions
from ._table import Action, Array, Block, Table, spans
from ._tokens import DECIMAL_COMMA, SWITCH, THOUSANDS, is_missing, short, thousands_of
from ._units import split_header

_DRIVES = ("input", "current")


class NumberReader:
    """Cells of one column as numbers, block by block.

    Parameters
    ----------
    table : Table
        For the lines in messages.
    place : int
        Column of the table.
    options : ImportOptions
        Import options, of which `missing` is used.
    channel : Channel, optional
        What the column is read as: of an input that is on or off the cells may be words.
    """

    def __init__(self, table: Table, place: int, options: ImportOptions, channel: Channel | None = None):
        self._table, self.place, self._channel = table, place, channel
        self.n_words = 0  # True, False, on and off taken as 1 and 0
        self._words = {code.strip().lower() for code in options.missing if isinstance(code, str)}
        self.fault: tuple[int, InputError] | None = None  # the first cell that is no number: its line, and what is said
        self.n_faults = 0

    @property
    def header(self) -> str:
        """Of the column."""
        return self._table.headers[self.place]

    def read(self, block: Block) -> Array:
        """Cells as they are written, nan where missing; the first that is no number is remembered."""
        cells = block.columns[self.place]
        if cells.dtype.kind == "f":
            return np.where(np.isfinite(cells), cells, np.nan)
        values = np.full(len(cells), np.nan)
        for row, cell in enumerate(cells):
            if cell is None or isinstance(cell, float) and cell != cell:
                continue
            text = str(cell).strip()
            if is_missing(text) or text.lower() in self._words:
                continue
            if self._channel is not None and _switched(self._channel) and text.lower() in SWITCH:
                values[row] = SWITCH[text.lower()]
                self.n_words += 1
                continue
            try:
                values[row] = _number(self._table, int(block.lines[row]), self.header, text)
            except InputError as error:
                error = _of_a_switch(error, self._channel, self.header, text) or error
                self.fault = self.fault or (int(block.lines[row]), error)
                self.n_faults += 1
        return values


def _switched(channel: Channel) -> bool:
    """Whether what a drive is when on was declared: in per cent, 1 would be next to nothing."""
    return channel.role in _DRIVES and channel.scaled


def _of_a_switch(error: InputError, channel: Channel | None, header: str, text: str) -> InputError | None:
    """What to declare of a heater or current whose cells are on and off, and of which nobody says how much on is."""
    if channel is None or channel.role not in _DRIVES or text.lower() not in SWITCH:
        return None
    kept = channel.unit or "its value"
    example = f'{channel.name} = {{ column = "{header}", scale = ({kept} when on) }}'
    return InputError(error.what, where=error.where, expected="a number in every cell, or what on means",
                      remedy=f"Write [columns] {example}: True and on are then 1, False and off 0.")


def refuse_faults(readers: Sequence[NumberReader]) -> None:
    """Refuse the first cell, by line, that is neither a number nor one of the words for a missing reading."""
    found = [(*reader.fault, reader.n_faults) for reader in readers if reader.fault is not None]
    if found:
        _, error, n = min(found, key=lambda one: one[0])
        more = f" ({n} such cells)" if n > 1 else ""
        raise InputError(error.what + more, where=error.where, expected=error.expected, remedy=error.remedy)


def take_codes(table: Table, place: int, values: Array, options: ImportOptions) -> None:
    """Declared fault codes become missing, in place, and are said."""
    for code in options.missing:
        if isinstance(code, str):
            continue
        hit = values == code
        if hit.any():
            header, n = table.headers[place], int(hit.sum())
            text = f"{code:g} taken as missing in {header!r}"
            table.actions.append(Action("fault_code", n, text, header, table.lines.of(hit)))
            values[hit] = np.nan


def _number(table: Table, line: int, header: str, text: str) -> float:
    decimal = table.facts.get("decimal", ".")
    where = table.at(line, header)
    if THOUSANDS.fullmatch(text):
        raise InputError(
            f"{short(text)} has a decimal and a thousands separator",
            where=where,
            expected="plain numbers",
            remedy=f"Declare both: {thousands_of(text)}.",
        )
    if decimal == "." and DECIMAL_COMMA.fullmatch(text):
        raise InputError(
            f"{short(text)} has a decimal comma, other cells a decimal point",
            where=where,
            expected="one of the two",
            remedy='Write decimal = ",".',
        )
    if decimal == "," and "." in text:
        raise InputError(
            f"{short(text)} has a decimal point, other cells a decimal comma",
            where=where,
            expected="one of the two",
            remedy='Write decimal = ".".',
        )
    try:
        if "_" in text:
            raise ValueError
        value = float(text.replace(",", ".") if decimal == "," else text)
    except ValueError:
        raise InputError(
            f"{short(text)} is not a number",
            where=where,
            expected="a number in every cell",
            remedy=f'If it means that nothing was measured: missing = ["{text[:20]}"].',
        ) from None
    return value if np.isfinite(value) else float("nan")


def to_si(channel: Channel, raw: Array) -> None:
    """Values of a channel in the unit that is kept, in place."""
    for part in spans(len(raw)):
        raw[part] = _in_si(channel, raw[part])


def in_kelvin(channel: Channel) -> tuple[float, float]:
    """Of a column of temperatures without a thermistor: kelvin = the first + the second · cell."""
    zero, one = _in_si(channel, np.array([0.0, 1.0])).tolist()
    return zero, one - zero


def _in_si(channel: Channel, raw: Array) -> Array:
    if channel.resistance is not None and channel.unit_read is not None:
        across = channel.unit_read.to_si(channel.scale * raw + channel.offset)
        return across**2 * (channel.resistance if channel.unit_read.quantity == "current" else 1 / channel.resistance)
    if channel.scaled:
        values = channel.scale * raw + channel.offset
        return channel.unit_read.to_si(values) if channel.unit == "K" and channel.unit_read else values
    if channel.unit_read is None or kept_as_read(channel):
        return raw
    return channel.unit_read.to_si(raw) * kept_factor(channel)


def mapped_actions(table: Table, channels: Sequence[Channel], of_means: bool) -> list[Action]:
    """What is said of names that differ from their headers and of units that are converted."""
    found = []
    for c in channels:
        header = table.headers[c.place]
        if split_header(header)[0] != c.name and header != c.name:
            found.append(Action("mapped", 1, f"{c.name} is column {header!r}", header))
        if c.thermistor is not None:
            found.append(Action("converted", len(table.lines), f"{c.name} to K: {c.thermistor}", header))
        elif c.resistance is not None and c.unit_read is not None:
            law = f"I² · {c.resistance:g} Ω" if c.unit_read.quantity == "current" else f"U² / {c.resistance:g} Ω"
            steady = ", right where it is steady within a step" if of_means else ""
            text = f"{c.name} from {c.unit_read.name} to W: {law}{steady}"
            found.append(Action("converted", len(table.lines), text, header))
        elif c.scaled:
            found.append(Action("converted", len(table.lines), f"{c.name} = {c.scale:g} · cell + {c.offset:g}", header))
        elif c.unit_read is not None and c.unit and not kept_as_read(c):
            found.append(Action("converted", len(table.lines), f"{c.name} from {c.unit_read.name} to {c.unit}", header))
    return found


def words_taken(readers: Sequence[NumberReader]) -> list[Action]:
    """What is said of cells that were words of a switch."""
    return [Action("converted", reader.n_words, f"{header!r}: True and on taken as 1, False and off as 0", header)
            for reader in readers if reader.n_words for header in [reader.header]]


def from_thermistor(table: Table, channel: Channel, raw: Array) -> None:
    """Kelvin from ohms or readings of a divider, in place; an open or shorted thermistor is missing, and said."""
    assert channel.thermistor is not None
    known = ~np.isnan(raw)
    for part in spans(len(raw)):
        raw[part] = channel.thermistor.temperature(channel.scale * raw[part] + channel.offset)
    coldest, hottest = channel.thermistor.range
    header = table.headers[channel.place]
    faults = (
        ("an open", "below", coldest, known & ~(raw >= coldest + ZERO_CELSIUS)),
        ("a shorted", "above", hottest, raw > hottest + ZERO_CELSIUS),
    )
    for what, side, limit, hit in faults:
        if hit.any():
            n = int(hit.sum())
            text = (
                f"{channel.name}: {n} reading{'s' * (n > 1)} of {what} thermistor, {side} {limit:g} °C, taken as "
                "missing"
            )
            table.actions.append(Action("fault_code", n, text, header, table.lines.of(hit)))
            raw[hit] = np.nan
