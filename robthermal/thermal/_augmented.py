"""The linear part of a simulation: lumps, lags, memories, periodic loads and energy meters, and its derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ._equations import Equations
from ._layout import Layout
from ._parameter_heat import AFFINE, unit_change
from ._parameters import locate
from ._ports import PortHeat
from ._terms import Array


@dataclass(frozen=True)
class Augmented:
    """ż = F z + B w + N q, q the nonlinear heats by target.

    Parameters
    ----------
    F : ndarray, shape (n_z, n_z)
        Matrix of the linear dynamics [1/s].
    B : ndarray, shape (n_z, n_w)
        Effect of the drives, constant over a segment, on the states.
    N : ndarray, shape (n_z, n_q)
        Heat of every target [K/J].
    ports : ndarray of int
        States that the terms need.
    """

    F: Array
    B: Array
    N: Array
    ports: NDArray[np.intp]


def augment(eq: Equations, layout: Layout, heat: PortHeat) -> Augmented:
    """Assemble the augmented linear part (dense: for systems of up to a few hundred lumps)."""
    n, nz = len(eq.system.lumps), layout.size
    F, D = np.zeros((nz, nz)), np.zeros((nz, eq.drives.width))
    F[:n, :n], D[:n] = (dense / eq.capacity[:, None] for dense in eq.dense)
    _sensors(eq, layout, F)
    for source, integral in layout.integrals.items():
        F[integral, source] = 1.0
    _meters(eq, layout, F, D)
    _memories(eq, layout, F, D)
    _periodic(eq, layout, F)
    for column, state in layout.drives.items():  # what a lagged drive heats, its state heats
        tau = eq.drives.of[column].time_constant
        F[:, state] += D[:, column]
        D[:, column] = 0.0
        F[state, state], D[state, column] = -1 / tau, 1 / tau
    return Augmented(F, D, heat.N, heat.ports)


def _sensors(eq: Equations, layout: Layout, F: Array) -> None:
    for name, state in layout.sensors.items():
        sensor = eq.system.sensors[name]
        F[state, state] = -1 / sensor.time_constant
        F[state, eq.index[sensor.lump]] = 1 / sensor.time_constant


def _meters(eq: Equations, layout: Layout, F: Array, D: Array) -> None:
    n, ambients = len(eq.capacity), eq.drives.ambients
    conductance = eq.dense[1][:, ambients]
    F[layout.ambient_meters, :n] = eq.carried - conductance.T
    D[layout.ambient_meters, ambients] = np.diag(conductance.sum(axis=0))
    D[layout.ambient_meters, eq.drives.one] = conductance.T @ eq.gradient
    for i, heater in enumerate(eq.system.inputs.values()):
        D[layout.heater_meters.start + i, i] = heater.gain
    own = sum(lump.heat for lump in eq.system.lumps.values())
    D[layout.source_meter, eq.drives.one] = own + sum(sensor.self_heating for sensor in eq.system.sensors.values())


def _memories(eq: Equations, layout: Layout, F: Array, D: Array) -> None:
    for name, state in layout.memories.items():
        module = eq.system.modules[name]
        if module.hysteresis is not None:
            tau, heat, cold = module.hysteresis.time_constant, module.hysteresis.heat, eq.index[module.cold]
            F[state, state], D[state, eq.drives.signs[name]] = -1 / tau, 1 / tau
            F[cold, state] += heat / eq.capacity[cold]
            F[layout.source_meter, state] += heat


def _periodic(eq: Equations, layout: Layout, F: Array) -> None:
    for name, sine in layout.periodic.items():
        load, lump = eq.system.lumps[name].periodic, eq.index[name]
        if load is not None:
            F[sine, sine + 1], F[sine + 1, sine] = 2 * np.pi / load.period, -2 * np.pi / load.period
            F[lump, sine] += load.heat / eq.capacity[lump]
            F[layout.source_meter, sine] += load.heat


def without_meters(parts: Augmented, n_free: int) -> Augmented:
    """The states before the meters, which feed nothing back."""
    return Augmented(parts.F[:n_free, :n_free], parts.B[:n_free], parts.N[:n_free], parts.ports)


def slope(layout: Layout, parts: Augmented, name: str) -> Augmented | None:
    """Derivative of F, B and N by a parameter of the linear part, meters left out; None when it has no part in it."""
    eq = layout.eq
    table, part, field = locate(eq.system, name)
    own = without_meters(parts, layout.n_free)
    if (table, field) == ("links", "conductance"):
        return _slope_by_conductance(eq, own, next(x for x in eq.system.links if x.name == part).between)
    if (table, field) == ("modules", "conductance.value"):
        return _slope_by_conductance(eq, own, (eq.system.modules[part].hot, eq.system.modules[part].cold))
    if (table, field) in AFFINE:  # a difference is exact
        changed, step = unit_change(eq.system, name)
        changed_eq = replace(eq, system=changed)
        changed_layout = Layout(changed_eq)
        other = without_meters(augment(changed_eq, changed_layout, PortHeat.of(changed_eq, changed_layout)), len(own.F))
        differences = ((other.F - own.F) / step, (other.B - own.B) / step, (other.N - own.N) / step)
        return Augmented(*differences, parts.ports)
    rows = _rows_of_scale(layout, table, part, field)
    return _rows_scaled(own, rows, -1 / eq.system.parameter(name)) if rows else None


def _slope_by_conductance(eq: Equations, parts: Augmented, between: tuple[str, str]) -> Augmented:
    """A linear conductance brings (T_b - T_a) / C_a into a, and as much the other way into b."""
    F, B, n = np.zeros_like(parts.F), np.zeros_like(parts.B), len(eq.capacity)
    a, b = (eq.index[node] for node in between)
    for node, other in ((a, b), (b, a)):
        if node < n:
            F[node, node] -= 1 / eq.capacity[node]
        if node < n and other < n:
            F[node, other] += 1 / eq.capacity[node]
        elif node < n:
            B[node, eq.drives.ambients.start + other - n] += 1 / eq.capacity[node]
            B[node, eq.drives.one] += eq.gradient[node] / eq.capacity[node]
    return Augmented(F, B, np.zeros_like(parts.N), parts.ports)


def _rows_of_scale(layout: Layout, table: str, part: str, field: str) -> list[int]:
    """Rows that are inversely proportional to a capacity, a time constant or a period."""
    eq = layout.eq
    if (table, field) == ("lumps", "capacity"):
        return [eq.index[part]]
    if (table, field) == ("lumps", "periodic.period"):
        return [layout.periodic[part], layout.periodic[part] + 1]
    if (table, field) == ("modules", "hysteresis.time_constant"):
        return [layout.memories[part]]
    if (table, field) == ("sensors", "time_constant") and part in layout.sensors:
        return [layout.sensors[part]]
    if field == "drive.time_constant" and eq.drives.column[part] in layout.drives:
        return [layout.drives[eq.drives.column[part]]]
    return []


def _rows_scaled(parts: Augmented, rows: list[int], factor: float) -> Augmented:
    F, B, N = (np.zeros_like(a) for a in (parts.F, parts.B, parts.N))
    F[rows], B[rows], N[rows] = factor * parts.F[rows], factor * parts.B[rows], factor * parts.N[rows]
    return Augmented(F, B, N, parts.ports)
