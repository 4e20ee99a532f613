"""What every file format offers to the reader: column headers, columns of finite numbers, and where a row stands."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ._checks import Array

_TWO_GIB = 2**31
_TEXT_TO_MEMORY = 4  # a file needs up to four times its size while it is parsed


class Source(Protocol):
    """An opened data file."""

    @property
    def path(self) -> Path:
        """Where it lies."""
        ...

    @property
    def headers(self) -> tuple[str, ...]:
        """Column headers as written, units included."""
        ...

    def read(self, wanted: Sequence[str]) -> dict[str, Array]:
        """The wanted columns, equally long."""
        ...

    def row(self, index: int) -> str:
        """Words for the place of data row `index`, counted from 0."""
        ...


def check_file(path: Path, max_bytes: float | None) -> None:
    """Refuse what is no file, empty, or larger than memory, before anything is read."""
    if not path.exists():
        raise InputError("there is no such file", where=f"{path}")
    if not path.is_file():
        raise InputError("this is not a file", where=f"{path}")
    try:
        size = path.stat().st_size
        with path.open("rb"):
            pass
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror or error})", where=f"{path}") from None
    if size == 0:
        raise InputError("the file is empty", where=f"{path}", expected="a header row and data rows")
    refuse_large(path, size, "bytes", max_bytes)


def refuse_large(path: Path, size: float, unit: str, max_bytes: float | None) -> None:
    """Refuse `size` [bytes] above the limit: given, or 2 GiB, or what the memory of this machine can hold."""
    limit = memory_limit(max_bytes)
    if size > limit:
        raise InputError(
            f"the data have {size:.4g} {unit}, more than the limit of {limit:.4g} (max_bytes)",
            where=f"{path}",
            expected="a record that fits into memory",
            remedy="Slice the file, or leave columns out; max_bytes= raises the limit.",
        )


def memory_limit(max_bytes: float | None) -> float:
    """Largest size of a record [bytes]."""
    return min(_TWO_GIB, _memory() / _TEXT_TO_MEMORY) if max_bytes is None else max_bytes


def _memory() -> float:
    """Physical memory [bytes]; infinite where the operating system does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # no sysconf on Windows
        return float("inf")


def numeric(column: NDArray[Any], header: str, path: Path) -> Array:
    """A column of a typed file as floats; text, complex numbers, booleans and objects are refused."""
    if column.dtype.kind not in "fiu":
        kind = {"b": "booleans", "c": "complex numbers", "U": "text", "S": "text", "O": "text or objects", "M": "dates"}
        raise InputError(
            f"column {header!r} holds {kind.get(column.dtype.kind, str(column.dtype))}",
            where=f"{path}",
            expected="real numbers",
        )
    return np.asarray(column, dtype=np.float64)


def equally_long(columns: dict[str, Array], path: Path) -> None:
    """Refuse columns of different lengths."""
    lengths = {header: len(column) for header, column in columns.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{header!r}: {length}" for header, length in lengths.items())
        raise InputError(f"the columns differ in length ({told})", where=f"{path}", expected="one value per time")
