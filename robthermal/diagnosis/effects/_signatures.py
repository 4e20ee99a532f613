"""Signatures: heat or changed reading per unit of an effect, along a simulated record."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ._effect import Add, Signature, Where
from ._response import Response

if TYPE_CHECKING:
    from ..path import Along

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
    """Difference of the equations with a small effect and without it: for heat that is linear in the size."""

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


def follow_held(u: Array, tau: float, h: float, start: float) -> Array:
    """First-order lag of a held signal: its value at the start of every sample, (n,)."""
    p = np.exp(-h / tau)
    lagged, _ = lfilter([1.0 - p], [1.0, -p], u[:-1], zi=[p * start])
    return np.concatenate([[start], lagged])


def hidden_mass(path: Along, where: Where, values: Values) -> Response:
    """Heat (T_hidden - T) / τ per unit of capacity, T_hidden following T."""
    T, tau = path.x[:, path.system.lump_names.index(where[0])], values["time_constant"]
    flow = (follow(T, tau, path.h) - T) / tau
    return into(path, {where[0]: (flow, np.concatenate([flow[1:], flow[-1:]]))})


def hysteresis(path: Along, where: Where, values: Values) -> Response:
    """The memory of the polarity, per watt, into the cold face."""
    current = path.u[:, path.system.exogenous_names.index(where[0])]
    memory = follow_held(np.sign(current), values["time_constant"], path.h, 0.0)
    cold = path.system.modules[where[0]].cold
    return into(path, {cold: (memory, np.concatenate([memory[1:], memory[-1:]]))})


def periodic(path: Along, where: Where, values: Values) -> Response:
    """A sine of one watt."""
    rate = 2.0 * np.pi / values["period"]
    return into(path, {where[0]: (np.sin(rate * path.time + values["phase"]),
                                  np.sin(rate * (path.time + path.h) + values["phase"]))})


def conductance_step(path: Along, where: Where, values: Values) -> Response:
    """The link's own linear heat from that time on; the sample in which it begins counts in part."""
    link = next(link for link in path.system.links if link.name == where[0])
    (a0, a1), (b0, b1) = node(path, link.between[0]), node(path, link.between[1])
    share = link.conductance * np.clip((path.time + path.h - values["time"]) / path.h, 0.0, 1.0)
    first, last = share * (b0 - a0), share * (b1 - a1)
    return into(path, {link.between[0]: (first, last), link.between[1]: (-first, -last)})


def driven(path: Along, name: str, v: Array, size: float) -> Response:
    """Heat per unit of size when an input has the mean value v (n,) over every sample instead of its own."""
    u = path.u.copy()
    u[:, path.system.exogenous_names.index(name)] = v
    heat = path.equations.heat
    return Response(heat=((heat(path.x, u) - heat(path.x, path.u)) / size,
                          (heat(path.end, u) - heat(path.end, path.u)) / size))


def input_lag(path: Along, where: Where, values: Values) -> Response:
    """The mean over every sample of the lagged input, at the trial τ."""
    u, tau = path.u[:, path.system.exogenous_names.index(where[0])], values["time_constant"]
    start = follow_held(u, tau, path.h, float(u[0]))
    return driven(path, where[0], u + (start - u) * (tau / path.h) * (1.0 - np.exp(-path.h / tau)), tau)


def input_delay(path: Along, where: Where, values: Values) -> Response:
    """The mean over every sample of the delayed input, at the trial delay."""
    u, delay = path.u[:, path.system.exogenous_names.index(where[0])], values["delay"]
    whole, part = divmod(delay / path.h, 1.0)
    k = np.arange(u.size) - int(whole)
    late = part * u[np.maximum(k - 1, 0)] + (1.0 - part) * u[np.maximum(k, 0)]
    return driven(path, where[0], late, delay)


def input_clip(path: Along, where: Where, values: Values) -> Response:
    """What a clip at the trial level cuts off, per unit of that level: the size is the level itself."""
    u, level = path.u[:, path.system.exogenous_names.index(where[0])], values["clip"]
    return driven(path, where[0], np.clip(u, -level, level), level)


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
    """Distance of the reading from the reference, per unit of the sensor's own gain."""
    sensor = path.system.sensors[where[0]]
    y = path.readings[:, path.system.sensor_names.index(where[0])]
    return reading(path, where[0], (y - sensor.offset - path.reference) / sensor.gain)
