"""Random thermal machines with modules, and the current that an own simulation says they bear."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from own_simulation import Network

import robthermal as rt


@dataclass(frozen=True)
class Case:
    """A machine with the ranges it is asked about."""

    system: rt.System
    temperature: tuple[float, float]
    ambient: dict[str, tuple[float, float]]
    heat: dict[str, tuple[float, float]]
    lower: str


def machine(rng: np.random.Generator) -> Case:
    """2 to 8 lumps, 1 to 3 modules, properties that vary with temperature, nonlinear losses, heaters, a random box."""
    modules_count = int(rng.integers(1, 4))
    n = int(rng.integers(modules_count + 1, 9))
    lumps = [f"x{i}" for i in range(n)]
    room = float(rng.uniform(288, 303))
    hot = lumps[: max(1, n - modules_count)]
    links = [{"between": (a, b), "conductance": rng.uniform(1, 12)} for a, b in zip(hot[:-1], hot[1:], strict=True)]
    for name in lumps:
        on_hot = name in hot
        link = {"between": (name, "room"), "conductance": rng.uniform(0.3, 3.0) if on_hot else rng.uniform(0.01, 0.3)}
        if rng.random() < 0.3:
            link["natural"] = {"gain": rng.uniform(0.005, 0.1), "exponent": 0.25}
        if rng.random() < 0.3:
            link["radiation"] = rng.uniform(1e-10, 3e-9)
        links.append(link)
    modules = {}
    for k in range(modules_count):
        bend = rng.random() < 0.7
        modules[f"m{k}"] = {
            "hot": str(rng.choice(hot)), "cold": lumps[len(hot) + k] if len(hot) + k < n else lumps[-1],
            "seebeck": {"value": rng.uniform(0.02, 0.06), "slope": bend * rng.uniform(-1e-5, 1e-4)},
            "resistance": {"value": rng.uniform(1.0, 6.0), "slope": bend * rng.uniform(0, 0.02)},
            "conductance": {"value": rng.uniform(0.15, 0.8), "slope": bend * rng.uniform(-1e-3, 1e-3)},
            "reference_temperature": 298.15}
        if rng.random() < 0.5:
            modules[f"m{k}"]["current_limits"] = tuple(rng.uniform([-6, 1], [-1, 6]))
    system = rt.System(ambients={"room": {"temperature": room}}, links=links, modules=modules,
                       lumps={name: {"capacity": 10 ** rng.uniform(0.5, 2)} for name in lumps})
    heat = {str(rng.choice(lumps)): (0.0, rng.uniform(0.2, 3.0))} if rng.random() < 0.6 else {}
    top = room + rng.uniform(30, 80)
    around = (room - rng.uniform(0, 5), room + rng.uniform(0, 5))
    return Case(system, (room - rng.uniform(20, 60), top), {"room": around}, heat,
                str(rng.choice(["inside", "reported"])))


def simulated_limit(case: Case, largest: float) -> float:
    """Largest current up to `largest` for which no constant currents leave the box, from the ambient range [A]."""
    network = Network(case.system)
    low, high = 0.0, largest
    if _stays(case, network, largest):
        return largest
    while high - low > 0.01 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _stays(case, network, middle) else (low, middle)
    return low


def _stays(case: Case, network: Network, c: float) -> bool:
    seconds = 12 * network.slowest()
    for pattern in product((0.0, 1.0), repeat=len(network.modules)):
        for room in case.ambient["room"]:
            for end in (0, 1):
                load = np.array([case.heat.get(name, (0.0, 0.0))[end] for name in network.lumps])
                _, states = network.run(np.full(len(network.lumps), room), seconds, c * np.array(pattern),
                                        np.array([room]), load, hottest=case.temperature[1] + 1)
                if states.max() > case.temperature[1]:
                    return False
                if case.lower == "inside" and states.min() < case.temperature[0]:
                    return False
    return True
