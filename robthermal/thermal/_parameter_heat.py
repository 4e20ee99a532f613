"""Derivative of the heats with respect to any named parameter, from one table of what acts where."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ._effect_terms import HeaterTerm
from ._parameters import locate
from ._terms import Array, LinkTerm, Term

if TYPE_CHECKING:
    from ._equations import Equations
    from ._system import System

# the linear equations are affine in each of these, so that a difference is an exact derivative
AFFINE = {("links", "conductance"), ("flows", "conductance"), ("modules", "conductance.value"),
          ("modules", "hysteresis.heat"), ("inputs", "gain"), ("inputs", "feedthrough.share"), ("lumps", "heat"),
          ("lumps", "gradient"), ("lumps", "periodic.heat"), ("sensors", "self_heating")}
Flows = tuple[Array, Array]


def unit_change(system: System, name: str) -> tuple[System, float]:
    """Copy with one parameter changed by a step that it accepts, and that step."""
    value, field = system.parameter(name), locate(system, name)[2]
    step = -1.0 if field == "feedthrough.share" and value > 0 else 1.0
    return system.with_parameters({name: value + step}), step


def touched(eq: Equations, name: str) -> Iterator[tuple[int, int, str]]:
    """Number of every term and pair that a parameter acts on, and under which field."""
    table, part, field = locate(eq.system, name)
    n = len(eq.system.lumps)
    for number, term in enumerate(eq.terms):
        if table == term.table and field in term.fields:
            yield from ((number, pair, field) for pair, owner in enumerate(term.components) if owner == part)
        elif (table, field) == ("lumps", "gradient") and (isinstance(term, LinkTerm) or term.table == "links"):
            for pair, (a, b) in enumerate(zip(term.a, term.b, strict=True)):
                if a == eq.index[part] and b >= n:
                    yield number, pair, "end_b"
                if b == eq.index[part] and a >= n:
                    yield number, pair, "end_a"
        elif table == "ambients" and isinstance(term, HeaterTerm) and part == eq.system.ambient_names[0]:
            yield from ((number, pair, "reference") for pair in range(len(term.a)))


def term_derivative(term: Term, field: str, Ta: Array, Tb: Array, drive: Array) -> Flows:
    """Derivative of a term's heats by a parameter, or by the temperature of an end ("end_a", "end_b")."""
    if field in ("end_a", "end_b"):
        s = term.slopes(Ta, Tb, drive)
        return (s.aa, s.ba) if field == "end_a" else (s.ab, s.bb)
    into_a, into_b = term.parameter_slopes(field, Ta, Tb, drive)
    return np.broadcast_to(into_a, Ta.shape), np.broadcast_to(into_b, Ta.shape)


def parameter_heat(eq: Equations, name: str, x: Array, u: Array) -> list[tuple[int, Array]]:
    """As `Equations.parameter_heat`."""
    table, part, field = locate(eq.system, name)
    if field == "capacity":
        i = eq.index[part]
        return [(i, -eq.heat(x, u)[..., i] / eq.capacity[i])]
    w = eq.drives(u)
    total = np.zeros(x.shape, np.result_type(x, w, float))
    if (table, field) in AFFINE:
        changed, step = unit_change(eq.system, name)
        other = replace(eq, system=changed)
        total = total + ((other.A - eq.A) @ x.T + (other.settled - eq.settled) @ w.T).T / step
    for number, pair, what in touched(eq, name):
        term = eq.terms[number]
        flows = term_derivative(term, what, *eq.driven(term, x, w))
        for node, flow in zip((term.a[pair], term.b[pair]), flows, strict=True):
            if node < len(eq.capacity):
                total[..., node] += flow[..., pair]
    dw = _drive_slope(eq, name, w, u)
    if dw is not None:
        total = total + _input_heat(eq, x, w, dw)
    nonzero = np.flatnonzero(np.any(total.reshape(-1, total.shape[-1]) != 0, axis=0))
    return [(int(i), total[..., i]) for i in nonzero]


def _drive_slope(eq: Equations, name: str, w: Array, u: Array) -> Array | None:
    """Derivative of w: of a drive's parameter, or of an ambient that no record gives."""
    table, part, _ = locate(eq.system, name)
    if table != "ambients":
        return eq.drives.parameter(name, u)
    dw = np.zeros(w.shape)
    dw[..., eq.drives.column[part]] = 1.0
    return dw


def _input_heat(eq: Equations, x: Array, w: Array, dw: Array) -> Array:
    """Change of the heats with a change of w."""
    total: Array = (eq.D @ dw.T).T.astype(np.result_type(x, w, float)) + np.zeros(x.shape)
    nodes = np.concatenate([np.zeros((*dw.shape[:-1], len(eq.capacity))), dw[..., eq.drives.ambients]], axis=-1)
    for term in eq.terms:
        s = term.slopes(*eq.driven(term, x, w))
        da, db = nodes[..., term.a], nodes[..., term.b]
        into_a, into_b = s.aa * da + s.ab * db, s.ba * da + s.bb * db
        if term.drive.size:
            by = dw[..., term.drive]
            into_a, into_b = into_a + s.a_drive * by, into_b + s.b_drive * by
        for node, flow in ((term.a, into_a), (term.b, into_b)):
            add_to_lumps(total, node, flow)
    return total


def add_to_lumps(total: Array, nodes: NDArray[np.intp], flow: Array) -> None:
    """Add flow (..., n_pairs) to the lumps among nodes; several pairs may share a lump."""
    keep = nodes < total.shape[-1]
    if total.ndim == 2 and np.unique(nodes[keep]).size == keep.sum():  # along a record, as fast as it goes
        total[:, nodes[keep]] += flow[:, keep]
        return
    np.add.at(total, (..., nodes[keep]), flow[..., keep])  # type: ignore[arg-type]  # numpy's stub knows no index tuple
