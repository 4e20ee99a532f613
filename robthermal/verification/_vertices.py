"""The vertices of the box at which a matrix inequality has to be checked.

For fixed (I, I²) the Jacobian is affine in the temperatures; for fixed temperatures it is affine in (I, I²). The
curve (I, I²) over [lo, hi] lies in the triangle (lo, lo²), (hi, hi²), ((lo+hi)/2, lo hi), so a matrix inequality that
holds at temperature vertices times triangle vertices holds over the box. Modules that share a lump share its
temperature: they form one cluster, whose vertices are taken together (proof note, 3).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from flint import fmpq

from ._cost import product_up_to
from ._fields import Interval
from ._numbers import name_of, show
from ._system import Module, Region, ThermalSystem

Entries = dict[tuple[int, int], fmpq]
_MANY = 1_000_000  # more than anything checks one by one


@dataclass(frozen=True)
class Point:
    """A point (I, q) of the hull of the curve q = I²."""

    current: fmpq
    square: fmpq


@dataclass(frozen=True)
class Cluster:
    """Modules connected by shared lumps."""

    lumps: tuple[int, ...]
    modules: tuple[int, ...]


@dataclass(frozen=True)
class Vertex:
    """Jacobian entries of one cluster at one vertex, and where that is."""

    entries: Entries
    temperatures: tuple[fmpq, ...]
    points: tuple[Point, ...]

    @property
    def real(self) -> bool:
        """Whether the vertex is a point of the box (and not only of the hull around it)."""
        return all(point.square == point.current**2 for point in self.points)


def clusters(system: ThermalSystem) -> list[Cluster]:
    """Return the modules grouped by shared lumps, in the order of their first modules."""
    above: dict[int, int] = {}  # a forest: lumps of one group have one root

    def root(lump: int) -> int:
        while above.setdefault(lump, lump) != lump:
            above[lump] = lump = above[above[lump]]
        return lump

    for module in system.modules:
        above[root(module.cold)] = root(module.hot)
    groups: dict[int, tuple[set[int], list[int]]] = {}
    for k, module in enumerate(system.modules):
        lumps, members = groups.setdefault(root(module.hot), (set(), []))
        lumps.update((module.hot, module.cold))
        members.append(k)
    return [Cluster(tuple(sorted(lumps)), tuple(members)) for lumps, members in groups.values()]


def ends(interval: Interval) -> list[fmpq]:
    """Return the one or two ends of an interval."""
    return list(interval) if interval[0] < interval[1] else [interval[0]]


def endpoints(interval: Interval) -> list[Point]:
    """Return the ends of the curve (I, I²)."""
    return [Point(current, current**2) for current in ends(interval)]


def hull(interval: Interval, pieces: int) -> list[Point]:
    """Return points whose hull contains the curve (I, I²): points of the curve, and where their tangents meet."""
    low, high = interval
    if low == high:
        return endpoints(interval)
    steps = [low + (high - low) * k / pieces for k in range(pieces + 1)]
    corners = [Point((a + b) / 2, a * b) for a, b in zip(steps[:-1], steps[1:], strict=True)]
    return [Point(step, step**2) for step in steps] + corners


def count(system: ThermalSystem, cluster: Cluster, region: Region, points: Sequence[Sequence[Point]]) -> int:
    """Return the number of vertices of a cluster before listing them; a number above a million where it is larger."""
    lumps = [len(ends(region.temperature[lump])) for lump in cluster.lumps]
    modules = [len(points[module]) * len(system.forms(module)) for module in cluster.modules]
    return product_up_to([*lumps, *modules], _MANY)


def vertices(system: ThermalSystem, region: Region, cluster: Cluster,
             points: Sequence[Sequence[Point]]) -> Iterator[Vertex]:
    """Make the vertices of a cluster; ``points`` holds the current points of every module of the system."""
    for temperatures in product(*(ends(region.temperature[lump]) for lump in cluster.lumps)):
        at = dict(zip(cluster.lumps, temperatures, strict=True))
        for chosen in product(*(product(points[k], system.forms(k)) for k in cluster.modules)):
            entries: Entries = {}
            for point, module in chosen:
                _add_module(entries, module, at, point)
            yield Vertex(entries, temperatures, tuple(point for point, _ in chosen))


def describe(system: ThermalSystem, cluster: Cluster, vertex: Vertex) -> str:
    """Return where a vertex lies, for a reason."""
    words = [f"{name_of(system.lumps[lump])} = {show(value)} K"
             for lump, value in zip(cluster.lumps, vertex.temperatures, strict=True)]
    words += [f"current {name_of(system.modules[k].name)} = {show(point.current)} A"
              for k, point in zip(cluster.modules, vertex.points, strict=True)]
    return ", ".join(words)


def _add_module(entries: Entries, module: Module, at: dict[int, fmpq], point: Point) -> None:
    h, c = module.hot, module.cold
    places = ((h, h), (h, c), (c, c), (c, h))
    for place, (a, b, d) in zip(places, module.entries(at[h], at[c]), strict=True):
        entries[place] = entries.get(place, fmpq(0)) + a + b * point.current + d * point.square
