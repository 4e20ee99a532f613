"""Fault codes that nobody declared: cells by which a logger or a thermometer says that nothing was measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..._celsius import HIGHEST_CELSIUS, ZERO_CELSIUS
from ...errors import InputError
from ._cells import in_kelvin
from ._channel import Channel
from ._options import ImportOptions
from ._table import Action, Array, Table

_CODES = (-127.0, -127.94, 999.0, 9999.0, -999.0, 32767.0, 6553.5, 3276.7)
_DOUBTED = 85.0  # what a DS18B20 says after power-up, and what a plate may have
# °C; what broken wires read: upper ends of thermocouples T, E, J, N, K, R, B (IEC 60584) and of Pt100 (IEC 60751), a
# MAX31865 at full scale, displays of four digits, 16 bits of hundredths.
_RANGE_ENDS = (400.0, 1000.0, 1200.0, 1300.0, 1370.0, 1372.0, 1768.0, 1820.0, 850.0, 988.79, 999.9, 327.67, 655.35)
_COLDEST = -200.0  # °C; lower ends: Pt100 here, thermocouples -270, a MAX31865 without a sensor -242.02
_HOTTEST = 2000.0  # °C; no reading is beyond
_JUMP = 10.0  # units: into the code, and back
_APART = 50.0  # K: the same of a temperature, which may pass what is a code elsewhere
_WARM = 10.0  # K, into 85 and back
_EXACT = 0.005  # K
_LISTED = 5
_FEWEST = 2

Hits = NDArray[np.bool_]


def refuse_codes(table: Table, channel: Channel, raw: Array, declared: ImportOptions) -> None:
    """Refuse rows that jump to a known fault code and back; 85.0 is only said.

    In a column of no temperatures a code lies beyond all other values. A temperature jumps by more than 50 K, from one
    side: what it passes is a reading. A code that stays until the end is a broken sensor. From -200 °C down every cell
    is refused unless the column gets there in smaller steps.

    Parameters
    ----------
    table : Table
        For the lines in messages, and its list of actions.
    channel : Channel
        What the column is read as.
    raw : ndarray
        Its cells as they are written, nan where missing.
    declared : ImportOptions
        Import options, of which `missing` is used.
    """
    index = np.flatnonzero(np.isfinite(raw))
    values = raw if len(index) == len(raw) else raw[index]
    header = table.headers[channel.place]
    found = _in_temperatures(channel, values) if channel.unit == "K" else _in_numbers(values)
    if found:
        row, how, _ = min(found, key=lambda one: one[0])
        cells = values[np.any([hit for _, _, hit in found], axis=0)]
        raise InputError(
            f"{values[row]:.10g} {how}, like a fault code ({len(cells)} such cells)",
            where=table.place(int(index[row]), header),
            expected="measured values",
            remedy=_remedy(cells, declared, len(cells) == len(values), channel.name),
        )
    if channel.unit == "K":
        _say_doubted(table, header, index, values, in_kelvin(channel)[1])


def _remedy(cells: Array, declared: ImportOptions, throughout: bool, name: str) -> str:
    """What to declare; of a column without anything else, that it is none."""
    if throughout:
        return f"If no sensor was connected, leave {name!r} out of [columns], or give the column another header."
    codes = np.unique(cells)
    own = [f'"{code}"' if isinstance(code, str) else f"{code:.10g}" for code in declared.missing]
    listed = ", ".join([*own, *(f"{code:.10g}" for code in codes[:_LISTED])]) + ", …" * (len(codes) > _LISTED)
    return f"Write missing = [{listed}] to take {'it' if len(codes) == 1 else 'them'} as missing, in every column."


def _in_numbers(values: Array) -> list[tuple[int, str, Hits]]:
    """First row, words and all cells of every code in a column of no temperatures."""
    found = []
    for code in _CODES if len(values) > _FEWEST else ():
        hit = values == code
        if hit.any() and not _within(values, code):
            start, stop = _jump(values, hit, _JUMP)
            if stop > start:
                found.append((start, _how(start, stop, len(values)), hit))
    return found


def _in_temperatures(channel: Channel, values: Array) -> list[tuple[int, str, Hits]]:
    """The same of temperatures: known codes, and whatever is too cold."""
    zero, slope = in_kelvin(channel)
    if slope == 0.0:
        return []
    ends = sorted(zero + slope * end - ZERO_CELSIUS for end in (values.min(), values.max()))
    found = []
    exact, apart = _EXACT / abs(slope), _APART / abs(slope)
    cells = [(end + ZERO_CELSIUS - zero) / slope for end in _RANGE_ENDS if end <= ends[1] + _EXACT]
    hits = {code: values == code for code in _CODES} | {cell: np.abs(values - cell) <= exact for cell in cells}
    for code, hit in hits.items() if len(values) > _FEWEST else ():
        if not hit.any():
            continue
        celsius = zero + slope * code - ZERO_CELSIUS
        others = zero + slope * values[~np.any(list(hits.values()), axis=0)] - ZERO_CELSIUS
        real = 0.0 < celsius < _HOTTEST  # a furnace may end there
        if hit.all() and not real:
            found.append((0, "stands in every row", hit))
            continue
        may_stay = not real or bool(others.size and others.max() <= HIGHEST_CELSIUS)
        start, stop = _jump(values, hit, apart, may_stay=may_stay, one_side=True)
        if stop > start:
            found.append((start, _how(start, stop, len(values)), hit))
    # What is cold in a column of kelvin looks like Celsius, which is said elsewhere.
    kelvin = channel.unit_read is not None and channel.unit_read.name == "K" and not channel.scaled
    return found if kelvin or ends[0] > _COLDEST + _EXACT else [*found, *_too_cold(zero + slope * values)]


def _too_cold(kelvin: Array) -> list[tuple[int, str, Hits]]:
    """Cells at or below absolute zero, and those from -200 °C down that are reached in one step, or never left."""
    none = kelvin <= _EXACT / 2
    if none.any():
        return [(int(none.argmax()), "is no temperature: absolute zero or below", none)]
    cold = kelvin <= ZERO_CELSIUS + _COLDEST + _EXACT
    if cold.all():
        return [(0, "stands in every row", cold)] if np.ptp(kelvin) == 0.0 else []
    crossings = np.flatnonzero(np.diff(cold) & (np.abs(np.diff(kelvin)) > _APART))
    if not crossings.size:
        return []
    row = int(crossings[0]) + bool(cold[crossings[0] + 1])
    return [(row, "jumps there" + ("" if cold[0] else " and stays" if cold[-1] else " and back"), cold)]


def _say_doubted(table: Table, header: str, index: NDArray[np.intp], values: Array, slope: float) -> None:
    hit = values == _DOUBTED
    if not hit.any() or slope == 0.0:
        return
    start, stop = _jump(values, hit, _WARM / abs(slope))
    if stop > start:
        text = f"{header!r} reads exactly 85.0 in single rows: a DS18B20 after power-up? "
        text += "missing = [85.0] takes it as missing"
        table.actions.append(Action("glitches", stop - start, text, header, [table.lines[int(index[start])]]))


def _within(values: Array, code: float) -> bool:
    """Whether a code lies between the other values, as 999 rpm of a fan does: then it is one of them."""
    others = values[~np.isin(values, _CODES)]
    return bool(others.size and others.min() < code < others.max())


def _how(start: int, stop: int, n: int) -> str:
    return "jumps there and back" if stop < n or stop - start == 1 else "jumps there and stays"


def _jump(values: Array, hit: Hits, apart: float, *, may_stay: bool = False, one_side: bool = False) -> tuple[int, int]:
    """First run of a code with a jump on either side, (0, 0) if there is none; a single row at an end has one side.

    Parameters
    ----------
    values : ndarray
        Cells that are not missing.
    hit : ndarray of bool
        Which of them are the code.
    apart : float
        Least size of the jumps.
    may_stay : bool, optional
        Whether a run of several rows at an end counts.
    one_side : bool, optional
        Whether the rows before and after have to lie on the same side of the code.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], hit.astype(np.int8), [0]])))
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        beside = [float(values[k] - values[start]) for k in (start - 1, stop) if 0 <= k < len(values)]
        if not beside or len(beside) == 1 and not may_stay and (one_side or stop - start > 1):
            continue
        if min(map(abs, beside)) > apart and not (one_side and min(beside) < 0.0 < max(beside)):
            return start, stop
    return 0, 0
