"""Sensor readings from states and drives, and their derivatives.

A thermometer reads its lump: lag (a state), delay, gain about the reference, offset; in a record of means the mean of
that over the sample before. The voltage of a module follows at once from the temperatures of its faces and from the
current of the same row of the record, or of the row before where it is read before the current is set.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from .._all_pole import all_pole
from ._equations import Equations
from ._layout import Layout
from ._parts import Sensor
from ._terms import Array
from ._voltage import voltages

Rates = tuple[Array, Array] | None
Drives = tuple[Array, Array]  # (n, n_w) just after every sample and just before it


def reference(eq: Equations) -> float:
    """Temperature about which sensor gains act: the first ambient's nominal one [K]."""
    return next(iter(eq.system.ambients.values())).temperature


def _read_from(after: Array, before: Array, sensor: Sensor) -> Array:
    """What a voltage is read with: what holds just after every sample, or just before it."""
    return before if sensor.read == "before" else after


def _currents(eq: Equations, states: Array, w: Drives, sensor: Sensor, column: int) -> Array:
    """Current of a column of the drives (n,): the state of its lag if it has one."""
    lags = Layout(eq).drives
    return states[..., lags[column]] if column in lags else _read_from(*w, sensor)[..., column]


def read_sensors(eq: Equations, states: Array, rates: Rates, w: Drives, h: float) -> Array:
    """Noise-free readings (n, n_sensors) [K or V] from states (n, n_states) and drives of every sample."""
    T_ref, columns = reference(eq), []
    layout, volts = Layout(eq), voltages(eq)
    for name, sensor in eq.system.sensors.items():
        if name in volts:
            current = _currents(eq, states, w, sensor, volts[name].column)
            columns.append(sensor.gain * volts[name].value(states, current) + sensor.offset)
            continue
        source = seen(layout, name, states, rates, sensor.delay, h)
        columns.append(T_ref + sensor.gain * (source - T_ref) + sensor.offset)
    return np.column_stack(columns) if columns else np.zeros((len(states), 0))


def reading_slopes(eq: Equations, states: Array, rates: Rates, w: Drives, slopes: Array, rate_slopes: Rates,
                   held: Mapping[str, Drives], names: Sequence[str], h: float, scale: Array) -> Array:
    """Derivative (n, n_sensors, n_parameters) of the readings, times `scale` (n_parameters,).

    Given are that of the states (n, n_states, n_parameters), and by name that of the drives (n, n_w) of every sample.
    """
    out = np.empty((len(states), len(eq.system.sensors), len(names)))
    layout, volts = Layout(eq), voltages(eq)
    for i, (name, sensor) in enumerate(eq.system.sensors.items()):
        if name in volts:
            out[:, i] = _voltage_slopes(eq, name, states, w, slopes, held, names) * scale
        else:
            np.multiply(sensor.gain * scale, seen(layout, name, slopes, rate_slopes, sensor.delay, h), out=out[:, i])
            _add_own_slopes(out[:, i], layout, name, states, rates, names, h, scale)
    return out


def _voltage_slopes(eq: Equations, name: str, states: Array, w: Drives, slopes: Array, held: Mapping[str, Drives],
                    names: Sequence[str]) -> Array:
    """Derivative (n, n_parameters) of the reading of a voltage."""
    volt, sensor = voltages(eq)[name], eq.system.sensors[name]
    current = _currents(eq, states, w, sensor, volt.column)
    lag = Layout(eq).drives.get(volt.column)
    none = np.zeros(len(states))
    by_current = slopes[:, lag] if lag is not None else np.column_stack(
        [_read_from(*held[parameter], sensor)[:, volt.column] if parameter in held else none for parameter in names])
    out = volt.along(states, current, slopes, by_current)
    for column, parameter in enumerate(names):
        out[:, column] += volt.parameter(parameter, states, current)
    out *= sensor.gain
    for column, parameter in enumerate(names):
        if parameter == f"sensors.{name}.offset":
            out[:, column] += 1.0
        elif parameter == f"sensors.{name}.gain":
            out[:, column] += volt.value(states, current)
    return out


def _add_own_slopes(out: Array, layout: Layout, name: str, states: Array, rates: Rates, names: Sequence[str],
                    h: float, scale: Array) -> None:
    """Add what the parameters of a thermometer, and the reference, change at fixed states (n, n_states)."""
    eq, sensor = layout.eq, layout.eq.system.sensors[name]
    T_ref, first = reference(eq), eq.system.ambient_names[0]
    for column, (parameter, times) in enumerate(zip(names, scale.tolist(), strict=True)):
        if parameter == f"sensors.{name}.offset":
            out[:, column] += times
        elif parameter == f"sensors.{name}.gain":
            out[:, column] += times * (seen(layout, name, states, rates, sensor.delay, h) - T_ref)
        elif parameter == f"sensors.{name}.delay" and rates is not None:
            step = 1e-4 * h
            later = seen(layout, name, states, rates, sensor.delay + step, h)
            sooner = seen(layout, name, states, rates, max(sensor.delay - step, 0.0), h)
            out[:, column] += times * sensor.gain * (later - sooner) / (step + min(step, sensor.delay))
        elif parameter == f"sensors.{name}.time_constant" and not sensor.time_constant and rates is not None:
            # a short lag τ reads x - τ ẋ
            out[1:, column] -= times * sensor.gain * _rate_seen(layout, name, states, rates, h)
        elif parameter == f"ambients.{first}.temperature":
            out[:, column] += times * (1.0 - sensor.gain)


def seen(layout: Layout, name: str, states: Array, rates: Rates, delay: float, h: float) -> Array:
    """What a thermometer without gain and offset reads, (n, ...), of states (n, n_states, ...) or of their slopes.

    At every sample the state it reads, `delay` seconds earlier; or the mean of it over the sample before, from the
    integral. Before the start it was as at the start.
    """
    source = layout.sources[name]
    integral = layout.integrals.get(source)
    if integral is None:
        return _delayed(states[:, source], _of(rates, source), delay, h)
    start = states[:1, source]
    until = _delayed(states[:, integral], _of(rates, integral), delay, h)
    before = np.minimum(h * np.arange(len(states)) - delay, 0.0).reshape(-1, *[1] * (until.ndim - 1))
    return np.concatenate([start, np.diff(until + before * start, axis=0) / h])


def _rate_seen(layout: Layout, name: str, states: Array, rates: tuple[Array, Array], h: float) -> Array:
    """Rate of what a thermometer reads at every sample but the first: just before it, or the mean since the last."""
    source = layout.sources[name]
    return np.diff(states[:, source], axis=0) / h if layout.integrals else rates[1][1:, source]


def lumps_read(eq: Equations) -> list[int]:
    """Lumps that some sensor reads, each once, in their order."""
    faces = [place for volt in voltages(eq).values() for place in (volt.hot, volt.cold)]
    return sorted({*faces, *(eq.index[sensor.lump] for sensor in eq.system.thermometers.values())})


def read_sampled(eq: Equations, kept: Sequence[int], sampled: Array, u: Array, h: float) -> Array:
    """Readings from the sampled temperatures (n, n_kept) of some lumps and the inputs u, for large networks.

    Lumps are taken as linear between samples, for which the lag is exact, and the mean that of both ends.
    """
    T_ref, columns, at = reference(eq), [], {lump: place for place, lump in enumerate(kept)}
    volts = {name: replace(volt, hot=at[volt.hot], cold=at[volt.cold]) for name, volt in voltages(eq).items()}
    for name, sensor in eq.system.sensors.items():
        if name in volts:
            w = eq.drives(u)
            current = _read_from(w, np.concatenate([w[:1], w[:-1]]), sensor)[:, volts[name].column]
            columns.append(sensor.gain * volts[name].value(sampled, current) + sensor.offset)
            continue
        source = sampled[:, at[eq.index[sensor.lump]]]
        read = _lag(source, sensor.initial, sensor.time_constant, h) if sensor.time_constant else source
        read = _delayed_linear(read[:, None], sensor.delay, h)[:, 0]
        if eq.averaged:
            read = np.concatenate([read[:1], 0.5 * (read[1:] + read[:-1])])
        columns.append(T_ref + sensor.gain * (read - T_ref) + sensor.offset)
    return np.column_stack(columns) if columns else np.zeros((len(sampled), 0))


def _lag(x: Array, initial: float | None, tau: float, h: float) -> Array:
    """First-order lag of a signal that is linear between samples, started at rest unless it is said otherwise."""
    p = np.exp(-h / tau)
    ramp = 1 - tau / h * (1 - p)  # weight of the newest sample
    drive = ramp * x[1:] + (1 - p - ramp) * x[:-1]
    return all_pole(np.array([1.0, -p]), np.concatenate([x[:1] if initial is None else [initial], drive]))


def _of(rates: Rates, state: int) -> tuple[Array, Array] | None:
    return None if rates is None else (rates[0][:, state], rates[1][:, state])


def _delayed(x: Array, rate: tuple[Array, Array] | None, delay: float, h: float) -> Array:
    """Value `delay` seconds earlier by cubic Hermite interpolation between samples; before the start the first value.
    """
    if not delay or rate is None:
        return x
    whole = int(np.ceil(delay / h - 1e-12))
    t = whole - delay / h  # position within the interval that ends whole-1 samples ago
    start = np.arange(len(x)) - whole
    k = np.clip(start, 0, len(x) - 2)
    after, before = rate[0][k] * h, rate[1][k + 1] * h
    value = (x[k] * (1 + 2 * t) * (1 - t) ** 2 + x[k + 1] * t**2 * (3 - 2 * t) + after * t * (1 - t) ** 2
             - before * t**2 * (1 - t))
    return np.where((start < 0).reshape(-1, *[1] * (x.ndim - 1)), x[0], value)


def _delayed_linear(s: Array, delay: float, h: float) -> Array:
    """Columns (n, n_columns) delayed by linear interpolation between samples."""
    if not delay:
        return s
    at = np.clip(np.arange(len(s)) - delay / h, 0, len(s) - 1)
    k = np.minimum(at.astype(np.intp), len(s) - 2)
    t = (at - k)[:, None]
    return (1 - t) * s[k] + t * s[k + 1]
