"""A lump split in two: capacity, surface and constant heats shared, a conductance between the halves."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from .._checks import positive_number
from ..errors import InputError
from ._parts import FitRange, Link, Lump, Natural
from ._system import System, conducting_paths

_RANGE = 100.0  # times smaller or larger than stated: the bounds of the conductance between the halves
_HEATS = ("heat", "periodic.heat", "condensation.conductance")  # of a lump: every half has half of it
_PATHS = ("conductance", "natural.gain", "radiation")  # of a link to an ambient: every half has half of the surface


@dataclass(frozen=True)
class SplitLump:
    """A system in which one lump has become two.

    Parameters
    ----------
    system : System
        System with both halves; its fit table has the bounds of a half, and the conductance between them.
    lump, other : str
        The two halves: the first keeps the name of the lump.
    moved : tuple of str
        What is attached to the other half, for example ``("lumps.plate", "sensors.T1")``.
    conductance : str
        Name of the number between the halves, for example ``links.block-block_2.conductance``.
    twins : mapping of str to str
        Numbers of the first half to the equal numbers of the other.

    Examples
    --------
    >>> import robthermal as rt
    >>> split = rt.thermal.split_lump(rt.systems.two_module(), "x3", ["sensors.T3"])
    >>> split.other, split.system.sensors["T3"].lump, split.conductance
    ('x3_2', 'x3_2', 'links.x3-x3_2.conductance')
    """

    system: System
    lump: str
    other: str
    moved: tuple[str, ...]
    conductance: str
    twins: Mapping[str, str]


def split_lump(system: System, lump: str, moved: Iterable[str] = (), *, conductance: float | None = None) -> SplitLump:
    """Split a lump in two.

    Each half has half of the capacity, of constant and periodic heats, and of every path to an ambient, whose surface
    it shares; random heats are independent, with the same sum. What is joined to the lump otherwise (links to other
    lumps, faces of modules, heaters, sensors) stays at the first half unless it is moved.

    Parameters
    ----------
    system : System
        System with the lump; it is not changed.
    lump : str
        Lump to split; the first half keeps its name.
    moved : iterable of str
        What goes to the other half: ``lumps.NAME`` for the links to a neighbor, ``modules.NAME``, ``inputs.NAME``,
        ``sensors.NAME``.
    conductance : float, optional
        Between the halves [W/K]; default twice that to all neighbors, the half way to each (twice that to the ambients
        where there are no neighbors).

    Returns
    -------
    SplitLump

    Raises
    ------
    InputError
        No such lump; something to move that is not attached to it; a conductance that is not positive.

    Examples
    --------
    >>> import robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar"}})
    >>> halves = rt.thermal.split_lump(bar, "bar", ["sensors.T"], conductance=2.0).system
    >>> halves.parameter("lumps.bar_2.capacity"), halves.parameter("links.bar_2-room.conductance")
    (50.0, 0.25)
    """
    if lump not in system.lumps:
        raise InputError(f"there is no lump {lump!r}", where="argument lump",
                         expected="one of " + ", ".join(system.lumps))
    away = tuple(moved)
    for name in away:
        if name not in (known := attached(system, lump)):
            raise InputError(f"{name!r} is not attached to lump {lump!r}", where="argument moved",
                             expected="some of " + (", ".join(known) or "nothing: nothing is attached to it"))
    g = inner_conductance(system, lump) if conductance is None else positive_number(conductance, "conductance", "W/K")
    other = _free(f"{lump}_2", {*system.lumps, *system.ambients})
    links, twins = _links(system, lump, other, away)
    names = {link.name for link in links}
    between = Link(between=(lump, other), conductance=g, name=_free(f"{lump}-{other}", names))
    numbers = {f"lumps.{lump}.{key}": f"lumps.{other}.{key}" for key in ("capacity", *_HEATS)} | twins
    number = f"links.{between.name}.conductance"
    content = {name: getattr(system, name) for name in System.model_fields} | {
        "lumps": {name: _half(one) if name == lump else one for name, one in system.lumps.items()}
        | {other: _half(system.lumps[lump])},
        "links": (*links, between), **_moved(system, lump, other, away),
        "fit": {name: _halved(one) if name in numbers else one for name, one in system.fit.items()}
        | ({number: FitRange(lower=g / _RANGE, upper=g * _RANGE)} if system.fit else {})}
    return SplitLump(System(**content), lump, other, away, number, numbers)


def ways_to_split(system: System, lump: str) -> Iterator[tuple[str, ...]]:
    """What may go to the other half: no neighbor or one, and its heaters, its sensors, or neither.

    Parameters
    ----------
    system : System
        System with the lump.
    lump : str
        Lump to split.

    Yields
    ------
    tuple of str
        As `moved` of `split_lump`; of two that only exchange the halves, one.

    Examples
    --------
    >>> import robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar"}})
    >>> list(rt.thermal.ways_to_split(bar, "bar"))
    [(), ('inputs.heater',)]
    """
    every = attached(system, lump)
    kinds = {kind: tuple(name for name in every if name.startswith(kind)) for kind in ("inputs.", "sensors.")}
    neighbors: list[tuple[str, ...]] = [(), *((name,) for name in every if name.startswith(("lumps.", "modules.")))]
    seen: set[frozenset[frozenset[str]]] = set()
    for near, own in product(neighbors, dict.fromkeys([(), *kinds.values()])):
        halves = frozenset({frozenset((*near, *own)), frozenset(every) - {*near, *own}})
        if halves not in seen:
            seen.add(halves)
            yield (*near, *own)


def attached(system: System, lump: str) -> tuple[str, ...]:
    """What is joined to a lump and can be at one half only.

    Parameters
    ----------
    system : System
        System with the lump.
    lump : str
        Name of that lump.
    """
    ends = [end for link in system.links if lump in link.between for end in link.between]
    return (*(f"lumps.{name}" for name in system.lumps if name in ends and name != lump),
            *(f"modules.{name}" for name, one in system.modules.items() if lump in (one.hot, one.cold)),
            *(f"inputs.{name}" for name, one in system.inputs.items() if one.lump == lump),
            *(f"sensors.{name}" for name, one in system.sensors.items() if one.lump == lump))


def inner_conductance(system: System, lump: str) -> float:
    """Twice the conductance to all neighbors [W/K]: half the way to each; to the ambients where there are none.

    Parameters
    ----------
    system : System
        System with the lump.
    lump : str
        Name of that lump.
    """
    own = [(b if a == lump else a, g) for a, b, g in conducting_paths(system) if lump in (a, b)]
    near = sum(g for name, g in own if name in system.lumps)
    return 2.0 * (near or sum(g for _, g in own))


def _half(lump: Lump) -> Lump:
    halves: dict[str, Any] = {"capacity": lump.capacity / 2, "heat": lump.heat / 2,
                              "disturbance": lump.disturbance / math.sqrt(2.0)}
    if lump.periodic is not None:
        halves["periodic"] = lump.periodic.model_copy(update={"heat": lump.periodic.heat / 2})
    if lump.condensation is not None:
        halves["condensation"] = lump.condensation.model_copy(
            update={"conductance": lump.condensation.conductance / 2})
    return lump.model_copy(update=halves)


def _links(system: System, lump: str, other: str, away: tuple[str, ...]) -> tuple[list[Link], dict[str, str]]:
    """Links of the system with the halves, and the numbers of those that have become two."""
    links: list[Link] = []
    second: list[Link] = []
    twins: dict[str, str] = {}
    taken = {link.name for link in system.links}
    for link in system.links:
        far = next((end for end in link.between if end != lump), "")
        if lump not in link.between:
            links.append(link)
        elif far in system.lumps:
            links.append(_ended(link, lump, other) if f"lumps.{far}" in away else link)
        else:
            half = _half_path(link)
            twin = _ended(half, lump, other).model_copy(update={"name": _free(f"{other}-{far}", taken)})
            taken.add(twin.name)
            links.append(half)
            second.append(twin)
            twins |= {f"links.{half.name}.{key}": f"links.{twin.name}.{key}" for key in _PATHS}
    return [*links, *second], twins


def _ended(link: Link, lump: str, other: str) -> Link:
    """The same link, under its name, at the other half."""
    a, b = (other if end == lump else end for end in link.between)
    return link.model_copy(update={"between": (a, b)})


def _half_path(link: Link) -> Link:
    halves: dict[str, Any] = {"conductance": link.conductance / 2}
    if link.natural is not None:
        halves["natural"] = Natural(gain=link.natural.gain / 2, exponent=link.natural.exponent)
    if link.radiation is not None:
        halves["radiation"] = link.radiation / 2
    return link.model_copy(update=halves)


def _moved(system: System, lump: str, other: str, away: tuple[str, ...]) -> dict[str, Any]:
    """Modules, heaters and sensors with what is moved at the other half."""
    def at(table: str, one: Any, name: str, *keys: str) -> Any:
        here = [key for key in keys if getattr(one, key) == lump]
        return one.model_copy(update=dict.fromkeys(here, other)) if f"{table}.{name}" in away else one

    return {"modules": {name: at("modules", one, name, "hot", "cold") for name, one in system.modules.items()},
            "inputs": {name: at("inputs", one, name, "lump") for name, one in system.inputs.items()},
            "sensors": {name: at("sensors", one, name, "lump") for name, one in system.sensors.items()}}


def _halved(one: FitRange) -> FitRange:
    return FitRange(lower=one.lower / 2, upper=one.upper / 2, sigma=None if one.sigma is None else one.sigma / 2)


def _free(name: str, taken: Iterable[str]) -> str:
    """The name, with a number if it is taken."""
    used, number, base = set(taken), 3, name.removesuffix("_2")
    while name in used:
        name, number = f"{base}_{number}", number + 1
    return name
