"""The column of a heater: its power, or its voltage or current across a resistance, or an input of another unit."""

from __future__ import annotations

from ...errors import InputError
from ._channel import Channel
from ._units import Unit, unit_of

_ELECTRIC = {"voltage": "U²/R", "current": "I² R"}


def heater_channel(
    name: str,
    place: int,
    unit: Unit | None,
    own: str | None,
    gain: float,
    scaling: tuple[float, float, bool],
    where: str,
    resistance: float | None = None,
) -> Channel:
    """A heater's column: in W, in the unit the system file gives the input, or its voltage or current.

    Parameters
    ----------
    name, place : str, int
        Name in the system, and column of the table.
    unit : Unit or None
        Unit of the cells.
    own : str or None
        Unit that the system gives the input.
    gain : float
        Heat per unit of the input [W].
    scaling : tuple of float, float, bool
        Scale and offset, and whether they were declared.
    where : str
        Column, for messages.
    resistance : float, optional
        Of a heater whose cells are its voltage or its current, and become its power, U²/R or I² R [Ω].

    Raises
    ------
    InputError
        Units that do not fit; a resistance for an input that is kept in another unit than W.
    """
    if resistance is not None:
        return _resistive(name, place, unit, own, resistance, scaling, where)
    kept = unit_of(own) if own else None
    if scaling[2]:
        return Channel(name, "input", place, None, own or "W", *scaling)
    if own is None:
        if gain == 0.0 and unit is not None:  # no heat: the numbers as they are
            return Channel(name, "input", place, unit, unit.name, *scaling)
        if unit is None or unit.name == "W":
            return Channel(name, "input", place, unit, "W" if gain == 1.0 or unit else "", *scaling)
        if unit.quantity == "power" and gain == 1.0:
            return Channel(name, "input", place, unit, "W", *scaling)
        if unit.quantity in _ELECTRIC and gain == 1.0:
            raise InputError(
                f"{name!r} is in {unit.name}, and the system takes it in W",
                where=where,
                expected="W, or a declared conversion",
                remedy=f"Of a resistive heater write [columns] {name} = {{ column = …, resistance = (Ω) }}: its power "
                f"is {_ELECTRIC[unit.quantity]}. Is it a command that the heat is proportional to, write unit = "
                f'"{unit.name}" and gain = (W per {unit.name}) in [inputs.{name}].',
            )
        raise InputError(
            f"{name!r} is in {unit.name} and the system does not say so (gain = {gain:g} W per unit)",
            where=where,
            expected="W, or a declared conversion",
            remedy=f'Write unit = "{unit.name}" in [inputs.{name}], or [columns] {name} = {{ column = …, unit = '
            f'"{unit.name}", scale = (W per {unit.name}) }}.',
        )
    if unit is None:
        return Channel(name, "input", place, kept, own, *scaling)
    if kept is not None and unit.quantity == kept.quantity:
        return Channel(name, "input", place, unit, own, *scaling)
    raise InputError(
        f"the column is in {unit.name} and [inputs.{name}] in {own}",
        where=where,
        expected=own,
        remedy="Correct one of the two, or declare scale.",
    )


def _resistive(name: str, place: int, unit: Unit | None, own: str | None, resistance: float,
               scaling: tuple[float, float, bool], where: str) -> Channel:
    """A power by a resistance; scale and offset act before the square."""
    if unit is None or unit.quantity not in _ELECTRIC:
        raise InputError(f"a resistance is declared for {name!r}, and the column is in {unit.name if unit else '?'}",
                         where=where, expected="V, mV, A or mA: the voltage or the current of the heater",
                         remedy=f'Write [columns] {name} = {{ column = …, unit = "V", resistance = {resistance:g} }}, '
                         "or remove resistance.")
    if own not in (None, "W"):
        raise InputError(f"a resistance is declared for {name!r}, which makes W, and [inputs.{name}] is in {own}",
                         where=where, expected="one of the two", remedy=f"Remove unit from [inputs.{name}].")
    return Channel(name, "input", place, unit, "W", *scaling, resistance=resistance)
