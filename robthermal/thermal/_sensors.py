"""Sensor readings from states: lag (a state), delay, gain about the reference, offset; and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from ._equations import Equations
from ._layout import Layout
from ._terms import Array

Rates = tuple[Array, Array] | None


def source_states(eq: Equations) -> list[int]:
    """State that every sensor reads: its lag state if it has one, else its lump."""
    lags = Layout(eq).sensors
    return [lags.get(name, eq.index[sensor.lump]) for name, sensor in eq.system.sensors.items()]


def reference(eq: Equations) -> float:
    """Temperature about which sensor gains act: the first ambient's nominal one [K]."""
    return next(iter(eq.system.ambients.values())).temperature


def read_sensors(eq: Equations, states: Array, rates: Rates, h: float) -> Array:
    """Noise-free readings (n, n_sensors) [K]."""
    T_ref, columns = reference(eq), []
    for state, sensor in zip(source_states(eq), eq.system.sensors.values(), strict=True):
        source = _delayed(states[:, state], _of(rates, state), sensor.delay, h)
        columns.append(T_ref + sensor.gain * (source - T_ref) + sensor.offset)
    return np.column_stack(columns) if columns else np.zeros((len(states), 0))


def reading_slopes(eq: Equations, states: Array, rates: Rates, slopes: Array, rate_slopes: Rates, names: Sequence[str],
                   h: float) -> Array:
    """Derivative (n, n_sensors, n_parameters) of the readings, given that of the states (n, n_states, n_parameters)."""
    T_ref = reference(eq)
    first = eq.system.ambient_names[0]
    out = np.empty((len(states), len(eq.system.sensors), len(names)))
    for i, (state, (name, sensor)) in enumerate(zip(source_states(eq), eq.system.sensors.items(), strict=True)):
        out[:, i] = sensor.gain * _delayed(slopes[:, state], _of(rate_slopes, state), sensor.delay, h)
        for column, parameter in enumerate(names):
            if parameter == f"sensors.{name}.offset":
                out[:, i, column] += 1.0
            elif parameter == f"sensors.{name}.gain":
                out[:, i, column] += _delayed(states[:, state], _of(rates, state), sensor.delay, h) - T_ref
            elif parameter == f"sensors.{name}.delay" and rates is not None:
                step = 1e-4 * h
                later = _delayed(states[:, state], _of(rates, state), sensor.delay + step, h)
                sooner = _delayed(states[:, state], _of(rates, state), max(sensor.delay - step, 0.0), h)
                out[:, i, column] += sensor.gain * (later - sooner) / (step + min(step, sensor.delay))
            elif parameter == f"sensors.{name}.time_constant" and not sensor.time_constant and rates is not None:
                out[1:, i, column] -= sensor.gain * rates[1][1:, state]  # a short lag τ reads x - τ ẋ
            elif parameter == f"ambients.{first}.temperature":
                out[:, i, column] += 1.0 - sensor.gain
    return out


def read_sampled(eq: Equations, sources: Array, h: float) -> Array:
    """Readings from the sampled temperature (n, n_sensors) of every sensor's lump, for large networks.

    The lump is taken as linear between samples, for which the lag is exact.
    """
    T_ref, columns = reference(eq), []
    for source, sensor in zip(sources.T, eq.system.sensors.values(), strict=True):
        seen = _lag(source, sensor.time_constant, h) if sensor.time_constant else source
        seen = _delayed_linear(seen[:, None], sensor.delay, h)[:, 0]
        columns.append(T_ref + sensor.gain * (seen - T_ref) + sensor.offset)
    return np.column_stack(columns) if columns else np.zeros((len(sources), 0))


def _lag(x: Array, tau: float, h: float) -> Array:
    """First-order lag of a signal that is linear between samples, started at rest."""
    p = np.exp(-h / tau)
    ramp = 1 - tau / h * (1 - p)  # weight of the newest sample
    drive = ramp * x[1:] + (1 - p - ramp) * x[:-1]
    return np.concatenate([x[:1], lfilter([1.0], [1.0, -p], drive, zi=[p * x[0]])[0]])


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
