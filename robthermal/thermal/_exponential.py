"""Exponential collocation in time: exact for the linear network, spectral for the modules.

Sixteen samples are solved at once while the heats are smooth enough (a window); where they are not, a sample is halved
until the last Chebyshev coefficients of the heats are worth less than the tolerance: first towards its start, where
the drives jump, so that a lag far shorter than a sample costs a step per halving; then everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

from .._recursion import recursion
from ..errors import Diverged
from ._augmented import augment
from ._collocation import DEGREE, TAIL, Step, step_matrices, window_matrices
from ._equations import Equations
from ._fixed_point import HOTTEST, FixedPoint
from ._layout import Layout
from ._march import Lengths, Marching, holds, library
from ._ports import PortHeat
from ._schedule import Schedule
from ._terms import Array

WINDOW = 16
FINEST = 14  # a sample is halved at most this many times
_MIXED = 512  # segments of several lengths in one recursion: each brings its own matrices
_TAIL = 20.0  # the last kept coefficients are at least this much larger than what is cut off (measured: 1000 times)


@dataclass(frozen=True)
class Path:
    """What the integrator did: the state at every sample, and every step it took.

    Parameters
    ----------
    z : ndarray, shape (n_segments, n_z)
        Augmented states at the starts of the schedule's segments.
    starts : ndarray, shape (n_steps, n_z)
        State at the start of every step.
    segment : ndarray of int, shape (n_steps,)
        Segment of every step.
    level : ndarray of int, shape (n_steps,)
        A step is its segment's length / 2**level long.
    """

    z: Array
    starts: Array
    segment: NDArray[np.intp]
    level: NDArray[np.intp]


@dataclass
class Integrator:
    """Integrates one system over segments of a few lengths, mostly whole samples.

    Parameters
    ----------
    eq : Equations
        Equations of the system to integrate.
    lengths : tuple of float
        Of the segments; the first is the sample time [s].
    tolerance : float
        Accepted truncation of the heats per step, as a temperature [K].
    """

    eq: Equations
    lengths: tuple[float, ...]
    tolerance: float = 1e-4
    _steps: dict[tuple[int, int], Step] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.layout = Layout(self.eq)
        self.port_heat = PortHeat.of(self.eq, self.layout)
        self.parts = augment(self.eq, self.layout, self.port_heat)
        self.ports = self.parts.ports
        self.nz, self.nq = self.parts.F.shape[0], self.parts.N.shape[1]
        self._gains: dict[tuple[int, int], Array] = {}
        self._fixed: dict[tuple[int, int], FixedPoint] = {}
        self._compiled: dict[tuple[int, int], Marching | None] = {}
        self._together: dict[tuple[tuple[int, int], ...], Lengths | None] = {}
        self._window: tuple[Step, Array, FixedPoint] | None = None

    @property
    def goal(self) -> float:
        """Change of a temperature at which a fixed point is found [K]."""
        return 1e-3 * self.tolerance

    def step(self, kind: int, level: int) -> Step:
        """Matrices of a step of lengths[kind] / 2**level."""
        if (kind, level) not in self._steps:
            self._steps[kind, level] = step_matrices(self.parts, self.lengths[kind] / 2**level)
        return self._steps[kind, level]

    def gain(self, kind: int, level: int) -> Array:
        """Temperature that one watt of each heat is worth over a step [K/W]."""
        if (kind, level) not in self._gains:
            n, first = len(self.eq.capacity), DEGREE * self.ports.size
            lumps = np.abs(self.step(kind, level).M[first:first + n])
            self._gains[kind, level] = lumps.reshape(n, DEGREE + 1, self.nq).sum(1).max(0)
        return self._gains[kind, level]

    def fixed(self, kind: int, level: int) -> FixedPoint:
        """Fixed point of a step of lengths[kind] / 2**level; the ports at its start are known."""
        if (kind, level) not in self._fixed:
            nodes = self.step(kind, level).M[:DEGREE * self.ports.size]
            known = np.zeros((self.ports.size, nodes.shape[1]))
            self._fixed[kind, level] = FixedPoint(self.port_heat, np.concatenate([known, nodes]), 1, self.goal)
        return self._fixed[kind, level]

    def compiled(self, kind: int, level: int) -> Marching | None:
        """Compiled steps of lengths[kind] / 2**level; None where they were not built, or do not know the system."""
        if (kind, level) not in self._compiled:
            built = library() if self.nq and holds(self.port_heat, self.nz) else None
            self._compiled[kind, level] = None if built is None else Marching(
                built, self.port_heat, self.step(kind, level), self.gain(kind, level), self.goal,
                _TAIL * self.tolerance, HOTTEST)
        return self._compiled[kind, level]

    def window(self) -> tuple[Step, Array, FixedPoint]:
        """Matrices of a window of samples, the gain of a sample, and the fixed point."""
        if self._window is None:
            step = window_matrices(self.step(0, 0), self.ports, WINDOW)
            at_ports = step.M[:WINDOW * (DEGREE + 1) * self.ports.size]
            self._window = step, self.gain(0, 0), FixedPoint(self.port_heat, at_ports, WINDOW, self.goal)
        return self._window

    def run(self, z0: Array, plan: Schedule) -> Path:
        """Integrate from z0 with the drives of a schedule.

        Raises
        ------
        Diverged
            When temperatures leave every sensible range.
        """
        n = len(plan.w)
        z = np.empty((n, self.nz))
        z[0] = z0
        refined: dict[int, tuple[Array, NDArray[np.intp]]] = {}
        k, level = 0, 0
        with np.errstate(over="ignore", invalid="ignore"):  # a fixed point that diverges is noticed by its change
            while k < n - 1:
                if not self.nq:
                    k += self._advance_linear(z, plan, k)
                    continue
                if level == 0:
                    done, level = self._advance_samples(z, plan, k)
                    k += done
                    if k == n - 1 or (done and not level):
                        continue
                level = self._advance_segment(z, plan, k, level, refined)
                k += 1
        return _path(z, refined)

    def _advance_samples(self, z: Array, plan: Schedule, k: int) -> tuple[int, int]:
        """Segments from k on while that is easy: how many were computed, and the level to start the next one with."""
        if (marched := self._march(z[k:], plan.kind[k:-1], plan.w[k:-1])) is not None:
            return marched[0], 1  # where it stopped, a whole segment is not enough
        whole = len(plan.w) - 1 - k >= WINDOW and not plan.kind[k:k + WINDOW].any()
        return (WINDOW if whole and self._advance_window(z, plan.w, k) else 0), 0

    def _march(self, z: Array, kind: NDArray[np.intp], w: Array) -> tuple[int, float] | None:
        """Compiled steps of lengths[kind]: how many, and their worst last coefficients; None: not built."""
        lengths = self._marching(tuple((one, 0) for one in range(len(self.lengths))))
        return None if lengths is None else lengths(kind, z, w)

    def _march_segment(self, z: Array, w: Array, kind: int, levels: NDArray[np.intp]) -> tuple[int, float] | None:
        """Compiled steps of lengths[kind] / 2**levels, as `_march`."""
        most, least = int(levels[0]), int(levels[-1])
        lengths = self._marching(tuple((kind, level) for level in range(least, most + 1)))
        return None if lengths is None else lengths(levels - least, z, w.repeat(len(levels), axis=0))

    def _marching(self, lengths: tuple[tuple[int, int], ...]) -> Lengths | None:
        """Compiled steps of lengths[kind] / 2**level for some kinds and levels; None: not built."""
        if lengths not in self._together:
            compiled = [one for one in (self.compiled(*length) for length in lengths) if one is not None]
            self._together[lengths] = Lengths(compiled) if len(compiled) == len(lengths) else None
        return self._together[lengths]

    def _advance_window(self, z: Array, w: Array, k: int) -> bool:
        matrices, gain, fixed = self.window()
        inputs = w[k:k + WINDOW]
        base = matrices.K @ z[k] + matrices.Ku @ inputs.ravel()
        rows = WINDOW * (DEGREE + 1) * self.ports.size
        q, converged = fixed.solve(base[:rows], z[k], inputs)
        if not converged or np.max(np.abs(TAIL @ q).sum(axis=1) @ gain, initial=0.0) > _TAIL * self.tolerance:
            return False
        z[k + 1:k + 1 + WINDOW] = (base[rows:] + matrices.M[rows:] @ q.ravel()).reshape(WINDOW, self.nz)
        return True

    def _advance_linear(self, z: Array, plan: Schedule, k: int) -> int:
        """Segments from k on without nonlinear heats, as one recursion: how many were computed."""
        whole = _whole(plan, k)
        stop = k + whole if whole else min(k + _MIXED, len(z) - 1)
        kind = plan.kind[k:stop]
        steps = [self.step(one, 0) for one in range(1 if whole else len(self.lengths))]
        if whole:
            A, driven = np.broadcast_to(steps[0].K, (whole, self.nz, self.nz)), plan.w[k:stop] @ steps[0].Ku.T
        else:
            A = np.stack([one.K for one in steps])[kind]
            driven = np.einsum("sij,sj->si", np.stack([one.Ku for one in steps])[kind], plan.w[k:stop])
        z[k:stop + 1] = recursion(A, driven[..., None], z[k][:, None])[..., 0]
        lumps = z[k:stop + 1, :len(self.eq.capacity)]
        if not (lumps.max() < HOTTEST and lumps.min() > -HOTTEST):
            hot = np.flatnonzero(~(np.abs(lumps).max(axis=1) < HOTTEST))
            self._give_up(z[k + hot[0]], plan.at[k + hot[0]] * self.lengths[0])
        return stop - k

    def _advance_segment(self, z: Array, plan: Schedule, k: int, level: int,
                         refined: dict[int, tuple[Array, NDArray[np.intp]]]) -> int:
        """One segment, its first step 1/2**level of it or less; return the level to start the next one with."""
        time = plan.at[k] * self.lengths[0]
        while True:
            for levels in _divisions(level):
                done = self._try_segment(z[k], plan.w[k:k + 1], int(plan.kind[k]), levels)
                if done is not None:
                    break
            if done is not None:
                break
            level += 1
            if level > FINEST:
                self._give_up(z[k], time)
        states, tail = done
        if not np.abs(states[-1, :len(self.eq.capacity)]).max() < HOTTEST:
            self._give_up(states[-1], time)
        z[k + 1] = states[-1]
        if level:
            refined[k] = states[:-1], levels
        return level - 1 if level and tail < _TAIL * self.tolerance / 300 else level

    def _try_segment(self, start: Array, w: Array, kind: int, levels: NDArray[np.intp]) -> tuple[Array, float] | None:
        """States of a segment in steps of 1/2**levels, and their worst last coefficients [K]; None if it needs more."""
        z = np.empty((len(levels) + 1, self.nz))
        z[0] = start
        if (marched := self._march_segment(z, w, kind, levels)) is not None:
            return (z, marched[1]) if marched[0] == len(levels) else None
        nodes = DEGREE * self.ports.size
        states, worst = [start], 0.0
        for level in levels.tolist():
            step, gain, fixed = self.step(kind, level), self.gain(kind, level), self.fixed(kind, level)
            base = step.K @ states[-1] + step.Ku @ w[0]
            at_ports = np.concatenate([states[-1][self.ports], base[:nodes]])
            q, converged = fixed.solve(at_ports, states[-1], w)
            tail = np.max(np.abs(TAIL @ q).sum(axis=1) @ gain, initial=0.0)
            if not converged or not tail <= _TAIL * self.tolerance:
                return None
            worst = max(worst, float(tail))
            states.append(base[nodes:] + step.M[nodes:] @ q.ravel())
        return np.array(states), worst

    def _give_up(self, z: Array, time: float) -> None:
        lumps = np.nan_to_num(z[:len(self.eq.capacity)], nan=np.inf)
        worst = int(np.argmax(np.abs(lumps - 300.0)))
        name = self.eq.system.lump_names[worst]
        raise Diverged(f"the simulation runs away at {time:.6g} s: lump {name!r} is at {lumps[worst]:.4g} K. "
                       "Thermal runaway of a module, or a current or heat far beyond its limits: check signs and "
                       "units, or limit the current to what rt.certify.usable_current gives.", time=time)


def _whole(plan: Schedule, k: int) -> int:
    """Number of whole samples from segment k on."""
    other = np.flatnonzero(plan.kind[k:-1])
    return int(other[0] if other.size else len(plan.kind) - 1 - k)


@cache
def _divisions(level: int) -> tuple[NDArray[np.intp], ...]:
    """Ways to cut a segment into steps of 1/2**levels of it: ever shorter towards its start, then evenly."""
    even = np.full(2**level, level)
    return (even,) if level < 2 else (np.array([level, *range(level, 0, -1)]), even)


def _path(z: Array, refined: dict[int, tuple[Array, NDArray[np.intp]]]) -> Path:
    """Steps of a run: one per segment, several where it was refined."""
    segments = len(z) - 1
    counts = np.ones(segments, np.intp)
    for k, (states, _) in refined.items():
        counts[k] = len(states)
    segment = np.repeat(np.arange(segments), counts)
    starts, level = z[segment], np.zeros(len(segment), np.intp)
    first = np.concatenate([[0], np.cumsum(counts)])
    for k, (states, levels) in refined.items():
        starts[first[k]:first[k + 1]], level[first[k]:first[k + 1]] = states, levels
    return Path(z, starts, segment, level)
