"""Vertices of the box: groups of modules that share lumps, ends of temperatures, points around the curve (I, I²)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

from ._exact import ZERO, Interval, ends
from ._thermal import Form, Network

Entries = dict[tuple[int, int], Fraction]
Point = tuple[Fraction, Fraction]  # (I, q), q in the place of I²


@dataclass(frozen=True)
class Group:
    """Modules connected by shared lumps."""

    lumps: tuple[int, ...]
    modules: tuple[int, ...]


@dataclass(frozen=True)
class Vertex:
    """Jacobian entries of one group, and where: temperature of each of its lumps, point and form of its modules."""

    entries: Entries
    temperatures: dict[int, Fraction]
    chosen: dict[int, tuple[Point, Form]]

    @property
    def real(self) -> bool:
        """Whether it is a point of the box, and not only of the hull around it."""
        return all(q == current**2 for (current, q), _ in self.chosen.values())


def groups(network: Network) -> list[Group]:
    """Return the modules, those that share lumps together."""
    found: list[tuple[set[int], set[int]]] = []
    for k, module in enumerate(network.modules):
        lumps, members = {module.hot, module.cold}, {k}
        for other in [item for item in found if item[0] & lumps]:
            found.remove(other)
            lumps, members = lumps | other[0], members | other[1]
        found.append((lumps, members))
    return [Group(tuple(sorted(lumps)), tuple(sorted(members))) for lumps, members in found]


def points(interval: Interval, pieces: int) -> list[Point]:
    """Return points whose hull holds (I, I²) over an interval: on the curve, and where the tangents there meet."""
    low, high = interval
    if low == high or pieces == 0:
        return [(current, current**2) for current in ends(interval)]
    marks = [low + (high - low) * k / pieces for k in range(pieces + 1)]
    return [(mark, mark**2) for mark in marks] + [
        ((a + b) / 2, a * b) for a, b in zip(marks[:-1], marks[1:], strict=True)]


def count(network: Network, group: Group, pieces: list[int]) -> int:
    """Return the number of vertices of a group before any is listed."""
    return math.prod([len(ends(network.temperature[lump])) for lump in group.lumps] +
                     [len(points(network.current[k], pieces[k])) * len(network.modules[k].forms)
                      for k in group.modules])


def vertices(network: Network, group: Group, pieces: list[int]) -> Iterator[Vertex]:
    """Yield all vertices of a group."""
    choices = [list(product(points(network.current[k], pieces[k]), network.modules[k].forms)) for k in group.modules]
    for temperatures in product(*(ends(network.temperature[lump]) for lump in group.lumps)):
        at = dict(zip(group.lumps, temperatures, strict=True))
        for chosen in product(*choices):
            entries: Entries = {}
            for k, (point, form) in zip(group.modules, chosen, strict=True):
                add_module(entries, network, k, form, at, point)
            yield Vertex(entries, at, dict(zip(group.modules, chosen, strict=True)))


def add_module(entries: Entries, network: Network, k: int, form: Form, at: dict[int, Fraction], point: Point) -> None:
    """Add the Jacobian entries of a module [W/K]."""
    module = network.modules[k]
    for place, (a, b, c) in module.jacobian(form, at[module.hot], at[module.cold]).items():
        add(entries, place, a + b * point[0] + c * point[1])


def add(entries: Entries, place: tuple[int, int], value: Fraction) -> None:
    """Add to one entry."""
    entries[place] = entries.get(place, ZERO) + value


def jacobian(network: Network, found: list[Vertex]) -> tuple[Entries, bool]:
    """Return the Jacobian at a point of the box [W/K], uncertain links at their least; and whether it is exact.

    Every lump that has no module is at the lower end of its temperatures, every ambient at the temperature of the lump.
    Where a broken exponent forbids exact numbers the slope of convection is rounded up.
    """
    at = {k: box[0] for k, box in enumerate(network.temperature)}
    entries: Entries = {}
    for vertex in found:
        at |= vertex.temperatures
        for place, value in vertex.entries.items():
            add(entries, place, value)
    is_exact = True
    for link in network.links:
        lumps = link.lumps
        if len(lumps) == 2:
            a, b = lumps
            g = link.exchange((at[a], at[a]), (at[b], at[b]), inner=True)[0]
            is_exact &= link.gain[0] == 0 or link.exponent.denominator == 1
            u, v = (4 * link.radiation[0] * at[lump] ** 3 for lump in lumps)
            for place, value in (((a, a), -g - u), ((a, b), g + v), ((b, b), -g - v), ((b, a), g + u)):
                add(entries, place, value)
        elif lumps:
            add(entries, (lumps[0], lumps[0]), -link.least_loss((at[lumps[0]],) * 2))
    return entries, is_exact
