"""The linear part of a system with its sensors' lags and its energy meters, and the ports where nonlinear heat enters.

State z = [lumps, lagged sensor temperatures, heat received from every ambient, electrical energy of every module].
The last two groups feed nothing back: they integrate energies, so that the balance of a simulation can be checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._equations import Equations
from ._parameters import locate
from ._terms import Array, ModuleTerm, Term

LINEAR_FIELDS = {("lumps", "capacity"), ("links", "conductance"), ("modules", "conductance.value"), ("inputs", "gain"),
                 ("sensors", "time_constant")}


@dataclass(frozen=True)
class Augmented:
    """ż = F z + B u + N q, q the nonlinear heats at the ports.

    Parameters
    ----------
    F : ndarray, shape (n_z, n_z)
        [1/s].
    B : ndarray, shape (n_z, n_u)
        Held inputs.
    N : ndarray, shape (n_z, n_q)
        Heat of every term into its first ends, then into its second ends, term by term [K/J].
    ports : ndarray of int
        States whose temperature the terms need.
    """

    F: Array
    B: Array
    N: Array
    ports: NDArray[np.intp]


def lagged(eq: Equations) -> list[str]:
    """Sensors with a lag: each has a state of its own."""
    return [name for name, sensor in eq.system.sensors.items() if sensor.time_constant > 0]


def augment(eq: Equations) -> Augmented:
    """Assemble the augmented linear part (dense: for systems of up to a few hundred lumps)."""
    system, n = eq.system, len(eq.system.lumps)
    lags, na, m = lagged(eq), len(system.ambients), len(system.modules)
    nz, nu = n + len(lags) + na + m, len(system.exogenous_names)
    F, B = np.zeros((nz, nz)), np.zeros((nz, nu))
    F[:n, :n] = eq.A.toarray() / eq.capacity[:, None]
    B[:n] = eq.B.toarray() / eq.capacity[:, None]
    for row, name in enumerate(lags, start=n):
        sensor = system.sensors[name]
        F[row, row] = -1 / sensor.time_constant
        F[row, system.lump_names.index(sensor.lump)] = 1 / sensor.time_constant
    ambient_rows = slice(n + len(lags), n + len(lags) + na)
    conductance = eq.B[:, nu - na:].toarray()
    F[ambient_rows, :n] = -conductance.T
    B[ambient_rows, nu - na:] = np.diag(conductance.sum(axis=0))
    return Augmented(F, B, _port_heat(eq, nz, n + len(lags)), port_lumps(eq))


def port_lumps(eq: Equations) -> NDArray[np.intp]:
    """Lumps that a nonlinear term touches."""
    ends = [end for term in eq.terms for end in (term.a, term.b)]
    nodes = np.unique(np.concatenate(ends)) if ends else np.zeros(0, np.intp)
    return nodes[nodes < len(eq.system.lumps)]


def _port_heat(eq: Equations, nz: int, first_meter: int) -> Array:
    n, na = len(eq.system.lumps), len(eq.system.ambients)
    N, column = np.zeros((nz, sum(2 * len(term.a) for term in eq.terms))), 0
    for term in eq.terms:
        for nodes in (term.a, term.b):
            for pair, node in enumerate(nodes):
                if node < n:
                    N[node, column] = 1 / eq.capacity[node]
                else:  # heat into the ambient: the lumps received as much less
                    N[first_meter + node - n, column] = -1.0
                if isinstance(term, ModuleTerm):
                    N[first_meter + na + pair, column] = 1.0
                column += 1
    return N


def slope(eq: Equations, parts: Augmented, name: str) -> Augmented | None:
    """Derivative of F, B and N with respect to a parameter of the linear part; None when it has no part in it."""
    table, part, field = locate(eq.system, name)
    if (table, field) not in LINEAR_FIELDS:
        return None
    if table == "lumps":
        row = eq.system.lump_names.index(part)
        return _row_scaled(parts, row, -1 / eq.capacity[row])
    if table == "sensors":
        if part not in lagged(eq):
            return None
        row = len(eq.system.lumps) + lagged(eq).index(part)
        return _row_scaled(parts, row, -1 / eq.system.sensors[part].time_constant)
    value = eq.system.parameter(name)  # conductances and gains enter linearly: a difference is exact
    other = augment(Equations(eq.system.with_parameters({name: value + 1.0})))
    return Augmented(other.F - parts.F, other.B - parts.B, other.N - parts.N, parts.ports)


def _row_scaled(parts: Augmented, row: int, factor: float) -> Augmented:
    F, B, N = (np.zeros_like(a) for a in (parts.F, parts.B, parts.N))
    F[row], B[row], N[row] = factor * parts.F[row], factor * parts.B[row], factor * parts.N[row]
    return Augmented(F, B, N, parts.ports)


@dataclass(frozen=True)
class PortHeat:
    """Evaluates all terms on temperatures of the ports, with columns renumbered to [ports, ambients]."""

    terms: tuple[Term, ...]
    columns: tuple[tuple[NDArray[np.intp], NDArray[np.intp]], ...]
    is_module: tuple[bool, ...]

    @classmethod
    def of(cls, eq: Equations, ports: NDArray[np.intp]) -> PortHeat:
        """Renumber the ends of the terms of a system."""
        n = len(eq.system.lumps)
        column = np.full(n + len(eq.system.ambients), -1, np.intp)
        column[ports] = np.arange(ports.size)
        column[n:] = ports.size + np.arange(len(eq.system.ambients))
        return cls(eq.terms, tuple((column[t.a], column[t.b]) for t in eq.terms),
                   tuple(isinstance(t, ModuleTerm) for t in eq.terms))

    def __call__(self, T: Array, current: Array) -> Array:
        """Heats (..., n_q) at temperatures T (..., n_ports + n_ambients)."""
        flows: list[Array] = []
        for term, (a, b), module in zip(self.terms, self.columns, self.is_module, strict=True):
            flows.extend(term.heat(T[..., a], T[..., b], current if module else current[..., :0]))
        return np.concatenate(flows, axis=-1) if flows else np.zeros((*T.shape[:-1], 0))

    def slopes(self, T: Array, current: Array) -> Array:
        """Derivative (..., n_q, n_ports + n_ambients) of the heats with respect to T."""
        total = sum(2 * len(t.a) for t in self.terms)
        out, row = np.zeros((*T.shape[:-1], total, T.shape[-1])), 0
        for term, (a, b), module in zip(self.terms, self.columns, self.is_module, strict=True):
            s = term.slopes(T[..., a], T[..., b], current if module else current[..., :0])
            for to_a, to_b in ((s.aa, s.ab), (s.ba, s.bb)):
                rows = row + np.arange(len(a))
                out[..., rows, a] += to_a
                out[..., rows, b] += to_b
                row += len(a)
        return out


def used_parameters(eq: Equations, names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Split parameter names into those of the linear part and the others."""
    linear = [name for name in names if locate(eq.system, name)[::2] in LINEAR_FIELDS]
    return linear, [name for name in names if name not in linear]
