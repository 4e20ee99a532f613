"""Cells of the used columns as SI numbers; what is missing is nan, what is a fault code is named."""

from __future__ import annotations

import numpy as np

from ...errors import InputError
from ._columns import Channel, kept_factor
from ._options import ImportOptions
from ._table import Action, Array, Table
from ._tokens import DECIMAL_COMMA, THOUSANDS, is_missing, short

_CODES = (-127.0, -127.94, 999.0, 9999.0, -999.0, 32767.0, 6553.5, 3276.7)
_DOUBTED = 85.0  # what a DS18B20 says after power-up, and what a plate may have
_JUMP = 10.0  # K or units: into the code, and back


def numbers(table: Table, place: int, options: ImportOptions) -> Array:
    """Numeric cells of a column as they are written, nan where missing.

    Raises
    ------
    InputError
        The first cell that is neither a number nor one of the words for a missing reading.
    """
    cells = table.columns[place]
    header = table.headers[place]
    codes = [code for code in options.missing if not isinstance(code, str)]
    words = {code.strip().lower() for code in options.missing if isinstance(code, str)}
    if cells.dtype.kind == "f":
        values = np.where(np.isfinite(cells), cells, np.nan)
    else:
        values = np.full(len(cells), np.nan)
        for row, cell in enumerate(cells):
            if cell is None or isinstance(cell, float) and cell != cell:
                continue
            text = str(cell).strip()
            if is_missing(text) or text.lower() in words:
                continue
            values[row] = _number(table, row, header, text)
    for code in codes:
        hit = values == code
        if hit.any():
            table.actions.append(
                Action(
                    "fault_code",
                    int(hit.sum()),
                    f"{code:g} taken as missing in {header!r}",
                    header,
                    [int(k) for k in table.lines[hit][:50]],
                )
            )
            values = np.where(hit, np.nan, values)
    return values


def _number(table: Table, row: int, header: str, text: str) -> float:
    decimal = table.facts.get("decimal", ".")
    where = table.place(row, header)
    if THOUSANDS.fullmatch(text):
        raise InputError(
            f"{short(text)} has a decimal and a thousands separator",
            where=where,
            expected="plain numbers",
            remedy='Declare both, for example decimal = "," and thousands = ".".',
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


def refuse_codes(table: Table, header: str, raw: Array, declared: ImportOptions) -> None:
    """Refuse rows that jump to a known fault code and back; 85.0 is only said."""
    known = {float(code) for code in declared.missing if not isinstance(code, str)}
    present = np.isfinite(raw)
    index = np.flatnonzero(present)
    values = raw[present]
    if len(values) < 3:
        return
    for code in (*_CODES, _DOUBTED):
        if code in known:
            continue
        hit = values == code
        if not hit.any() or hit.all():
            continue
        before = np.flatnonzero(hit[1:] & ~hit[:-1] & (np.abs(values[1:] - values[:-1]) > _JUMP)) + 1
        for start in before.tolist():
            after = start + int(np.argmin(hit[start:]))
            if hit[start:].all() or abs(values[after] - code) <= _JUMP:  # it stays there: a value like any other
                continue
            row = int(index[start])
            if code == _DOUBTED:
                table.actions.append(
                    Action(
                        "glitches",
                        after - start,
                        f"{header!r} reads exactly 85.0 in single rows: a "
                        "DS18B20 after power-up? missing = [85.0] takes it as missing",
                        header,
                        [int(table.lines[row])],
                    )
                )
                break
            raise InputError(
                f"{code:g} jumps there and back, like a fault code ({int(hit.sum())} such cells)",
                where=table.place(row, header),
                expected="measured values",
                remedy=f"Write missing = [{code:g}] to take it as missing.",
            )


def in_si(channel: Channel, raw: Array) -> Array:
    """Values of a channel in the unit that is kept."""
    if channel.scaled:
        values = channel.scale * raw + channel.offset
        return channel.unit_read.to_si(values) if channel.unit == "K" and channel.unit_read else values
    if channel.unit_read is None:
        return raw
    if channel.unit == channel.unit_read.name:
        return raw
    return channel.unit_read.to_si(raw) * kept_factor(channel)
