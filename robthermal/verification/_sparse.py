"""Large sparse networks E x' = A x as certificates store them, and what floating-point sums over them are good for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from robthermal.errors import InputError

from ._fields import get
from ._numbers import as_float, exact, name_of

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
UNIT = 2.0**-52  # twice the rounding error of one operation
_MODERATE = (1e-90, 1e90)  # products of three such numbers neither overflow nor underflow


@dataclass(frozen=True)
class Numbers:
    """A list of exact numbers and the doubles nearest to them."""

    source: Any
    nearest: Floats

    def at(self, k: int) -> fmpq:
        """Return one number exactly."""
        return exact(self.source[k], "number")


@dataclass(frozen=True)
class Sparse:
    """Capacities and all entries of A."""

    capacity: Numbers
    rows: Indices
    cols: Indices
    values: Numbers


def read_sparse(table: Mapping[str, Any]) -> Sparse:
    """Return the network of a section `system`, or raise InputError."""
    capacity = numbers_of(get(table, "capacity", "system"), "system.capacity")
    n = len(capacity.nearest)
    if n == 0 or not bool(np.all(capacity.nearest > 0)):
        where = int(np.argmin(capacity.nearest > 0)) if n else 0
        raise InputError(f"capacity of lump {where} is missing or not positive", where="system.capacity")
    rows = _indices(get(table, "rows", "system"), n, "system.rows")
    cols = _indices(get(table, "cols", "system"), n, "system.cols")
    values = numbers_of(get(table, "values", "system"), "system.values")
    if not len(rows) == len(cols) == len(values.nearest):
        raise InputError(f"{len(rows)} rows, {len(cols)} cols, {len(values.nearest)} values", where="system",
                         expected="the same number of each")
    _no_duplicates(rows, cols, n)
    return Sparse(capacity, rows, cols, values)


def one_per_lump(value: Any, n: int, where: str) -> Numbers:
    """Return a list of n numbers."""
    found = numbers_of(value, where)
    if len(found.nearest) != n:
        raise InputError(f"{len(found.nearest)} numbers", where=where, expected=f"{n}, one per lump")
    return found


def moderate(values: Floats | np.float64) -> NDArray[np.bool_]:
    """Return which numbers are so far from the limits of doubles that products of three keep all their digits."""
    size = np.abs(values)
    return np.asarray((size >= _MODERATE[0]) & (size <= _MODERATE[1]))


def numbers_of(value: Any, where: str) -> Numbers:
    """Return a list of exact numbers and their doubles."""
    if isinstance(value, np.ndarray) and value.dtype == np.float64 and value.ndim == 1:
        if not bool(np.all(np.isfinite(value))):
            raise InputError(f"entry {int(np.argmin(np.isfinite(value)))} is not finite", where=where)
        return Numbers(value, value)
    if not isinstance(value, (list, tuple)):
        raise InputError(f"{name_of(type(value).__name__)} is not a list of numbers", where=where)
    nearest = [item if type(item) is float and math.isfinite(item) else as_float(exact(item, f"{where}[{k}]"))
               for k, item in enumerate(value)]
    return Numbers(value, np.array(nearest, dtype=np.float64))


def _indices(value: Any, n: int, where: str) -> Indices:
    if isinstance(value, np.ndarray):
        if value.ndim != 1 or value.dtype.kind not in "iu":
            raise InputError(f"array of {value.dtype}", where=where, expected="a list of integers")
        bad = np.flatnonzero((value < 0) | (value >= n))
        if len(bad):
            raise InputError(f"index {value[bad[0]]}", where=f"{where}[{bad[0]}]", expected=f"0 to {n - 1}")
        return value.astype(np.int64)
    if not isinstance(value, (list, tuple)):
        raise InputError(f"{name_of(type(value).__name__)} is not a list of integers", where=where)
    for k, item in enumerate(value):
        if type(item) is not int or not 0 <= item < n:
            raise InputError(f"index {name_of(item)}", where=f"{where}[{k}]", expected=f"an integer from 0 to {n - 1}")
    return np.array(value, dtype=np.int64)


def _no_duplicates(rows: Indices, cols: Indices, n: int) -> None:
    keys = np.sort(rows * np.int64(n) + cols)
    twice = np.flatnonzero(keys[1:] == keys[:-1])
    if len(twice):
        key = int(keys[twice[0]])
        raise InputError(f"entry ({key // n}, {key % n}) is given twice", where="system.rows, system.cols")
