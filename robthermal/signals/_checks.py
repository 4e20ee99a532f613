"""What a record refuses: every message names the argument, the channel, the row and the time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._checks import finite_number as finite_number
from .._checks import positive_number as positive_number
from ..errors import InputError

Array = NDArray[np.float64]


def channel_names(value: object, where: str) -> tuple[str, ...]:
    """`value` as a tuple of non-empty texts, none twice."""
    if isinstance(value, (str, bytes)) or not isinstance(value, (Sequence, np.ndarray)):
        raise InputError(
            f"{where} is {value!r}",
            where=f"argument {where}",
            expected="a list of channel names",
            remedy="Write ['T1'].",
        )
    names = []
    for place, name in enumerate(value):
        if not isinstance(name, str) or not name.strip():
            raise InputError(
                f"name {place} is {name!r}", where=f"argument {where}", expected="names that are non-empty text"
            )
        if name in names:
            raise InputError(f"the name {name!r} is used twice", where=f"argument {where}", expected="names used once")
        names.append(str(name))
    return tuple(names)


def distinct(input_names: Sequence[str], output_names: Sequence[str]) -> None:
    """Refuse a name that stands for an input and an output."""
    for name in output_names:
        if name in input_names:
            raise InputError(
                f"the name {name!r} is used twice, for an input and for an output",
                where="argument output_names",
                expected="every name once among inputs and outputs",
                remedy="Rename one of the two.",
            )


def channel_units(value: object, names: Sequence[str]) -> dict[str, str]:
    """`value` as a dictionary from channel name to unit text."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise InputError(f"units is {value!r}", where="argument units", expected="a mapping from channel name to text")
    for name, unit in value.items():
        if name not in names:
            raise InputError(
                f"there is no channel {name!r}", where="argument units", expected=f"some of {', '.join(names)}"
            )
        if not isinstance(unit, str):
            raise InputError(f"the unit of {name!r} is {unit!r}", where="argument units", expected="text such as 'K'")
    return dict(value)


def channel_matrix(value: ArrayLike, names: Sequence[str], where: str, sample_time: float, start_time: float) -> Array:
    """`value` as read-only (n, channels) finite floats, columns named by `names`."""
    matrix = _two_dimensional(_real_numbers(value, where), where)
    if matrix.shape[1] != len(names):
        singular = where.removesuffix("s")
        raise InputError(
            f"{where} has {matrix.shape[1]} columns and {singular}_names has {len(names)} names",
            where=f"argument {where}",
            expected=f"one column per name, an array of shape (n_samples, {len(names)})",
            remedy="Transpose it: time runs down." if matrix.shape[0] == len(names) != matrix.shape[1] else "",
        )
    wrong = np.argwhere(~np.isfinite(matrix))
    if wrong.size:
        row, column = (int(i) for i in wrong[0])
        raise InputError(
            f"channel {names[column]!r} is {matrix[row, column]} (not finite) in row {row}, "
            f"time {start_time + row * sample_time:.10g} s"
            + (f"; {len(wrong)} such values in all" if len(wrong) > 1 else ""),
            where=f"argument {where}",
            expected="finite numbers",
            remedy="Cut the record there, or repair the data.",
        )
    matrix.setflags(write=False)
    return matrix


def _two_dimensional(array: Array, where: str) -> Array:
    if array.ndim == 1:
        return array[:, np.newaxis]
    if array.ndim != 2:
        raise InputError(
            f"{where} has shape {array.shape}", where=f"argument {where}", expected="an array (n_samples, channels)"
        )
    return array


def _real_numbers(value: ArrayLike, where: str) -> Array:
    """A C-contiguous float copy, or the array itself if it is read-only; other kinds of values are refused."""
    expected = "real numbers, an array (n_samples, channels)"
    if _is_frozen(value):
        return value  # type: ignore[return-value]
    if np.ma.isMaskedArray(value) and np.ma.is_masked(value):
        row = int(np.argwhere(np.ma.getmaskarray(value))[0][0])
        raise InputError(f"a value is masked (missing) in row {row}", where=f"argument {where}", expected=expected)
    try:
        raw = np.asarray(value)
    except (ValueError, TypeError) as error:  # rows of different lengths
        raise InputError(
            f"{where} is not a rectangular array ({error})", where=f"argument {where}", expected=expected
        ) from None
    if raw.dtype.kind == "O":
        raw = _unpacked(raw, where, expected)
    if raw.dtype.kind not in "fiu":
        kind = {"b": "booleans", "c": "complex numbers", "U": "text", "S": "text", "M": "dates", "m": "time spans"}
        raise InputError(
            f"{where} holds {kind.get(raw.dtype.kind, str(raw.dtype))}", where=f"argument {where}", expected=expected
        )
    with np.errstate(over="ignore"):  # a long double beyond float becomes inf, refused below with its row
        return np.array(raw, dtype=np.float64, order="C")


def _is_frozen(value: object) -> bool:
    """Whether nobody can change an array any more, so that no copy is needed."""
    if type(value) is not np.ndarray or value.dtype != np.float64 or not value.flags.c_contiguous:
        return False
    base = value.base
    return not value.flags.writeable and (base is None or type(base) is np.ndarray and not base.flags.writeable)


def _unpacked(raw: NDArray[Any], where: str, expected: str) -> Array:
    """An object array as floats: numbers of any length are welcome, everything else is named."""
    flat = np.empty(raw.size)
    for place, item in enumerate(raw.ravel()):
        row = place // (raw.size // raw.shape[0]) if raw.ndim else 0
        if isinstance(item, (bool, np.bool_)) or not isinstance(item, (Real, np.integer, np.floating)):
            raise InputError(f"row {row} holds {item!r}, not a number", where=f"argument {where}", expected=expected)
        try:
            flat[place] = float(item)
        except OverflowError:
            raise InputError(
                f"row {row} holds an integer too large for a float (overflow)",
                where=f"argument {where}",
                expected=expected,
            ) from None
    return flat.reshape(raw.shape)


def ripple_of(value: object, names: Sequence[str], n: int) -> dict[str, Array]:
    """`value` as read-only columns (n,), not negative, by input; those that are zero throughout are left out."""
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not set(value) <= set(names):
        raise InputError(f"ripple is {value!r}"[:200], where="argument ripple",
                         expected="a mapping from input to its ripple in every sample")
    columns = {str(name): _real_numbers(column, "ripple") for name, column in value.items()}
    for name, column in columns.items():
        if column.shape != (n,) or not np.isfinite(column).all() or column.min() < 0.0:
            raise InputError(f"the ripple of {name!r} is no column of {n} finite values, none negative",
                             where="argument ripple")
        column.setflags(write=False)
    return {name: column for name, column in columns.items() if column.any()}


def same_length(U: Array, Y: Array) -> None:
    """Refuse inputs and outputs without a channel, of different lengths, or of fewer than two samples."""
    if U.shape[1] == 0 and Y.shape[1] == 0:
        raise InputError(
            "the record has neither inputs nor outputs",
            where="arguments inputs and outputs",
            expected="at least one channel",
            remedy="Give input_names or output_names.",
        )
    if U.shape[0] != Y.shape[0]:
        raise InputError(
            f"inputs have {U.shape[0]} rows and outputs have {Y.shape[0]} rows: their lengths differ",
            where="arguments inputs and outputs",
            expected="the same number of samples",
            remedy="A record without inputs has inputs of shape (n_samples, 0)." if 0 in (U.size, Y.size) else "",
        )
    if U.shape[0] < 2:
        raise InputError(
            f"the record has {U.shape[0]} samples: it is {'empty' if U.shape[0] == 0 else 'a single sample'}",
            where="arguments inputs and outputs",
            expected="at least two samples",
        )


def truth(value: object) -> bool:
    """`value` of the argument `averaged`."""
    if not isinstance(value, bool):
        raise InputError(f"averaged is {value!r}", where="argument averaged", expected="True or False")
    return value


def text(value: object, where: str) -> str:
    """`value` as text."""
    if not isinstance(value, str):
        raise InputError(f"{where} is {value!r}", where=f"argument {where}", expected="text")
    return value


def texts(value: object) -> tuple[str, ...]:
    """`value` of the argument `notes`, a list of texts."""
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise InputError(f"notes is {value!r}", where="argument notes", expected="a list of texts")
    return tuple(text(note, "notes") for note in value)
