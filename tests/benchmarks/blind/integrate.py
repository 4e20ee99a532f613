"""Runge-Kutta integration of a plant with hidden effects: numpy only, equations as in the contract of the diagnosis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .plants import H, Plant

Array = np.ndarray
Heat = Callable[[Array, Array, Array, Array, Array], None]  # (t, T, u, m, Q): adds to Q [W]
Drive = Callable[[Array], Array]  # columns of a record -> what heaters and modules get
Reading = Callable[[Array, Array], Array]  # (Y, m) -> Y, all samples [K]
FINENESS = 20  # sub-steps in the fastest time constant


@dataclass(frozen=True)
class Memory:
    """A first-order state: time_constant m' = target(T, u) - m; from 0 at the start, or from its target."""

    time_constant: float
    target: Callable[[Array, Array], Array]
    from_zero: bool = False


@dataclass(frozen=True)
class Hidden:
    """What the plant has beside its network: heats, memories, what stands between record and plant or sensor.

    `delays` and `lags` are seconds by column number, `capacity` a factor (batch, lumps) on every capacity.
    """

    heats: tuple[Heat, ...] = ()
    memories: tuple[Memory, ...] = ()
    drives: tuple[Drive, ...] = ()
    delays: dict[int, float] = field(default_factory=dict)
    lags: dict[int, float] = field(default_factory=dict)
    readings: tuple[Reading, ...] = ()
    capacity: Callable[[Array], Array] | None = None

    def __add__(self, other: Hidden) -> Hidden:
        """Both at once; the memories of the second are numbered after those of the first."""
        return Hidden(self.heats + other.heats, self.memories + other.memories, self.drives + other.drives,
                      {**self.delays, **other.delays}, {**self.lags, **other.lags}, self.readings + other.readings,
                      self.capacity or other.capacity)


class Network:
    """Matrices of a plant, divided by the capacities: linear links, heaters, S I T and ½ R I² of the modules."""

    def __init__(self, plant: Plant):
        self.at = {name: i for i, name in enumerate(plant.capacity)}
        n, modules = len(self.at), list(plant.modules.values())
        nodes = {**self.at, **{name: n + k for k, name in enumerate(plant.ambients)}}
        full = np.zeros((len(nodes), len(nodes)))
        for a, b, G in [(*p, G) for p, G in plant.links.items()] + [(m.hot, m.cold, m.K) for m in modules]:
            i, j = nodes[a], nodes[b]
            full[[i, j], [i, j]] -= G
            full[[i, j], [j, i]] += G
        self.C = np.array(list(plant.capacity.values()))
        self.n_heaters, n_columns = len(plant.heaters), len(plant.columns)
        self.A = full[:n, :n] / self.C[:, None]
        self.B = np.zeros((n_columns, n))
        for k, (lump, _) in enumerate(plant.heaters.values()):
            self.B[k, self.at[lump]] = 1.0 / self.C[self.at[lump]]
        self.B[n_columns - len(plant.ambients):] = (full[:n, n:] / self.C[:, None]).T
        self.peltier, self.joule = np.zeros((len(modules), n, n)), np.zeros((len(modules), n))
        for k, m in enumerate(modules):
            for lump, sign in ((self.at[m.hot], 1.0), (self.at[m.cold], -1.0)):
                self.peltier[k, lump, lump] = sign * m.S / self.C[lump]
                self.joule[k, lump] = 0.5 * m.R / self.C[lump]

    @property
    def fastest(self) -> float:
        """Fastest time constant of the linear network [s]."""
        return float(1.0 / np.max(np.abs(np.linalg.eigvals(self.A))))

    def frozen(self, u: Array) -> tuple[Array, Array, Array]:
        """M, b with dT/dt = M T + b while the columns u (batch, columns) hold; and u."""
        current = u[:, self.n_heaters:self.n_heaters + len(self.joule)]
        M = self.A + np.tensordot(current, self.peltier, 1)
        return M, u @ self.B + current**2 @ self.joule, u


def integrate(plant: Plant, U: Array, start: Array, T0: Array, hidden: Hidden, rng: np.random.Generator,
              h: float = H) -> tuple[Array, Array]:
    """Temperatures (batch, n, lumps) and memories (batch, n, k) at every sample, with random heat.

    `U` (batch, n, columns) is held over every sample of `h` s from the times `start` (batch,) on; `T0` (batch, lumps).
    Random heat is drawn per sub-step.
    """
    net = Network(plant)
    sub = _sub_steps(net, hidden, h)
    dt, (batch, n, _) = h / sub, U.shape
    for drive in hidden.drives:
        U = drive(U)
    fine = _fine(U, hidden, sub, dt) if hidden.delays or hidden.lags else None
    scale = np.zeros(len(net.C))
    for name, s in plant.disturbance.items():
        scale[net.at[name]] = s / np.sqrt(dt) / net.C[net.at[name]]
    tau = np.array([part.time_constant for part in hidden.memories])
    T, m = np.array(T0, float), _start(hidden, T0, U[:, 0])
    temperatures, memories = np.zeros((batch, n, T.shape[1])), np.zeros((batch, n, m.shape[1]))

    def rate(t: Array, T: Array, m: Array, held: tuple[Array, Array, Array], shake: Array) -> tuple[Array, Array]:
        M, b, u = held
        dT = np.matmul(M, T[..., None])[..., 0] + b + shake
        if hidden.heats:
            Q = np.zeros_like(T)
            for heat in hidden.heats:
                heat(t, T, u, m, Q)
            dT += Q / net.C
        if hidden.capacity is not None:
            dT /= hidden.capacity(T)
        if not tau.size:
            return dT, m
        return dT, (np.column_stack([part.target(T, u) for part in hidden.memories]) - m) / tau

    for k in range(n):
        temperatures[:, k], memories[:, k] = T, m
        shaken = scale * rng.standard_normal((sub, *T.shape))
        first = middle = last = net.frozen(U[:, k])
        for j in range(sub):
            if fine is not None:
                first, middle, last = (net.frozen(fine[stage][:, k * sub + j]) for stage in range(3))
            t, shake = start + k * h + j * dt, shaken[j]
            a, am = rate(t, T, m, first, shake)
            b, bm = rate(t + dt / 2, T + dt / 2 * a, m + dt / 2 * am, middle, shake)
            c, cm = rate(t + dt / 2, T + dt / 2 * b, m + dt / 2 * bm, middle, shake)
            d, dm = rate(t + dt, T + dt * c, m + dt * cm, last, shake)
            T = T + dt / 6 * (a + 2 * (b + c) + d)
            if tau.size:
                m = m + dt / 6 * (am + 2 * (bm + cm) + dm)
    return temperatures, memories


def _sub_steps(net: Network, hidden: Hidden, h: float) -> int:
    """Per sample: twenty in the fastest pole, two in the shortest lag, ten a second where there is a delay."""
    shortest = min([*hidden.lags.values(), *(part.time_constant for part in hidden.memories)], default=np.inf)
    fine = round(10 * h) if hidden.delays else 1
    least = max(int(np.ceil(FINENESS * h / net.fastest)), int(np.ceil(2 * h / shortest)))
    return fine * max(int(np.ceil(least / fine)), 1)


def _start(hidden: Hidden, T: Array, u: Array) -> Array:
    if not hidden.memories:
        return np.zeros((len(T), 0))
    return np.column_stack([np.zeros(len(T)) if part.from_zero else part.target(T, u) for part in hidden.memories])


def _fine(U: Array, hidden: Hidden, sub: int, dt: float) -> tuple[Array, Array, Array]:
    """Columns at the start, middle and end of every sub-step, delayed (to whole sub-steps) and lagged (exactly)."""
    held = np.repeat(U, sub, axis=1)
    for column, delay in hidden.delays.items():
        late = np.maximum(np.arange(held.shape[1]) - int(round(delay / dt)), 0)
        held[:, :, column] = held[:, late, column]
    stages = [held, held.copy(), held.copy()]
    for column, tau in hidden.lags.items():
        target, value = held[:, :, column].copy(), held[:, 0, column].copy()
        for g in range(target.shape[1]):
            gap = value - target[:, g]
            for stage, out in enumerate(stages):
                out[:, g, column] = target[:, g] + gap * np.exp(-0.5 * stage * dt / tau)
            value = stages[2][:, g, column]
    return stages[0], stages[1], stages[2]
