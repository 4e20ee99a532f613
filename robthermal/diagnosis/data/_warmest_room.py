"""How warm a room that was not recorded can have been, beside a machine that is only heated.

With heats that are never negative and one ambient T, a passive network that has never been colder than T never gets
colder than T: at the coldest lump every conduction, convection and radiation term is at least that of a lump at T. So
T is at most the coolest reading, but for what the thermometer reads wrong and for how fast the room itself can have
warmed up.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...fitting import Data
from ...thermal import System
from ._dataset import DataSet

SLACK = 1.0
_COOLEST = 5.0  # per cent of the readings: single ones are colder by noise, and in a night by a colder room
_RUNNING = 5  # readings of a running median: a machine may be at rest for no longer than a few
_WARMS = 1.0 / 3600.0  # K/s: how fast a room is taken to warm up after its coolest reading


def warmest_room(system: System, one: Data) -> float:
    """Upper bound of an ambient's temperature [K] that a record allows; infinite where it allows no statement.

    That is the case with a module, a heat that may be negative, several ambients, or no thermometer.

    Parameters
    ----------
    system : System
        Nominal system of the record.
    one : Data
        Readings and recorded inputs.
    """
    if len(system.ambients) != 1 or not _only_heated(system, one):
        return np.inf
    readings = [values[np.isfinite(values)] for name, values in zip(one.sensors, one.readings.T, strict=True)
                if name in system.thermometers]
    span = len(one.readings) * one.record.sample_time
    cool = [_coolest(values, span) for values in readings if values.size]
    return min(cool) + SLACK if cool else np.inf


def _coolest(values: NDArray[np.float64], span: float) -> float:
    """Coolest that a sensor has read [K], by itself or as the room may have warmed up since."""
    half = min(_RUNNING // 2, values.size - 1)
    running = np.lib.stride_tricks.sliding_window_view(np.pad(values, half, mode="reflect"), 2 * half + 1)
    first = float(np.min(np.median(running, axis=1)))
    return min(float(np.percentile(values, _COOLEST)), first + _WARMS * span)


def warmest_rooms(system: System, data: Sequence[DataSet]) -> list[float]:
    """Upper bounds of the ambient's temperature [K] for every data set: one room for all parts of a file.

    A part that begins while the machine is hot says nothing of the room; the part before it does.

    Parameters
    ----------
    system : System
        Nominal system of the data.
    data : sequence of DataSet
        Records and frequency responses; parts of a file share the report of its import.
    """
    own = [one.warmest_room(system) for one in data]
    files = [id(one.record.imported or one) if isinstance(one, Data) else id(one) for one in data]
    return [min(most for most, other in zip(own, files, strict=True) if other == file) for file in files]


def _only_heated(system: System, one: Data) -> bool:
    """Whether no heat into a lump was negative in the record."""
    if system.modules or any(lump.heat < 0 or lump.periodic or lump.condensation for lump in system.lumps.values()):
        return False
    inputs = dict(zip(one.record.input_names, np.asarray(one.record.inputs).T, strict=True))
    return all(part.gain > 0 and name in inputs and float(np.min(inputs[name])) >= 0.0
               for name, part in system.inputs.items() if part.gain)  # without one it heats nothing: a fan, a force
