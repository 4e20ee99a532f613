"""Kelvin inside, Celsius at the border: single temperatures of system files, converted exactly as those of records."""

from __future__ import annotations

from .. import signals


def celsius_to_kelvin(value: float) -> float:
    """Nearest float of the decimal number ``value`` + 273.15 [K].

    >>> celsius_to_kelvin(25.1)
    298.25
    """
    return float(signals.celsius_to_kelvin(value))


def kelvin_to_celsius(value: float) -> float:
    """Nearest float of the decimal number ``value`` - 273.15 [°C]; `celsius_to_kelvin` undoes it exactly.

    >>> kelvin_to_celsius(298.25)
    25.1
    """
    return float(signals.kelvin_to_celsius(value))
