"""Where effects are possible: every part of a kind, without those that have the effect already."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

from .._system import System
from ._response import Where


def modules(system: System) -> list[Where]:
    """Every module."""
    return [(name,) for name in system.modules]


def lumps(system: System) -> list[Where]:
    """Every lump."""
    return [(name,) for name in system.lumps]


def lumps_without(key: str) -> Callable[[System], list[Where]]:
    """Lumps whose table `key` is not set."""
    return lambda system: [(name,) for name, lump in system.lumps.items() if getattr(lump, key) is None]


def sensors(system: System) -> list[Where]:
    """Every thermometer."""
    return [(name,) for name in system.thermometers]


def driven(system: System) -> list[Where]:
    """Every input and module."""
    return [(name,) for name in (*system.inputs, *system.modules)]


def level(system: System) -> list[Where]:
    """Heaters whose gain does not depend on their value."""
    return [(name,) for name, part in system.inputs.items() if not part.drive.gain_slope]


def prompt(key: str) -> Callable[[System], list[Where]]:
    """Inputs and modules that are not late already."""
    return lambda system: [*((name,) for name, part in system.inputs.items() if not getattr(part.drive, key)),
                           *((name,) for name, part in system.modules.items() if not getattr(part.drive, key))]


def joined_pairs(system: System) -> set[frozenset[str]]:
    """Pairs of nodes that conduct already."""
    pairs = {frozenset(link.between) for link in system.links if link.conductance > 0}
    return pairs | {frozenset((m.hot, m.cold)) for m in system.modules.values()}


def pairs_with(what: str, system: System) -> set[frozenset[str]]:
    """Pairs of nodes between which there is such a term."""
    return {frozenset(link.between) for link in system.links if getattr(link, what) is not None}


def ambient_pairs_without(what: str) -> Callable[[System], Iterator[Where]]:
    """Lumps and ambients between which there is no such term yet."""
    def places(system: System) -> Iterator[Where]:
        there = pairs_with(what, system)
        return (pair for pair in product(system.lumps, system.ambients) if frozenset(pair) not in there)

    return places
