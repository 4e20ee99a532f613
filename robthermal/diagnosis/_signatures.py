"""Signatures: heat, input or reading per unit of an effect, along a simulated record."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ._along import Along, Response
from ._effect import Add, Signature, Where

Array = NDArray[np.float64]
Values = Mapping[str, float]


def node(path: Along, name: str) -> tuple[Array, Array]:
    """Temperature of a lump or ambient at the start and at the end of every sample, (n,) [K]."""
    if name in path.system.lumps:
        i = path.system.lump_names.index(name)
        return path.x[:, i], path.end[:, i]
    column = path.u[:, path.system.exogenous_names.index(name)]
    return column, column


def into(path: Along, flows: Mapping[str, tuple[Array, Array]]) -> Response:
    """Heat into lumps by name; what flows into an ambient is lost."""
    start, end = np.zeros_like(path.x), np.zeros_like(path.x)
    for name, (first, last) in flows.items():
        if name in path.system.lumps:
            i = path.system.lump_names.index(name)
            start[:, i] += first
            end[:, i] += last
    return Response(heat=(start, end))


def exchanged(law: Callable[[Array, Array, Values], Array]) -> Signature:
    """Heat law(T_a, T_b) that flows into a and out of b, `where` = (a, b)."""

    def signature(path: Along, where: Where, values: Values) -> Response:
        (a0, a1), (b0, b1) = node(path, where[0]), node(path, where[1])
        first, last = law(a0, b0, values), law(a1, b1, values)
        return into(path, {where[0]: (first, last), where[1]: (-first, -last)})

    return signature


def by_heat(add: Add, size: str, step: float) -> Signature:
    """Difference of the equations with a small effect and without it: for effects that are linear heat."""

    def signature(path: Along, where: Where, values: Values) -> Response:
        start, end = path.heat_of(add(path.system, where, {**values, size: step}))
        return Response(heat=(start / step, end / step))

    return signature


def follow(T: Array, tau: float, h: float) -> Array:
    """First-order lag of a signal that is linear between samples, started at rest."""
    p = np.exp(-h / tau)
    ramp = 1.0 - tau / h * (1.0 - p)
    drive = ramp * T[1:] + (1.0 - p - ramp) * T[:-1]
    lagged, _ = lfilter([1.0], [1.0, -p], drive, zi=[p * T[0]])
    return np.concatenate([T[:1], lagged])


def hidden_mass(path: Along, where: Where, values: Values) -> Response:
    """Heat (T_hidden - T) / τ per unit of capacity, T_hidden following T."""
    T, tau = path.x[:, path.system.lump_names.index(where[0])], values["time_constant"]
    flow = (follow(T, tau, path.h) - T) / tau
    return into(path, {where[0]: (flow, np.concatenate([flow[1:], flow[-1:]]))})


def reading(path: Along, sensor: str, change: Array) -> Response:
    """Change of one sensor's reading (n,) [K]."""
    out = np.zeros_like(path.readings)
    out[:, path.system.sensor_names.index(sensor)] = change
    return Response(reading=out)


def sensor_lag(path: Along, where: Where, values: Values) -> Response:
    """(lagged - reading) / τ at the trial τ."""
    y, tau = path.readings[:, path.system.sensor_names.index(where[0])], values["time_constant"]
    return reading(path, where[0], (follow(y, tau, path.h) - y) / tau)


def sensor_offset(path: Along, where: Where, values: Values) -> Response:
    """One kelvin."""
    return reading(path, where[0], np.ones(len(path.x)))


def sensor_gain(path: Along, where: Where, values: Values) -> Response:
    """Distance of the reading from the reference."""
    y = path.readings[:, path.system.sensor_names.index(where[0])]
    return reading(path, where[0], y - path.reference)
