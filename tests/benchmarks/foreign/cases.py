"""One case: what the workflow is given, and what it must not see."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

import robthermal as rt

from .field import Array
from .hidden import CATALOG, MAKE, OUTSIDE, Hidden, lagged
from .machines import MACHINES, ROOM, Machine
from .march import march

H, SUB, N_TRAIN, N_UNSEEN = 6.0, 3, 1500, 900
PAUSE = N_TRAIN * H + 1800.0  # s from the start of one record to that of the next: the clock runs on
DISCRETE = (1.5, 10.0)  # whitened variance that the network's coarseness alone leaves
STRENGTH = (3.0, 100.0)  # excess of the hidden effect, over that


@dataclass(frozen=True, order=True)
class Case:
    """Key of a data set; `group` is hidden, nothing or outside."""

    machine: str
    group: str
    effect: str
    seed: int

    @property
    def key(self) -> str:
        """For files and random numbers."""
        return f"{self.machine}/{self.group}/{self.effect}/{self.seed}"


@dataclass(frozen=True)
class Made:
    """All that the workflow sees, and the truth."""

    system: rt.System
    train: rt.Record
    unseen: rt.Record
    truth: list[tuple[str, tuple[str, ...], float]]
    discrete: float  # whitened variance without the effect
    strength: float  # excess of the effect over its excess
    coarse: float  # rms of what the network leaves without the effect [K]


def all_cases(seeds: list[int]) -> list[Case]:
    """Every effect once per seed, a null and an outside effect of every machine and seed."""
    out = []
    for seed in seeds:
        for machine in OUTSIDE:  # those of the suite; the pair serves to time a catalog of more than 155 candidates
            out += [Case(machine, "hidden", effect, seed) for effect in CATALOG[machine]]
            out += [Case(machine, "nothing", "nothing", 2 * seed + i) for i in (0, 1)]
            out += [Case(machine, "outside", effect, seed) for effect in OUTSIDE[machine]]
    return out


def staircase(n: int, limits: tuple[float, float], rng: np.random.Generator) -> Array:
    """Held values, a third of them zero, with dwells of 1 to 10 min."""
    out, k = np.zeros(n), 0
    while k < n:
        dwell = int(rng.choice([10, 20, 40, 60, 100]))
        out[k:k + dwell] = 0.0 if rng.random() < 0.33 else rng.uniform(*limits)
        k += dwell
    return out


def drift(n: int, T: float, rng: np.random.Generator) -> Array:
    """An ambient that drifts by a kelvin or two."""
    t = np.arange(n) / n
    return np.round(T + rng.normal(0, 1) + 2 * rng.uniform(-1, 1) * t + np.sin(2 * np.pi * (rng.uniform(.5, 2) * t
                                                                                         + rng.random())), 3)


class _Bench:
    """A machine with its inputs; runs it with and without the effect."""

    def __init__(self, case: Case):
        self.case = case
        self.rng = np.random.default_rng(zlib.crc32(case.key.encode()))
        self.seed = int(self.rng.integers(2**31))
        machine = self.machine()
        self.columns = machine.plant.columns
        self.U = []
        for n in (N_TRAIN, N_UNSEEN):
            driven = [staircase(n, machine.limits[name], self.rng) for name in self.columns if name in machine.limits]
            self.U.append(np.column_stack(driven + [drift(n, T, self.rng) for T in machine.ambients.values()]))
        table = {"hidden": CATALOG, "outside": OUTSIDE}.get(case.group)
        self.where: tuple[str, ...] = ()
        self.guess = 0.0
        if table is not None:
            places, self.guess = table[case.machine][case.effect]
            self.where = places[int(self.rng.integers(len(places)))]
        self.noise_seed = int(self.rng.integers(2**31))

    def machine(self) -> Machine:
        """The same numbers every time."""
        return MACHINES[self.case.machine](np.random.default_rng(self.seed))

    def readings(self, size: float) -> list[Array]:
        """Of both records, without noise."""
        out = []
        for number, U in enumerate(self.U):
            m = self.machine()
            hidden = MAKE[self.case.effect](m, self.where, size) if size else Hidden()
            fine = hidden.drive(np.repeat(U, SUB, axis=0), H / SUB)
            T0 = np.full(len(m.plant.capacity), U[0, -len(m.ambients)])
            Y = march(m.plant, fine, T0, H, SUB, hidden.heats, self.shake(m, number), number * PAUSE)
            for k, tau in hidden.lags.items():
                Y[:, k] = lagged(Y[:, k], tau, H / SUB)
            for k, gain in hidden.gains.items():
                Y[:, k] += gain * (Y[:, k] - ROOM)
            out.append(Y[::SUB])
        return out

    def shake(self, m: Machine, number: int) -> Array | None:
        """Random heat, spread over the cells of its lumps."""
        if not m.draughts:
            return None
        rng = np.random.default_rng(self.seed + 1 + number)
        out = np.zeros((len(self.U[number]) * SUB, len(m.plant.capacity)))
        for lump, s in m.draughts.items():
            cells = m.plant.zones[lump]
            out[:, cells] = (s / np.sqrt(H / SUB) * rng.standard_normal(len(out)) / len(cells))[:, None]
        return out

    def as_cataloged(self, size: float) -> float:
        """A slope of S that the legs have relative, in V/K² and with that of the plain machine."""
        if self.case.effect != "seebeck_slope":
            return size
        (legs,) = self.machine().plant.legs
        return legs.S * (legs.S_slope + size)

    def record(self, Y: Array, number: int, noise: float) -> rt.Record:
        """With sensor noise."""
        rng = np.random.default_rng(self.noise_seed + number)
        return rt.Record(sample_time=H, inputs=self.U[number], outputs=Y + noise * rng.standard_normal(Y.shape),
                         input_names=self.columns, output_names=list(self.machine().plant.sensors),
                         start_time=number * PAUSE)


def made(case: Case) -> Made:
    """Draw machine, inputs and noise; scale noise and effect to the misfits asked for."""
    bench = _Bench(case)
    rng = bench.rng
    wanted = float(np.exp(rng.uniform(*np.log(DISCRETE))))
    strong = float(np.exp(rng.uniform(*np.log(STRENGTH))))
    told = int(rng.integers(2**31))
    plain = bench.readings(0.0)

    def system(noise: float) -> rt.System:
        return bench.machine().network(noise, np.random.default_rng(told))

    def excess(Y: Array, noise: float) -> float:
        fit = rt.diagnosis.refit(system(noise), bench.record(Y, 0, noise))
        raised = float(np.mean(list(fit.levels.noise.values())) ** 2)  # its noise has grown with the misfit
        return max(fit.variance * raised - 1.0, 1e-3)

    noise = 0.02
    for _ in range(5):
        now = excess(plain[0], noise)
        noise = float(np.clip(noise * np.clip(np.sqrt(now / (wanted - 1.0)), 0.1, 10.0), 2e-3, 0.5))
    base = excess(plain[0], noise)
    size, Y, ratio = 0.0, plain, 0.0
    if case.group != "nothing":
        size = bench.guess
        for _ in range(4):
            Y = bench.readings(size)
            ratio = excess(Y[0], noise) / base
            if 0.7 < ratio / strong < 1.4:
                break
            size = min(size * float(np.clip(np.sqrt(strong / ratio), 0.25, 4.0)), 8.0 * bench.guess)
    truth = [(case.effect, bench.where, bench.as_cataloged(size))] if case.group == "hidden" else []
    return Made(system(noise), bench.record(Y[0], 0, noise), bench.record(Y[1], 1, noise), truth, base + 1.0, ratio,
                float(np.sqrt(base)) * noise)

