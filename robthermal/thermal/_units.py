"""Kelvin inside, Celsius at the border: exact decimal conversion, so that files survive a round trip."""

from __future__ import annotations

from decimal import Decimal

_ZERO_CELSIUS = Decimal("273.15")
LOWEST_KELVIN = 150.0
HIGHEST_CELSIUS = 250.0


def celsius_to_kelvin(value: float) -> float:
    """Nearest float of the decimal number ``value`` + 273.15 [K].

    >>> celsius_to_kelvin(25.1)
    298.25
    """
    return float(Decimal(repr(float(value))) + _ZERO_CELSIUS)


def kelvin_to_celsius(value: float) -> float:
    """Nearest float of the decimal number ``value`` - 273.15 [°C]; `celsius_to_kelvin` undoes it exactly.

    >>> kelvin_to_celsius(298.25)
    25.1
    """
    return float(Decimal(repr(float(value))) - _ZERO_CELSIUS)
