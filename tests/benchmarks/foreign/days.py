"""Days of a machine: every number of its field is a few per cent off, and on one day something has changed.

Some machines have a path, on all days, that no network has.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import robthermal as rt

from .cases import SUB, H, drift, staircase
from .field import Array, Heat
from .hidden import CATALOG, missing_link
from .machines import MACHINES, Machine
from .march import march

N, SCATTER = 900, 0.03
CONVECTION = ", convection"  # all losses depend on the temperature difference, on all days: no network has that
PATH = ", hidden path"  # between two lumps, on all days: no network has that, either
CHANGES = ("ambient", "contact", "heater", "offset", "fan",
           *(kind + CONVECTION for kind in ("ambient", "contact", "heater", "fan")),
           *(kind + PATH for kind in ("ambient", "contact", "heater", "fan")))
OUTSIDE = tuple(kind + more for more in ("", CONVECTION, PATH) for kind in ("sensor drifts", "gusts"))
HEALTHY = tuple("healthy" + more for more in ("", CONVECTION, PATH))


@dataclass(frozen=True, order=True)
class Change:
    """Key of a comparison: a machine, what has changed ("healthy": nothing), a seed."""

    machine: str
    kind: str
    seed: int

    @property
    def key(self) -> str:
        """For random numbers and tables."""
        return f"{self.machine}/{self.kind}/{self.seed}"


@dataclass(frozen=True)
class Days:
    """What the comparison is given, and the truth: where the right names are; empty if there is none."""

    system: rt.System
    healthy: list[rt.Record]
    new: rt.Record
    truth: tuple[tuple[str, ...], ...]
    size: float  # relative; of an offset or drift [K], of gusts [W]
    path: tuple[str, ...] = ()  # lumps that a path joins on all days, of which the network knows nothing


def days(change: Change, n_healthy: int = 3) -> Days:
    """Draw the machine, its network, healthy days and the day in question."""
    rng = np.random.default_rng(zlib.crc32(change.key.encode()))
    seed, told = (int(rng.integers(2**31)) for _ in range(2))
    noise = float(np.exp(rng.uniform(*np.log((0.01, 0.05)))))

    network = MACHINES[change.machine](np.random.default_rng(seed)).network(noise, np.random.default_rng(told))
    convection, path = change.kind.endswith(CONVECTION), ()
    if change.kind.endswith(PATH):
        places, usual = CATALOG[change.machine]["missing_link"]
        path, conductance = places[int(rng.integers(len(places)))], usual * float(rng.uniform(1.0, 3.0))

    def machine() -> Machine:
        made = MACHINES[change.machine](np.random.default_rng(seed))
        if path:
            missing_link(made, path, conductance)
        return made

    truth, size, act = _drawn(change.kind.removesuffix(CONVECTION).removesuffix(PATH), machine(), rng)
    by_itself = () if not convection else tuple(
        lump for lump in machine().plant.zones if not (change.kind.startswith("fan") and lump == _cooled(machine())[0]))
    healthy = [_record(machine(), noise, rng, _nothing, by_itself) for _ in range(n_healthy)]
    return Days(network, healthy, _record(machine(), noise, rng, act, by_itself), truth, size, path)


@dataclass
class _Day:
    """What acts on one day: factors on heaters, heats, and what is added to the readings."""

    power: dict[str, float]
    heats: list[Heat]
    added: dict[str, Array]


Act = Callable[[Machine, _Day], None]


def _nothing(machine: Machine, day: _Day) -> None:
    """A healthy day."""


def _drawn(kind: str, machine: Machine, rng: np.random.Generator
           ) -> tuple[tuple[tuple[str, ...], ...], float, Act]:
    """Truth, size, and what does it to a machine."""
    zones, ambients = machine.plant.zones, set(machine.ambients)
    if kind == "healthy":
        return (), 0.0, _nothing
    if kind in ("ambient", "fan"):  # the path that takes most of the heat; of air that no fan moves: a law of its own
        pair = _cooled(machine)
        f = float(rng.uniform(0.3, 0.6))

        def less(m: Machine, day: _Day) -> None:
            _scale(m, pair, f)
            if kind == "fan":
                day.heats.append(_lifting(m, (pair[0],)))

        return ((_name(pair),), pair)[:1 + (kind == "fan")], f - 1.0, less  # the law of the air is a name, too
    if kind == "contact":
        inner = [pair for pair in machine.links if not ambients & set(pair) and _joins(machine, pair)]
        pair = inner[int(rng.integers(len(inner)))]
        f = float(rng.uniform(0.3, 0.6))
        return ((_name(pair),),), f - 1.0, lambda m, day: _loosen(m, pair, f)
    if kind == "heater":
        name = str(rng.choice(list(machine.plant.heaters)))
        gain = float(rng.uniform(0.6, 0.85))
        return ((name,),), gain - 1.0, lambda m, day: day.power.update({name: gain})
    sensor, size = str(rng.choice(list(machine.plant.sensors))), float(rng.uniform(1.0, 3.0))
    if kind == "offset":
        return ((sensor,),), size, lambda m, day: day.added.update({sensor: np.full(N, size)})
    if kind == "sensor drifts":
        return (), size, lambda m, day: day.added.update({sensor: size * np.linspace(0.0, 1.0, N)})
    lump = str(rng.choice(list(zones)))
    on = np.cumsum(rng.random(N + 1) < 0.03) % 2  # a few minutes at a time
    heat = float(rng.uniform(0.05, 0.2)) * max(high for name, (_, high) in machine.limits.items()
                                               if name in machine.plant.heaters)

    def gusts(t: float, T: Array, u: Array, Q: Array) -> None:
        cells = zones[lump]
        Q[cells] -= heat * on[int(t / H)] / len(cells)

    return (), heat, lambda m, day: day.heats.append(gusts)


def _cooled(machine: Machine) -> tuple[str, str]:
    """The path to an ambient that takes most of the heat."""
    return max((pair for pair in machine.links if pair[1] in machine.ambients), key=lambda pair: machine.links[pair])


def _record(machine: Machine, noise: float, rng: np.random.Generator, act: Act = _nothing,
            by_itself: tuple[str, ...] = ()) -> rt.Record:
    """One day: inputs and numbers of its own; air that moves by itself takes the losses of some lumps."""
    plant, day = machine.plant, _Day({}, [], {})
    U = np.column_stack([*(staircase(N, machine.limits[name], rng) for name in plant.columns if name in machine.limits),
                         *(drift(N, T, rng) for T in machine.ambients.values())])
    zones = list(plant.zones)
    for pair in [*((a, a) for a in zones), *((a, b) for i, a in enumerate(zones) for b in zones[i + 1:]),
                 *((a, ambient) for a in zones for ambient in machine.ambients)]:
        _scale(machine, pair, float(np.exp(SCATTER * rng.standard_normal())))
    for cells in plant.zones.values():
        off = float(np.exp(SCATTER * rng.standard_normal()))
        for cell in cells:
            plant.capacity[cell] *= off
    act(machine, day)
    if by_itself:  # of the conductances as they are on that day
        day.heats.append(_lifting(machine, by_itself))
    driven = U.copy()
    for name, gain in day.power.items():
        driven[:, plant.columns.index(name)] *= gain
    shake = np.zeros((N * SUB, len(plant.capacity)))
    for lump, s in machine.draughts.items():
        cells = plant.zones[lump]
        shake[:, cells] = (s / np.sqrt(H / SUB) * rng.standard_normal(N * SUB) / len(cells))[:, None]
    T0 = np.full(len(plant.capacity), U[0, -len(machine.ambients):].mean()) + rng.uniform(0.0, 2.0)
    Y = march(plant, np.repeat(driven, SUB, axis=0), T0, H, SUB, day.heats, shake)[::SUB]
    for name, added in day.added.items():
        Y[:, list(plant.sensors).index(name)] += added
    return rt.Record(sample_time=H, inputs=U, outputs=Y + noise * rng.standard_normal(Y.shape),
                     input_names=plant.columns, output_names=list(plant.sensors))


def _lifting(machine: Machine, lumps: tuple[str, ...]) -> Heat:
    """What losses of lumps to the ambients take beyond their conductance G if it is G (|ΔT|/10 K)^(1/4)."""
    zone, n = _zone(machine), len(machine.ambients)
    rows = [row for row in machine.plant.outside if zone[row[0]] in lumps]
    cells, at, G = (np.array(x) for x in zip(*rows, strict=True))

    def heat(t: float, T: Array, u: Array, Q: Array) -> None:
        far = u[-n:][at] - T[cells]
        np.add.at(Q, cells, G * ((np.abs(far) / 10.0) ** 0.25 - 1.0) * far)

    return heat


def _name(pair: tuple[str, str]) -> str:
    return f"links.{pair[0]}-{pair[1]}.conductance"


def _zone(machine: Machine) -> dict[int, str]:
    return {int(cell): name for name, cells in machine.plant.zones.items() for cell in cells}


def _joins(machine: Machine, pair: tuple[str, str]) -> bool:
    """Whether cells of both lumps touch."""
    zone = _zone(machine)
    return any({zone[i], zone[j]} == set(pair) for i, j, _ in machine.plant.links)


def _scale(machine: Machine, pair: tuple[str, str], factor: float) -> None:
    """All paths between two lumps, within one (the same twice), or from a lump to an ambient."""
    plant, zone = machine.plant, _zone(machine)
    if pair[1] in machine.ambients:
        k = plant.ambients.index(pair[1])
        plant.outside = [(i, at, G * factor if zone[i] == pair[0] and at == k else G) for i, at, G in plant.outside]
        return
    plant.links = [(i, j, G * factor if {zone[i], zone[j]} == set(pair) else G) for i, j, G in plant.links]


def _loosen(machine: Machine, pair: tuple[str, str], factor: float) -> None:
    """A resistance where two lumps touch, so that the network's conductance between them has this factor."""
    zone = _zone(machine)
    touch = sum(G for i, j, G in machine.plant.links if {zone[i], zone[j]} == set(pair))
    more = (1.0 / factor - 1.0) / machine.links[pair]
    _scale(machine, pair, 1.0 / (1.0 + touch * more))
