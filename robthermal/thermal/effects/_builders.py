"""How an effect becomes ordinary content of a system: a number of a part, a table of a part, or one more link."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field
from typing import Any

from .._parameters import number, parts_of
from .._parts import Link
from .._system import System
from ._response import Values, Where

Names = Mapping[str, str]


@dataclass(frozen=True)
class Builder:
    """Adds an effect to a system, and knows where its numbers are then.

    Parameters
    ----------
    add : callable
        ``add(system, where, values)`` returns the system with the effect; `values` has every quantity.
    names : callable
        ``names(system, where)`` maps each quantity to its number in the system that has just got the effect.
    present : callable
        ``present(system, where)`` says whether a system has the effect at that place already.
    defaults : callable
        ``defaults(system, where)`` gives quantities that have a usual value other than zero.
    """

    add: Callable[[System, Where, Values], System]
    names: Callable[[System, Where], Names]
    present: Callable[[System, Where], bool]
    defaults: Callable[[System, Where], Values] = field(default=lambda system, where: {})

    def __call__(self, system: System, where: Where, values: Values) -> System:
        """System with the effect.

        Parameters
        ----------
        system : System
            System without the effect; it is not changed.
        where : tuple of str
            Parts that the effect names.
        values : mapping
            Value of every quantity.
        """
        return self.add(system, where, values)


def numbers(table: str, absent: float = 0.0, **keys: str) -> Builder:
    """Numbers of the first part named: each quantity is added to the key of that name.

    Parameters
    ----------
    table : str
        Table of the part; "" for the inputs or modules.
    absent : float
        Value of the number when the effect is absent.
    **keys : str
        Quantity to key of the part.
    """
    def names(system: System, where: Where) -> dict[str, str]:
        owner = table or ("inputs" if where[0] in system.inputs else "modules")
        return {quantity: f"{owner}.{where[0]}.{key}" for quantity, key in keys.items()}

    def add(system: System, where: Where, values: Values) -> System:
        return system.with_parameters({name: values[quantity] + (number(system, name) or 0.0)
                                       for quantity, name in names(system, where).items()})

    def present(system: System, where: Where) -> bool:
        return any(number(system, name) not in (None, absent) for name in names(system, where).values())

    return Builder(add, names, present)


def slope(what: str) -> Builder:
    """Slope of a module's property; the file then says at which temperature the value holds.

    Parameters
    ----------
    what : str
        Property: "seebeck", "resistance" or "conductance".
    """
    own = numbers("modules", slope=f"{what}.slope")

    def add(system: System, where: Where, values: Values) -> System:
        reference = f"modules.{where[0]}.reference_temperature"
        return own.add(system.with_parameters({reference: system.parameter(reference)}), where, values)

    return Builder(add, own.names, own.present)


def subtable(table: str, key: str, quantities: tuple[str, ...], **defaults: float) -> Builder:
    """A table of the first part named, with one key per quantity.

    Parameters
    ----------
    table, key : str
        Table of the part, and the key of its new table.
    quantities : tuple of str
        Keys of the new table.
    **defaults : float
        Usual values of quantities that are not zero.
    """
    def names(system: System, where: Where) -> dict[str, str]:
        return {quantity: f"{table}.{where[0]}.{key}.{quantity}" for quantity in quantities}

    def add(system: System, where: Where, values: Values) -> System:
        return system.with_parameters({name: values[quantity] for quantity, name in names(system, where).items()})

    def present(system: System, where: Where) -> bool:
        return getattr(parts_of(system, table)[where[0]], key) is not None

    return Builder(add, names, present, lambda system, where: defaults)


def new_link(content: Callable[[Values], dict[str, Any]], keys: Names, **defaults: float) -> Builder:
    """One more link between the two nodes named, with a name of its own.

    Parameters
    ----------
    content : callable
        Values of the quantities to the keys of the link.
    keys : mapping
        Quantity to the name of its number in the link.
    **defaults : float
        Usual values of quantities that are not zero.
    """
    def names(system: System, where: Where) -> dict[str, str]:
        return {quantity: f"links.{system.links[-1].name}.{key}" for quantity, key in keys.items()}

    return Builder(lambda system, where, values: joined(system, where, **content(values)), names,
                   lambda system, where: False, lambda system, where: defaults)


def joined(system: System, where: Where, **content: Any) -> System:
    """System with one more link, under a free name.

    Parameters
    ----------
    system : System
        System that gets the link.
    where : tuple of str
        The two nodes.
    **content : Any
        Keys of the link.
    """
    name = free_name("-".join(where), {link.name for link in system.links}, " ")
    link = Link(between=(where[0], where[1]), name=name, **content)
    return system.model_copy(update={"links": (*system.links, link)})


def free_name(wanted: str, taken: Container[str], gap: str = "") -> str:
    """The name wanted, with a number behind it where it is taken.

    Parameters
    ----------
    wanted : str
        Name of a new part.
    taken : container of str
        Names that others have.
    gap : str
        What stands between the name and its number.
    """
    name, number = wanted, 2
    while name in taken:
        name, number = f"{wanted}{gap}{number}", number + 1
    return name


def content_of(system: System) -> dict[str, Any]:
    """All fields of a system, to build a changed one that is checked again.

    Parameters
    ----------
    system : System
        System to copy.
    """
    return {name: getattr(system, name) for name in type(system).model_fields}
