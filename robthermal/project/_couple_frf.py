"""Measured frequency responses of a coupling file: CSV with a header row, hertz in, rad/s out."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import control
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ._toml import read_text

_MAX_BYTES = 100_000_000
_ONE = ("frequency", "real", "imag")
_FOUR = ("frequency", *(f"{part}{row}{column}" for row, column in product("12", "12") for part in ("re", "im")))
_ALIAS = {"freq": "frequency", "f": "frequency", "re": "real", "im": "imag"}
_HERTZ = ("", "hz")


def plants_from_pairs(first: list[Path], second: list[Path], dt: float) -> tuple[control.FrequencyResponseData, ...]:
    """Diagonal 2x2 plants, the k-th file of each list one machine position.

    Parameters
    ----------
    first, second : list of Path
        Files of the subsystems: frequency [Hz], real, imag.
    dt : float
        Sample time [s].
    """
    found = []
    for one, two in zip(first, second, strict=True):
        (frequencies, upper), (others, lower) = _read(one, _ONE), _read(two, _ONE)
        if frequencies.shape != others.shape or not np.allclose(frequencies, others, rtol=1e-9, atol=0.0):
            raise InputError(f"its frequencies differ from those of {one.name!r}", where=str(two),
                             expected="the same frequencies in both files of a machine position")
        response = np.zeros((2, 2, len(frequencies)), dtype=complex)
        response[0, 0], response[1, 1] = upper[0], lower[0]
        found.append(_plant(frequencies, response, dt))
    return tuple(found)


def plants_from_whole(files: list[Path], dt: float) -> tuple[control.FrequencyResponseData, ...]:
    """2x2 plants, one file each.

    Parameters
    ----------
    files : list of Path
        Files: frequency [Hz], re11, im11, re12, im12, re21, im21, re22, im22.
    dt : float
        Sample time [s].
    """
    return tuple(_plant(frequencies, entries.reshape(2, 2, -1), dt)
                 for frequencies, entries in (_read(file, _FOUR) for file in files))


def _plant(frequencies: NDArray[np.float64], response: NDArray[np.complex128], dt: float
           ) -> control.FrequencyResponseData:
    return control.FrequencyResponseData(response, 2 * np.pi * frequencies, dt=dt)


def _read(path: Path, columns: tuple[str, ...]) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Frequencies [Hz] and one row of complex numbers per entry."""
    lines = enumerate(read_text(path, "CSV", _MAX_BYTES).splitlines(), start=1)
    rows = [(number, [cell.strip(' "') for cell in line.split(",")]) for number, line in lines
            if line.strip() and not line.startswith("#")]
    if not rows:
        raise InputError("is empty", where=str(path), expected=f"columns {', '.join(columns)}")
    names = rows[0][1]
    header = _header(names, columns, path)
    values = np.array([_numbers(row, f"{path}, line {number}", names) for number, row in rows[1:]])
    if len(values) < 2:
        raise InputError(f"has {len(values)} frequencies", where=str(path), expected="at least two")
    table = dict(zip(header, values.T, strict=True))
    entries = [table[real] + 1j * table[imag] for real, imag in zip(columns[1::2], columns[2::2], strict=True)]
    return table["frequency"], np.array(entries)


def _header(names: list[str], columns: tuple[str, ...], path: Path) -> list[str]:
    found = []
    for name in names:
        plain, _, unit = name.lower().partition("[")
        unit = unit.rstrip("] ")
        plain = _ALIAS.get(plain.strip(), plain.strip())
        if plain == "frequency" and unit not in _HERTZ:
            raise InputError(f"column {name!r}", where=str(path), expected="frequencies in hertz",
                             remedy="Convert them: f = omega / (2 pi).")
        found.append(plain)
    if sorted(found) != sorted(columns):
        raise InputError(f"columns are {', '.join(names)}", where=str(path),
                         expected=f"a header row with {', '.join(columns)}; frequency in Hz")
    return found


def _numbers(row: list[str], where: str, header: list[str]) -> list[float]:
    if len(row) != len(header):
        raise InputError(f"has {len(row)} values", where=where, expected=f"{len(header)}, one per column")
    try:
        values = [float(text) for text in row]
    except ValueError as error:
        raise InputError(str(error), where=where, expected="numbers") from None
    wrong = [name for name, value in zip(header, values, strict=True) if not np.isfinite(value)]
    if wrong:
        raise InputError(f"column {wrong[0]!r} is not a finite number", where=where, expected="finite numbers",
                         remedy="Leave that frequency out.")
    return values
