"""The loop as it is implemented, linearized: held currents, sensors, observer and law of the nominal model, controller.

x⁺ = Φ x + Γ v from the heats v that are applied, v = C x from the controller. Opened at one heat, it is a single loop.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from ..errors import InputError
from ..thermal import System, state_matrices
from ._controller import Controller
from ._discrete import delayed
from ._linearization import FeedbackLinearization
from ._matrices import Matrices, matrices
from ._modules import Array
from ._observer import GainObserver
from ._plant import cold_side
from ._regulated_points import Regulate, RegulatedPoint, regulated_points

_STEPS = 50  # of Newton's method for the observer's steady state
_CONDITION = 1e9  # of eigenvectors that are still used


@dataclass(frozen=True)
class SampledLoop:
    """x⁺ = A x + B w, v = C x: w are the heats that are applied, v those the controller asks for; closed, w = v.

    Parameters
    ----------
    A, B, C : ndarray
        Of plant, sensors, observer, law and controller.
    sample_time : float
        Time between two samples [s].
    """

    A: Array
    B: Array
    C: Array
    sample_time: float

    @property
    def poles(self) -> np.ndarray:
        """Poles of the closed loop; it is stable when all are inside the unit circle."""
        return np.linalg.eigvals(self.A + self.B @ self.C).astype(complex)

    def single(self, i: int) -> SampledLoop:
        """Loop of one heat while all others are closed, with the sign of a loop transfer: L = -v/w."""
        others = [k for k in range(self.B.shape[1]) if k != i]
        A = self.A + self.B[:, others] @ self.C[others]
        return SampledLoop(A, self.B[:, [i]], -self.C[[i]], self.sample_time)

    def response(self, frequency: Array) -> np.ndarray:
        """v/w at frequencies, (n_frequencies, n_modules, n_modules).

        Parameters
        ----------
        frequency : ndarray
            Angular frequencies of the response [rad/s].
        """
        z = np.exp(1j * np.atleast_1d(frequency) * self.sample_time)
        values, vectors = np.linalg.eig(self.A)
        if np.linalg.cond(vectors) < _CONDITION:
            return np.asarray(((self.C @ vectors) / (z[:, None, None] - values)) @ np.linalg.solve(vectors, self.B))
        return np.asarray(self.C @ np.linalg.solve(z[:, None, None] * np.eye(len(self.A)) - self.A, self.B))


@dataclass(frozen=True)
class LoopParts:
    """What makes a loop besides its plant: law, controller, observer, regulated points, all of the nominal model.

    Parameters
    ----------
    law : FeedbackLinearization
        Acts on the cold faces, as measured or estimated.
    controller : Matrices
        Of the outer loop.
    observer : GainObserver or None
        Whose estimates law and controller take; None where every lump is measured.
    points : tuple of RegulatedPoint
        What the controller regulates.
    """

    law: FeedbackLinearization
    controller: Matrices
    observer: GainObserver | None
    points: tuple[RegulatedPoint, ...]

    @classmethod
    def of(cls, law: FeedbackLinearization, controller: Controller, observer: GainObserver | None = None,
           regulate: Regulate = None) -> LoopParts:
        """Check that the parts fit each other.

        Parameters
        ----------
        law : FeedbackLinearization
            Of the nominal model.
        controller : Controller
            Linear; its sample time is that of the loop.
        observer : GainObserver, optional
            Of the nominal model.
        regulate : mapping of module to str, optional
            Sensor or lump that a module regulates.
        """
        points = cold_side(law, regulate=regulate).points if regulate else regulated_points(law)
        if observer is not None and not isinstance(observer, GainObserver):
            raise InputError(f"observer is a {type(observer).__name__}", where="argument observer",
                             expected="an observer with a constant gain", remedy="Make one with rt.design.observer, "
                             'method "kalman", "positive" or "lmi".')
        M = matrices(controller)
        if observer is not None and abs(observer.sample_time - M.sample_time) > 1e-9 * M.sample_time:
            raise InputError(f"the observer's sample time is {observer.sample_time:g} s", where="argument observer",
                             expected=f"the controller's, {M.sample_time:g} s")
        return cls(law, M, observer, points)

    def loop(self, plant: System, temperatures: Array, inputs: Mapping[str, float]) -> SampledLoop:
        """Linearize the whole at a steady state of a plant.

        Parameters
        ----------
        plant : System
            What is controlled: the nominal model, or one with other parameters.
        temperatures : ndarray
            Of all lumps in steady state [K].
        inputs : mapping
            Currents, heaters and ambients in steady state [A], [unit], [K].
        """
        h, n, names = self.controller.sample_time, len(plant.lumps), plant.lump_names
        A, B, states = state_matrices(plant, temperatures, inputs)
        drive = B[:, [plant.exogenous_names.index(name) for name in self.law.names]]
        read = [*self.points, *self._observed()]
        C = np.array([_row(point, plant, states) for point in read])
        delays = [plant.sensors[point.name].delay if point.kind == "sensor" else 0.0 for point in read]
        Phi, Gamma, out = delayed(A, drive, C, delays, h)
        believed: Array = np.eye(n, len(Phi))
        at = np.asarray(temperatures, float)
        current = np.array([inputs[name] for name in self.law.names])
        if self.observer is not None:
            Phi, Gamma, out, believed, at = self._with_observer(Phi, Gamma, out, plant, at, inputs)
        y = [believed[names.index(point.name)] if point.kind == "lump" else out[i]
             for i, point in enumerate(self.points)]
        by_heat, by_faces = law_slopes(self.law, at, current)
        Phi, Gamma = Phi + Gamma @ by_faces @ believed, Gamma @ by_heat
        return self._close(Phi, Gamma, np.array(y), believed)

    def _observed(self) -> list[RegulatedPoint]:
        """Sensors of the observer, as points."""
        if self.observer is None:
            return []
        lumps = {name: part.lump for name, part in self.law.system.sensors.items()}
        return [RegulatedPoint("", name, "sensor", lumps[name]) for name in self.observer.sensors]

    def _with_observer(self, Phi: Array, Gamma: Array, out: Array, plant: System, temperatures: Array,
                       inputs: Mapping[str, float]) -> tuple[Array, Array, Array, Array, Array]:
        """The same with the observer's lumps as further states, what they say, and its steady state."""
        assert self.observer is not None
        model, L = self.observer.model, self.observer.gain
        sensors = [plant.sensors[name] for name in self.observer.sensors]
        T_ref = next(iter(plant.ambients.values())).temperature
        readings = np.array([T_ref + s.gain * (temperatures[plant.lump_names.index(s.lump)] - T_ref) + s.offset
                             for s in sensors])
        u = model.exogenous(inputs)
        estimate, right = temperatures.copy(), L @ model.measured(readings)
        for _ in range(_STEPS):
            slope = model.A_d + model.Gamma @ model.rest_slope(estimate, u) - L @ model.C
            change = np.linalg.solve(slope - np.eye(len(estimate)),
                                     model.predict(estimate, u) + right - L @ model.C @ estimate - estimate)
            estimate = estimate - change
            if np.abs(change).max() < 1e-9:
                break
        n, size = len(estimate), len(Phi)
        slope = model.A_d + model.Gamma @ model.rest_slope(estimate, u) - L @ model.C
        columns = [self.law.system.exogenous_names.index(name) for name in self.law.names]
        drive = model.Gamma @ model.equations.input_jacobian(estimate, u).toarray()[:, columns]
        seen = out[len(self.points):] / np.array([self.law.system.sensors[name].gain
                                                  for name in self.observer.sensors])[:, None]
        whole = block_diag(Phi, slope)
        whole[size:, :size] = L @ seen
        believed = np.hstack([np.zeros((n, size)), np.eye(n)])
        return (whole, np.vstack([Gamma, drive]), np.hstack([out, np.zeros((len(out), n))]), believed, estimate)

    def _close(self, Phi: Array, Gamma: Array, y: Array, believed: Array) -> SampledLoop:
        """Controller behind the plant: what it sees, its memory, its heats."""
        M = self.controller
        names = self.law.system.lump_names
        zero = np.zeros((M.modules, len(Phi)))
        around = [believed[names.index(name)] if name in names else np.zeros(len(Phi)) for name in M.around]
        seen = np.vstack([zero, y, believed[list(M.indices)], *(row[None] for row in around)])
        memory, k = len(M.start), len(seen)
        heat = np.hstack([M.heat[:, memory:] @ seen, M.heat[:, :memory]])
        wanted = M.advance[:, memory + k:memory + k + M.modules] + M.advance[:, memory + k + M.modules:]
        own = np.hstack([M.advance[:, memory:memory + k] @ seen, M.advance[:, :memory]]) + wanted @ heat
        A = np.vstack([np.hstack([Phi, np.zeros((len(Phi), memory))]), own])
        return SampledLoop(A, np.vstack([Gamma, np.zeros((memory, Gamma.shape[1]))]), heat, M.sample_time)


def _row(point: RegulatedPoint, plant: System, states: tuple[str, ...]) -> Array:
    """Row of C that reads a sensor of the plant without its delay, or a lump."""
    row = np.zeros(len(states))
    if point.kind == "lump":
        row[plant.lump_names.index(point.name)] = 1.0
        return row
    sensor = plant.sensors[point.name]
    source = f"{point.name}_lag" if sensor.time_constant else sensor.lump
    row[states.index(source)] = sensor.gain
    return row


def law_slopes(law: FeedbackLinearization, temperatures: Array, current: Array) -> tuple[Array, Array]:
    """Derivatives of the currents of a law: by the heats (m, m) [A/W], by all lumps (m, n) [A/K].

    Parameters
    ----------
    law : FeedbackLinearization
        No limit of it is active.
    temperatures : ndarray
        Of all lumps [K].
    current : ndarray
        Currents at that point [A].
    """
    p = law.modules.properties(temperatures)
    S1, R1, K1 = (np.array([getattr(part, key).slope for part in law.modules.parts])
                  for key in ("seebeck", "resistance", "conductance"))
    across, I = p.hot - p.cold, current  # noqa: E741 - I is the current
    by_mean = 0.5 * K1 * across + 0.25 * R1 * I**2 - 0.5 * S1 * p.cold * I  # by the mean temperature of the faces
    by_current = p.R * I - p.S * p.cold
    by_faces = np.zeros((len(I), len(law.system.lumps)))
    for i, (hot, cold) in enumerate(zip(law.modules.hot, law.modules.cold, strict=True)):
        by_faces[i, hot] = -(p.K + by_mean)[i] / by_current[i]
        by_faces[i, cold] = -(by_mean - p.K - p.S * I)[i] / by_current[i]
    return np.diag(1.0 / by_current), by_faces
