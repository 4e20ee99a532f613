"""Three plants as plain numbers, what a user would declare about them, and the excitation they get."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import robthermal as rt

H = 3.0  # s, sample time
N_TRAIN, N_VALIDATION = 1200, 800  # 1 h and 40 min
ROOM = 298.15  # K, nominal temperature of the first ambient: T_ref of the contract
MODULE_SIGMA = {"seebeck": 0.05, "resistance": 0.05, "conductance": 0.1}
CAPACITY_SIGMA, FACE_SIGMA, LINK_SIGMA = 0.1, 0.2, 0.15


@dataclass(frozen=True)
class Module:
    """Thermoelectric module between two lumps; constant S [V/K], R [Ω], K [W/K]."""

    hot: str
    cold: str
    S: float
    R: float
    K: float
    limits: tuple[float, float]


@dataclass(frozen=True)
class Plant:
    """Numbers of a set-up: capacities [J/K], conductances [W/K], heaters (lump, limits [W]), sensors, random heat."""

    capacity: dict[str, float]
    links: dict[tuple[str, str], float]
    ambients: dict[str, float]
    heaters: dict[str, tuple[str, tuple[float, float]]]
    sensors: dict[str, str]
    modules: dict[str, Module]
    disturbance: dict[str, float]

    @property
    def columns(self) -> list[str]:
        """Inputs of a record: heaters, currents, ambients."""
        return [*self.heaters, *self.modules, *self.ambients]


def one_module() -> Plant:
    """A: sample and plate, cooled through one module into a sink; both faces unmeasured."""
    return Plant(
        capacity={"sample": 40.0, "plate": 60.0, "cold": 20.0, "hot": 22.0, "sink": 300.0},
        links={("sample", "plate"): 1.2, ("plate", "cold"): 3.5, ("hot", "sink"): 4.0, ("sink", "room"): 2.5,
               ("sample", "room"): 0.08},
        ambients={"room": ROOM}, heaters={"heater": ("sample", (0.0, 15.0))},
        sensors={"Ts": "sample", "Tp": "plate", "Tk": "sink"},
        modules={"m1": Module("hot", "cold", 0.03, 1.8, 0.55, (-1.5, 3.0))},
        disturbance={"sample": 0.03, "sink": 0.1})


def two_modules() -> Plant:
    """B: two plates with a weak bridge, a module each, two sinks with a bridge; four faces unmeasured."""
    return Plant(
        capacity={"left": 70.0, "right": 90.0, "cold1": 20.0, "hot1": 22.0, "cold2": 20.0, "hot2": 22.0, "sink1": 260.0,
                  "sink2": 320.0},
        links={("left", "right"): 0.25, ("left", "cold1"): 3.5, ("right", "cold2"): 3.2, ("hot1", "sink1"): 4.0,
               ("hot2", "sink2"): 3.8, ("sink1", "sink2"): 0.8, ("sink1", "room"): 2.2, ("sink2", "room"): 2.6,
               ("left", "room"): 0.1},
        ambients={"room": ROOM}, heaters={"heater": ("left", (0.0, 12.0))},
        sensors={"Tl": "left", "Tr": "right", "T1": "sink1", "T2": "sink2"},
        modules={"m1": Module("hot1", "cold1", 0.028, 1.7, 0.5, (-1.5, 2.5)),
                 "m2": Module("hot2", "cold2", 0.032, 2.0, 0.6, (-1.5, 2.5))},
        disturbance={"left": 0.03, "sink1": 0.1, "sink2": 0.1})


def stage() -> Plant:
    """C: a stage with two heaters on a frame between room air and a water-cooled base; no module."""
    return Plant(
        capacity={"left": 45.0, "right": 60.0, "frame": 150.0, "cover": 35.0, "base": 400.0},
        links={("left", "frame"): 0.9, ("right", "frame"): 1.1, ("frame", "base"): 1.6, ("left", "cover"): 0.35,
               ("cover", "room"): 0.25, ("frame", "room"): 0.3, ("base", "water"): 6.0},
        ambients={"room": ROOM, "water": 291.15}, heaters={"q1": ("left", (0.0, 14.0)), "q2": ("right", (0.0, 16.0))},
        sensors={"Tl": "left", "Tr": "right", "Tb": "base"}, modules={}, disturbance={"right": 0.03, "frame": 0.06})


PLANTS = {"A": one_module, "B": two_modules, "C": stage}


def varied(plant: Plant, rng: np.random.Generator) -> Plant:
    """True numbers: nominal times exp(N(0, sigma))."""

    def off(value: float, sigma: float) -> float:
        return float(value * np.exp(sigma * rng.standard_normal()))

    modules = {name: replace(m, S=off(m.S, MODULE_SIGMA["seebeck"]), R=off(m.R, MODULE_SIGMA["resistance"]),
                             K=off(m.K, MODULE_SIGMA["conductance"])) for name, m in plant.modules.items()}
    return replace(plant, capacity={name: off(C, _capacity_sigma(plant, name)) for name, C in plant.capacity.items()},
                   links={pair: off(G, LINK_SIGMA) for pair, G in plant.links.items()}, modules=modules)


def _capacity_sigma(plant: Plant, name: str) -> float:
    return FACE_SIGMA if any(name in (m.hot, m.cold) for m in plant.modules.values()) else CAPACITY_SIGMA


def nominal(plant: Plant, noise: dict[str, float], disturbance: dict[str, float]) -> rt.System:
    """What the workflow is told: nominal numbers, priors, and declared noise levels [K, W/√Hz]."""
    sigma = {f"lumps.{name}.capacity": (C, _capacity_sigma(plant, name)) for name, C in plant.capacity.items()}
    sigma |= {f"links.{a}-{b}.conductance": (G, LINK_SIGMA) for (a, b), G in plant.links.items()}
    for name, m in plant.modules.items():
        sigma |= {f"modules.{name}.{part}.value": (value, MODULE_SIGMA[part])
                  for part, value in (("seebeck", m.S), ("resistance", m.R), ("conductance", m.K))}
    return rt.System(
        ambients={name: {"temperature": T} for name, T in plant.ambients.items()},
        lumps={name: {"capacity": C, "disturbance": disturbance.get(name, 0.0)} for name, C in plant.capacity.items()},
        links=[{"between": pair, "conductance": G} for pair, G in plant.links.items()],
        inputs={name: {"lump": lump, "limits": limits} for name, (lump, limits) in plant.heaters.items()},
        modules={name: {"hot": m.hot, "cold": m.cold, "seebeck": m.S, "resistance": m.R, "conductance": m.K,
                        "reference_temperature": ROOM, "current_limits": m.limits}
                 for name, m in plant.modules.items()},
        sensors={name: {"lump": lump, "noise": noise[name]} for name, lump in plant.sensors.items()},
        fit={name: {"lower": value / 4, "upper": 4 * value, "sigma": share * value}
             for name, (value, share) in sigma.items()})


def excitation(plant: Plant, n: int, rng: np.random.Generator) -> np.ndarray:
    """Staircases of every heater and current with dwells from 15 s to 5 min, and drifting ambients, (n, columns)."""
    columns = [_staircase(n, limits, rng, 0.35) for _, limits in plant.heaters.values()]
    columns += [_staircase(n, m.limits, rng, 0.15) for m in plant.modules.values()]
    return np.column_stack(columns + [_ambient(n, T, number > 0, rng)
                                      for number, T in enumerate(plant.ambients.values())])


def _staircase(n: int, limits: tuple[float, float], rng: np.random.Generator, off: float) -> np.ndarray:
    out = np.zeros(n)
    k = 0
    while k < n:
        dwell = int(rng.choice([5, 10, 20, 40, 100]))
        out[k:k + dwell] = 0.0 if rng.random() < off else rng.uniform(*limits)
        k += dwell
    return out


def _ambient(n: int, T: float, stepped: bool, rng: np.random.Generator) -> np.ndarray:
    """Offset, trend and a slow wave; a chiller also changes its set-point."""
    t = np.arange(n) / n
    drift = rng.normal(0.0, 1.0) + 2.0 * rng.uniform(-1.0, 1.0) * t + np.sin(2 * np.pi * (rng.uniform(0.5, 2) * t
                                                                                         + rng.random()))
    steps = np.repeat(rng.uniform(-3.0, 3.0, n // 200 + 1), 200)[:n] if stepped else 0.0
    return np.round(T + drift + steps, 3)
