"""Tables that are in memory already: data frames, series, dictionaries of arrays, structured arrays."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import timedelta
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from ..._pandas import pd
from ...errors import InputError
from .._stated import KEY, of_value
from ._table import Lines, Table


def is_in_memory(source: Any) -> bool:
    """Whether a source is a frame, a series, a mapping or a structured array."""
    if isinstance(source, str | Path):  # a missing file is answered before pandas is loaded
        return False
    return isinstance(source, pd.DataFrame | pd.Series | Mapping) or (
        isinstance(source, np.ndarray) and bool(source.dtype.names)
    )


def read_frame(source: Any) -> Table:
    """A source in memory as a table.

    Parameters
    ----------
    source : DataFrame, Series, mapping of name to array, or structured ndarray
        A DatetimeIndex or TimedeltaIndex, or a named index of numbers, becomes the time column.

    Raises
    ------
    InputError
        Columns of different lengths, more than one dimension, nothing in it.
    """
    where = type(source).__name__
    if isinstance(source, np.ndarray):
        source = pd.DataFrame({name: _flat(source[name], name, where) for name in source.dtype.names or ()})
    elif isinstance(source, Mapping):
        columns = {str(name): _flat(value, str(name), where) for name, value in source.items()}
        lengths = {name: len(column) for name, column in columns.items()}
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{name!r}: {n}" for name, n in list(lengths.items())[:8])
            raise InputError(f"the arrays differ in length ({told})", where=where, expected="one value per time")
        source = pd.DataFrame(columns)
    elif isinstance(source, pd.Series):
        source = source.to_frame(source.name if source.name is not None else "value")
    return frame_table(source, where)


def frame_table(frame: pd.DataFrame, where: str, first_row: int = 0) -> Table:
    """A data frame as a table.

    Parameters
    ----------
    frame : DataFrame
        Columns are headers.
    where : str
        Name of the data frame in messages.
    first_row : int
        Number of the first row, for messages.
    """
    if frame.columns.nlevels > 1:
        raise InputError("the columns have several levels", where=where, expected="one header per column")
    if not len(frame) or not len(frame.columns):
        raise InputError("there are no rows", where=where, expected="a row per sample")
    headers = [str(name).strip() if not str(name).startswith("Unnamed:") else "" for name in frame.columns]
    columns: list[Any] = [plain_column(frame.iloc[:, k]) for k in range(len(headers))]
    index = frame.index
    if isinstance(index, pd.DatetimeIndex | pd.TimedeltaIndex):
        headers.insert(0, _index_name(headers))
        columns.insert(0, index if isinstance(index, pd.DatetimeIndex) else np.asarray(index.total_seconds(), float))
    elif index.name is not None and pd.api.types.is_numeric_dtype(index):
        headers.insert(0, str(index.name))
        columns.insert(0, np.asarray(index, float))
    facts = {"rows": len(frame), KEY: of_value(frame.attrs.get(KEY))}
    return Table(where, tuple(headers), columns, Lines(np.arange(first_row, first_row + len(frame))), facts=facts)


def plain_column(column: pd.Series[Any]) -> Any:
    """float64 with nan for missing, a DatetimeIndex, or an object column of texts."""
    if pd.api.types.is_datetime64_any_dtype(column.dtype):
        return pd.DatetimeIndex(column)
    if pd.api.types.is_timedelta64_dtype(column.dtype):
        return column.dt.total_seconds().to_numpy(float)
    if pd.api.types.is_bool_dtype(column.dtype):
        return column.astype(str).to_numpy(object)
    if pd.api.types.is_complex_dtype(column.dtype):
        raise InputError(f"column {str(column.name)!r} has complex numbers", where="DataFrame", expected="real numbers")
    if pd.api.types.is_numeric_dtype(column.dtype):
        return column.to_numpy(dtype=float, na_value=np.nan)
    return _of_objects(column)


def _of_objects(column: pd.Series[Any]) -> Any:
    """Cells of several kinds: dates, spans of time, numbers, else texts."""
    gone = column.isna().to_numpy(bool)
    cells = column.to_numpy(object)
    there = cells[~gone]
    if len(there) and all(isinstance(cell, timedelta) for cell in there):  # elapsed times of a workbook
        return pd.to_timedelta(pd.Series(np.where(gone, None, cells))).dt.total_seconds().to_numpy(float)
    if len(there) and all(hasattr(c, "isoformat") and hasattr(c, "hour") and hasattr(c, "year") for c in there):
        return pd.DatetimeIndex(pd.to_datetime(pd.Series(np.where(gone, None, cells))))
    numbers = all(isinstance(c, int | float | Decimal | np.number) and not isinstance(c, bool) for c in there)
    found = np.full(len(cells), np.nan, float if numbers else object)
    found[~gone] = [float(cell) if numbers else str(cell) for cell in there]
    return found


def _flat(value: Any, name: str, where: str) -> Any:
    if isinstance(value, pd.Series | pd.DatetimeIndex | pd.TimedeltaIndex):
        return value.to_numpy() if isinstance(value, pd.Series) else value
    if np.ma.isMaskedArray(value):  # what is masked was not measured
        value = np.ma.filled(np.ma.asarray(value).astype(float), np.nan)
    array = np.asarray(value)
    if array.ndim == 2 and 1 in array.shape:
        array = array.reshape(-1)
    if array.ndim != 1:
        raise InputError(f"{name!r} has shape {array.shape}", where=where, expected="one dimension, a value per time")
    if array.dtype.kind == "c":
        raise InputError(f"{name!r} holds complex numbers", where=where, expected="real numbers")
    return array


def _index_name(headers: list[str]) -> str:
    return "time" if "time" not in (header.lower() for header in headers) else "index time"
