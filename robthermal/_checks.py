"""Checks of arguments, and quotations of what was wrong, as every package writes them into its messages."""

from __future__ import annotations

import math
import reprlib
from numbers import Real

import numpy as np

from .errors import InputError

QUOTED = 120  # characters of the user's input that a message may hold, at most
_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 80
_SHORT.maxlevel = 2
_SHORT.maxlist = _SHORT.maxtuple = _SHORT.maxdict = _SHORT.maxset = 4


def quoted(value: object) -> str:
    """`value` as python writes it: on one line, and cut after `QUOTED` characters whatever it holds.

    Parameters
    ----------
    value : object
        Text or number from a file or an argument.

    Examples
    --------
    >>> quoted("m1"), quoted(2.5), len(quoted("x" * 10**6)) <= QUOTED
    ("'m1'", '2.5', True)
    """
    return excerpt(_SHORT.repr(value))


def excerpt(text: object) -> str:
    r"""Text on one line without quotation marks, cut after `QUOTED` characters.

    Parameters
    ----------
    text : object
        A list of names, or the message of an exception, which may repeat a whole file.

    Examples
    --------
    >>> excerpt("time,\n  m1"), excerpt("a, b, " * 1000).endswith(" ..."), len(excerpt("a, b, " * 1000))
    ('time, m1', True, 120)
    """
    line = " ".join(str(text)[:20 * QUOTED].split())
    return line if len(line) <= QUOTED else line[:QUOTED - 4] + " ..."


def finite_number(value: object, where: str, unit: str = "") -> float:
    """`value` as a finite float; booleans, text, complex numbers, NaN and infinity are refused.

    Parameters
    ----------
    value : object
        What the caller gave.
    where : str
        Name of the argument, or its place in words ("lump 'x' capacity"), for the message.
    unit : str
        Unit of the argument, for the message.

    Raises
    ------
    InputError
        Naming the argument, its value and its unit.

    Examples
    --------
    >>> finite_number(3, "load", "W")
    3.0
    """
    expected = f"a finite number{f' [{unit}]' if unit else ''}"
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (Real, np.integer, np.floating)):
        raise InputError(f"{where} is {quoted(value)}, not a number", where=_place(where), expected=expected)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(f"{where} is {number}, not finite", where=_place(where), expected=expected)
    return number


def _place(where: str) -> str:
    return where if " " in where else f"argument {where}"


def positive_number(value: object, where: str, unit: str = "") -> float:
    """`value` as a finite float above zero.

    Parameters
    ----------
    value : object
        What the caller gave.
    where : str
        Name of the argument, or its place in words ("lump 'x' capacity"), for the message.
    unit : str
        Unit of the argument, for the message.

    Raises
    ------
    InputError
        Naming the argument, its value and its unit.

    Examples
    --------
    >>> positive_number(3, "capacity", "J/K")
    3.0
    """
    number = finite_number(value, where, unit)
    if number <= 0.0:
        raise InputError(f"{where} is {quoted(value)}", where=_place(where),
                         expected=f"a positive number{f' [{unit}]' if unit else ''}")
    return number


def whole_number(value: object, where: str, least: int) -> int:
    """`value` as an int not below `least`; fractions, text, booleans, NaN and infinity are refused.

    Parameters
    ----------
    value : object
        What the caller gave.
    where : str
        Name of the argument, or its place in words, for the message.
    least : int
        Smallest number that is accepted.

    Raises
    ------
    InputError
        Naming the argument and its value.

    Examples
    --------
    >>> whole_number(3.0, "periods", 1)
    3
    """
    number = finite_number(value, where)
    if number != int(number) or number < least:
        raise InputError(f"{where} is {quoted(value)}", where=_place(where),
                         expected=f"a whole number of at least {least}")
    return int(number)
