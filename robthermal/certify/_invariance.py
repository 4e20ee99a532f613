"""Box invariance: trajectories that start in the box stay in it, for all inputs in their ranges."""

from __future__ import annotations

from collections.abc import Mapping

from ..thermal import System
from ..verification import Certificate, establish
from ._heaters import following
from ._own_heat import driven
from ._sections import (
    Currents,
    Interval,
    Temperatures,
    current_box,
    made_by,
    named_ranges,
    region_section,
    system_section,
)
from ._surroundings import ambient_ranges


def invariance(system: System, *, current: Currents, temperature: Temperatures,
               ambient: Mapping[str, Interval] | None = None,
               heat: Mapping[str, Interval] | None = None,
               parameters: Mapping[str, Interval] | None = None) -> Certificate:
    """Certify that a temperature box is never left.

    Parameters
    ----------
    system : System
        Network with its modules.
    current : mapping
        {module: (lower, upper)} [A], every module.
    temperature : tuple or mapping
        Box [K]: (lower, upper) for all lumps, or {lump: (lower, upper)}.
    ambient : mapping, optional
        {ambient: (lower, upper)} [K]; default its nominal temperature.
    heat : mapping, optional
        {lump: (lower, upper)} extra heat, heaters and loads [W]; default none. Not in it are constant and periodic
        heats of the system, which are added, and heaters whose power follows temperature: their declared limits count.
    parameters : mapping, optional
        Uncertain numbers of the system as in `contraction`.

    Returns
    -------
    Certificate
        On every face of the box the heat flows inwards (Nagumo), or `reason` names the face where it may not.

    Raises
    ------
    InputError
        Boxes that do not fit the system.

    Examples
    --------
    >>> import robthermal as rt
    >>> box = {"m1": (0.0, 0.0), "m2": (0.0, 0.0)}
    >>> rt.certify.invariance(rt.systems.two_module(), current=box, temperature=(288.15, 308.15),
    ...                       ambient={"room": (293.15, 303.15)}).holds
    True
    """
    given = named_ranges(heat or {}, system.lump_names, "heat", "lump")
    plain = driven(system, {name: (low, high) for name, (low, high) in given.items()}, parameters,
                   current_box(system, current))
    region = region_section(plain.system, current, temperature, plain.parameters, ("inputs",))
    region["ambient"] = {name: list(pair) for name, pair in ambient_ranges(system, ambient, parameters).items()}
    if plain.heat:
        region["heat"] = {name: list(pair) for name, pair in plain.heat.items()}
    section = system_section(plain.system, heaters=following(system, parameters))
    return establish("invariance", system=section, region=region, evidence={},
                     made_by=made_by("none", "checked directly"))
