"""One case: what the workflow is given, and what it must not see."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import robthermal as rt

from .hidden import with_effects
from .integrate import Hidden, integrate
from .outside import NOISES, OUTSIDE, readings_noise
from .plants import N_TRAIN, N_VALIDATION, PLANTS, H, Plant, excitation, nominal, varied
from .sizes import SIZES, Found, drawn

VALIDATION_START, FOLLOW_START = 4200.0, 7200.0  # s: the records follow each other, the clock runs on


@dataclass(frozen=True, order=True)
class Case:
    """Key of a data set; `group` is hidden, nothing, noise, outside or two."""

    topology: str
    group: str
    effect: str
    seed: int

    @property
    def key(self) -> str:
        """For files and random numbers."""
        return f"{self.topology}/{self.group}/{self.effect}/{self.seed}"


@dataclass(frozen=True)
class Given:
    """All that the workflow sees."""

    system: rt.System
    train: rt.Record
    validation: rt.Record


@dataclass(frozen=True)
class Truth:
    """What it does not: effects with their values, and the plant, to experiment on and to measure modules of."""

    effects: tuple[Found, ...]
    experiment: Callable[[rt.Record], rt.Record]
    measured: Callable[[rt.diagnosis.Measurement], float]


def made(case: Case) -> tuple[Given, Truth]:
    """Draw the plant, its noise and its inputs, integrate, and split what is given from what is true."""
    rng = np.random.default_rng(zlib.crc32(case.key.encode()))
    told = PLANTS[case.topology]()
    plant = varied(told, rng)
    noise = {name: float(np.exp(rng.uniform(np.log(0.005), np.log(0.02)))) for name in plant.sensors}
    system = nominal(told, _declared(noise, rng), _declared(plant.disturbance, rng))
    inputs = excitation(told, N_TRAIN, rng), excitation(told, N_VALIDATION, rng)
    effects = _effects(case, rng)
    kind = case.effect if case.group == "noise" else "white"
    if kind == "heat_twice":
        plant = replace(plant, disturbance={name: 2.0 * s for name, s in plant.disturbance.items()})
    plant, hidden = with_effects(plant, list(effects))
    if case.group == "outside":
        plant, hidden = OUTSIDE[case.effect](plant, rng)

    def run(U: list[np.ndarray], starts: list[float], rng: np.random.Generator, h: float = H) -> list[rt.Record]:
        return _records(plant, hidden, noise, kind, U, starts, rng, h)

    def measured(asked: rt.diagnosis.Measurement) -> float:
        _, module, part, _ = asked.parameter.split(".")
        value = {"resistance": plant.modules[module].R, "seebeck": plant.modules[module].S}[part]
        return float(value * (1.0 + asked.accuracy * own_rng.standard_normal()))

    train, validation = run(list(inputs), [0.0, VALIDATION_START], rng)
    own_rng = np.random.default_rng(rng.integers(2**32))
    return (Given(system, train, validation),
            Truth(effects, lambda plan: run([_inputs(told, plan)], [FOLLOW_START], own_rng, plan.sample_time)[0],
                  measured))


def _declared(levels: dict[str, float], rng: np.random.Generator) -> dict[str, float]:
    """Levels in the system file: 5 to 20 % off, either way."""
    return {name: value * (1.0 + float(rng.choice([-1, 1]) * rng.uniform(0.05, 0.2))) for name, value in levels.items()}


def _effects(case: Case, rng: np.random.Generator) -> tuple[Found, ...]:
    if case.group == "hidden":
        return (drawn(case.topology, case.effect, case.seed, rng),)
    if case.group == "two":
        first, second = rng.choice(sorted(SIZES[case.topology]), 2, replace=False)
        return tuple(drawn(case.topology, str(name), None, rng) for name in (first, second))
    return ()


def _inputs(plant: Plant, record: rt.Record) -> np.ndarray:
    return np.column_stack([record[name] for name in plant.columns])


def _records(plant: Plant, hidden: Hidden, noise: dict[str, float], kind: str, U: list[np.ndarray],
             starts: list[float], rng: np.random.Generator, h: float) -> list[rt.Record]:
    """Integrate together (short ones padded), read the sensors, add their noise."""
    n = max(map(len, U))
    padded = np.stack([np.concatenate([u, np.repeat(u[-1:], n - len(u), axis=0)]) for u in U])
    room = padded[:, 0, plant.columns.index("room")]
    T0 = room[:, None] + 0.5 * rng.standard_normal((len(U), len(plant.capacity)))
    T, m = integrate(plant, padded, np.array(starts), T0, hidden, rng, h)
    names = list(plant.capacity)
    Y = T[..., [names.index(lump) for lump in plant.sensors.values()]]
    for reading in hidden.readings:
        Y = reading(Y, m)
    sigma = np.array(list(noise.values()))
    Y = readings_noise(kind, Y, sigma, rng)
    return [rt.Record(sample_time=h, inputs=u, outputs=Y[i, :len(u)], input_names=plant.columns,
                      output_names=list(plant.sensors), start_time=start)
            for i, (u, start) in enumerate(zip(U, starts, strict=True))]


def all_cases(seeds: int, topologies: list[str], effects: list[str] | None = None, first: int = 0) -> list[Case]:
    """The suite: `seeds` of every hidden effect from `first` on, and the other groups in proportion."""
    counts = {"nothing": 2 * seeds, "noise": max(1, seeds // 2), "outside": max(1, seeds // 4), "two": seeds}
    names = {"nothing": ["nothing"], "noise": list(NOISES), "outside": list(OUTSIDE), "two": ["two"]}
    out = [Case(where, "hidden", effect, first + seed) for where in topologies for effect in SIZES[where]
           for seed in range(seeds)]
    out += [Case(where, group, effect, 2 * first + seed) for where in topologies for group, own in names.items()
            for effect in own if effect != "polarity_memory" or PLANTS[where]().modules
            for seed in range(counts[group])]
    counts["hidden"] = seeds

    def share(case: Case) -> float:  # a run that is cut short has seen as much of every group
        return (case.seed - (first if case.group == "hidden" else 2 * first)) / counts[case.group]

    out.sort(key=share)
    return [case for case in out if effects is None or case.effect in effects]
