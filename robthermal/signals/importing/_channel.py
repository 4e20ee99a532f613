"""A column that is used: its name, its unit in the file and the one that is kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .._thermistor import Thermistor
from ._units import Unit, unit_of


@dataclass(frozen=True)
class Channel:
    """One column that is used.

    Parameters
    ----------
    name : str
        In the record.
    role : str
        "input", "current", "ambient", "sensor" or "voltage" (of a module).
    place : int
        Column of the table.
    unit_read : Unit or None
        Unit of the cells; None where neither header nor declaration says one.
    unit : str
        Unit that is kept: "K", "A", "V", "W", or the input's own; "" where nobody says.
    scale, offset : float
        Value = scale · cell + offset, before a unit is converted; declared, or 1 and 0.
    scaled : bool
        Whether scale or offset were declared.
    thermistor : Thermistor or None
        Characteristic of what the cells are read from.
    resistance : float or None
        Of a heater whose cells are its voltage or its current, and become its power [Ω].
    """

    name: str
    role: str
    place: int
    unit_read: Unit | None
    unit: str
    scale: float = 1.0
    offset: float = 0.0
    scaled: bool = False
    thermistor: Thermistor | None = None
    resistance: float | None = None


def kept_as_read(channel: Channel) -> bool:
    """Whether the numbers stay as they are in the file: nobody says their unit, or it is the one that is kept."""
    read = channel.unit_read
    return read is None or read.name == channel.unit or read.same_as(unit_of(channel.unit))


def kept_factor(channel: Channel) -> float:
    """Factor from SI to the unit an input is kept in: 1 except for inputs with a unit of their own."""
    own: Any = unit_of(channel.unit) if channel.unit else None
    return 1.0 if own is None or channel.role != "input" or own.factor == 0 else 1.0 / own.factor
