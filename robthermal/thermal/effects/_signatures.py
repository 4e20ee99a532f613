"""What signatures of effects share: heat or changed reading per unit of an effect, along a simulated record."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ..._all_pole import all_pole
from .._system import System
from ._response import Array, RecordContext, Response, Signature, Values, Where

# s, what the record resolves of them
TIMES = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0, 30000.0, 100000.0)
CONSTANT = "constant in time: a frequency response does not show it"
ALTERED = "not linear and time-invariant: a frequency response does not show it"


def constant(system: System, where: Where) -> str:
    """Why a frequency response cannot show a constant."""
    return CONSTANT


def altered(system: System, where: Where) -> str:
    """Why a frequency response cannot show what is not linear and time-invariant."""
    return ALTERED


def node(record: RecordContext, name: str) -> tuple[Array, Array]:
    """Temperature of a lump or ambient at the start and at the end of every sample, (n,) [K]."""
    if name in record.system.lumps:
        i = record.system.lump_names.index(name)
        return record.x[:, i], record.end[:, i]
    column = record.u[:, record.system.exogenous_names.index(name)]
    return column, column


def column_of(record: RecordContext, name: str) -> Array:
    """One input of the record, (n,)."""
    return record.u[:, record.system.exogenous_names.index(name)]


def into(record: RecordContext, flows: Mapping[str, tuple[Array, Array]]) -> Response:
    """Heat into lumps by name; what flows into an ambient is lost."""
    lumps = record.system.lump_names
    return Response(heat={lumps.index(name): flow for name, flow in flows.items() if name in record.system.lumps})


def exchanged(flow: Callable[[Array, Array, Values], Array]) -> Signature:
    """Heat flow(T_a, T_b) that flows into a and out of b, `where` = (a, b)."""

    def signature(record: RecordContext, where: Where, values: Values) -> Response:
        (a0, a1), (b0, b1) = node(record, where[0]), node(record, where[1])
        first, last = flow(a0, b0, values), flow(a1, b1, values)
        return into(record, {where[0]: (first, last), where[1]: (-first, -last)})

    return signature


def difference(Ta: Array, Tb: Array, values: Values) -> Array:
    """Heat flow of a conductance of 1 W/K [W]."""
    return Tb - Ta


def by_heat(add: Callable[[System, Where, Values], System], size: str, step: float) -> Signature:
    """Difference of the equations with a small effect and without it: for heat that is linear in the size."""

    def signature(record: RecordContext, where: Where, values: Values) -> Response:
        start, end = record.heat_of(add(record.system, where, {**values, size: step}))
        return Response(heat=(start / step, end / step))

    return signature


def follow(T: Array, tau: float, h: float) -> Array:
    """First-order lag of a signal that is linear between samples, started at rest."""
    p = np.exp(-h / tau)
    ramp = 1.0 - tau / h * (1.0 - p)
    drive = ramp * T[1:] + (1.0 - p - ramp) * T[:-1]
    return all_pole(np.array([1.0, -p]), np.concatenate([T[:1], drive]))


def follow_held(u: Array, tau: float, h: float, start: float) -> Array:
    """First-order lag of a held signal: its value at the start of every sample, (n,)."""
    p = np.exp(-h / tau)
    return all_pole(np.array([1.0, -p]), np.concatenate([[start], (1.0 - p) * u[:-1]]))


def driven_by(record: RecordContext, name: str, v: Array, size: float) -> Response:
    """Heat per unit of size when an input has the mean value v (n,) over every sample instead of its own."""
    u = record.u.copy()
    u[:, record.system.exogenous_names.index(name)] = v
    heat, (start, end) = record.equations.heat, record.own_heat
    return Response(heat=((heat(record.x, u) - start) / size, (heat(record.end, u) - end) / size))


def reading(record: RecordContext, sensor: str, change: Array) -> Response:
    """Change of one sensor's reading (n,) [K]."""
    out = np.zeros_like(record.readings)
    out[:, record.system.sensor_names.index(sensor)] = change
    return Response(reading=out)
