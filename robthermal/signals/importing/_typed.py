"""Files of typed columns as tables: Parquet, MATLAB, TDMS."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from ..._matfile import Value, kind_of, read_matlab
from ..._pandas import pd
from ...errors import InputError
from .._export import require_pyarrow
from .._source import memory_limit, refuse_large
from .._stated import KEY, of_value
from .._tdms import TdmsSource
from ._frames import frame_table
from ._options import ImportOptions
from ._table import Table
from ._tokens import short
from ._units import split_header

_HDF5 = b"\x89HDF\r\n\x1a\n"


def read_parquet(path: Path, max_bytes: float | None) -> Table:
    """A Parquet file as a table; missing values are missing readings.

    Parameters
    ----------
    path : Path
        Parquet file to read.
    max_bytes : float or None
        Largest size unpacked [bytes].
    """
    pyarrow, parquet = require_pyarrow()
    broken = (pyarrow.ArrowException, OSError, UnicodeDecodeError, ValueError)
    try:
        file = parquet.ParquetFile(path)
        refuse_large(path, 8.0 * file.metadata.num_rows * len(file.schema_arrow.names), "bytes unpacked", max_bytes)
        frame = file.read().to_pandas()
        if word := of_value((file.schema_arrow.metadata or {}).get(KEY.encode())):
            frame.attrs[KEY] = word
    except InputError:
        raise
    except broken as error:
        raise InputError(f"this is no Parquet file, or a damaged one ({short(error, 80)})", where=f"{path}") from None
    return _with_hash(frame_table(frame, f"{path}"), path)


def read_mat(path: Path, options: ImportOptions, max_bytes: float | None) -> Table:
    """A MATLAB file (format 4 to 7) as a table: variables of one length, or a scalar struct of them.

    Parameters
    ----------
    path : Path
        MATLAB file to read.
    options : ImportOptions
        Import options, of which `variable` is used.
    max_bytes : float or None
        Largest size unpacked [bytes].
    """
    content = path.read_bytes()
    if content.startswith(b"MATLAB 7.3") or _HDF5 in content[:520]:
        raise InputError(
            "the file has the MATLAB format 7.3 (HDF5)",
            where=f"{path}",
            expected="format 4 to 7",
            remedy="Save it in MATLAB with save(..., '-v7').",
        )
    try:
        variables = read_matlab(content, memory_limit(max_bytes))
    except ValueError as error:
        raise InputError(f"this is no MATLAB file, or a damaged one ({short(error, 80)})", where=f"{path}") from None
    except MemoryError:
        refuse_large(path, np.inf, "bytes unpacked", max_bytes)
        raise
    found = _variables(variables, options, path)
    columns = {name: _vector(value) for name, value in found.items() if _is_vector(value)}
    left_out = {name: f"a {kind_of(value)}" for name, value in found.items() if name not in columns}
    if not columns:
        listed = ", ".join(f"{name} ({kind_of(value)})" for name, value in list(found.items())[:8])
        raise InputError(
            f"there are no numeric vectors in it: {listed or 'nothing that can be read'}",
            where=f"{path}",
            expected="variables of one length, or a struct of them",
            remedy="Timetables, tables and timeseries are opaque outside MATLAB: writetimetable(tt, 'run.csv'), "
            "or save a struct made with table2struct(..., 'ToScalar', true).",
        )
    table = _equally_long(columns, left_out, path)
    table.facts[KEY] = of_value(found.get(KEY))
    return _with_hash(table, path)


def _equally_long(columns: dict[str, Any], left_out: dict[str, str], path: Path) -> Table:
    """Table of the columns as long as the time, else as most of them; the others are remembered as left out."""
    clock = next((name for name in columns if split_header(name)[0].lower() in ("time", "t")), None)
    lengths = [len(column) for column in columns.values()]
    n = len(columns[clock]) if clock is not None else max(set(lengths), key=lengths.count)
    left_out |= {
        name: f"of length {len(column)}, the time of length {n}" for name, column in columns.items() if len(column) != n
    }
    table = frame_table(pd.DataFrame({name: column for name, column in columns.items() if len(column) == n}), f"{path}")
    table.facts["left_out"] = left_out
    return table


def _variables(variables: dict[str, Value], options: ImportOptions, path: Path) -> dict[str, Value]:
    if options.variable is not None:
        value = variables.get(options.variable)
        if not isinstance(value, dict):
            raise InputError(
                f"variable = {options.variable!r}: "
                + ("there is none" if value is None else f"it is a {kind_of(value)}"),
                where=f"{path}",
                expected="a scalar struct: " + ", ".join(list(variables)[:10]),
            )
        return value
    structs = [value for value in variables.values() if isinstance(value, dict)]
    if any(name.lower() in ("time", "t") for name in variables) or len(structs) != 1:
        return variables
    return structs[0]


def _is_vector(value: Value) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.ndim == 2 and 1 in value.shape


def _vector(value: Any) -> Any:
    return np.asarray(value.reshape(-1), float)


def read_tdms(path: Path, max_bytes: float | None) -> Table:
    """A National Instruments TDMS file as a table; groups that repeat a channel name put the group before it.

    Parameters
    ----------
    path : Path
        TDMS file to read.
    max_bytes : float or None
        Largest size unpacked [bytes].
    """
    source = TdmsSource(path, max_bytes)
    columns, left_out = source.everything()
    table = _equally_long(columns, left_out, path)
    if source.origin is not None:
        table.facts["origin"] = source.origin
    return _with_hash(table, path)


def _with_hash(table: Table, path: Path) -> Table:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    table.facts["sha256"] = digest.hexdigest()
    return table
