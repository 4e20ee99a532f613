"""Matrix Market files (Boisvert, Pozo and Remington, NISTIR 5935, 1996), read with every index checked.

Written out because `scipy.io.mmread` crashes the interpreter on some damaged files.
"""

from __future__ import annotations

import gzip
import io
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[np.float64]
_MOST_ROWS, _MOST_ENTRIES = 20_000_000, 500_000_000  # a corrupt header must not ask for all memory
_LINE = 1024  # bytes of a line, by the format
_ENTRY = 100  # bytes: two indices and a number, generously
_SIGN = {"general": 0.0, "symmetric": 1.0, "skew-symmetric": -1.0}  # of the mirrored entries


@dataclass(frozen=True)
class _Head:
    sparse: bool
    sign: float
    rows: int
    columns: int
    entries: int


def read_market(path: Path) -> scipy.sparse.csr_array:
    """Read a real matrix.

    Parameters
    ----------
    path : Path
        .mtx or .mtx.gz, coordinate or array, general, symmetric or skew-symmetric.

    Returns
    -------
    csr_array

    Raises
    ------
    InputError
        A type of numbers or a size that no network has.
    ValueError, OSError, EOFError, zlib.error
        Damaged.
    """
    with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
        head = _head(file, path)
        text = file.read(_ENTRY * head.entries + _LINE)
        if file.read(1):
            raise ValueError("more text than entries are declared")
    table = _numbers(text, 3 if head.sparse else 1, head.entries)
    where, values = (_places(table, head), table[:, 2]) if head.sparse else (_column_by_column(head), table[:, 0])
    if head.sign:
        off = where[0] != where[1]
        values = np.concatenate([values, head.sign * values[off]])
        where = np.concatenate([where, where[::-1, off]], axis=1)
    return scipy.sparse.coo_array((values, (where[0], where[1])), shape=(head.rows, head.columns)).tocsr()


def _head(file: gzip.GzipFile | io.BufferedReader, path: Path) -> _Head:
    words = _line(file).lower().split()
    if len(words) != 5 or words[:2] != ["%%matrixmarket", "matrix"] or words[2] not in ("coordinate", "array"):
        raise ValueError("no header of Matrix Market")
    _, _, layout, kind, symmetry = words
    line = _line(file)
    while line.startswith("%") or (line and not line.strip()):
        line = _line(file)
    sizes = [int(word) for word in line.split()]
    sparse = layout == "coordinate"
    if len(sizes) != (3 if sparse else 2) or min(sizes) < 0:
        raise ValueError("no line of sizes")
    rows, columns = sizes[:2]
    half = symmetry != "general"
    entries = sizes[2] if sparse else rows * (rows + 1) // 2 - (symmetry == "skew-symmetric") * rows if half else (
        rows * columns)
    if max(rows, columns) > _MOST_ROWS or entries > _MOST_ENTRIES or kind not in ("real", "integer"):
        raise InputError(f"declares {rows} by {columns} and {entries} entries of type {kind}", where=str(path),
                         expected=f"real numbers, at most {_MOST_ROWS} rows", remedy="Is this the right file?")
    if symmetry not in _SIGN or (half and rows != columns):
        raise ValueError(f"a {symmetry} matrix of {rows} by {columns}")
    return _Head(sparse, _SIGN[symmetry], rows, columns, entries)


def _line(file: gzip.GzipFile | io.BufferedReader) -> str:
    line = file.readline(_LINE + 1)
    if len(line) > _LINE:
        raise ValueError(f"a line of more than {_LINE} bytes")
    return line.decode("utf-8")


def _numbers(text: bytes, width: int, entries: int) -> Array:
    if not entries:
        return np.zeros((0, width))
    with warnings.catch_warnings(action="ignore", category=UserWarning):  # of no numbers at all, refused below
        table = np.loadtxt(io.StringIO(text.decode("ascii")), comments="%", ndmin=2)
    if table.shape != (entries, width) or not np.isfinite(table).all():
        raise ValueError(f"not {entries} lines of {width} finite numbers")
    return table


def _places(table: Array, head: _Head) -> NDArray[np.intp]:
    """Rows and columns of the entries, counted from 0."""
    where = table[:, :2].T - 1.0
    if np.any(where != np.floor(where)) or np.any(where < 0) or np.any(where.T >= (head.rows, head.columns)):
        raise ValueError("an entry lies outside the matrix")
    return where.astype(np.intp)


def _column_by_column(head: _Head) -> NDArray[np.intp]:
    """Rows and columns of the numbers of an array: all, or those on and below (skew: below) the diagonal."""
    column, row = np.divmod(np.arange(head.rows * head.columns), max(head.rows, 1))
    if head.sign:
        kept = row >= column if head.sign > 0 else row > column
        row, column = row[kept], column[kept]
    return np.array([row, column], np.intp)
