"""The nonlinear heats as one function of what they need: V = [states at the ports, w]."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ._equations import Equations
from ._layout import Layout
from ._parameter_heat import term_derivative, touched
from ._terms import Array, Indices, Term


@dataclass(frozen=True)
class PortHeat:
    """Evaluates all terms and adds up their heats by target: a lump, or an energy meter.

    Parameters
    ----------
    eq : Equations
        Equations whose terms are evaluated.
    ports : ndarray of int
        States that the terms need: lumps, lagged drives.
    N : ndarray, shape (n_z, n_q)
        What each target's heat does to the states [K/J, or 1 for meters].
    places : tuple
        Columns of V of every term: ends a, b, drive.
    scatter : ndarray, shape (n_flows, n_q)
        Which flow goes to which target; flows run term by term, first into a, then into b.
    """

    eq: Equations
    ports: Indices
    N: Array
    places: tuple[tuple[Indices, Indices, Indices], ...]
    scatter: Array

    @classmethod
    def of(cls, eq: Equations, layout: Layout) -> PortHeat:
        """Number ports, columns and targets of a system."""
        ports = _ports(eq, layout)
        rows = [_targets(eq, layout, term) for term in eq.terms]
        flat = [pair for term in rows for side in term for pair in side]
        used = sorted({row for pair in flat for row in pair})
        scatter = np.zeros((len(flat), len(used)))
        for flow, pair in enumerate(flat):
            scatter[flow, [used.index(row) for row in pair]] = 1.0
        N = np.zeros((layout.size, len(used)))
        for column, row in enumerate(used):
            N[row, column] = 1 / eq.capacity[row] if row < len(eq.capacity) else 1.0
            if layout.ambient_meters.start <= row < layout.ambient_meters.stop:
                N[row, column] = -1.0  # heat into the ambient: the lumps received as much less
        return cls(eq, ports, N, tuple(_places(eq, layout, ports, term) for term in eq.terms), scatter)

    def __call__(self, V: Array) -> Array:
        """Heats (..., n_q) at V (..., n_ports + n_w)."""
        return self.flows(V) @ self.scatter

    def flows(self, V: Array) -> Array:
        """Heats before they are added up by target (..., n_flows) at V (..., n_ports + n_w)."""
        flows: list[Array] = []
        for term, (a, b, drive) in zip(self.eq.terms, self._views, strict=True):
            flows.extend(term.heat(V[..., a], V[..., b], V[..., drive]))
        return np.concatenate(flows, axis=-1) if flows else np.zeros((*V.shape[:-1], 0))

    @cached_property
    def _views(self) -> list[tuple[Indices | slice, ...]]:
        """`places`, as slices where they are evenly spaced: this is the innermost loop, and a view costs little."""
        return [tuple(map(_view, place)) for place in self.places]

    def slopes(self, V: Array) -> Array:
        """Derivative (..., n_q, n_ports + n_w) of the heats with respect to V."""
        out, row = np.zeros((*V.shape[:-1], len(self.scatter), V.shape[-1])), 0
        for term, (a, b, drive) in zip(self.eq.terms, self.places, strict=True):
            s = term.slopes(V[..., a], V[..., b], V[..., drive])
            for to_a, to_b, by_drive in ((s.aa, s.ab, s.a_drive), (s.ba, s.bb, s.b_drive)):
                rows = row + np.arange(len(a))
                out[..., rows, a] += to_a
                out[..., rows, b] += to_b
                if drive.size:
                    out[..., rows, drive] += by_drive
                row += len(a)
        return self.scatter.T @ out

    def parameter(self, name: str, V: Array) -> Array | None:
        """Derivative (..., n_q) with respect to a parameter of the terms; None where it acts on none."""
        flows: Array | None = None
        first = np.concatenate([[0], np.cumsum([2 * len(term.a) for term in self.eq.terms])]).astype(np.intp)
        for number, pair, field in touched(self.eq, name):
            flows = np.zeros((*V.shape[:-1], len(self.scatter))) if flows is None else flows
            term, (a, b, drive) = self.eq.terms[number], self.places[number]
            sides = term_derivative(term, field, V[..., a], V[..., b], V[..., drive])
            for side, flow in enumerate(sides):
                flows[..., first[number] + side * len(a) + pair] += flow[..., pair]
        return None if flows is None else flows @ self.scatter


def _view(place: Indices) -> Indices | slice:
    steps = np.diff(place)
    if not place.size or np.any(steps != steps[:1]) or np.any(steps <= 0):
        return place
    return slice(int(place[0]), int(place[-1]) + 1, int(steps[0]) if steps.size else 1)


def _ports(eq: Equations, layout: Layout) -> NDArray[np.intp]:
    ends = [end for term in eq.terms for end in (term.a, term.b)]
    nodes = np.unique(np.concatenate(ends)) if ends else np.zeros(0, np.intp)
    driving = {int(column) for term in eq.terms for column in term.drive} & set(layout.drives)
    return np.concatenate([nodes[nodes < len(eq.capacity)],
                           np.array(sorted(layout.drives[c] for c in driving), np.intp)])


def _targets(eq: Equations, layout: Layout, term: Term) -> list[list[list[int]]]:
    """States that receive every pair's heat, at end a and at end b."""
    first = {"modules": layout.module_meters.start, "inputs": layout.heater_meters.start}
    sides = []
    for nodes in (term.a, term.b):
        side = []
        for pair, node in enumerate(nodes):
            row = int(node) if node < len(eq.capacity) else layout.ambient_meters.start + int(node) - len(eq.capacity)
            meter = [first[term.supply] + int(term.supply_index[pair])] if term.supply in first else []
            side.append([row, *meter, *([layout.source_meter] if term.supply == "sources" else [])])
        sides.append(side)
    return sides


def _places(eq: Equations, layout: Layout, ports: Indices, term: Term) -> tuple[Indices, Indices, Indices]:
    n, place = len(eq.capacity), {int(state): i for i, state in enumerate(ports)}
    of_node = [place[node] if node < n else ports.size + eq.drives.ambients.start + node - n
               for node in map(int, np.concatenate([term.a, term.b]))]
    of_drive = [place[layout.drives[column]] if column in layout.drives else ports.size + column
                for column in map(int, term.drive)]
    a, b = (np.array(of_node[start:stop], np.intp) for start, stop in pairwise((0, len(term.a), 2 * len(term.a))))
    return a, b, np.array(of_drive, np.intp)
