"""Simulation of a thermal network from the equations of docs/explanations/certificates.md, section 1, by scipy alone.

Deliberately not through robthermal.thermal: tests of current limits must not lean on what they test.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

import robthermal as rt


class Network:
    """Numbers of a system, read off its parts, and the heat into every lump."""

    def __init__(self, system: rt.System):
        self.lumps = list(system.lumps)
        nodes = [*self.lumps, *system.ambients]
        self.capacity = np.array([lump.capacity for lump in system.lumps.values()])
        self.ambient = np.array([a.temperature for a in system.ambients.values()])
        self.links = [(nodes.index(link.between[0]), nodes.index(link.between[1]), link.conductance,
                       link.natural.gain if link.natural else 0.0, link.natural.exponent if link.natural else 0.0,
                       link.radiation or 0.0) for link in system.links]
        self.modules = [(nodes.index(m.hot), nodes.index(m.cold), m) for m in system.modules.values()]

    def heat(self, x: np.ndarray, current: np.ndarray, ambient: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Heat into every lump [W]."""
        T = np.concatenate([x, ambient])
        into = np.zeros(len(T))
        for a, b, g, gain, exponent, c in self.links:
            d = T[b] - T[a]
            flow = g * d + gain * abs(d) ** exponent * d + c * (T[b] ** 4 - T[a] ** 4)
            into[a] += flow
            into[b] -= flow
        for (h, c, m), i in zip(self.modules, current, strict=True):
            away = 0.5 * (T[h] + T[c]) - m.reference_temperature
            S, R, K = (p.value + p.slope * away for p in (m.seebeck, m.resistance, m.conductance))
            into[h] += S * T[h] * i + 0.5 * R * i**2 + K * (T[c] - T[h])
            into[c] += -S * T[c] * i + 0.5 * R * i**2 + K * (T[h] - T[c])
        return into[: len(x)] + load

    def run(self, x: np.ndarray, seconds: float, current: np.ndarray, ambient: np.ndarray | None = None,
            load: np.ndarray | None = None, hottest: float = 2200.0) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] and temperatures (n_times, n) at constant inputs; ends where something is hotter than `hottest`."""
        ambient = self.ambient if ambient is None else ambient
        load = np.zeros(len(x)) if load is None else load

        def too_hot(t: float, x: np.ndarray) -> float:
            return float(hottest - x.max())

        too_hot.terminal = True  # type: ignore[attr-defined]
        found = solve_ivp(lambda t, x: self.heat(x, current, ambient, load) / self.capacity, (0.0, seconds), x,
                          method="LSODA", rtol=1e-7, atol=1e-7, events=too_hot)
        return found.t, found.y.T

    def slowest(self) -> float:
        """Time constant of the network without current [s]."""
        x = np.full(len(self.lumps), self.ambient.mean())
        off, load = np.zeros(len(self.modules)), np.zeros(len(x))

        def at(x: np.ndarray) -> np.ndarray:
            return self.heat(x, off, self.ambient, load)

        J = np.stack([(at(x + 0.01 * e) - at(x - 0.01 * e)) / 0.02 for e in np.eye(len(x))], axis=1)
        return float(-1 / np.linalg.eigvals(J / self.capacity[:, None]).real.max())


def first_outside(times: np.ndarray, states: np.ndarray, low: float, high: float) -> float:
    """First time at which a lump is below `low` or above `high` [s]; inf where none ever is."""
    out = (states < low).any(axis=1) | (states > high).any(axis=1)
    return float(times[out][0]) if out.any() else float("inf")




def switching(network: Network, x: np.ndarray, low: np.ndarray, high: np.ndarray, rng: np.random.Generator,
              intervals: int, ambient: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Temperatures while every module jumps between its ends: at random, or so as to heat or cool one lump most."""
    tau, states = network.slowest(), [x[None]]
    target, sign = int(rng.integers(len(x))), float(rng.choice([-1.0, 1.0]))
    for k in range(intervals):
        if k % 2:
            current = np.where(rng.random(len(low)) < 0.5, low, high)
        else:  # greedy: the ends at which the target's heat a little later is largest
            ends = [np.where(rng.random(len(low)) < 0.5, low, high) for _ in range(3)] + [low, high]
            current = max(ends, key=lambda i: sign * network.heat(x + network.heat(x, i, ambient, load)
                                                                  / network.capacity, i, ambient, load)[target])
        seconds = tau * 10 ** rng.uniform(-2.0, 0.7)
        states.append(network.run(x, seconds, current, ambient, load)[1])
        x = states[-1][-1]
    return np.concatenate(states)
