"""Exact numbers: what a digit in a certificate file means, and nothing else.

A JSON number or a decimal text is that decimal (0.1 is one tenth, not the nearest binary number); a hexadecimal
text is that binary number; a Python float is its shortest decimal, so that a certificate means the same before it
is saved and after it is loaded.
"""

from __future__ import annotations

import math
import re
import sys
from fractions import Fraction
from typing import Any

import numpy as np
from flint import fmpq, fmpz

from robthermal.errors import InputError

_DECIMAL = re.compile(r"([+-]?)(\d*)(?:\.(\d*))?(?:[eE]([+-]?\d{1,6}))?", re.ASCII)
_HEXADECIMAL = re.compile(r"([+-]?)0[xX]([0-9a-fA-F]*)(?:\.([0-9a-fA-F]*))?(?:[pP]([+-]?\d{1,6}))?", re.ASCII)
_LONGEST = 2000  # characters; the longest exact double has fewer than 800 digits
_EXPECTED = "a finite number: a JSON number, decimal text or hexadecimal-float text"


def exact(value: Any, where: str) -> fmpq:
    """Return the exact rational number that a value in a certificate denotes.

    Parameters
    ----------
    value : int, float or str
        JSON number, decimal text or hexadecimal-float text [-].
    where : str
        Place in the certificate, for the message.

    Returns
    -------
    fmpq
        The number, exactly [-].

    Raises
    ------
    InputError
        For true, null, empty text, NaN, infinity and exponents beyond a float.

    Examples
    --------
    >>> exact(0.1, "rate"), exact("0x1p-3", "rate")
    (1/10, 1/8)
    """
    if isinstance(value, (bool, np.bool_)):
        raise _bad(value, where)
    if isinstance(value, (int, np.integer)):
        return _from_integer(int(value), where)
    if isinstance(value, (float, np.floating)):
        if not math.isfinite(value):
            raise _bad(value, where)
        return _from_decimal(float.__repr__(float(value)), where)
    if isinstance(value, str):
        return _from_text(value, where)
    raise _bad(value, where)


def plain_number(text: str, where: str) -> float | str:
    """Return a JSON number as a float where its shortest decimal is the same number, else as decimal text."""
    value = _from_text(text, where)
    number = float(text)
    return number if _from_decimal(float.__repr__(number), where) == value else text


def as_float(value: fmpq) -> float:
    """Return the double nearest to a rational number, clipped to the range of doubles."""
    try:
        return int(value.p) / int(value.q)  # correctly rounded by Python
    except OverflowError:
        return math.copysign(sys.float_info.max, 1.0 if value > 0 else -1.0)


def round_down(value: fmpq) -> float:
    """Return the largest double that is not above a rational number."""
    number = as_float(value)
    return number if Fraction(number) <= Fraction(int(value.p), int(value.q)) else math.nextafter(number, -math.inf)


def round_up(value: fmpq) -> float:
    """Return the smallest double that is not below a rational number."""
    return -round_down(-value)


def show(value: fmpq) -> str:
    """Return a number for a message, to nearest: the shortest decimal of a double. Claims use `decimal`."""
    text = float.__repr__(as_float(value))
    return text[:-2] if text.endswith(".0") else text


def decimal(value: fmpq) -> str:
    """Return a number for a claim: its exact decimal, all digits, written as Python writes a double.

    Every number of a certificate has one, because it is a decimal or a binary number. With digits d1 d2 ... dn and
    value = d1.d2...dn times ten to the x: plain for -4 <= x < 16, else d1.d2...dn, "e", sign and at least two digits.

    Examples
    --------
    >>> decimal(exact("1.00000000000000000001", "bound")), decimal(exact("0x1p-3", "rate")), decimal(fmpq(-7))
    ('1.00000000000000000001', '0.125', '-7')
    """
    if value == 0:
        return "0"
    places = _places(value.q)
    mantissa = (abs(value.p) * fmpz(10) ** places // value.q).str()
    x = len(mantissa) - 1 - places
    digits = mantissa.rstrip("0")
    if x < -4 or x >= 16:
        text = digits[0] + ("." + digits[1:] if len(digits) > 1 else "") + f"e{'-' if x < 0 else '+'}{abs(x):02d}"
    elif x < 0:
        text = "0." + "0" * (-x - 1) + digits
    else:
        text = (digits[:x + 1].ljust(x + 1, "0") + "." + digits[x + 1:]).rstrip(".")
    return "-" + text if value < 0 else text


def _places(denominator: fmpz) -> int:
    """Return how many decimal places a number with this denominator has."""
    q = int(denominator)
    twos = (q & -q).bit_length() - 1
    rest, fives = q >> twos, 0
    while rest % 5 == 0:
        rest, fives = rest // 5, fives + 1
    if rest != 1:
        raise ValueError("the number has no exact decimal")
    return max(twos, fives)


def name_of(value: Any) -> str:
    """Return a value from the file in quotes, escaped and cut, safe for any terminal."""
    text = ascii(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _from_integer(value: int, where: str) -> fmpq:
    if value.bit_length() > 1024:
        raise _beyond(f"an integer of {value.bit_length()} bits", where)
    return fmpq(value)


def _from_text(text: str, where: str) -> fmpq:
    if len(text) > _LONGEST:
        raise InputError(f"number with {len(text)} characters", where=where, expected=f"at most {_LONGEST}")
    return _from_hexadecimal(text, where) if "x" in text.lower() else _from_decimal(text, where)


def _from_decimal(text: str, where: str) -> fmpq:
    match = _DECIMAL.fullmatch(text)
    if match is None or not (match[2] or match[3]):
        raise _bad(text, where)
    fraction = match[3] or ""
    mantissa = int(match[2] + fraction)
    if mantissa == 0:
        return fmpq(0)
    number = float(text)
    if math.isinf(number) or number == 0.0:
        raise _beyond(name_of(text), where)
    exponent = int(match[4] or 0) - len(fraction)
    return _scaled(-mantissa if match[1] == "-" else mantissa, 10, exponent)


def _from_hexadecimal(text: str, where: str) -> fmpq:
    match = _HEXADECIMAL.fullmatch(text)
    if match is None or not (match[2] or match[3]):
        raise _bad(text, where)
    fraction = match[3] or ""
    mantissa = int(match[2] + fraction, 16)
    exponent = int(match[4] or 0) - 4 * len(fraction)
    if mantissa and not -1074 < mantissa.bit_length() + exponent <= 1024:
        raise _beyond(name_of(text), where)
    return _scaled(-mantissa if match[1] == "-" else mantissa, 2, exponent)


def _scaled(mantissa: int, base: int, exponent: int) -> fmpq:
    if exponent >= 0:
        return fmpq(mantissa * base**exponent)
    return fmpq(mantissa, base**-exponent)


def _bad(value: Any, where: str) -> InputError:
    return InputError(f"{name_of(value)} is not a number", where=where, expected=_EXPECTED)


def _beyond(what: str, where: str) -> InputError:
    return InputError(f"{what} is beyond the range of a float", where=where, expected=_EXPECTED)
