"""MATLAB .mat, version 4 to 7: one variable per column, or one struct with a field per column."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from zlib import error as BadCompression  # noqa: N812 - the name says what went wrong

import numpy as np
from scipy.io import loadmat, whosmat
from scipy.io.matlab import MatReadError

from ..errors import InputError
from ._checks import Array
from ._source import equally_long, numeric, refuse_large

_DAMAGED = (ValueError, TypeError, KeyError, IndexError, OSError, MatReadError, BadCompression, OverflowError)
_HDF5 = b"\x89HDF\r\n\x1a\n"


class MatlabSource:
    """A .mat file, its list of variables read."""

    def __init__(self, path: Path, max_bytes: float | None):
        self.path = path
        self._refuse_hdf5()
        try:
            variables = whosmat(str(path))
        except NotImplementedError:
            raise self._version_7_3() from None
        except _DAMAGED as error:
            raise InputError(f"this is no MATLAB file ({error})", where=f"{path}") from None
        # Compressed: a small file may hold large variables.
        refuse_large(path, 8.0 * sum(float(np.prod(shape)) for _, shape, _ in variables), "bytes unpacked", max_bytes)
        self._kinds = {name: kind for name, _, kind in variables}
        self._struct = self._only_struct()
        if self._struct:
            self._columns = self._load(self._struct)
            self.headers = tuple(self._columns)
        else:
            self._columns = {}
            self.headers = tuple(self._kinds)

    def read(self, wanted: Sequence[str]) -> dict[str, Array]:
        """The wanted columns."""
        columns = {}
        for header in wanted:
            if not self._struct and self._kinds[header] in ("function", "object", "opaque", "cell", "struct", "char"):
                raise InputError(
                    f"variable {header!r} is a {self._kinds[header]}", where=f"{self.path}", expected="a numeric vector"
                )
            raw = self._columns[header] if self._struct else self._load(header)
            columns[header] = self._vector(header, raw)
        equally_long(columns, self.path)
        return columns

    def row(self, index: int) -> str:
        """Words for a data row, counted from 0."""
        return f"row {index}"

    def _only_struct(self) -> str:
        """Name of the struct that holds the columns, when time is not a variable of its own."""
        structs = [name for name, kind in self._kinds.items() if kind == "struct"]
        if any(name.lower() == "time" for name in self._kinds) or len(structs) != 1:
            return ""
        return structs[0]

    def _load(self, name: str) -> Any:
        try:
            value = loadmat(str(self.path), variable_names=[name], squeeze_me=False)[name]
        except _DAMAGED as error:
            raise InputError(f"variable {name!r} is damaged ({error})", where=f"{self.path}") from None
        if self._kinds[name] != "struct":
            return value
        if value.size != 1:
            raise InputError(
                f"struct {name!r} is an array of {value.size} structs",
                where=f"{self.path}",
                expected="one struct with a field per column",
            )
        return {field: value.reshape(-1)[0][field] for field in value.dtype.names}

    def _vector(self, header: str, raw: Any) -> Array:
        value = np.asarray(raw)
        if value.ndim != 2 or 1 not in value.shape or value.dtype.names:
            raise InputError(
                f"{header!r} has shape {value.shape}", where=f"{self.path}", expected="a numeric vector, one column"
            )
        return numeric(value.reshape(-1), header, self.path)

    def _refuse_hdf5(self) -> None:
        with self.path.open("rb") as file:
            head = file.read(520)
        if head.startswith((b"MATLAB 7.3", _HDF5)) or _HDF5 in head:
            raise self._version_7_3()

    def _version_7_3(self) -> InputError:
        return InputError(
            "the file has the MATLAB format 7.3 (HDF5)",
            where=f"{self.path}",
            expected="format 5 to 7",
            remedy="Save it in MATLAB with save(..., '-v7').",
        )
