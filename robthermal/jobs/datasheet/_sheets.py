"""Rated values of modules: typed on the command line, from a CSV file, or from the sheets of the package."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..._celsius import HIGHEST_CELSIUS, LOWEST_KELVIN, ZERO_CELSIUS
from ..._checks import quoted
from ..._pandas import pd
from ...errors import InputError
from ...systems import datasheets
from ...thermal import Rating

Sheets = dict[str, tuple[Rating, ...]]
_LARGEST = 5_000_000  # bytes of a CSV file
_KEYS = {"th": "t_hot", "vmax": "v_max", "imax": "i_max", "dtmax": "dt_max", "qmax": "q_max"}
_LABELS = {"t_hot": "Th", "v_max": "Vmax", "i_max": "Imax", "dt_max": "dTmax", "q_max": "Qmax"}
_UNITS = {"t_hot": {"": 1.0, "C": 1.0, "°C": 1.0, "degC": 1.0, "K": 1.0}, "v_max": {"": 1.0, "V": 1.0, "mV": 1e-3},
          "i_max": {"": 1.0, "A": 1.0, "mA": 1e-3}, "dt_max": {"": 1.0, "K": 1.0, "C": 1.0, "°C": 1.0},
          "q_max": {"": 1.0, "W": 1.0, "mW": 1e-3}}
_COLUMNS = {"t_hot": "Th_C", "v_max": "Vmax_V", "i_max": "Imax_A", "dt_max": "dTmax_K", "q_max": "Qmax_W"}
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-z°]*)")
_EXAMPLE = "--rating 'Th=27, Vmax=14.3, Imax=4.4, dTmax=60, Qmax=37.7'"


def read_sheets(names: Sequence[str] = (), ratings: Sequence[str] = (), name: str = "module") -> Sheets:
    """Collect datasheets.

    Parameters
    ----------
    names : sequence of str
        CSV files with columns name, Th_C [°C], Vmax_V [V], Imax_A [A], dTmax_K [K] and Qmax_W [W] (may be empty); or
        names of `rt.systems.datasheets`. Rows of one name are the hot-side columns of one sheet.
    ratings : sequence of str
        Columns of one more sheet: "Th=27, Vmax=14.3, Imax=4.4, dTmax=60, Qmax=37.7", Th in °C unless it says K.
    name : str
        Name of the module of `ratings`.

    Returns
    -------
    dict
        Name to its columns, one `Rating` each.

    Raises
    ------
    InputError
        Nothing given, an unknown name, a file that cannot be read, numbers that are missing or wrong by a unit.

    Examples
    --------
    >>> import robthermal as rt
    >>> sheets = rt.jobs.datasheet.read_sheets(["RMT 1MC06-126-03"], ["Th=27, Vmax=15.4, Imax=3, dTmax=67"])
    >>> {name: len(columns) for name, columns in sheets.items()}
    {'RMT 1MC06-126-03': 3, 'module': 1}
    """
    found: Sheets = {}
    for one in names:
        for key, columns in _of_file_or_package(one).items():
            if key in found:
                raise InputError(f"module {quoted(key)} is given twice", where="datasheets", remedy="Leave one out.")
            found[key] = columns
    if ratings:
        if name in found:
            raise InputError(f"module {quoted(name)} is given twice", where="--rating",
                             remedy="Name the typed one with --name.")
        found[name] = tuple(_typed(text) for text in ratings)
    if not found:
        raise InputError("no datasheet is given", where="datasheet", expected="a name, a CSV file or --rating",
                         remedy=_EXAMPLE)
    return found


def _of_file_or_package(one: str) -> Sheets:
    path = Path(one)
    if path.suffix.lower() == ".csv":
        return _of_table(_table(path), str(path))
    known = datasheets()
    if one not in known.index:
        names = list(dict.fromkeys(known.index))
        near = difflib.get_close_matches(one, names, n=3, cutoff=0.3) or names[:3]
        raise InputError(f"there is no datasheet {quoted(one)}", where="datasheet", expected="a CSV file, or a name of "
                         f"rt.systems.datasheets(), the nearest {', '.join(map(repr, near))}",
                         remedy=f"Or type it: {_EXAMPLE}")
    return _of_table(known.loc[[one]].reset_index(), "robthermal.systems.datasheets")


def _table(path: Path) -> pd.DataFrame:
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(f"is larger than {_LARGEST // 1_000_000} MB", where=str(path))
        table = pd.read_csv(path, encoding="utf-8-sig", skipinitialspace=True)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=str(path), remedy="Check the path.") from None
    except (UnicodeDecodeError, ValueError) as error:  # pandas' own errors of parsing are ValueErrors
        raise InputError(f"is not a table in CSV: {quoted(str(error))}", where=str(path)) from None
    missing = [column for column in ("name", *_COLUMNS.values()) if column not in table.columns and column != "Qmax_W"]
    if missing:
        raise InputError(f"has no column {missing[0]!r}", where=str(path),
                         expected="columns name, " + ", ".join(_COLUMNS.values()),
                         remedy="Th_C in °C, Vmax_V in V, Imax_A in A, dTmax_K in K, Qmax_W in W (may be empty).")
    if table.empty:
        raise InputError("has no row", where=str(path), expected="one row per module and hot-side temperature")
    return table


def _of_table(table: pd.DataFrame, where: str) -> Sheets:
    found: Sheets = {}
    for number, row in enumerate(table.to_dict("records"), start=2):
        name = str(row["name"])
        place = f"{where}, line {number} ({name})" if where.lower().endswith(".csv") else f"{where}, {name}"
        values = {key: _cell(row.get(column), key, place) for key, column in _COLUMNS.items()}
        found[name] = (*found.get(name, ()), _rating(values, place, "C"))
    return found


def _cell(value: object, key: str, where: str) -> float | None:
    try:
        number = float(str(value))
    except ValueError:
        number = math.nan if value is None else math.inf
    if math.isnan(number) and key == "q_max":
        return None
    if not math.isfinite(number):
        raise InputError(f"{_COLUMNS[key]} is {quoted(value)}", where=where, expected="a number")
    return number


def _typed(text: str) -> Rating:
    values: dict[str, float | None] = {}
    scale = "C"
    for entry in filter(None, (part.strip() for part in re.split(r"[,;]", text))):
        label, equals, value = entry.partition("=")
        key = _KEYS.get(label.strip().lower().replace("_", "").replace("δ", "d").replace("delta", "d"))
        match = _NUMBER.fullmatch(value.strip())
        if not equals or key is None or match is None:
            raise InputError(f"{quoted(entry)} is no rated value", where="--rating",
                             expected="Th, Vmax, Imax, dTmax, Qmax = number, separated by commas", remedy=_EXAMPLE)
        if match[2] not in _UNITS[key]:
            raise InputError(f"{quoted(entry)} has the unit {match[2]!r}", where="--rating",
                             expected="one of " + ", ".join(filter(None, _UNITS[key])))
        if key in values:
            raise InputError(f"{_LABELS[key]} is given twice", where="--rating",
                             remedy="A second hot-side column is a second --rating.")
        values[key] = float(match[1]) * _UNITS[key][match[2]]
        scale = "K" if key == "t_hot" and match[2] == "K" else scale
    missing = [label for key, label in _LABELS.items() if key not in values and key != "q_max"]
    if missing:
        raise InputError(f"{missing[0]} is missing in {quoted(text)}", where="--rating",
                         expected="Th, Vmax, Imax, dTmax, and Qmax if the sheet has it", remedy=_EXAMPLE)
    return _rating({key: values.get(key) for key in _LABELS}, "--rating", scale)


def _rating(values: Mapping[str, float | None], where: str, scale: str) -> Rating:
    """A checked column; messages name the numbers as the sheet does."""
    hot = values["t_hot"] or 0.0
    if scale == "C" and hot > HIGHEST_CELSIUS:
        raise InputError(f"Th = {hot:g} °C is above {HIGHEST_CELSIUS:g} °C: it looks like kelvin", where=where,
                         expected="degrees Celsius", remedy=f"Write Th={hot:g}K, or {hot - ZERO_CELSIUS:g} °C.")
    if scale == "K" and hot < LOWEST_KELVIN:
        raise InputError(f"Th = {hot:g} K is below {LOWEST_KELVIN:g} K: it looks like degrees Celsius", where=where,
                         expected="kelvin", remedy=f"Write Th={hot:g}, without K.")
    numbers = {key: value for key, value in values.items() if value is not None}
    try:
        return Rating(**{**numbers, "t_hot": hot + (ZERO_CELSIUS if scale == "C" else 0.0)})
    except InputError as error:
        label = _LABELS.get(error.where.removeprefix("argument "), error.where)
        raise InputError(error.what, where=f"{where}, {label}", expected=error.expected,
                         remedy=error.remedy) from None
