"""Effects that are links, lumps, sensor properties or slopes: the change they make to a system file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..thermal import Link, Lump, System
from ._effect import Where

Values = Mapping[str, float]


def joined(system: System, where: Where, **content: Any) -> System:
    """One more link between two nodes, with a name of its own."""
    taken, name, number = {link.name for link in system.links}, "-".join(where), 2
    while name in taken:
        name, number = f"{'-'.join(where)}-{number}", number + 1
    return system.model_copy(update={"links": (*system.links, Link(between=(where[0], where[1]), name=name, **content))})


def missing_link(system: System, where: Where, values: Values) -> System:
    """A heat path."""
    return joined(system, where, conductance=max(values["conductance"], 0.0))


def natural_convection(system: System, where: Where, values: Values) -> System:
    """Natural convection to an ambient."""
    return joined(system, where, natural={"gain": max(values["gain"], 0.0), "exponent": values["exponent"]})


def radiation(system: System, where: Where, values: Values) -> System:
    """Radiation to an ambient."""
    return joined(system, where, radiation=max(values["coefficient"], 0.0))


def hidden_mass(system: System, where: Where, values: Values) -> System:
    """A lump of that capacity behind conductance capacity / time_constant."""
    name, number = f"{where[0]}_hidden", 2
    while name in system.lumps:
        name, number = f"{where[0]}_hidden{number}", number + 1
    capacity = max(values["capacity"], 1e-9)
    lumps = {**system.lumps, name: Lump(capacity=capacity, initial=system.lumps[where[0]].initial)}
    return joined(system.model_copy(update={"lumps": lumps}), (where[0], name),
                  conductance=capacity / values["time_constant"])


def slope(system: System, where: Where, what: str, value: float) -> System:
    """Add to a slope of a module's property."""
    module = system.modules[where[0]]
    old = getattr(module, what)
    update = {what: old.model_copy(update={"slope": old.slope + value})}
    # set, so that the file says at which temperature the value holds
    update["reference_temperature"] = module.reference_temperature
    return system.model_copy(update={"modules": {**system.modules, where[0]: module.model_copy(update=update)}})


def sensor(system: System, where: Where, what: str, value: float) -> System:
    """Change one property of a sensor."""
    return system.with_parameters({f"sensors.{where[0]}.{what}": value})


def heater_gain(system: System, where: Where, values: Values) -> System:
    """Relative error of a heater's gain."""
    name = f"inputs.{where[0]}.gain"
    return system.with_parameters({name: system.parameter(name) * (1.0 + values["gain"])})
