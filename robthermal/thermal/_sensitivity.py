"""Exact derivatives of a simulated trajectory with respect to named parameters, batched over the steps.

Differentiates the discrete scheme itself, so that they are the derivatives of the computed numbers:
dz_(k+1) = F_k dz_k + P_k dθ, with F_k and P_k from one batched linear solve over the port temperatures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._augmented import Augmented, slope
from ._collocation import DEGREE, Step, step_matrices
from ._exponential import Integrator, Path
from ._parameters import locate
from ._terms import Array, ModuleTerm, NaturalTerm, RadiationTerm

_CHUNK = 1024
_IMAGINARY = 1e-40


@dataclass(frozen=True)
class Transitions:
    """Linear maps of every step: dz(end) = F dz(start) + P dθ."""

    F: Array
    P: Array


class Sensitivity:
    """Differentiates one integrator with respect to some parameters.

    Parameters
    ----------
    integrator : Integrator
        Whose steps are differentiated.
    names : sequence of str
        Parameter names.
    held : ndarray, shape (n_u, n_parameters)
        Derivative of the held inputs (an ambient that the record lacks).
    """

    def __init__(self, integrator: Integrator, names: Sequence[str], held: Array):
        self.by = integrator
        self.names, self.held = list(names), held
        n = len(integrator.eq.capacity) + sum(s.time_constant > 0 for s in integrator.eq.system.sensors.values())
        self.n_free = n  # meters feed nothing back
        self._linear = {name: part for name in self.names
                        if (part := slope(integrator.eq, integrator.parts, name)) is not None}
        self._steps: dict[tuple[str, int], Step] = {}

    def _step_slope(self, name: str, level: int) -> Step:
        """Derivative of the step matrices by a complex step."""
        if (name, level) not in self._steps:
            parts, d = self.by.parts, self._linear[name]
            moved = Augmented(parts.F + 1j * _IMAGINARY * d.F, parts.B + 1j * _IMAGINARY * d.B,
                              parts.N + 1j * _IMAGINARY * d.N, parts.ports)
            s = step_matrices(moved, self.by.h / 2**level)
            self._steps[name, level] = Step(*(m.imag / _IMAGINARY for m in (s.K, s.Ku, s.M)))
        return self._steps[name, level]

    def along(self, path: Path, u: Array, start: Array) -> Array:
        """Propagate along a path.

        Parameters
        ----------
        path : Path
            From `Integrator.run`.
        u : ndarray, shape (n_samples, n_u)
            Its inputs.
        start : ndarray, shape (n_z, n_parameters)
            Derivative of the initial state.

        Returns
        -------
        ndarray, shape (n_samples, n_free, n_parameters)
        """
        out = np.empty((len(u), self.n_free, len(self.names)))
        out[0] = now = start[:self.n_free]
        for first in range(0, len(path.sample), _CHUNK):
            chunk = slice(first, first + _CHUNK)
            maps = self.transitions(path.starts[chunk], u[path.sample[chunk]], path.level[chunk])
            for i, k in enumerate(path.sample[chunk]):
                now = maps.F[i] @ now + maps.P[i]
                out[k + 1] = now
        return out

    def transitions(self, starts: Array, u: Array, level: NDArray[np.integer]) -> Transitions:
        """Linear maps of steps that start at `starts` (n_steps, n_z) with inputs u (n_steps, n_u)."""
        n = self.n_free
        F, P = np.empty((len(u), n, n)), np.empty((len(u), n, len(self.names)))
        for one in np.unique(level):
            own = level == one
            F[own], P[own] = self._of_level(starts[own], u[own], int(one))
        return Transitions(F, P)

    def _of_level(self, z: Array, u: Array, level: int) -> tuple[Array, Array]:
        step, ports = self.by.step(level), self.by.ports
        nodes, n, np_ = DEGREE * ports.size, self.n_free, ports.size
        T, current = self._port_temperatures(step, z, u)
        q = self.by.port_heat(T, current)
        G = self.by.port_heat.slopes(T, current)  # (S, p+1, nq, np + na)
        direct = self._direct(step, level, z, u, T, current, q, G)  # (S, rows, P)
        S = len(z)
        M = step.M.reshape(step.M.shape[0], DEGREE + 1, self.by.nq)
        coupled = np.empty((S, nodes, DEGREE + 1, np_))
        for j in range(DEGREE + 1):
            coupled[:, :, j] = M[:nodes, j] @ G[:, j, :, :np_]
        A = np.eye(nodes) - coupled[:, :, 1:].reshape(S, nodes, nodes)
        rhs = np.concatenate([np.broadcast_to(step.K[:nodes, :n], (S, nodes, n)), direct[:, :nodes]], axis=2)
        rhs[:, :, ports] += coupled[:, :, 0]
        dT = np.linalg.solve(A, rhs) if nodes else rhs
        at_start = np.zeros((S, np_, dT.shape[2]))
        at_start[:, np.arange(np_), ports] = 1.0
        dT = np.concatenate([at_start, dT], axis=1).reshape(S, DEGREE + 1, np_, dT.shape[2])
        dq = (G[..., :np_] @ dT).reshape(S, (DEGREE + 1) * self.by.nq, dT.shape[-1])
        end = step.M[nodes:nodes + n] @ dq
        return step.K[nodes:nodes + n, :n] + end[:, :, :n], direct[:, nodes:nodes + n] + end[:, :, n:]

    def _port_temperatures(self, step: Step, z: Array, u: Array) -> tuple[Array, Array]:
        """Nodal port temperatures of a batch of steps, by the same fixed point as the integrator's."""
        by, nodes = self.by, DEGREE * self.by.ports.size
        base = z @ step.K[:nodes].T + u @ step.Ku[:nodes].T
        T = np.empty((len(z), DEGREE + 1, by.ports.size + by.n_ambients))
        T[..., :by.ports.size] = z[:, None, by.ports]
        T[..., by.ports.size:] = u[:, None, u.shape[1] - by.n_ambients:]
        current = u[:, None, by.first_current:by.first_current + by.n_modules]
        for _ in range(30):
            q = by.port_heat(T, current).reshape(len(z), (DEGREE + 1) * by.nq)
            new = (base + q @ step.M[:nodes].T).reshape(len(z), DEGREE, by.ports.size)
            change = np.abs(new - T[:, 1:, :by.ports.size]).max(initial=0.0)
            T[:, 1:, :by.ports.size] = new
            if change < 1e-10:
                break
        return T, current

    def _direct(self, step: Step, level: int, z: Array, u: Array, T: Array, current: Array, q: Array,
                G: Array) -> Array:
        """Derivative of all rows with respect to the parameters at fixed port temperatures."""
        out = np.zeros((len(z), step.K.shape[0], len(self.names)))
        flat = q.reshape(len(z), (DEGREE + 1) * self.by.nq)
        ambient = slice(u.shape[1] - self.by.n_ambients, u.shape[1])
        for column, name in enumerate(self.names):
            if name in self._linear:
                d = self._step_slope(name, level)
                out[..., column] = z @ d.K.T + u @ d.Ku.T + flat @ d.M.T
            heat = self._parameter_heat(name, T, current)
            if np.any(self.held[:, column]):
                out[..., column] += step.Ku @ self.held[:, column]
                heat = heat + G[..., self.by.ports.size:] @ self.held[ambient, column]
            if np.any(heat):
                out[..., column] += heat.reshape(len(z), (DEGREE + 1) * self.by.nq) @ step.M.T
        return out

    def _parameter_heat(self, name: str, T: Array, current: Array) -> Array:
        """Derivative (S, p + 1, n_q) of the nodal heats with respect to a parameter of a nonlinear term."""
        system, out = self.by.eq.system, np.zeros((*T.shape[:-1], self.by.nq))
        table, part, field = locate(system, name)
        if table == "modules" and field != "conductance.value":
            kind: type = ModuleTerm
            pair = system.module_names.index(part)
        elif table == "links" and field.startswith("natural"):
            kind, pair = NaturalTerm, [li.name for li in system.links if li.natural is not None].index(part)
        elif table == "links" and field == "radiation":
            kind = RadiationTerm
            pair = [li.name for li in system.links if li.radiation is not None].index(part)
        else:
            return out
        column = 0
        for term, (a, b) in zip(self.by.port_heat.terms, self.by.port_heat.columns, strict=True):
            if isinstance(term, kind):
                through = current if kind is ModuleTerm else T[..., :0]
                flows = term.parameter_slopes(field, T[..., a], T[..., b], through)
                for side, flow in enumerate(flows):
                    out[..., column + side * len(a) + pair] = np.broadcast_to(flow, T[..., a].shape)[..., pair]
            column += 2 * len(a)
        return out
