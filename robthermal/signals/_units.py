"""Kelvin inside, Celsius at the border: exact decimal conversion of whole columns."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._celsius import ZERO_CELSIUS

_REST = float(Fraction("273.15") - Fraction(ZERO_CELSIUS))  # what the float 273.15 lacks: 2.3e-14

_MOST_DECIMALS = 12  # beyond this, 10^d x no longer fits the 53 bits of a float for temperatures


def celsius_to_kelvin(temperature: ArrayLike) -> NDArray[np.float64]:
    """Nearest float of the decimal number ``temperature`` + 273.15 [K].

    Parameters
    ----------
    temperature : array_like
        [°C]. Up to 12 decimals count as a decimal number; longer ones are added with one rounding. To Celsius and back
        is exact between 210 K and 400 K.

    Returns
    -------
    ndarray
        [K].

    Examples
    --------
    >>> 25.1 + 273.15, float(celsius_to_kelvin(25.1))
    (298.25, 298.25)
    >>> 20.58 + 273.15 == 293.73, float(celsius_to_kelvin(20.58)) == 293.73
    (False, True)
    """
    return _shift(temperature, 1.0)


def kelvin_to_celsius(temperature: ArrayLike) -> NDArray[np.float64]:
    """Nearest float of the decimal number ``temperature`` - 273.15 [°C]; `celsius_to_kelvin` undoes it.

    Parameters
    ----------
    temperature : array_like
        Thermodynamic temperatures to convert [K].

    Returns
    -------
    ndarray
        [°C].

    Examples
    --------
    >>> float(kelvin_to_celsius(293.73))
    20.58
    """
    return _shift(temperature, -1.0)


def _shift(temperature: ArrayLike, sign: float) -> NDArray[np.float64]:
    x = np.asarray(temperature, dtype=np.float64)
    shifted: NDArray[Any] = _added(x, sign)
    waiting = np.abs(x) < 900.0  # 900 * 10^12 < 2^53: the scaled integers below are exact
    for decimals in range(_MOST_DECIMALS + 1):
        scale = 10.0**decimals  # exact up to 10^22
        short = waiting & (np.rint(x * scale) / scale == x)
        if short.any():
            # One correctly rounded division of exact integers: the nearest float of the decimal sum.
            places = max(decimals, 2)
            exact = np.rint(x[short] * 10.0**places) + sign * np.rint(ZERO_CELSIUS * 10.0**places)
            shifted[short] = exact / 10.0**places
            waiting &= ~short
        if not waiting.any():
            break
    return shifted


def _added(x: NDArray[np.float64], sign: float) -> NDArray[np.float64]:
    """x + sign * 273.15 with one rounding (Knuth's two-sum; the lost digits are added back)."""
    with np.errstate(invalid="ignore"):  # infinite readings become NaN here, and are refused by name elsewhere
        total = x + sign * ZERO_CELSIUS
        part = total - x
        lost = (x - (total - part)) + (sign * ZERO_CELSIUS - part)
        return np.array(total + (lost + sign * _REST))
