"""What drives a simulation: held inputs and the initial state, taken from a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..signals import Record
from ._augmented import lagged
from ._checks import by_lump
from ._equations import Equations
from ._terms import Array
from ._units import LOWEST_KELVIN

Initial = ArrayLike | Mapping[str, float] | None


def held_inputs(eq: Equations, record: Record) -> Array:
    """Matrix u (n_samples, n_u) of a record, in the order of `System.exogenous_names`."""
    if not isinstance(record, Record):
        raise InputError(f"record is a {type(record).__name__}", where="argument record",
                         expected="a robthermal.Record", remedy="Read one with rt.read_record(path, system).")
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


def start_state(eq: Equations, record: Record, initial: Initial, nz: int) -> Array:
    """Augmented state at the first sample; see `Lump.initial` for the default."""
    lumps = _given(eq, initial)
    if lumps is None:
        lumps = _default(eq, record)
    z = np.zeros(nz)
    z[:len(lumps)] = lumps
    for row, name in enumerate(lagged(eq) if nz > len(lumps) else [], start=len(lumps)):
        z[row] = lumps[eq.system.lump_names.index(eq.system.sensors[name].lump)]
    return z


def start_slope(eq: Equations, record: Record, initial: Initial, names: Sequence[str], nz: int) -> Array:
    """Derivative of `start_state` with respect to named parameters, (n_z, n_parameters)."""
    n, out = len(eq.system.lumps), np.zeros((nz, len(names)))
    if initial is not None:
        return out
    first = eq.system.ambient_names[0]
    from_ambient = first not in record.input_names and not _measured(eq, record)
    for column, name in enumerate(names):
        for i, (lump, part) in enumerate(eq.system.lumps.items()):
            own = name == f"lumps.{lump}.initial" and part.initial is not None
            shared = name == f"ambients.{first}.temperature" and part.initial is None and from_ambient
            out[i, column] = float(own or shared)
        for row, sensor in enumerate(lagged(eq), start=n):
            out[row, column] = out[eq.system.lump_names.index(eq.system.sensors[sensor].lump), column]
    return out


def held_slope(eq: Equations, record: Record, names: Sequence[str]) -> Array:
    """Derivative of the held inputs: one for an ambient temperature that the record lacks, (n_u, n_parameters)."""
    out = np.zeros((len(eq.system.exogenous_names), len(names)))
    for row, ambient in enumerate(eq.system.exogenous_names):
        if ambient in eq.system.ambients and ambient not in record.input_names:
            out[row] = [float(name == f"ambients.{ambient}.temperature") for name in names]
    return out


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
    for name, sensor in eq.system.sensors.items():
        if name in record.output_names:
            readings.setdefault(sensor.lump, reference + (record[name][0] - sensor.offset - reference) / sensor.gain)
    return readings


def _default(eq: Equations, record: Record) -> NDArray[np.float64]:
    first = eq.system.ambient_names[0]
    ambient = record[first][0] if first in record.input_names else eq.system.ambients[first].temperature
    readings = _measured(eq, record)
    nearest = eq.system.nearest_lumps(readings)
    return np.array([lump.initial if lump.initial is not None
                     else readings[nearest[name]] if name in nearest else ambient
                     for name, lump in eq.system.lumps.items()])
