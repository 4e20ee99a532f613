"""Frequency responses in CSV: a header row, hertz, one entry or two by two; there is no covariance in them."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from robthermal._arrays import Array
from robthermal._checks import excerpt, quoted
from robthermal.errors import InputError

_ONE = ("frequency", "real", "imag")
_FOUR = ("frequency", *(f"{part}{row}{column}" for row, column in product("12", "12") for part in ("re", "im")))
_ALIAS = {"freq": "frequency", "f": "frequency", "re": "real", "im": "imag"}
_EXPECTED = f"a header row with {', '.join(_ONE)}, or {', '.join(_FOUR)}; frequency in Hz"
WITHOUT = ("The file has no covariance: how far its values can be believed is not known, and its noise counts as the "
           "machine's. Use the .json that robthermal frf writes.")


def is_table(text: str) -> bool:
    """Whether the first row names the columns of a frequency response.

    Parameters
    ----------
    text : str
        Beginning of the file, at least its first row.
    """
    return sorted(_plain(name)[0] for name in _cells(_first(text))) in (sorted(_ONE), sorted(_FOUR))


def read_table(text: str, path: Path) -> dict[str, Any]:
    """Arguments for `FrequencyResponse`, but the sample time.

    Parameters
    ----------
    text : str
        Content of the file.
    path : Path
        Where it is, for messages.

    Raises
    ------
    InputError
        Other columns, frequencies that are not hertz, cells that are not finite numbers: by line and column.
    """
    first = _first(text)
    if not first:
        raise InputError("is empty", where=str(path), expected=_EXPECTED)
    columns = _columns(_cells(first), path)
    lines = [(number, line) for number, line in enumerate(text.splitlines(), start=1) if _is_row(line)]
    values = np.array([_numbers(line, f"{path}, line {number}", columns) for number, line in lines[1:]])
    if len(values) < 2:
        raise InputError(f"has {len(values)} frequencies", where=str(path), expected="at least two")
    values = values[np.argsort(values[:, columns.index("frequency")], kind="stable")]
    found = dict(zip(columns, values.T, strict=True))
    ordered = _ONE if len(columns) == len(_ONE) else _FOUR
    entries = [found[re] + 1j * found[im] for re, im in zip(ordered[1::2], ordered[2::2], strict=True)]
    return _without_covariance(found["frequency"], np.array(entries))


def _without_covariance(frequencies: Array, entries: Array) -> dict[str, Any]:
    """No degrees of freedom and covariances that are not numbers: nothing is claimed about the noise."""
    n_f, size = len(frequencies), 1 if len(entries) == 1 else 2
    return {"frequencies": frequencies, "response": entries.reshape(size, size, n_f),
            "covariance": np.full((size**2, size**2, n_f), np.nan),
            "noise_covariance": np.full((size, size, n_f), np.nan),
            "degrees_of_freedom": np.zeros(n_f), "input_names": [f"u{k + 1}" for k in range(size)],
            "output_names": [f"y{k + 1}" for k in range(size)], "n_samples": 0, "method": "a CSV file",
            "notes": [WITHOUT]}


def _is_row(line: str) -> bool:
    return bool(line.strip()) and not line.startswith("#")


def _first(text: str) -> str:
    return next((line for line in text.splitlines() if _is_row(line)), "")


def _cells(line: str) -> list[str]:
    return [cell.strip(' "') for cell in line.split(",")]


def _plain(name: str) -> tuple[str, str]:
    """Name of a column without its unit, and the unit."""
    plain, _, unit = name.lower().partition("[")
    return _ALIAS.get(plain.strip(), plain.strip()), unit.rstrip("] ")


def _columns(names: list[str], path: Path) -> list[str]:
    found = [_plain(name) for name in names]
    if sorted(plain for plain, _ in found) not in (sorted(_ONE), sorted(_FOUR)):
        raise InputError(f"is no frequency response: its columns are {excerpt(', '.join(names))}", where=str(path),
                         expected=_EXPECTED + ", or a file that robthermal frf wrote")
    for name, (plain, unit) in zip(names, found, strict=True):
        if plain == "frequency" and unit not in ("", "hz"):
            raise InputError(f"column {quoted(name)}", where=str(path), expected="frequencies in hertz",
                             remedy="Convert them: f = omega / (2 pi).")
    return [plain for plain, _ in found]


def _numbers(line: str, where: str, columns: list[str]) -> list[float]:
    row = _cells(line)
    if len(row) != len(columns):
        raise InputError(f"has {len(row)} values", where=where, expected=f"{len(columns)}, one per column")
    try:
        values = [float(text) for text in row]
    except ValueError as error:
        raise InputError(excerpt(error), where=where, expected="numbers") from None
    wrong = [name for name, value in zip(columns, values, strict=True) if not np.isfinite(value)]
    if wrong:
        raise InputError(f"column {wrong[0]!r} is not a finite number", where=where, expected="finite numbers",
                         remedy="Leave that frequency out.")
    return values
