"""Exact derivatives of a simulated trajectory with respect to named parameters, batched over the steps.

Differentiates the discrete scheme itself, so that they are the derivatives of the computed numbers:
dz_(k+1) = F_k dz_k + P_k dθ, with F_k and P_k from one batched linear solve over the port temperatures.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .._recursion import recursion
from ._augmented import slope, without_meters
from ._collocation import DEGREE, Step, step_slopes
from ._exponential import Integrator, Path
from ._parameter_heat import touched
from ._schedule import Schedule
from ._terms import Array

_CHUNK = 1024
_ENTRIES = 60000  # of all matrices F that are differentiated at once: their step matrices have 35 times as many


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
        Names of the parameters of differentiation.
    held : mapping of str to ndarray, shape (n_segments, n_w)
        Derivative of the drives with respect to those parameters that act on them.
    jumps : mapping of str to ndarray, shape (n_segments, n_free)
        What moving the times of jumps adds to the derivative of the state at the start of a segment.
    """

    def __init__(self, integrator: Integrator, names: Sequence[str], held: Mapping[str, Array],
                 jumps: Mapping[str, Array]):
        self.by = integrator
        self.names, self.held, self.jumps = list(names), held, jumps
        self.n_free = integrator.layout.n_free  # meters feed nothing back
        self._linear = {name: part for name in self.names
                        if (part := slope(integrator.layout, integrator.parts, name)) is not None}
        eq = integrator.eq
        self._heating = {name for name in self.names if any(True for _ in touched(eq, name))}
        driving = np.unique(np.concatenate([np.zeros(0, np.intp), *(end for place in integrator.port_heat.places
                                                                    for end in place)])) - integrator.ports.size
        driving = driving[driving >= 0]  # drives that the terms need
        self._driving = {name for name, slopes in held.items() if slopes[:, driving].any()}
        self._columns = [self.names.index(name) for name in self._linear]
        self._steps: dict[tuple[int, int], Array] = {}

    def _step_slopes(self, kind: int, level: int) -> Array:
        """Derivatives of a step's matrices [K Ku M] by all parameters, (columns, rows, P): 0 by those of the heats."""
        if (kind, level) not in self._steps:
            parts, h = without_meters(self.by.parts, self.n_free), self.by.lengths[kind] / 2**level
            size = max(1, _ENTRIES // self.n_free**2)
            every, done = list(self._linear.values()), []
            for first in range(0, len(every), size):
                done.append(step_slopes(parts, every[first:first + size], h))
            by_linear = np.concatenate(done, axis=2)
            self._steps[kind, level] = np.zeros((*by_linear.shape[:2], len(self.names)))
            self._steps[kind, level][..., self._columns] = by_linear
        return self._steps[kind, level]

    def along(self, path: Path, plan: Schedule, start: Array) -> Array:
        """Propagate along a path.

        Parameters
        ----------
        path : Path
            From `Integrator.run`.
        plan : Schedule
            Schedule with the drives of the path.
        start : ndarray, shape (n_z, n_parameters)
            Derivative of the initial state.

        Returns
        -------
        ndarray, shape (n_segments, n_free, n_parameters)
            At the start of every segment, just before a jump.
        """
        out = np.empty((len(plan.w), self.n_free, len(self.names)))
        out[0] = now = start[:self.n_free]
        ends = np.append(path.segment[1:] != path.segment[:-1], True)  # of the last step of every segment
        for first in range(0, len(path.segment), _CHUNK):
            chunk = slice(first, first + _CHUNK)
            maps, segment = self.transitions(path, plan, chunk), path.segment[chunk]
            begins = np.flatnonzero(np.concatenate([[True], ends[:-1]])[chunk])
            for name, jump in self.jumps.items():
                moved = jump[segment[begins], :, None]
                maps.P[begins, :, self.names.index(name)] += (maps.F[begins] @ moved)[..., 0]
            if len(begins) == len(segment):  # one step each
                now = recursion(maps.F, maps.P, now, out[segment[0]:segment[-1] + 2])[-1]
                continue
            states = recursion(maps.F, maps.P, now)
            out[segment[ends[chunk]] + 1] = states[1:][ends[chunk]]
            now = states[-1]
        return out

    def transitions(self, path: Path, plan: Schedule, chunk: slice) -> Transitions:
        """Linear maps of a chunk of steps."""
        n, segment, level = self.n_free, path.segment[chunk], path.level[chunk]
        kind = plan.kind[segment]
        if np.all((kind == kind[0]) & (level == level[0])):
            held = {name: slopes[segment] for name, slopes in self.held.items()}
            return Transitions(*self._of_length(path.starts[chunk], plan.w[segment], held, int(kind[0]), int(level[0])))
        F, P = np.empty((len(segment), n, n)), np.empty((len(segment), n, len(self.names)))
        for which, depth in set(zip(kind.tolist(), level.tolist(), strict=True)):
            own = (kind == which) & (level == depth)
            held = {name: slopes[segment[own]] for name, slopes in self.held.items()}
            F[own], P[own] = self._of_length(path.starts[chunk][own], plan.w[segment[own]], held, which, depth)
        return Transitions(F, P)

    def rate_slopes(self, states: Array, w: Array, slopes: Array, held: Mapping[str, Array]) -> Array:
        """Derivative (n, n_free, n_parameters) of ż at states (n, n_free) that move by slopes, and drives by held."""
        n, parts, ports = self.n_free, self.by.parts, self.by.ports
        V = np.concatenate([states[:, ports], w], axis=1)
        q, G, into = self.by.port_heat(V), self.by.port_heat.slopes(V), parts.N[:n]
        by_state = np.broadcast_to(parts.F[:n, :n], (len(states), n, n)).copy()
        by_state[:, :, ports] += into @ G[:, :, :ports.size]
        out = by_state @ slopes
        for column, name in enumerate(self.names):
            if name in self._linear:
                d = self._linear[name]
                out[..., column] += states @ d.F.T + w @ d.B.T + q @ d.N.T
            if name in held:
                through = np.einsum("nqw,nw->nq", G[..., ports.size:], held[name])
                out[..., column] += held[name] @ parts.B[:n].T + through @ into.T
            heat = self.by.port_heat.parameter(name, V)
            if heat is not None:
                out[..., column] += heat @ into.T
        return out

    def _of_length(self, z: Array, w: Array, held: Mapping[str, Array], kind: int, level: int) -> tuple[Array, Array]:
        nodes, n, march = DEGREE * self.by.ports.size, self.n_free, self.by.compiled(kind, level)
        if not nodes:  # nothing but the linear network
            F, none = np.broadcast_to(self.by.step(kind, level).K[:n, :n], (len(z), n, n)), np.zeros((len(z), 1, 0))
            return F, self._direct(kind, level, z, w, held, none, none, np.zeros((len(z), 1, 0, w.shape[1])))
        found = None if march is None else march.linearized(z, w, n)
        V = self._at_ports(self.by.step(kind, level), z, w) if found is None else found.V
        q = self.by.port_heat(V) if found is None else found.q
        G = self.by.port_heat.slopes(V) if found is None or self._driving else np.zeros(0)  # (S, p+1, nq, np + nw)
        direct = self._direct(kind, level, z, w, held, V, q, G)  # (S, rows, P)
        F, through = self._through(kind, level, G) if found is None else (found.F, found.through)
        return F, direct[:, nodes:nodes + n] + through @ direct[:, :nodes]

    def _through(self, kind: int, level: int, G: Array) -> tuple[Array, Array]:
        """Derivatives of the end by the start, and by what is added to the ports at nodes 1 to p."""
        step, ports = self.by.step(kind, level), self.by.ports
        S, nodes, n = len(G), DEGREE * ports.size, self.n_free
        nodes_by, end_by = self._by_ports(step, G)  # derivatives by the port states at start and nodes
        A = np.eye(nodes) - nodes_by[:, :, 1:].reshape(S, nodes, nodes)
        # The transposed system: as many right-hand sides as states, however many parameters there are.
        through = np.linalg.solve(A.transpose(0, 2, 1), end_by[:, :, 1:].reshape(S, n, nodes).transpose(0, 2, 1))
        through = np.ascontiguousarray(through.transpose(0, 2, 1))
        F = step.K[nodes:nodes + n, :n] + through @ step.K[:nodes, :n]
        F[:, :, ports] += end_by[:, :, 0] + through @ nodes_by[:, :, 0]
        return F, through

    def _by_ports(self, step: Step, G: Array) -> tuple[Array, Array]:
        """Derivatives of the nodes (S, nodes, p + 1, ports) and of the end, by the port states at start and nodes."""
        nodes, n, np_ = DEGREE * self.by.ports.size, self.n_free, self.by.ports.size
        M = step.M[:nodes + n].reshape(nodes + n, DEGREE + 1, self.by.nq)
        out = np.empty((len(G), nodes + n, DEGREE + 1, np_))
        for j in range(DEGREE + 1):
            out[:, :, j] = M[:, j] @ G[:, j, :, :np_]
        return out[:, :nodes], out[:, nodes:]

    def _at_ports(self, step: Step, z: Array, w: Array) -> Array:
        """Nodal port states and drives of a batch of steps, by the same fixed point as the integrator's."""
        by, nodes, np_ = self.by, DEGREE * self.by.ports.size, self.by.ports.size
        base = z @ step.K[:nodes].T + w @ step.Ku[:nodes].T
        V = np.empty((len(z), DEGREE + 1, np_ + w.shape[1]))
        V[..., :np_] = z[:, None, by.ports]
        V[..., np_:] = w[:, None]
        for _ in range(30):
            q = by.port_heat(V).reshape(len(z), (DEGREE + 1) * by.nq)
            new = (base + q @ step.M[:nodes].T).reshape(len(z), DEGREE, np_)
            change = np.abs(new - V[:, 1:, :np_]).max(initial=0.0)
            V[:, 1:, :np_] = new
            if change < 1e-10:
                break
        return V

    def _direct(self, kind: int, level: int, z: Array, w: Array, held: Mapping[str, Array], V: Array, q: Array,
                G: Array) -> Array:
        """Derivative of all rows with respect to all parameters, at fixed port states; 0 by those of the start."""
        step, rows = self.by.step(kind, level), DEGREE * self.by.ports.size + self.n_free
        if self._linear:
            d = self._step_slopes(kind, level)
            by = np.concatenate([z[:, :self.n_free], w, q.reshape(len(z), -1)], axis=1)
            out: Array = (by @ d.reshape(len(d), -1)).reshape(len(z), rows, -1)
        else:
            out = np.zeros((len(z), rows, len(self.names)))
        for column, name in enumerate(self.names):
            heat = self.by.port_heat.parameter(name, V) if name in self._heating else None
            if name in held:
                out[..., column] += held[name] @ step.Ku[:rows].T
            if name in self._driving:
                through_drive = np.einsum("sjqw,sw->sjq", G[..., self.by.ports.size:], held[name])
                heat = through_drive if heat is None else heat + through_drive
            if heat is not None:
                out[..., column] += heat.reshape(len(z), -1) @ step.M[:rows].T
        return out
