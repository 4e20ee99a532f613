"""MATLAB .mat, format 4 to 7: one variable per column, or one struct with a field per column."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .._matfile import Value, kind_of, read_matlab
from ..errors import InputError
from ._checks import Array
from ._source import equally_long, memory_limit, numeric, refuse_large

_HDF5 = b"\x89HDF\r\n\x1a\n"


class MatlabSource:
    """A .mat file, read."""

    def __init__(self, path: Path, max_bytes: float | None):
        self.path = path
        content = path.read_bytes()
        if content.startswith(b"MATLAB 7.3") or _HDF5 in content[:520]:
            raise InputError(
                "the file has the MATLAB format 7.3 (HDF5)",
                where=f"{path}",
                expected="format 4 to 7",
                remedy="Save it in MATLAB with save(..., '-v7').",
            )
        limit = memory_limit(max_bytes)
        try:
            variables = read_matlab(content, limit)
        except ValueError as error:
            raise InputError(f"this is no MATLAB file, or a damaged one ({error})", where=f"{path}") from None
        except MemoryError:  # compressed: a small file may hold large variables
            refuse_large(path, np.inf, "bytes unpacked", max_bytes)
        self._columns = _columns(variables)
        self.headers = tuple(self._columns)

    def read(self, wanted: Sequence[str]) -> dict[str, Array]:
        """The wanted columns."""
        columns = {header: self._vector(header, self._columns[header]) for header in wanted}
        equally_long(columns, self.path)
        return columns

    def row(self, index: int) -> str:
        """Words for a data row, counted from 0."""
        return f"row {index}"

    def _vector(self, header: str, value: Value) -> Array:
        if not isinstance(value, np.ndarray) or value.dtype.kind == "c":
            raise InputError(f"variable {header!r} is a {kind_of(value)}", where=f"{self.path}",
                             expected="a real numeric vector")
        if value.ndim != 2 or 1 not in value.shape:
            raise InputError(
                f"{header!r} has shape {value.shape}", where=f"{self.path}", expected="a numeric vector, one column"
            )
        return numeric(value.reshape(-1), header, self.path)


def _columns(variables: dict[str, Value]) -> dict[str, Value]:
    """The fields of the only struct, unless time is a variable of its own."""
    structs = [value for value in variables.values() if isinstance(value, dict)]
    if any(name.lower() == "time" for name in variables) or len(structs) != 1:
        return variables
    return structs[0]
