"""A mass lies within the path from a lump to an ambient: it stores heat on the way."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...errors import InputError
from .._parts import Link, Lump
from .._system import System
from ._builders import Builder, free_name
from ._effect import Effect, Quantity
from ._response import RecordContext, Response, TrialContext, Values, Where
from ._signatures import TIMES, follow, into, node

_TINY = 1e-6  # of its lump's capacity: a mass that is not there yet
_RATIOS = (0.3, 1.0, 3.0)
_NEAREST = 0.1  # ratio: a mass nearer to the lump hangs on it, one as near to the ambient is not seen
_STILL = 1e-9  # K: an ambient that moves less is constant


def _ends(system: System, name: str) -> tuple[Link, str, str]:
    """A link, the lump and the ambient that it joins."""
    link = next(link for link in system.links if link.name == name)
    a, b = link.between
    return (link, a, b) if a in system.lumps else (link, b, a)


def _share(values: Values) -> float:
    """Part of the resistance of the path that lies between the lump and the mass."""
    return values["ratio"] / (1.0 + values["ratio"])


def _conducts(system: System, link: Link) -> bool:
    """Whether it joins a lump to an ambient, and by conduction alone."""
    plain = all(getattr(link, what) is None for what in ("natural", "radiation", "step", "follow", "temperature_law"))
    return link.conductance > 0 and plain and not set(link.between) <= set(system.lumps)


def _within(system: System, where: Where) -> str:
    """The mass that this effect has put at one end of a link; "" where there is none."""
    a, b = next(link.between for link in system.links if link.name == where[0])
    return next((mass for lump, mass in ((a, b), (b, a)) if mass.startswith(f"{lump}_") and "_mass" in mass), "")


def _places(system: System) -> Iterator[Where]:
    return ((link.name,) for link in system.links
            if _conducts(system, link) and not _present(system, (link.name,)))


def _add(system: System, where: Where, values: Values) -> System:
    """The link ends at the new lump; a second one goes on to the ambient. In a steady state nothing changes."""
    link, lump, ambient = _ends(system, where[0])
    if not _conducts(system, link):
        raise InputError(f"{link.name!r} is no path of conduction alone to an ambient", where="argument where",
                         remedy="Give natural convection, radiation, a step or what a column drives a link of its own.")
    name, share = free_name(f"{lump}_{ambient}_mass", system.lumps), _share(values)
    own, outside = system.lumps[lump], system.ambients[ambient]
    capacity = max(values["capacity"], 1e-9)  # a lump of no capacity is no lump
    mass = (Lump(capacity=capacity) if own.initial is None else
            Lump(capacity=capacity, initial=own.initial + share * (outside.temperature - own.initial)))
    halves = (Link(between=(lump, name), conductance=link.conductance / share, name=link.name),
              Link(between=(name, ambient), conductance=link.conductance / (1.0 - share)))
    links = [half for one in system.links for half in (halves if one is link else (one,))]
    fit = dict(system.fit)
    key = f"links.{link.name}.conductance"
    if key in fit:  # its range was that of the whole path
        limits = fit[key]
        fit[key] = limits.model_copy(update={part: value / share for part in ("lower", "upper", "sigma")
                                             if (value := getattr(limits, part)) is not None})
    if not any(set(one.between) == {lump, ambient} for one in links):  # a coolant passes the mass now
        passed = tuple(name if one == lump else one for one in outside.coolant)
        outside = outside.model_copy(update={"coolant": passed} if passed else {})
    return system.model_copy(update={"lumps": {**system.lumps, name: mass}, "links": tuple(links), "fit": fit,
                                     "ambients": {**system.ambients, ambient: outside}})


def _names(system: System, where: Where) -> dict[str, str]:
    mass = _within(system, where)
    outer = next(one for one in system.links if mass in one.between and one.name != where[0])
    return {"capacity": f"lumps.{mass}.capacity", "ratio": f"links.{outer.name}.conductance"}


def _present(system: System, where: Where) -> bool:
    return bool(_within(system, where))


def _usual(system: System, where: Where) -> dict[str, float]:
    return {"capacity": _TINY * system.lumps[_ends(system, where[0])[1]].capacity, "ratio": 1.0}


_ADD = Builder(_add, _names, _present, _usual)


def _capacities(record: TrialContext, where: Where) -> list[float]:
    """Capacities whose time constants in the middle of the path the record resolves; none if the ambient is constant.

    A mass in the path to a constant ambient does what a mass does that hangs on the lump.
    """
    link, _, ambient = _ends(record.system, where[0])
    u = getattr(record, "u", None)  # a frequency response has none
    if u is None or np.ptp(u[:, record.system.exogenous_names.index(ambient)]) < _STILL:
        return []
    return [4.0 * tau * link.conductance for tau in TIMES[::2] if record.h / 2 <= tau <= record.span / 3]


def _alike(system: System, where: Where) -> str:
    """Why a frequency response cannot show it."""
    return "no ambient moves in a frequency response: there it is the hidden_mass of its lump"


def _stored(record: RecordContext, where: Where, values: Values) -> Response:
    """Heat that the mass gives to the lump beyond that of the path in its steady state, per unit of its capacity.

    The mass follows T_s = (1 - share) T + share T_ambient with time constant C share (1 - share) / G.
    """
    link, lump, ambient = _ends(record.system, where[0])
    share, C, G = _share(values), values["capacity"], link.conductance
    settled = (1.0 - share) * node(record, lump)[0] + share * node(record, ambient)[0]
    flow = G / share * (follow(settled, C * share * (1.0 - share) / G, record.h) - settled) / C
    return into(record, {lump: (flow, np.concatenate([flow[1:], flow[-1:]]))})


EFFECT = Effect(
    name="path_mass",
    rank=155,
    meaning="A mass lies within the path from a lump to an ambient, such as a wall: it stores heat on the way.",
    where=("link",),
    places=_places,
    quantities=(Quantity("capacity", "J/K", 0.0, 1e5, grid=_capacities),
                Quantity("ratio", "-", _NEAREST, 1.0 / _NEAREST, grid=_RATIOS)),
    nonnegative=("capacity",),
    add=_ADD,
    signature=_stored,
    hidden=_alike,
    confused_with=("hidden_mass", "missing_ambient_link"),
    separated_by="a step of the ambient temperature",
    measure="record the temperature within {0}, and let that of the ambient change",
)
