"""Exact numbers of a certificate file, as fractions, and enclosures of powers by integer square roots."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from fractions import Fraction
from functools import lru_cache
from typing import Any

Interval = tuple[Fraction, Fraction]
ZERO, ONE = Fraction(0), Fraction(1)
_DECIMAL = re.compile(r"([+-]?)(\d*)(?:\.(\d*))?(?:[eE]([+-]?\d{1,6}))?", re.ASCII)
_HEXADECIMAL = re.compile(r"([+-]?)0[xX]([0-9a-fA-F]*)(?:\.([0-9a-fA-F]*))?(?:[pP]([+-]?\d{1,6}))?", re.ASCII)
_LONGEST = 2000  # characters of one number
_BITS = 224  # of an enclosed power


class Malformed(Exception):
    """The file is not what the format demands."""


class NotCovered(Exception):
    """This checker cannot decide the file; it may be valid."""


class Token(str):
    """A number as it stands in a JSON file."""

    __slots__ = ()


def exact(value: Any, where: str) -> Fraction:
    """Return the number that a value of a certificate denotes, exactly.

    Parameters
    ----------
    value : int, float or str
        JSON number, decimal text or hexadecimal-float text; a float is its shortest decimal.
    where : str
        Place in the file, for the message.

    Returns
    -------
    Fraction
        The number, without rounding.

    Raises
    ------
    Malformed
        For anything else, also true, null, NaN and numbers beyond a double.

    Examples
    --------
    >>> exact(0.1, "rate"), exact("0x1p-3", "rate")
    (Fraction(1, 10), Fraction(1, 8))
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise Malformed(f"{where}: {short(value)} is not a number")
    if isinstance(value, int):
        if value.bit_length() > 1024:
            raise Malformed(f"{where}: an integer beyond a double")
        return Fraction(value)
    text = value if isinstance(value, str) else float.__repr__(value)
    if len(text) > _LONGEST:
        raise Malformed(f"{where}: a number with {len(text)} characters")
    return _hexadecimal(text, where) if "x" in text.lower() else _decimal(text, where)


def short(value: Any) -> str:
    """Return a value of the file in quotes, escaped and cut, safe for any terminal."""
    text = ascii(value if not isinstance(value, Token) else str(value))
    return text if len(text) <= 80 else text[:77] + "..."


@lru_cache(maxsize=4096)
def power(base: Fraction, exponent: Fraction) -> Interval:
    """Return rational bounds of base**exponent for base >= 0, exponent >= 0 (0**0 = 1).

    The binary digits of the exponent choose square roots of the base; all roots and products are rounded outwards.

    Examples
    --------
    >>> low, high = power(Fraction(2), Fraction(1, 2))
    >>> low**2 < 2 < high**2, float(high - low) < 1e-60
    (True, True)
    """
    if exponent == 0 or base in (ZERO, ONE):
        return (ONE, ONE) if exponent == 0 or base == 1 else (ZERO, ZERO)
    whole, rest = divmod(exponent, 1)
    if rest == 0:
        return base ** int(whole), base ** int(whole)
    low = high = base
    down = up = base ** int(whole)
    for _ in range(_BITS):
        low, high = _root(low)[0], _root(high)[1]
        rest *= 2
        if rest >= 1:
            rest -= 1
            down, up = _cut(down * low)[0], _cut(up * high)[1]
        if rest == 0:
            return down, up
    # what is left of the exponent is below 2**-_BITS: a factor between 1 and the last root
    return down * min(low, ONE), up * max(high, ONE)


def _root(value: Fraction) -> Interval:
    """Return bounds of a square root, relative error about 2**-_BITS."""
    shift = 2 * _BITS - 2 * ((value.numerator.bit_length() - value.denominator.bit_length()) // 2)
    scaled = value.numerator << shift if shift >= 0 else value.numerator
    below = value.denominator if shift >= 0 else value.denominator << -shift
    root, step = math.isqrt(scaled // below), Fraction(2) ** (-shift // 2)
    return root * step, (root + 1) * step


def _cut(value: Fraction) -> Interval:
    """Return bounds with few digits."""
    shift = 2 * _BITS - (value.numerator.bit_length() - value.denominator.bit_length())
    step = Fraction(2) ** -shift
    floor = math.floor(value / step)
    return floor * step, (floor + 1) * step


def _decimal(text: str, where: str) -> Fraction:
    match = _DECIMAL.fullmatch(text)
    if match is None or not (match[2] or match[3]):
        raise Malformed(f"{where}: {short(text)} is not a number")
    fraction = match[3] or ""
    mantissa = int(match[2] + fraction)
    if mantissa == 0:
        return ZERO
    nearest = float(text)
    if math.isinf(nearest) or nearest == 0.0:
        raise Malformed(f"{where}: {short(text)} is beyond a double")
    return _scaled(-mantissa if match[1] == "-" else mantissa, 10, int(match[4] or 0) - len(fraction))


def _hexadecimal(text: str, where: str) -> Fraction:
    match = _HEXADECIMAL.fullmatch(text)
    if match is None or not (match[2] or match[3]):
        raise Malformed(f"{where}: {short(text)} is not a number")
    fraction = match[3] or ""
    mantissa = int(match[2] + fraction, 16)
    exponent = int(match[4] or 0) - 4 * len(fraction)
    if mantissa and not -1074 < mantissa.bit_length() + exponent <= 1024:
        raise Malformed(f"{where}: {short(text)} is beyond a double")
    return _scaled(-mantissa if match[1] == "-" else mantissa, 2, exponent) if mantissa else ZERO


def _scaled(mantissa: int, base: int, exponent: int) -> Fraction:
    return Fraction(mantissa * base**exponent) if exponent >= 0 else Fraction(mantissa, base**-exponent)


def ends(interval: Interval) -> list[Fraction]:
    """Return the one or two ends of an interval."""
    return [interval[0]] if interval[0] == interval[1] else list(interval)


def hull(values: Iterable[Fraction]) -> Interval:
    """Return the least interval that holds some numbers."""
    listed = list(values)
    return min(listed), max(listed)
