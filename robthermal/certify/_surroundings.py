"""Ranges of what acts on a machine from outside: ambients and heaters, with what their parameters add."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..thermal import System
from ._heaters import following, heater_range
from ._own_heat import add, through
from ._sections import Currents, Interval, Temperatures, named_ranges, region_section


def heater_heat(system: System, parameters: Mapping[str, Interval] | None = None,
                stated: Mapping[str, Interval] | None = None) -> dict[str, Interval]:
    """Heat range of every heated lump from the declared limits of the heaters, but for lumps whose heat is stated.

    Parameters
    ----------
    system : System
        System with heaters and their declared limits.
    parameters : mapping, optional
        {parameter name: (lower, upper)}; ranges of the gain of a heater and of what it makes of its column otherwise
        widen the heat, others change nothing.
    stated : mapping, optional
        {lump: (lower, upper)} [W] that count instead of the heaters on these lumps.

    Returns
    -------
    dict
        {lump: (lower, upper)} [W]; heaters on one lump add up, and an input of gain 0 is none. Without heaters whose
        power follows temperature: of these, certificates state the power at a temperature.

    Raises
    ------
    InputError
        A heater without limits on a lump whose heat is not stated; a stated range that is none, or of no lump.

    Examples
    --------
    >>> import robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 50.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}],
    ...                 inputs={"foil": {"lump": "bar", "gain": 2.0, "limits": (0.0, 10.0)}})
    >>> rt.certify.heater_heat(bar)
    {'bar': (0.0, 20.0)}
    >>> rt.certify.heater_heat(bar, {"inputs.foil.gain": (1.9, 2.1)})
    {'bar': (0.0, 21.0)}
    """
    given = _checked(system, stated or {})
    heat: dict[str, Interval] = {}
    others = following(system, parameters)
    for name, heater in system.inputs.items():
        gains = (parameters or {}).get(f"inputs.{name}.gain", (heater.gain, heater.gain))
        if name in others or not any(gains):  # no heat: the speed of a fan, a force, whatever its limits
            continue
        if all(lump in given for lump, _ in through(system, name, (0.0, 1.0), parameters)):
            continue
        for lump, pair in through(system, name, heater_range(system, name, parameters), parameters):
            add(heat, lump, pair)
    return heat | given


def heat_ranges(system: System, heat: Mapping[str, Interval] | None, parameters: Mapping[str, Interval] | None
                ) -> dict[str, Interval]:
    """Heat into every lump that gets any: as given, checked, or what heaters may give within their limits."""
    if heat is None:
        return heater_heat(system, parameters)
    return _checked(system, heat)


def _checked(system: System, heat: Mapping[str, Interval]) -> dict[str, Interval]:
    return {name: (low, high) for name, (low, high) in named_ranges(heat, system.lump_names, "heat", "lump").items()}


def claim_box(system: System, *, current: Currents, temperature: Temperatures,
              ambient: Mapping[str, Interval] | None = None, parameters: Mapping[str, Interval] | None = None
              ) -> dict[str, dict[str, Sequence[float]]]:
    """Ranges of every lump, module and ambient of a box, and of the uncertain numbers that a claim knows.

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
    parameters : mapping, optional
        Uncertain numbers of the system as in `contraction`; what no claim depends on is left out.

    Returns
    -------
    dict
        "temperature" and "ambient" [K], "current" [A], "parameters" [own unit], each {name: (lower, upper)}.

    Raises
    ------
    InputError
        Boxes that do not fit the system.

    Examples
    --------
    >>> import robthermal as rt
    >>> two = rt.systems.two_module()
    >>> box = rt.certify.claim_box(two, current={"m1": (0, 1), "m2": (0, 1)}, temperature=(280, 320))
    >>> box["current"]["m2"], box["temperature"]["x1"], len(box["temperature"])
    ([0.0, 1.0], [280.0, 320.0], 18)
    """
    region = region_section(system, current, temperature, parameters)
    boxes = region["temperature"]
    lumps = dict(boxes) if isinstance(boxes, Mapping) else dict.fromkeys(system.lump_names, boxes)
    return {"temperature": lumps, "current": region["current"], "parameters": region.get("parameters", {}),
            "ambient": {name: list(pair) for name, pair in ambient_ranges(system, ambient, parameters).items()}}


def ambient_ranges(system: System, ambient: Mapping[str, Interval] | None,
                   parameters: Mapping[str, Interval] | None = None) -> dict[str, Interval]:
    """Range of every ambient [K]: as given, else that of its parameter, else its nominal temperature."""
    ranges = {name: (part.temperature, part.temperature) for name, part in system.ambients.items()}
    named = {name: f"ambients.{name}.temperature" for name in ranges}
    ranges |= {name: (parameters or {})[key] for name, key in named.items() if key in (parameters or {})}
    found = named_ranges({**ranges, **(ambient or {})}, system.ambient_names, "ambient", "ambient", kelvin=True)
    return {name: (low, high) for name, (low, high) in found.items()}
