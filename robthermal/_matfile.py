"""Variables of MATLAB files, format 4 and 5 to 7, read with every length checked.

Written out because `scipy.io.loadmat` crashes the interpreter on some damaged files. Format: MathWorks,
MAT-File Format (document R2019b), chapters 1 and 2. Decoded are numeric matrices, texts, cells of them and structs of
them; of everything else the kind is told.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _CHAR = 1, 2, 4
_TEXTS = {1: "latin-1", 2: "latin-1", 3: "utf-16", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_KINDS = {1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse matrix", 16: "function", 17: "opaque object"}
_COMPLEX = 0x0800
_NUMBERS_4 = {0: "f8", 1: "f4", 2: "i4", 3: "i2", 4: "u2", 5: "u1"}
_KINDS_4 = {1: "char", 2: "sparse matrix"}


@dataclass(frozen=True)
class Other:
    """A variable of a kind that is not decoded."""

    kind: str


Value = NDArray[Any] | str | Other | list[Any] | dict[str, Any]


def kind_of(value: Value) -> str:
    """What MATLAB calls it."""
    if isinstance(value, np.ndarray):
        return "complex matrix" if value.dtype.kind == "c" else "matrix"
    return value.kind if isinstance(value, Other) else {str: "char", list: "cell", dict: "struct"}[type(value)]


def read_matlab(content: bytes, most: float) -> dict[str, Value]:
    """Variables by name; at most `most` bytes are unpacked. ValueError for whatever does not fit the format."""
    try:
        if len(content) >= 20 and 0 in content[:4]:  # the text header of format 5 has no zero byte there
            return dict(_variables_4(content))
        return dict(_variables_5(content, most))
    except (struct.error, zlib.error, UnicodeDecodeError, OverflowError) as error:
        raise ValueError(str(error)) from None


def _variables_5(content: bytes, most: float) -> Iterator[tuple[str, Value]]:
    if len(content) < 136 or content[126:128] not in (b"IM", b"MI"):
        raise ValueError("no MATLAB header")
    order = "<" if content[126:128] == b"IM" else ">"
    unpacked = 0
    for kind, data in _elements(content[128:], order):
        if kind == _COMPRESSED:
            data = _unpack(data, most - unpacked)
            unpacked += len(data)
            kind, data = _next(_elements(data, order))
        if kind != _MATRIX:
            raise ValueError(f"element of type {kind} where a variable is expected")
        yield _matrix(data, order, fields=True)


def _unpack(data: bytes, most: float) -> bytes:
    stream = zlib.decompressobj()
    unpacked = stream.decompress(data, int(min(max(most, 1.0), 2.0**62)))
    if stream.unconsumed_tail:
        raise MemoryError("more data than max_bytes when unpacked")
    if not stream.eof:
        raise ValueError("compressed data end too early")
    return unpacked


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Type and content of the elements one after the other; small ones carry their content in the tag."""
    place = 0
    while place < len(data):
        (tag,) = struct.unpack_from(order + "I", data, place)
        if tag >> 16:
            kind, size, start, after = tag & 0xFFFF, tag >> 16, place + 4, place + 8
        else:
            (size,) = struct.unpack_from(order + "I", data, place + 4)
            kind, start = tag, place + 8
            after = start + (size if kind == _COMPRESSED else -(-size // 8) * 8)
        if start + size > len(data) or (tag >> 16 and size > 4):
            raise ValueError("an element is longer than the file")
        yield kind, data[start : start + size]
        place = after


def _matrix(data: bytes, order: str, *, fields: bool) -> tuple[str, Value]:
    """Name and value of one variable; `fields` says whether a struct is opened."""
    parts = _elements(data, order)
    flags = _integers(parts, order, 6)
    if len(flags) != 2:
        raise ValueError("array flags are missing")
    kind = int(flags[0]) & 0xFF
    if kind == 17:  # opaque objects have no dimensions
        return _opaque_name(parts), Other(_KINDS[kind])
    shape = tuple(int(size) for size in _integers(parts, order, 5))
    name = _text(parts)
    if kind == _STRUCT and fields and math.prod(shape) == 1:
        return name, _struct(parts, order)
    if kind == _CELL and fields:
        return name, _cell(parts, order, math.prod(shape))
    if kind == _CHAR and len(shape) == 2 and (shape[0] == 1 or not math.prod(shape)):
        return name, _characters(parts, order, math.prod(shape))
    if kind in _KINDS:
        return name, Other(_KINDS[kind])
    numbers = _numbers(parts, order)
    if int(flags[0]) & _COMPLEX:
        imaginary = _numbers(parts, order)
        if len(imaginary) != len(numbers):
            raise ValueError(f"variable {name!r} has {len(numbers)} real and {len(imaginary)} imaginary parts")
        both = np.empty(len(numbers), np.complex128)  # not real + 1j imaginary: that turns an infinity into NaN
        both.real, both.imag = numbers, imaginary
        numbers = both
    if len(shape) < 2 or min(shape) < 0 or math.prod(shape) != len(numbers):
        raise ValueError(f"variable {name!r} of shape {shape} holds {len(numbers)} numbers")
    return name, numbers.reshape(shape, order="F")


def _cell(parts: Iterator[tuple[int, bytes]], order: str, count: int) -> list[Any]:
    """Values of a cell array, column by column; what is nested in them is not opened."""
    found = []
    for kind, data in parts:
        if kind != _MATRIX:
            raise ValueError(f"element of type {kind} in a cell")
        found.append(_matrix(data, order, fields=False)[1] if data else Other("nothing"))
    if len(found) != count:
        raise ValueError(f"a cell of {count} holds {len(found)}")
    return found


def _characters(parts: Iterator[tuple[int, bytes]], order: str, count: int) -> str:
    if not count:
        return ""
    kind, data = _next(parts)
    if kind not in _TEXTS:
        raise ValueError(f"characters of unknown type {kind}")
    coding = _TEXTS[kind] if kind in (1, 2, 16) else _TEXTS[kind] + ("-le" if order == "<" else "-be")
    return data.decode(coding)


def _struct(parts: Iterator[tuple[int, bytes]], order: str) -> dict[str, Any]:
    width = int(_integers(parts, order, 5)[0])
    kind, packed = _next(parts)
    if kind != 1 or width < 1 or len(packed) % width:
        raise ValueError("field names are damaged")
    names = [packed[i : i + width].split(b"\0")[0].decode("ascii") for i in range(0, len(packed), width)]
    columns = {}
    for name in names:
        kind, data = _next(parts)
        if kind != _MATRIX:
            raise ValueError(f"field {name!r} is damaged")
        columns[name] = _matrix(data, order, fields=False)[1] if data else Other("nothing")
    return columns


def _next(parts: Iterator[tuple[int, bytes]]) -> tuple[int, bytes]:
    element = next(parts, None)
    if element is None:
        raise ValueError("a variable ends too early")
    return element


def _numbers(parts: Iterator[tuple[int, bytes]], order: str) -> NDArray[Any]:
    kind, data = _next(parts)
    if kind not in _NUMBERS:
        raise ValueError(f"numbers of unknown type {kind}")
    dtype = np.dtype(order + _NUMBERS[kind])
    if len(data) % dtype.itemsize:
        raise ValueError("numbers are cut off")
    return np.frombuffer(data, dtype)


def _integers(parts: Iterator[tuple[int, bytes]], order: str, kind: int) -> NDArray[Any]:
    found, data = _next(parts)
    if found != kind or len(data) % 4 or not data:
        raise ValueError("a variable has no proper head")
    return np.frombuffer(data, np.dtype(order + _NUMBERS[kind]))


def _text(parts: Iterator[tuple[int, bytes]]) -> str:
    _, data = _next(parts)
    return data.decode("utf-8")


def _opaque_name(parts: Iterator[tuple[int, bytes]]) -> str:
    return _text(parts) or "unnamed object"


def _variables_4(content: bytes) -> Iterator[tuple[str, Value]]:
    place = 0
    while place < len(content):
        order = "<" if struct.unpack_from("<i", content, place)[0] in range(5000) else ">"
        code, rows, columns, imaginary, length = struct.unpack_from(order + "5i", content, place)
        machine, digit, precision, kind = code // 1000, code // 100 % 10, code // 10 % 10, code % 10
        if machine not in (0, 1) or digit or precision not in _NUMBERS_4 or kind > 2 or min(rows, columns, length) < 0:
            raise ValueError("no MATLAB variable head")
        dtype = np.dtype(order + _NUMBERS_4[precision])
        start = place + 20 + length
        size = rows * columns * dtype.itemsize
        place = start + size * (2 if imaginary else 1)
        if place > len(content):
            raise ValueError("a variable is longer than the file")
        name = content[start - length : start].split(b"\0")[0].decode("ascii")
        if kind or imaginary:
            yield name, Other(_KINDS_4.get(kind, "complex matrix"))
        else:
            yield name, np.frombuffer(content[start : start + size], dtype).reshape((rows, columns), order="F")
