"""Machines as fields of 150 cells and more, and the network of 4 to 8 lumps that a user would draw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import robthermal as rt

from .field import Array, Field, Legs

ROOM = 296.15  # K
SPREAD = {"capacity": 0.15, "conductance": 0.25}  # sigma of the fit table, relative


@dataclass
class Machine:
    """A field and its network: links between lumps, modules (hot, cold, S, R, K), limits of every input."""

    plant: Field
    links: dict[tuple[str, str], float]
    ambients: dict[str, float]
    limits: dict[str, tuple[float, float]]
    modules: dict[str, tuple[str, str, float, float, float]] = field(default_factory=dict)
    draughts: dict[str, float] = field(default_factory=dict)  # random heat of lumps [W/√Hz]

    def capacities(self) -> dict[str, float]:
        """Sum of the cells of every lump [J/K]."""
        C = np.array(self.plant.capacity)
        return {name: float(C[cells].sum()) for name, cells in self.plant.zones.items()}

    def lump_of(self, cells: Array) -> str:
        """The lump in which most of these cells lie."""
        return max(self.plant.zones, key=lambda name: np.isin(cells, self.plant.zones[name]).sum())

    def network(self, noise: float, rng: np.random.Generator) -> rt.System:
        """The user's system: numbers some 8 % off, with a fit table."""
        def told(value: float) -> float:
            return float(value * np.exp(0.08 * rng.standard_normal()))

        C = {name: told(value) for name, value in self.capacities().items()}
        G = {pair: told(value) for pair, value in self.links.items()}
        fit: dict[str, Any] = {f"lumps.{name}.capacity": (value, SPREAD["capacity"]) for name, value in C.items()}
        fit |= {f"links.{a}-{b}.conductance": (value, SPREAD["conductance"]) for (a, b), value in G.items()}
        modules = {name: {"hot": hot, "cold": cold, "seebeck": told(S), "resistance": told(R), "conductance": told(K),
                          "reference_temperature": ROOM, "current_limits": self.limits[name]}
                   for name, (hot, cold, S, R, K) in self.modules.items()}
        fit |= {f"modules.{name}.{part}.value": (one[part], 0.1) for name, one in modules.items()
                for part in ("seebeck", "resistance", "conductance")}
        return rt.System(
            ambients={name: {"temperature": T} for name, T in self.ambients.items()},
            lumps={name: {"capacity": value, "disturbance": self.draughts.get(name, 0.0)} for name, value in C.items()},
            links=[{"between": pair, "conductance": value} for pair, value in G.items()],
            inputs={name: {"lump": self.lump_of(cells), "limits": self.limits[name]}
                    for name, cells in self.plant.heaters.items()},
            modules=modules,
            sensors={name: {"lump": self.lump_of(cells), "noise": noise} for name, cells in self.plant.sensors.items()},
            fit={name: {"lower": value / 6, "upper": 6 * value, "sigma": share * value}
                 for name, (value, share) in fit.items()})


def bar(rng: np.random.Generator) -> Machine:
    """A bar of 240 cells, heated in two places, cooled by water at one end: a chain of six lumps."""
    plant, n = Field(("room", "water")), 240
    across = rng.uniform(0.5, 1.0)  # W/K from one lump to the next
    cells = plant.chain(n, rng.uniform(180.0, 320.0), across / 5.975)
    plant.zones = {f"x{i + 1}": part for i, part in enumerate(np.split(cells, 6))}
    loss = rng.uniform(0.03, 0.06)
    for name in plant.zones:
        plant.lose(plant.zones[name], "room", loss)
    plant.lose(cells[-3:], "water", 1.5)
    plant.heaters = {"q1": cells[12:28], "q2": cells[128:148]}
    plant.sensors = {"T1": cells[24:26], "T3": cells[103:105], "T4": cells[136:138], "T6": cells[218:220]}
    links = {(f"x{i}", f"x{i + 1}"): across for i in range(1, 6)}
    links |= {(name, "room"): loss for name in plant.zones} | {("x6", "water"): 1.0}
    return Machine(plant, links, {"room": ROOM, "water": 289.0}, {"q1": (0.0, 14.0), "q2": (0.0, 12.0)})


def plate(rng: np.random.Generator) -> Machine:
    """A plate of 18 by 12 cells, heated in two patches, on a cold rail along one edge: two rows of three lumps."""
    plant, nx, ny = Field(("room", "rail")), 18, 12
    cells = plant.block(nx * ny, rng.uniform(150.0, 260.0)).reshape(nx, ny)
    sheet = rng.uniform(0.7, 1.3)  # conductance of a square [W/K]
    plant.links += [(int(a), int(b), sheet) for a, b in zip(cells[:-1].ravel(), cells[1:].ravel(), strict=True)]
    plant.links += [(int(a), int(b), sheet) for a, b in zip(cells[:, :-1].ravel(), cells[:, 1:].ravel(), strict=True)]
    plant.zones = {f"p{i}{j}": cells[6 * i:6 * i + 6, 6 * j:6 * j + 6].ravel() for i in range(3) for j in range(2)}
    loss = rng.uniform(0.04, 0.08)
    for name in plant.zones:
        plant.lose(plant.zones[name], "room", loss)
    plant.lose(cells[:, 0], "rail", 4.0)
    plant.heaters = {"q1": cells[1:4, 7:10].ravel(), "q2": cells[13:17, 3:6].ravel()}
    plant.sensors = {"Ta": cells[2:4, 8:10].ravel(), "Tb": cells[8:10, 8:10].ravel(), "Tc": cells[14:16, 3:5].ravel(),
                     "Td": cells[3:5, 2:4].ravel()}
    links = {(f"p{i}{j}", f"p{i + 1}{j}"): sheet for i in range(2) for j in range(2)}
    links |= {(f"p{i}0", f"p{i}1"): sheet for i in range(3)}
    links |= {(name, "room"): loss for name in plant.zones} | {(f"p{i}0", "rail"): 0.8 for i in range(3)}
    return Machine(plant, links, {"room": ROOM, "rail": 292.0}, {"q1": (0.0, 10.0), "q2": (0.0, 9.0)})


def stack(rng: np.random.Generator) -> Machine:
    """Sample, spreader, module with distributed legs, sink: 156 cells, five lumps."""
    plant = Field(("room",), currents=("m1",))
    sample, spread = plant.chain(30, 45.0, 7.0), plant.chain(30, 55.0, 9.0)
    cold, hot = plant.block(1, 16.0), plant.block(1, 18.0)
    legs = plant.block(30, 4.0)
    base, fins = plant.chain(24, 130.0, 14.0), plant.chain(40, 170.0, 7.0)
    K = rng.uniform(0.45, 0.65)
    for a, b in zip([*cold, *legs], [*legs, *hot], strict=True):
        plant.links.append((int(a), int(b), K * 31))
    plant.bridge(sample[-1:], spread[:1], rng.uniform(1.5, 2.5))
    plant.bridge(spread[-1:], cold, 5.0)
    plant.bridge(hot, base[:1], 6.0)
    plant.bridge(base[-1:], fins[:1], 15.0)
    plant.lose(fins, "room", rng.uniform(2.2, 3.0))
    plant.lose(sample, "room", 0.08)
    plant.zones = {"sample": sample, "spreader": spread, "cold": np.concatenate([cold, legs[:15]]),
                   "hot": np.concatenate([hot, legs[15:]]), "sink": np.concatenate([base, fins])}
    S, R = rng.uniform(0.026, 0.034), rng.uniform(1.5, 2.1)
    plant.legs = [Legs(legs, int(cold[0]), int(hot[0]), 1, S, rng.uniform(-2e-4, 2e-4), R, rng.uniform(-3e-4, 3e-4),
                       ROOM)]
    plant.heaters = {"heater": sample[3:10]}
    plant.sensors = {"Ts": sample[14:16], "Tp": spread[10:12], "Tk": fins[2:4]}
    links = {("sample", "spreader"): 1.2, ("spreader", "cold"): 2.5, ("hot", "sink"): 3.0, ("sink", "room"): 2.3,
             ("sample", "room"): 0.08}
    return Machine(plant, links, {"room": ROOM}, {"heater": (0.0, 12.0), "m1": (-1.2, 2.5)},
                   {"m1": ("hot", "cold", S, R, K)}, {"sink": 0.05})


def housing(rng: np.random.Generator) -> Machine:
    """A heated board in a housing of three thick walls around air: 161 cells, six lumps."""
    plant = Field(("room", "floor"))
    board = plant.chain(40, 60.0, 1.2)
    air = plant.block(1, rng.uniform(10.0, 20.0))
    walls = {name: plant.chain(30, C, G) for name, C, G in (("lid", 70.0, 1.6), ("side", 110.0, 2.2),
                                                            ("bottom", 150.0, 3.0))}
    rack = plant.chain(30, 80.0, 2.0)
    plant.bridge(board, air, rng.uniform(0.4, 0.6))
    for name, G in (("lid", 0.5), ("side", 0.7), ("bottom", 0.4)):
        plant.bridge(air, walls[name][:1], G)
    plant.bridge(air, rack, 0.3)
    plant.bridge(board[-2:], rack[:2], rng.uniform(0.2, 0.4))
    plant.bridge(walls["side"][12:18], walls["bottom"][12:18], 0.3)
    plant.lose(walls["lid"][-1:], "room", 0.5)
    plant.lose(walls["side"][-1:], "room", 0.8)
    plant.lose(walls["bottom"][-1:], "floor", 2.0)
    plant.zones = {"board": board, "air": air, **walls, "rack": rack}
    plant.heaters = {"q1": board[5:15], "q2": rack[18:26]}
    plant.sensors = {"Tb": board[18:20], "Ta": air, "Tl": walls["lid"][20:22], "Tr": rack[14:16]}
    links = {("board", "air"): 0.5, ("air", "lid"): 0.45, ("air", "side"): 0.6, ("air", "bottom"): 0.37,
             ("air", "rack"): 0.3, ("board", "rack"): 0.25, ("side", "bottom"): 0.3, ("lid", "room"): 0.45,
             ("side", "room"): 0.65, ("bottom", "floor"): 1.5}
    return Machine(plant, links, {"room": ROOM, "floor": 293.0}, {"q1": (0.0, 9.0), "q2": (0.0, 8.0)},
                   draughts={"air": 0.02})


def pair(rng: np.random.Generator) -> Machine:
    """Two blocks joined by a bar, each on a module with distributed legs, both on one water-cooled base: nine lumps."""
    plant = Field(("room", "water"), currents=("m1", "m2"))
    bar, base, links, modules = plant.chain(24, 30.0, 0.5), plant.chain(40, 260.0, 8.0), {}, {}
    for i, end in ((1, 0), (2, -1)):
        block, cold, hot, legs = plant.chain(30, 50.0, 6.0), plant.block(1, 16.0), plant.block(1, 18.0), plant.block(
            20, 4.0)
        K, S, R = rng.uniform(0.45, 0.65), rng.uniform(0.026, 0.034), rng.uniform(1.5, 2.1)
        plant.links += [(int(a), int(b), K * 21) for a, b in zip([*cold, *legs], [*legs, *hot], strict=True)]
        plant.bridge(block[-1:], cold, rng.uniform(2.0, 3.0))
        plant.bridge(block[:1], bar[end:][:1], 0.8)
        plant.bridge(hot, base[8:12] if i == 1 else base[28:32], 5.0)
        plant.lose(block, "room", 0.06)
        plant.zones |= {f"block{i}": block, f"cold{i}": np.concatenate([cold, legs[:10]]),
                        f"hot{i}": np.concatenate([hot, legs[10:]])}
        plant.legs.append(Legs(legs, int(cold[0]), int(hot[0]), i + 1, S, rng.uniform(-2e-4, 2e-4), R,
                               rng.uniform(-3e-4, 3e-4), ROOM))
        plant.heaters[f"q{i}"], plant.sensors[f"T{i}"] = block[3:10], block[14:16]
        links |= {(f"block{i}", f"cold{i}"): 2.0, (f"block{i}", "bar"): 0.4, (f"block{i}", "room"): 0.06}
        links[f"hot{i}", "near" if i == 1 else "far"] = 3.0
        modules[f"m{i}"] = f"hot{i}", f"cold{i}", S, R, K
    plant.lose(base[-3:], "water", 6.0)
    plant.lose(base, "room", 0.3)
    plant.zones |= {"bar": bar, "near": base[:20], "far": base[20:]}
    plant.sensors |= {"Tb": bar[11:13], "Tn": base[4:6], "Tf": base[33:35]}
    links |= {("near", "far"): 10.0, ("far", "water"): 4.0, ("near", "room"): 0.15, ("far", "room"): 0.15}
    limits = {"q1": (0.0, 12.0), "q2": (0.0, 10.0), "m1": (-1.2, 2.5), "m2": (-1.2, 2.5)}
    return Machine(plant, links, {"room": ROOM, "water": 291.0}, limits, modules, {"far": 0.05})


MACHINES: dict[str, Callable[[np.random.Generator], Machine]] = {
    "bar": bar, "plate": plate, "stack": stack, "housing": housing, "pair": pair}
