"""Heat paths that a model may lack, or that change."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np

from ...thermal import System
from . import _adding as adding
from ._effect import Effect, Quantity, Where
from ._signatures import Array, Values, conductance_step, exchanged

if TYPE_CHECKING:
    from ..path import Along

_N_TIMES = 30


def _joined(system: System) -> set[frozenset[str]]:
    """Pairs that conduct already."""
    pairs = {frozenset(link.between) for link in system.links if link.conductance > 0}
    return pairs | {frozenset((m.hot, m.cold)) for m in system.modules.values()}


def _lump_pairs(system: System) -> Iterator[Where]:
    joined = _joined(system)
    return (pair for pair in combinations(system.lumps, 2) if frozenset(pair) not in joined)


def _ambient_pairs(system: System) -> Iterator[Where]:
    joined = _joined(system)
    return (pair for pair in product(system.lumps, system.ambients) if frozenset(pair) not in joined)


def _without(system: System, what: str) -> Iterator[Where]:
    """Lumps and ambients between which there is no such term yet."""
    there = {frozenset(link.between) for link in system.links if getattr(link, what) is not None}
    return (pair for pair in product(system.lumps, system.ambients) if frozenset(pair) not in there)


def _steady(system: System) -> list[Where]:
    return [(link.name,) for link in system.links if link.conductance > 0 and link.step is None]


def _difference(Ta: Array, Tb: Array, values: Values) -> Array:
    return Tb - Ta


def _natural(Ta: Array, Tb: Array, values: Values) -> Array:
    return np.abs(Tb - Ta) ** values["exponent"] * (Tb - Ta)


def _fourth(Ta: Array, Tb: Array, values: Values) -> Array:
    return Tb**4 - Ta**4


def _times(path: Along, where: Where) -> list[float]:
    """Times of a sudden change: never in the first or last twentieth, where nothing tells it from the start."""
    return [float(t) for t in np.linspace(path.time[0], path.time[-1], _N_TIMES + 2)[1:-1]]


LINK_EFFECTS = (
    Effect("missing_link", _lump_pairs, (Quantity("conductance", "W/K", 0.0, 1e3),), adding.missing_link,
           exchanged(_difference), ("missing_link", "missing_ambient_link", "hidden_mass"),
           "a large temperature difference between the two lumps without moving the others"),
    Effect("missing_ambient_link", _ambient_pairs, (Quantity("conductance", "W/K", 0.0, 1e3),), adding.missing_link,
           exchanged(_difference), ("natural_convection", "radiation", "missing_ambient_link"),
           "a step of the ambient temperature"),
    Effect("natural_convection", lambda system: _without(system, "natural"),
           (Quantity("gain", "W/K^1.25", 0.0, 1e2), Quantity("exponent", "-", 0.25, 0.25, grid=(0.25,))),
           adding.natural_convection, exchanged(_natural), ("radiation", "missing_ambient_link"),
           "small and large differences to the ambient, of both signs"),
    Effect("radiation", lambda system: _without(system, "radiation"),
           (Quantity("coefficient", "W/K⁴", 0.0, 5.67e-7, typical=1e-10),),
           adding.radiation, exchanged(_fourth), ("natural_convection", "missing_ambient_link"),
           "another absolute level at equal differences"),
    Effect("conductance_step", _steady,
           (Quantity("relative", "-", -1.0, 20.0), Quantity("time", "s", -1e12, 1e12, grid=_times)),
           adding.subtable("links", "step"), conductance_step, ("missing_link", "natural_convection"),
           "the same profile early and late"),
)
