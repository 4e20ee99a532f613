"""What no effect of the catalog describes, and noise that is not what the system file says."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .integrate import Hidden, Memory
from .plants import N_TRAIN, ROOM, H, Plant

NOISES = ("heat_twice", "colored", "quantized", "noise_half_more")
AROUND = ("sink", "sink1", "frame")  # the lump with most surface, per topology
STAGE = ("plate", "left")
JOINTS = (("plate", "cold"), ("left", "cold1"), ("left", "frame"))


def readings_noise(kind: str, Y: np.ndarray, sigma: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Readings (batch, n, sensors) with white noise, or with what the file does not say."""
    white = sigma * rng.standard_normal(Y.shape)
    if kind == "colored":  # AR(0.9) of half the standard deviation on top
        slow, drive = np.zeros_like(Y), rng.standard_normal(Y.shape)
        slow[:, 0] = drive[:, 0]
        for k in range(1, Y.shape[1]):
            slow[:, k] = 0.9 * slow[:, k - 1] + np.sqrt(1 - 0.81) * drive[:, k]
        return Y + white + 0.5 * sigma * slow
    if kind == "quantized":  # converter steps of four standard deviations
        return np.round((Y + white) / (4 * sigma)) * (4 * sigma)
    return Y + (1.5 if kind == "noise_half_more" else 1.0) * white


def _one_of(plant: Plant, names: tuple[str, ...]) -> int:
    return next(i for i, name in enumerate(plant.capacity) if name in names)


def _link_of(plant: Plant, lump: int) -> tuple[float, int]:
    """Conductance and column of a lump's path to the room."""
    name = list(plant.capacity)[lump]
    return plant.links[name, "room"], plant.columns.index("room")


def _melting(plant: Plant, rng: np.random.Generator) -> tuple[Plant, Hidden]:
    """A material in the plate that melts over a few kelvin."""
    i, middle, width, latent = (_one_of(plant, STAGE), ROOM + rng.uniform(-1, 5), rng.uniform(1.0, 2.5),
                                rng.uniform(0.5, 2.0))

    def capacity(T):
        factor = np.ones_like(T)
        factor[:, i] += latent * np.exp(-((T[:, i] - middle) / width) ** 2)
        return factor

    return plant, Hidden(capacity=capacity)


def _through_room(plant: Plant, share: Callable[[np.ndarray], np.ndarray]) -> tuple[Plant, Hidden]:
    """The path to the room times 1 + share(t)."""
    i = _one_of(plant, AROUND)
    G, k = _link_of(plant, i)

    def heat(t, T, u, m, Q):
        Q[:, i] += G * share(t) * (u[:, k] - T[:, i])

    return plant, Hidden(heats=(heat,))


def _humidity(plant: Plant, rng: np.random.Generator) -> tuple[Plant, Hidden]:
    """Convection that wanders up and down over the hour."""
    size, period, phase = rng.uniform(0.3, 0.8), rng.uniform(2500, 5000), rng.uniform(0, 2 * np.pi)
    return _through_room(plant, lambda t: size * (1 + np.sin(2 * np.pi * t / period + phase)))


def _fan(plant: Plant, rng: np.random.Generator) -> tuple[Plant, Hidden]:
    """A fan that switches on and off."""
    size, times = rng.uniform(0.5, 1.5), np.cumsum(rng.uniform(200, 700, 100))
    return _through_room(plant, lambda t: size * (np.searchsorted(times, t) % 2))


def _wandering(plant: Plant, rng: np.random.Generator) -> tuple[Plant, Hidden]:
    """Heat that wanders slowly at random, standard deviation 1 to 3 W, memory ten minutes."""
    i, n, size = _one_of(plant, AROUND), 4 * N_TRAIN, rng.uniform(1.0, 3.0)
    path, keep = np.zeros(n), np.exp(-H / 600)
    for k in range(1, n):
        path[k] = keep * path[k - 1] + np.sqrt(1 - keep**2) * rng.standard_normal()

    def heat(t, T, u, m, Q):
        Q[:, i] += size * path[np.minimum((t / H).astype(int), n - 1)]

    return plant, Hidden(heats=(heat,))


def _polarity_memory(plant: Plant, rng: np.random.Generator) -> tuple[Plant, Hidden]:
    """A module whose Joule heat slowly follows the polarity: not the constant heat of `hysteresis`."""
    name = next(iter(plant.modules))
    module, k, names = plant.modules[name], plant.columns.index(name), list(plant.capacity)
    hot, cold = names.index(module.hot), names.index(module.cold)
    size, tau = rng.uniform(0.2, 0.6), rng.uniform(60.0, 300.0)

    def heat(t, T, u, m, Q):
        more = size * m[:, 0] * module.R * u[:, k] ** 2
        Q[:, hot] += 0.5 * more
        Q[:, cold] += 0.5 * more

    return plant, Hidden(heats=(heat,), memories=(Memory(tau, lambda T, u: np.sign(u[:, k]), from_zero=True),))


def _bent_link(plant: Plant, rng: np.random.Generator) -> tuple[Plant, Hidden]:
    """A joint whose conductance depends on its temperature (a dried-out paste, a bimetal)."""
    (a, b), names = next(pair for pair in JOINTS if pair in plant.links), list(plant.capacity)
    i, j, G, size = names.index(a), names.index(b), plant.links[a, b], rng.uniform(0.3, 0.8)

    def heat(t, T, u, m, Q):
        flow = G * size * np.tanh((0.5 * (T[:, i] + T[:, j]) - ROOM - 3.0) / 5.0) * (T[:, j] - T[:, i])
        Q[:, i] += flow
        Q[:, j] -= flow

    return plant, Hidden(heats=(heat,))


OUTSIDE = {"melting": _melting, "humidity": _humidity, "fan": _fan, "wandering_heat": _wandering,
           "polarity_memory": _polarity_memory, "bent_link": _bent_link}
