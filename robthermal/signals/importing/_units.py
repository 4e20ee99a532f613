"""Units of measured columns: as headers write them, and what a cell in them is in SI."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._units import celsius_to_kelvin

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Unit:
    """A unit that is known.

    Parameters
    ----------
    name : str
        As it is written in reports.
    quantity : str
        "time", "current", "voltage", "power", "percent", "temperature", "resistance" or "rotation" (turns per time).
    factor : float
        Value in SI = factor · cell (+ the zero of a temperature scale).
    """

    name: str
    quantity: str
    factor: float

    def to_si(self, cells: Array) -> Array:
        """Cells in this unit as SI values (kelvin, ampere, watt, volt, second, ohm, 1/s; percent stays percent)."""
        if self.name == "degC":
            return celsius_to_kelvin(cells)
        if self.name == "degF":
            return np.asarray(celsius_to_kelvin((cells - 32.0) * 5.0 / 9.0))
        return cells if self.factor == 1.0 else cells * self.factor

    def same_as(self, other: Unit | None) -> bool:
        """Whether both are one unit, as rpm and 1/min are."""
        if other is None or self.name == other.name:
            return other is not None
        return self.quantity == other.quantity != "temperature" and self.factor == other.factor


def _known() -> dict[str, Unit]:
    table = {
        "s": ("time", 1.0, "s sec secs second seconds sek"),
        "ms": ("time", 1e-3, "ms msec millisecond milliseconds"),
        "us": ("time", 1e-6, "us µs μs usec microsecond microseconds"),
        "ns": ("time", 1e-9, "ns nsec nanosecond nanoseconds"),
        "min": ("time", 60.0, "min mins minute minutes"),
        "h": ("time", 3600.0, "h hr hrs hour hours"),
        "A": ("current", 1.0, "A amp amps ampere"),
        "mA": ("current", 1e-3, "mA"),
        "V": ("voltage", 1.0, "V volt volts"),
        "mV": ("voltage", 1e-3, "mV"),
        "W": ("power", 1.0, "W watt watts"),
        "mW": ("power", 1e-3, "mW"),
        "kW": ("power", 1e3, "kW"),
        "%": ("percent", 1.0, "% percent pct"),
        "K": ("temperature", 1.0, "K kelvin"),
        "mK": ("temperature", 1e-3, "mK"),
        "degC": ("temperature", 1.0, "°C ℃ degC deg_C C celsius Celsius"),
        "degF": ("temperature", 1.0, "°F ℉ degF deg_F F"),
        "ohm": ("resistance", 1.0, "Ω Ω ohm Ohm"),
        "rpm": ("rotation", 1 / 60, "rpm"),
        "1/min": ("rotation", 1 / 60, "1/min min^-1 min-1 min⁻¹"),
        "U/min": ("rotation", 1 / 60, "U/min Upm"),
        "r/min": ("rotation", 1 / 60, "r/min rev/min"),
        "1/s": ("rotation", 1.0, "1/s s^-1 s-1 s⁻¹"),
        "rps": ("rotation", 1.0, "rps r/s rev/s U/s"),
        "Hz": ("rotation", 1.0, "Hz"),
    }
    found = {}
    for name, (quantity, factor, spellings) in table.items():
        for text in spellings.split():
            found[text] = Unit(name, quantity, factor)
    found["degree Celsius"] = found["deg C"] = found["degC"]
    return found


KNOWN = _known()
LISTED = ", ".join(dict.fromkeys(unit.name for unit in KNOWN.values()))
_NUMBERED = ("s-1", "min-1")  # behind a blank or an underscore the number of a sensor
_BRACKETS = re.compile(r"^(.*?)\s*[\[(]([^\[\]()]*)[\])]\s*$")
_PER = re.compile(r"^(.*\S)[ _](\S+/\S+)$")
_SLASH = re.compile(r"^(.*?)\s*/\s*([^/\s]+)\s*$")
_SUFFIX = re.compile(r"^(.*\S)[ _](\S+)$")
_LETTERS = frozenset(text for text in KNOWN if len(text) == 1 and text not in "°C%Ω") | {"C", "F", "K"}


def unit_of(text: str) -> Unit | None:
    """The unit a text names, exactly or, where that is no other unit, in another case; None if it is none."""
    words = text.strip().strip("[]()").strip()
    if words in KNOWN:
        return KNOWN[words]
    folded = {key.lower(): unit for key, unit in KNOWN.items() if len(key) > 2}
    return folded.get(words.lower())


def split_header(header: str) -> tuple[str, str | None]:
    """Name and unit text of a header such as ``T1 [°C]``, ``NTC1 (degC)``, ``I/A``, ``I_TEC_mA`` or ``I_TEC mA``.

    In brackets anything is taken as the unit text; behind a slash, a blank or an underscore only a known unit.
    """
    match = _BRACKETS.match(header)
    if match is not None and match[1]:
        return match[1].strip(), match[2].strip()
    for pattern in (_PER, _SLASH, _SUFFIX):
        match = pattern.match(header)
        if match is not None and match[1] and match[2] in KNOWN and not (pattern is _SUFFIX and match[2] in _NUMBERED):
            return match[1].strip(), match[2]
    return header, None
