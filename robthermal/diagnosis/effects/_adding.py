"""The change every effect makes to a system: ordinary content of its file, added to what is there already."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...thermal import Link, Lump, System, add_effect
from ._effect import Add, Where

Values = Mapping[str, float]


def joined(system: System, where: Where, **content: Any) -> System:
    """One more link between two nodes, with a name of its own."""
    taken, name, number = {link.name for link in system.links}, "-".join(where), 2
    while name in taken:
        name, number = f"{'-'.join(where)} {number}", number + 1
    link = Link(between=(where[0], where[1]), name=name, **content)
    return system.model_copy(update={"links": (*system.links, link)})


def missing_link(system: System, where: Where, values: Values) -> System:
    """A heat path."""
    return joined(system, where, conductance=values["conductance"])


def natural_convection(system: System, where: Where, values: Values) -> System:
    """Natural convection to an ambient."""
    return joined(system, where, natural={"gain": values["gain"], "exponent": values["exponent"]})


def radiation(system: System, where: Where, values: Values) -> System:
    """Radiation to an ambient."""
    return joined(system, where, radiation=values["coefficient"])


def hidden_mass(system: System, where: Where, values: Values) -> System:
    """A lump of that capacity behind conductance capacity / time_constant."""
    name, number = f"{where[0]}_hidden", 2
    while name in system.lumps:
        name, number = f"{where[0]}_hidden{number}", number + 1
    capacity = max(values["capacity"], 1e-9)  # a lump of no capacity is no lump
    lump = Lump(capacity=capacity, initial=system.lumps[where[0]].initial)
    with_lump = system.model_copy(update={"lumps": {**system.lumps, name: lump}})
    return joined(with_lump, (where[0], name), conductance=capacity / values["time_constant"])


def number(table: str, keys: Mapping[str, str]) -> Add:
    """Numbers of the first part named: each quantity is added to the key of that name."""

    def add(system: System, where: Where, values: Values) -> System:
        owner = table or ("inputs" if where[0] in system.inputs else "modules")
        names = {quantity: f"{owner}.{where[0]}.{key}" for quantity, key in keys.items()}
        known = set(system.parameter_names)
        return system.with_parameters({name: values[quantity] + (system.parameter(name) if name in known else 0.0)
                                       for quantity, name in names.items()})

    return add


def subtable(table: str, key: str) -> Add:
    """A table of the first part named, with one key per quantity."""

    def add(system: System, where: Where, values: Values) -> System:
        return system.with_parameters({f"{table}.{where[0]}.{key}.{quantity}": value
                                       for quantity, value in values.items()})

    return add


def slope(what: str) -> Add:
    """Slope of a module's property; the file then says at which temperature the value holds."""
    own = number("modules", {"slope": f"{what}.slope"})

    def add(system: System, where: Where, values: Values) -> System:
        reference = f"modules.{where[0]}.reference_temperature"
        return own(system.with_parameters({reference: system.parameter(reference)}), where, values)

    return add


def by_name(effect: str) -> Add:
    """Effect that `rt.thermal.add_effect` builds."""

    def add(system: System, where: Where, values: Values) -> System:
        return add_effect(system, effect, where, values).system

    return add
