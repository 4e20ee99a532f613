"""Short hashes of exact content: the same for the same numbers and names, however the numbers are written.

The hash is that of a canonical text. A number is ``d`` and the 16 hexadecimal digits of a double (IEEE 754, most
significant byte first) where it equals the shortest decimal of that double, else ``p/q`` in lowest terms. A text that
denotes a number (0.5, 5e-1 and "0x1p-1" are one) is that number, any other text is JSON in ASCII. Lists are in square
brackets, objects in braces with their keys sorted, commas between, no spaces.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from flint import fmpq

from robthermal.errors import InputError

from ._numbers import as_float, exact, name_of

_DIGITS = 12
_LARGEST = 2**53  # whole numbers up to here are their own shortest decimals


class Name(str):
    """A text that never denotes a number."""

    __slots__ = ()


def short_hash(value: Any) -> str:
    """Return the first 12 hexadecimal digits of the SHA-256 of the canonical text of a value."""
    digest = hashlib.sha256()
    for piece in canonical(value):
        digest.update(piece)
    return digest.hexdigest()[:_DIGITS]


def canonical(value: Any) -> list[bytes]:
    """Return the canonical text of numbers, texts, lists and objects, in pieces."""
    pieces: list[bytes] = []
    _write(pieces, value)
    return pieces


def _write(pieces: list[bytes], value: Any) -> None:
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value):
            raise InputError(f"{name_of(value)} has a key that is not a text", expected="a JSON object")
        pieces.append(b"{")
        for k, key in enumerate(sorted(value)):
            pieces.append((b"," if k else b"") + json.dumps(key).encode() + b":")
            _write(pieces, value[key])
        pieces.append(b"}")
    elif isinstance(value, (list, tuple, np.ndarray)):
        pieces.append(b"[")
        _write_items(pieces, value)
        pieces.append(b"]")
    elif isinstance(value, str):
        number = None if isinstance(value, Name) else _number_of(value)
        pieces.append(json.dumps(value).encode() if number is None else _number(number))
    else:
        pieces.append(_number(value if isinstance(value, fmpq) else exact(value, "a hashed value")))


def _write_items(pieces: list[bytes], value: Any) -> None:
    doubles = _doubles(value)
    if doubles is not None:
        pieces.append(_joined(doubles))
        return
    for k, item in enumerate(value):
        if k:
            pieces.append(b",")
        _write(pieces, item)


def _doubles(value: Any) -> Any:
    """Return the doubles whose shortest decimals are all numbers of a list, None where that cannot be told at once."""
    if isinstance(value, np.ndarray):
        if value.ndim != 1 or not value.size or (value.dtype != np.float64 and value.dtype.kind not in "iu"):
            return None
        small = value.dtype == np.float64 or (int(value.max()) <= _LARGEST and int(value.min()) >= -_LARGEST)
        return value.astype(np.float64) if small else None
    types = set(map(type, value))
    if not types or not types <= {int, float}:
        return None
    if int in types and any(type(item) is int and abs(item) > _LARGEST for item in value):
        return None
    return np.array(value, dtype=np.float64)


def _joined(doubles: Any) -> bytes:
    """Return the numbers of a list with commas between, all at once."""
    if not bool(np.all(np.isfinite(doubles))):
        raise InputError("a number is not finite", expected="finite numbers")
    digits = (doubles + 0.0).astype(">f8").tobytes().hex().encode()  # + 0.0: there is one zero
    table = np.empty((len(doubles), 18), dtype=np.uint8)
    table[:, 0], table[:, 1] = ord(","), ord("d")
    table[:, 2:] = np.frombuffer(digits, dtype=np.uint8).reshape(-1, 16)
    return table.tobytes()[1:]


def _number(value: fmpq) -> bytes:
    nearest = as_float(value)
    if value != 0 and (nearest == 0 or exact(nearest, "a hashed value") != value):
        return f"{value.p}/{value.q}".encode()
    return b"d" + struct.pack(">d", nearest).hex().encode()


def _number_of(text: str) -> fmpq | None:
    """Return the number that a text denotes, None for any other text."""
    if not text or text[0] not in "+-.0123456789":
        return None
    try:
        return exact(text, "a hashed value")
    except InputError:
        return None
