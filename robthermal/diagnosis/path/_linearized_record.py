"""A system linearized along a simulated record: how readings answer to a small extra heat, sample by sample.

dδ/dt = E⁻¹(∂f/∂x δ + q): with ∂f/∂x frozen at the middle of each sample and the extra heat q linear within it, the step
is exact, δ(k+1) = A δ(k) + h φ₁(Mh) q₀ + h φ₂(Mh)(q₁ - q₀). All candidates go through the recursion together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._recursion import recursion
from ..._residual import residual
from ...thermal import Equations, System, Trajectory, trajectory, voltage_slopes
from ..data import RecordData, ResponseData
from ..effects import Candidate, Response
from ._coarseness import coarse_responses
from ._draw_residuals import draw_residuals
from ._exact_steps import exact_steps, over_steps
from ._heat_splines import heat_splines
from ._late_means import LATE_MEANS, late_means
from ._linearized import Unknowns
from ._rates import each, heat_slopes, heats_of, is_diagonal, kinds_of, sliced
from ._whitening import Whitener, whitener

Array = NDArray[np.float64]
Places = NDArray[np.intp]
_BLOCK = 32  # signatures at once, over so many samples: they stay in the cache
_SAMPLES = 512
_SAME = 1e-4  # change of a rate times the sample time [-]


@dataclass(frozen=True, eq=False)
class LinearizedRecord:
    """A simulated record and the system linearized along it.

    Parameters
    ----------
    system : System
        With the record's initial temperatures.
    one : RecordData
        The record and its sensors.
    x : ndarray, shape (n, n_lumps)
        Simulated lump temperatures [K].
    readings : ndarray, shape (n, n_sensors)
        Simulated readings of all sensors of the system [K, V].
    u : ndarray, shape (n, n_u)
        Held inputs, in the order of `System.exogenous_names`.
    run : Trajectory
        The simulation, for its derivatives.
    coarse : ndarray, shape (n, n_sensors, k), optional
        Changes of the readings by which a finer network may differ, from `coarse_columns`.
    b : ndarray, shape (k,), optional
        How large they are here.
    late : float
        Of a record of means: how many steps these are late [-].
    """

    system: System
    one: RecordData
    x: Array
    readings: Array
    u: Array
    run: Trajectory
    coarse: Array | None = None
    b: Array | None = None
    late: float = 0.0

    @property
    def h(self) -> float:
        """Sample time [s]."""
        return self.one.record.sample_time

    @cached_property
    def time(self) -> Array:
        """Time of every sample [s]."""
        return self.one.record.time

    @property
    def reference(self) -> float:
        """Temperature about which sensor gains act [K]."""
        return next(iter(self.system.ambients.values())).temperature

    @property
    def span(self) -> float:
        """Length of the record [s]."""
        return len(self.x) * self.h

    def draw(self, ax: Any, r: Array) -> None:
        """Draw residuals (n, n_sensors) [K, V] against time; voltages on an axis at the right.

        Parameters
        ----------
        ax : matplotlib.axes.Axes
            Axes to draw on.
        r : ndarray, shape (n, n_sensors)
            Residuals of the sensors [K, V].
        """
        draw_residuals(ax, self.time, r, {name: self.system.sensors[name].unit for name in self.one.sensors})

    @property
    def in_time(self) -> bool:
        """A record."""
        return True

    @cached_property
    def residual(self) -> Array:
        """Free-run residual, measured − modelled, (n, n_sensors) [K, V]; without what a finer network would change."""
        free = residual(self.one.readings, self.readings[:, self.one.columns])
        free = free - self.late * self.late_columns if self.late else free
        return free if self.coarse is None or self.b is None else free - self.coarse @ self.b

    @cached_property
    def late_columns(self) -> Array:
        """Change of the readings per step that means are late, (n, n_sensors) [K]."""
        read = self.readings[:, self.one.columns]
        return late_means(self.system, self.one.sensors, read, self.x) if self.means else np.zeros(read.shape)

    def coarse_columns(self, base: System) -> Array:
        """As `Linearized.coarse_columns`.

        Parameters
        ----------
        base : System
            Network without added effects.
        """
        responses = list(coarse_responses(self, base))
        return self.readings_of(responses) if responses else np.zeros((*self.one.readings.shape, 0))

    def refined(self, columns: Array, b: Array) -> LinearizedRecord:
        """As `Linearized.refined`.

        Parameters
        ----------
        columns, b : ndarray
            Changes of the readings (n, n_sensors, k), and how large they are (k,).
        """
        return replace(self, coarse=columns, b=b)

    def white(self, noise: Callable[[LinearizedRecord], tuple[Any, ...]]) -> Whitener:
        """As `Linearized.white`: a Kalman filter along the record.

        Parameters
        ----------
        noise : callable
            Gives the noise of a record; a response brings its own.
        """
        return whitener(self, *noise(self))

    def bands(self, z: Array) -> list[str]:
        """As `Linearized.bands`: conditions of records are looked at together.

        Parameters
        ----------
        z : ndarray
            Whitened residuals of the data set.
        """
        return []

    def noise_windows(self, block: Array) -> Iterator[tuple[ResponseData, Array]]:
        """As `Linearized.noise_windows`: none.

        Parameters
        ----------
        block : ndarray
            Rows of this data set.
        """
        return iter(())

    def slopes(self, unknowns: Unknowns) -> Array:
        """As `Linearized.slopes`: exact, by the simulation's own derivatives.

        Parameters
        ----------
        unknowns : Unknowns
            Where, and what they are.
        """
        names, chain = unknowns.names, unknowns.chain
        initial = unknowns.initial.names if unknowns.initial.n_free else ()
        sigma = unknowns.initial.sigma[:unknowns.initial.n_free]
        if unknowns.v.size == len(names) + len(initial) and is_diagonal(chain):  # one number each, and then the start
            return self._derivative([*names, *initial], np.concatenate([np.diag(chain), sigma]))
        own = [number for number in unknowns.gain_names if number not in names and number != LATE_MEANS]
        J = self._derivative([*names, *own, *initial])
        out = np.zeros((*J.shape[:2], unknowns.v.size))
        common = np.ascontiguousarray(J[..., :len(names)]).reshape(len(J) * J.shape[1], -1) @ chain  # one product
        out[..., :chain.shape[1]] = common.reshape(*J.shape[:2], -1)
        out[..., unknowns.start] = J[..., len(names) + len(own):] * sigma
        at = {number: J[..., place] for place, number in enumerate([*names, *own])}
        for i, (number, std) in enumerate(zip(unknowns.gain_names, unknowns.gain_sigma, strict=True)):
            out[..., unknowns.gains.start + i] = std * (self.late_columns if number == LATE_MEANS else at[number])
        if self.coarse is not None and unknowns.coarse.stop > unknowns.coarse.start:
            out[..., unknowns.coarse] = self.coarse
        return out

    def _derivative(self, names: list[str], scale: Array | None = None) -> Array:
        """Derivative (n, n_sensors, k) of the record's sensors by numbers of the system, each times a number."""
        J = np.asarray(self.run.derivative(names, scale), np.float64)
        return J if np.array_equal(self.one.columns, np.arange(J.shape[1])) else J[:, self.one.columns]

    def columns(self, trials: Sequence[Candidate]) -> Array:
        """As `Linearized.columns`: by signatures, or by simulating again with a small effect.

        Parameters
        ----------
        trials : sequence of Candidate
            Effects with trial values.
        """
        signed = [(i, trial, None if self._changes_voltage(trial) else trial.effect.signature)
                  for i, trial in enumerate(trials)]
        linear = [(i, trial, signature) for i, trial, signature in signed if signature is not None]
        out = np.zeros((*self.one.readings.shape, len(trials)))
        for first in range(0, len(linear), _BLOCK):
            some = linear[first:first + _BLOCK]
            out[..., sliced([i for i, _, _ in some])] = self.readings_of(
                [signature(self, trial.where, trial.shape) for _, trial, signature in some])
        for i, trial, signature in signed:
            if signature is None:
                step = trial.shape.get(trial.effect.size.name, trial.effect.size.typical)
                run = trajectory(trial.add(self.system, step), self.one.record)
                out[..., i] = (run.readings - self.readings)[:, self.one.columns] / step
        return out

    def _changes_voltage(self, trial: Candidate) -> bool:
        """Whether an effect acts on a module whose voltage is read: beside its heat, it changes a reading at once."""
        return bool({self.system.sensors[name].module for name in self.one.sensors} & {*trial.where} - {""})

    def splines(self, lump: int) -> Array:
        """As `Linearized.splines`: a spline in time of 1 W.

        Parameters
        ----------
        lump : int
            Place of the lump.
        """
        basis = heat_splines(self.time)
        start = np.zeros((*self.x.shape, basis.shape[1]))
        end = np.zeros_like(start)
        start[:, lump], end[:, lump] = basis, np.concatenate([basis[1:], basis[-1:]])
        return self.answer(start, end)

    @cached_property
    def equations(self) -> Equations:
        """Equations of the system."""
        return Equations(self.system)

    @cached_property
    def end(self) -> Array:
        """Lump temperatures at the end of every sample (n, n_lumps) [K]."""
        return np.concatenate([self.x[1:], self.x[-1:]])

    @cached_property
    def lags(self) -> list[str]:
        """Sensors with a state of their own."""
        return [name for name, sensor in self.system.sensors.items() if sensor.time_constant > 0]

    @cached_property
    def sources(self) -> list[int]:
        """State that every sensor in the record reads, its lag or its lump; -1 for voltages."""
        nl, lumps = self.x.shape[1], self.system.lump_names
        return [-1 if self.system.sensors[name].module else nl + self.lags.index(name) if name in self.lags
                else lumps.index(self.system.sensors[name].lump) for name in self.one.sensors]

    @cached_property
    def means(self) -> list[int]:
        """Of which states a mean over the sample before is a state too: what sensors read, in a record of means."""
        return sorted(set(self.sources)) if self.one.record.averaged else []

    @property
    def M(self) -> Array:
        """Rate of the deviations of lumps and lagged sensors, and of means from 0, (n, n_z, n_z) [1/s]."""
        n, nl = self.x.shape
        core = nl + len(self.lags)
        nz = core + len(self.means)
        M = np.zeros((n, nz, nz))
        for row, source in enumerate(self.means, start=core):
            M[:, row, source] = 1.0 / self.h
        slopes = heat_slopes(self.equations, 0.5 * (self.x + self.end), self.u)
        M[:, :nl, :nl] = slopes / self.equations.capacity[:, None]
        for row, name in enumerate(self.lags, start=nl):
            sensor = self.system.sensors[name]
            M[:, row, row] = -1.0 / sensor.time_constant
            M[:, row, self.system.lump_names.index(sensor.lump)] = 1.0 / sensor.time_constant
        return M

    @cached_property
    def kinds(self) -> tuple[Array, Places]:
        """The different rates among the samples, (n_kinds, n_z, n_z), and which one each sample has, (n,).

        Rates that differ by less than 1e-4 of a sample are one: a held current has one matrix, not one per sample.
        """
        return kinds_of(M := self.M, np.round(M * (self.h / _SAME)))

    @cached_property
    def steps(self) -> tuple[Array, Array, Array]:
        """A, and what heat at the start and at the end of a sample [W] leaves in the states at its end."""
        M, kind = self.kinds
        core = M.shape[1] - len(self.means)
        A, phi1, phi2 = exact_steps(M[:, :core, :core] * self.h, self.means)
        nl = self.x.shape[1]
        per_watt = self.h / self.equations.capacity
        by_end = phi2[..., :nl] * per_watt
        return each(A, kind), each(phi1[..., :nl] * per_watt - by_end, kind), each(by_end, kind)

    @cached_property
    def C(self) -> Array:
        """What the sensors in the record read of the states, (n, n_sensors, n_z); that of voltages varies."""
        varies = any(self.system.sensors[name].module for name in self.one.sensors)
        core = self.x.shape[1] + len(self.lags)
        C = np.zeros((len(self.x) if varies else 1, len(self.one.sensors), core + len(self.means)))
        read = [core + self.means.index(source) for source in self.sources] if self.means else self.sources
        for i, name in enumerate(self.one.sensors):
            if read[i] < 0:
                u = self.u[np.maximum(np.arange(len(self.u)) - (self.system.sensors[name].read == "before"), 0)]
                C[:, i, :self.x.shape[1]] = voltage_slopes(self.equations, name, self.x, u)
            else:
                C[:, i, read[i]] = self.system.sensors[name].gain
        return C if varies else np.broadcast_to(C[0], (len(self.x), *C.shape[1:]))

    @cached_property
    def mean(self) -> tuple[Array, Array, Array]:
        """A, C and M of the middle: their means over the samples."""
        return self.steps[0].mean(axis=0), self.C.mean(axis=0), self.M.mean(axis=0)

    @cached_property
    def own_heat(self) -> tuple[Array, Array]:
        """Heat of the system as it is at the start and at the end of every sample (n, n_lumps) [W]."""
        start, end = (np.asarray(self.equations.heat(x, self.u), np.float64) for x in (self.x, self.end))
        return start, end

    def heat_of(self, system: System) -> tuple[Array, Array]:
        """Extra heat of a changed system, at the start and at the end of every sample.

        Parameters
        ----------
        system : System
            With the same lumps.

        Returns
        -------
        tuple of ndarray, shape (n, n_lumps)
            [W].
        """
        other, (start, end) = Equations(system), self.own_heat
        return other.heat(self.x, self.u) - start, other.heat(self.end, self.u) - end

    def readings_of(self, responses: list[Response]) -> Array:
        """Change of the record's sensors that each response causes.

        Parameters
        ----------
        responses : list of Response
            Of m effects; some dozens, so that they stay in the cache.

        Returns
        -------
        ndarray, shape (n, n_sensors, m)
            [K].
        """
        out = self._answered(lambda some: heats_of(responses, self.x[some].shape, some), len(responses))
        for j, response in enumerate(responses):
            if response.reading is not None:
                read = response.reading[:, self.one.columns]
                out[..., j] += over_steps(read) if self.means else read
        return out

    def answer(self, start: Array, end: Array) -> Array:
        """Change of the readings that extra heats cause.

        Parameters
        ----------
        start, end : ndarray, shape (n, n_lumps, m)
            Heat at the start and at the end of every sample [W].

        Returns
        -------
        ndarray, shape (n, n_sensors, m)
            [K].
        """
        return self._answered(lambda some: (start[some], end[some]), start.shape[2])

    def _answered(self, heat: Callable[[slice], tuple[Array, Array]], m: int) -> Array:
        """As `answer`, of m heats that are asked for some samples at a time."""
        A, by_start, by_end = self.steps
        out = np.empty((*self.one.readings.shape, m))
        state = np.zeros((A.shape[1], m))
        for first in range(0, len(out), _SAMPLES):
            some = slice(first, first + _SAMPLES)
            start, end = heat(some)
            push = by_start[some] @ start
            push += by_end[some] @ end
            states = recursion(A[some], push, state)
            np.matmul(self.C[some], states[:-1], out=out[some])
            state = states[-1]
        return out
