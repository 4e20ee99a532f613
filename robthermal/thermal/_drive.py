"""What drives a simulation: held inputs and the initial state, taken from a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._celsius import LOWEST_KELVIN
from ..errors import InputError
from ..signals import Record
from ._checks import by_lump
from ._equations import Equations
from ._layout import Layout
from ._schedule import Schedule
from ._terms import Array

Initial = ArrayLike | Mapping[str, float] | None


def record_of(record: Record) -> Record:
    """A record, refusing what is not one."""
    if not isinstance(record, Record):
        raise InputError(f"record is a {type(record).__name__}", where="argument record",
                         expected="a robthermal.Record", remedy="Read one with rt.read_record(path, system).")
    return record


def held_inputs(eq: Equations, record: Record) -> Array:
    """Matrix u (n_samples, n_u) of a record, in the order of `System.exogenous_names`."""
    record_of(record)
    columns, missing = [], []
    for name, nominal in zip(eq.system.exogenous_names, eq.nominal(), strict=True):
        if name in record.input_names:
            columns.append(record[name])
        elif name in eq.system.ambients:
            columns.append(np.full(record.n_samples, nominal))
        else:
            missing.append(name)
    if missing:
        raise InputError(f"the record has no column {', '.join(map(repr, missing))}", where="argument record",
                         expected="a column for every heater and module of the system",
                         remedy="Add it; a column of zeros says that it was off.")
    u = np.column_stack(columns)
    _no_celsius(eq, u)
    return u


def _no_celsius(eq: Equations, u: Array) -> None:
    for offset, name in enumerate(reversed(eq.system.ambient_names), start=1):
        low = u[:, -offset].min()
        if low < LOWEST_KELVIN:
            raise InputError(f"ambient {name!r} falls to {low:.6g} K", where="argument record",
                             expected="kelvin inside a Record", remedy="Add 273.15, or read the file with its unit.")


def start_state(eq: Equations, record: Record, initial: Initial, plan: Schedule) -> Array:
    """Augmented state at the first sample; see `Lump.initial` for the default."""
    layout = Layout(eq)
    z = np.zeros(layout.size)
    z[:len(eq.capacity)] = start_lumps(eq, record, initial)
    settle(eq, layout, z, plan.w[0], record.start_time)
    return z


def start_lumps(eq: Equations, record: Record, initial: Initial) -> Array:
    """Temperatures of the lumps at the first sample."""
    lumps = _given(eq, initial)
    return _default(eq, record) if lumps is None else lumps


def settle(eq: Equations, layout: Layout, z: Array, w: Array, time: float) -> None:
    """States beside the lumps at the start.

    Lags are settled unless it is said otherwise, no polarity is remembered, periodic loads go by the clock.
    """
    for name, state in layout.sensors.items():
        sensor = eq.system.sensors[name]
        z[state] = z[eq.index[sensor.lump]] if sensor.initial is None else sensor.initial
    for column, state in layout.drives.items():
        u = _before(eq, column)
        z[state] = w[column] if u is None else eq.drives(u)[column]
    for name, sine in layout.periodic.items():
        angle = _angle(eq, name, time)
        z[sine], z[sine + 1] = np.sin(angle), np.cos(angle)


def _angle(eq: Equations, lump: str, time: float) -> float:
    load = eq.system.lumps[lump].periodic
    return 0.0 if load is None else 2 * np.pi * time / load.period + load.phase


def start_slope(eq: Equations, record: Record, initial: Initial, names: Sequence[str],
                held: Mapping[str, Array]) -> Array:
    """Derivative of `start_state` with respect to named parameters, (n_z, n_parameters)."""
    layout = Layout(eq)
    out = np.zeros((layout.size, len(names)))
    if initial is None:
        _lumps_slope(eq, record, names, out)
    for column, name in enumerate(names):
        for sensor, row in layout.sensors.items():
            part = eq.system.sensors[sensor]
            settled = part.initial is None
            out[row, column] = out[eq.index[part.lump], column] if settled else name == f"sensors.{sensor}.initial"
        for drive, row in layout.drives.items():
            out[row, column] = _settled_slope(eq, drive, name, held)
        for lump, sine in layout.periodic.items():
            load, angle = eq.system.lumps[lump].periodic, _angle(eq, lump, record.start_time)
            turn = 0.0
            if name == f"lumps.{lump}.periodic.phase":
                turn = 1.0
            elif name == f"lumps.{lump}.periodic.period" and load is not None:
                turn = -2 * np.pi * record.start_time / load.period**2
            out[sine, column], out[sine + 1, column] = turn * np.cos(angle), -turn * np.sin(angle)
    return out


def _before(eq: Equations, column: int) -> Array | None:
    """Exogenous vector with the value that a drive had before the record; None if that is its first one."""
    before = eq.drives.of[column].before
    if before is None:
        return None
    u = np.zeros(eq.drives.n_u)
    u[column] = before
    return u


def _settled_slope(eq: Equations, column: int, name: str, held: Mapping[str, Array]) -> float:
    """Derivative of the start of a lagged drive by a parameter."""
    u = _before(eq, column)
    if u is None:
        return float(held[name][0, column]) if name in held else 0.0
    if name == _name_of_before(eq, column):
        return float(eq.drives.slopes(u)[column])
    slopes = eq.drives.parameter(name, u)
    return 0.0 if slopes is None else float(slopes[column])


def _name_of_before(eq: Equations, column: int) -> str:
    name = eq.system.exogenous_names[column]
    return f"{'inputs' if name in eq.system.inputs else 'modules'}.{name}.drive.before"


def _lumps_slope(eq: Equations, record: Record, names: Sequence[str], out: Array) -> None:
    first = eq.system.ambient_names[0]
    from_ambient = first not in record.input_names and not _measured(eq, record)
    for column, name in enumerate(names):
        for i, (lump, part) in enumerate(eq.system.lumps.items()):
            own = name == f"lumps.{lump}.initial" and part.initial is not None
            shared = name == f"ambients.{first}.temperature" and part.initial is None and from_ambient
            out[i, column] = float(own or shared)


def held_slopes(eq: Equations, record: Record, names: Sequence[str], plan: Schedule) -> dict[str, Array]:
    """Derivative (n_segments, n_w) of the drives with respect to each parameter that acts on them."""
    found: dict[str, Array] = {}
    for name in names:
        dw = eq.drives.parameter(name, plan.u)
        if dw is not None:
            found[name] = dw
    for column, drive in eq.drives.of.items():
        if drive.delay and drive.before is not None and (name := _name_of_before(eq, column)) in names:
            found[name] = np.zeros(plan.w.shape)
            found[name][:, column] = eq.drives.slopes(plan.u)[:, column] * plan.before(drive.delay)
    for module, column in eq.drives.ripples.items():
        name, lag = f"modules.{module}.drive.time_constant", eq.system.modules[module].drive.time_constant
        if name in names and lag:
            found.setdefault(name, np.zeros(plan.w.shape))
            found[name][:, column] = -12.0 * lag / (plan.lengths[0] ** 2 + 12.0 * lag**2) * plan.w[:, column]
    for ambient in eq.system.ambients:  # an ambient that the record lacks is a parameter
        name = f"ambients.{ambient}.temperature"
        if name in names and ambient not in record.input_names:
            found[name] = np.zeros(plan.w.shape)
            found[name][:, eq.drives.column[ambient]] = 1.0
    return found


def _given(eq: Equations, initial: Initial) -> NDArray[np.float64] | None:
    if initial is None:
        return None
    names = eq.system.lump_names
    if isinstance(initial, Mapping):
        initial = by_lump(initial, names, "initial")
    values = np.asarray(initial, float)
    if values.shape not in ((), (len(names),)) or not np.isfinite(values).all() or values.min() < LOWEST_KELVIN:
        raise InputError(f"initial has shape {values.shape}, smallest value {values.min(initial=np.inf):.6g}",
                         where="argument initial", expected=f"one or {len(names)} finite temperatures [K]",
                         remedy="Temperatures are kelvin inside.")
    return np.broadcast_to(values, (len(names),)).copy()


def _measured(eq: Equations, record: Record) -> dict[str, float]:
    """First reading of every sensor in the record, as temperature of its lump."""
    reference = eq.nominal()[len(eq.system.inputs) + len(eq.system.modules)]
    readings: dict[str, float] = {}
    for name, sensor in eq.system.thermometers.items():
        if name in record.output_names:
            readings.setdefault(sensor.lump, reference + (record[name][0] - sensor.offset - reference) / sensor.gain)
    return readings


def _default(eq: Equations, record: Record) -> NDArray[np.float64]:
    own = [lump.initial for lump in eq.system.lumps.values() if lump.initial is not None]
    if len(own) == len(eq.capacity):
        return np.array(own)
    first = eq.system.ambient_names[0]
    ambient = record[first][0] if first in record.input_names else eq.system.ambients[first].temperature
    readings = _measured(eq, record)
    nearest = eq.system.nearest_lumps(readings)
    return np.array([lump.initial if lump.initial is not None
                     else readings[nearest[name]] if name in nearest else ambient
                     for name, lump in eq.system.lumps.items()])
