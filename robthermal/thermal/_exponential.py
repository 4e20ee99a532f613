"""Exponential collocation in time: exact for the linear network, spectral for the modules.

Sixteen samples are solved at once while the heats are smooth enough (a window); where they are not, a sample is halved
until the last Chebyshev coefficients of the heats are worth less than the tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..errors import Diverged
from ._augmented import PortHeat, augment
from ._collocation import DEGREE, TAIL, Step, step_matrices, window_matrices
from ._equations import Equations
from ._terms import Array

WINDOW = 16
FINEST = 14  # a sample is halved at most this many times
_ITERATIONS = 12
_HOTTEST = 3000.0  # K
_TAIL = 20.0  # the last kept coefficients are at least this much larger than what is cut off (measured: 1000 times)


@dataclass(frozen=True)
class Path:
    """What the integrator did: the state at every sample, and every step it took.

    Parameters
    ----------
    z : ndarray, shape (n_samples, n_z)
        Augmented states at the samples.
    starts : ndarray, shape (n_steps, n_z)
        State at the start of every step.
    sample : ndarray of int, shape (n_steps,)
        Sample interval of every step.
    level : ndarray of int, shape (n_steps,)
        A step is h / 2**level long.
    """

    z: Array
    starts: Array
    sample: NDArray[np.intp]
    level: NDArray[np.intp]


@dataclass
class Integrator:
    """Integrates one system at one sample time.

    Parameters
    ----------
    eq : Equations
        The system.
    h : float
        Sample time [s].
    tolerance : float
        Accepted truncation of the heats per step, as a temperature [K].
    """

    eq: Equations
    h: float
    tolerance: float = 1e-4
    _steps: dict[int, Step] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.parts = augment(self.eq)
        self.ports = self.parts.ports
        self.port_heat = PortHeat.of(self.eq, self.ports)
        self.nz, self.nq = self.parts.F.shape[0], self.parts.N.shape[1]
        self.n_ambients = len(self.eq.system.ambients)
        self.first_current = len(self.eq.system.inputs)
        self.n_modules = len(self.eq.system.modules)
        self._window: tuple[Step, Array] | None = None

    def step(self, level: int) -> Step:
        """Matrices of a step of h / 2**level."""
        if level not in self._steps:
            self._steps[level] = step_matrices(self.parts, self.h / 2**level)
        return self._steps[level]

    def gain(self, level: int) -> Array:
        """Temperature that one watt of each heat is worth over a step [K/W]."""
        lumps = slice(DEGREE * self.ports.size, DEGREE * self.ports.size + len(self.eq.capacity))
        return np.abs(self.step(level).M[lumps]).reshape(len(self.eq.capacity), DEGREE + 1, self.nq).sum(1).max(0)

    def window(self) -> tuple[Step, Array]:
        """Matrices of a window of samples, and the gain of a sample."""
        if self._window is None:
            self._window = window_matrices(self.step(0), self.ports, WINDOW), self.gain(0)
        return self._window

    def run(self, z0: Array, u: Array) -> Path:
        """Integrate from z0 with inputs u (n_samples, n_u) held over each sample.

        Raises
        ------
        Diverged
            When temperatures leave every sensible range.
        """
        n = len(u)
        z = np.empty((n, self.nz))
        z[0] = z0
        refined: dict[int, Array] = {}
        k, level = 0, 0
        while k < n - 1:
            if level == 0 and n - 1 - k >= WINDOW and self._advance_window(z, u, k):
                k += WINDOW
                continue
            level = self._advance_sample(z, u, k, level, refined)
            k += 1
        return _path(z, refined)

    def _advance_window(self, z: Array, u: Array, k: int) -> bool:
        matrices, gain = self.window()
        inputs = u[k:k + WINDOW]
        base = matrices.K @ z[k] + matrices.Ku @ inputs.ravel()
        rows = WINDOW * (DEGREE + 1) * self.ports.size
        q, change = self.solve_ports(base[:rows], matrices.M[:rows], z[k], inputs, WINDOW)
        if not change or np.max(np.abs(TAIL @ q).sum(axis=1) @ gain, initial=0.0) > _TAIL * self.tolerance:
            return False
        z[k + 1:k + 1 + WINDOW] = (base[rows:] + matrices.M[rows:] @ q.ravel()).reshape(WINDOW, self.nz)
        return True

    def _advance_sample(self, z: Array, u: Array, k: int, level: int, refined: dict[int, Array]) -> int:
        """One sample in 2**level steps, refined as needed; return the level to start the next one with."""
        while True:
            done = self._try_sample(z[k], u[k:k + 1], level)
            if done is not None:
                break
            level += 1
            if level > FINEST:
                self._give_up(z[k], k)
        states, tail = done
        if not np.abs(states[-1, :len(self.eq.capacity)]).max() < _HOTTEST:
            self._give_up(states[-1], k)
        z[k + 1] = states[-1]
        if level:
            refined[k] = states[:-1]
        return level - 1 if level and tail < _TAIL * self.tolerance / 300 else level

    def _try_sample(self, start: Array, u: Array, level: int) -> tuple[Array, float] | None:
        step, gain = self.step(level), self.gain(level)
        nodes = DEGREE * self.ports.size
        states, worst = [start], 0.0
        own = np.zeros((self.ports.size, step.M.shape[1]))
        M = np.concatenate([own, step.M[:nodes]])
        for _ in range(2**level):
            base = step.K @ states[-1] + step.Ku @ u[0]
            at_ports = np.concatenate([states[-1][self.ports], base[:nodes]])
            q, converged = self.solve_ports(at_ports, M, states[-1], u, 1)
            tail = np.max(np.abs(TAIL @ q).sum(axis=1) @ gain, initial=0.0)
            if not converged or not tail <= _TAIL * self.tolerance:
                return None
            worst = max(worst, float(tail))
            states.append(base[nodes:] + step.M[nodes:] @ q.ravel())
        return np.array(states), worst

    def solve_ports(self, base: Array, M: Array, start: Array, u: Array, samples: int) -> tuple[Array, bool]:
        """Fixed point q = heat(base + M q), by Picard iteration: heats (samples, p + 1, n_q), whether it converged."""
        if not self.nq:
            return np.zeros((samples, DEGREE + 1, 0)), True
        np_ = self.ports.size
        T = np.empty((samples, DEGREE + 1, np_ + self.n_ambients))
        T[..., :np_] = start[self.ports]
        T[..., np_:] = u[:, None, u.shape[1] - self.n_ambients:]
        current = u[:, None, self.first_current:self.first_current + self.n_modules]
        shape, last = (samples, DEGREE + 1, np_), np.inf
        for _ in range(_ITERATIONS):
            q = self.port_heat(T, current)
            new = (base + M @ q.ravel()).reshape(shape)
            change = np.abs(new - T[..., :np_]).max()
            T[..., :np_] = new
            if change < 1e-3 * self.tolerance:
                return q, True
            if not change < 2 * last:  # grows, or is not a number
                return q, False
            last = change
        return q, False

    def _give_up(self, z: Array, k: int) -> None:
        lumps = np.nan_to_num(z[:len(self.eq.capacity)], nan=np.inf)
        worst = int(np.argmax(np.abs(lumps - 300.0)))
        name = self.eq.system.lump_names[worst]
        raise Diverged(f"the simulation runs away at {k * self.h:.6g} s: lump {name!r} is at {lumps[worst]:.4g} K. "
                       "Thermal runaway of a module, or a current far beyond its limits: check signs and units, or "
                       "limit the current (rt.certify.largest_current tells how much is safe).", time=k * self.h)


def _path(z: Array, refined: dict[int, Array]) -> Path:
    """Steps of a run: one per sample, several where it was refined."""
    samples = len(z) - 1
    counts = np.ones(samples, np.intp)
    for k, states in refined.items():
        counts[k] = len(states)
    sample = np.repeat(np.arange(samples), counts)
    starts = z[sample]
    first = np.concatenate([[0], np.cumsum(counts)])
    for k, states in refined.items():
        starts[first[k]:first[k + 1]] = states
    return Path(z, starts, sample, np.log2(counts[sample]).astype(np.intp))
