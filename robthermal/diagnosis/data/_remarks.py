"""What the numbers of the records say about themselves: stuck, held and saturated readings, inputs that never move."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..._celsius import ZERO_CELSIUS
from ...errors import InputError
from ...fitting import Data, quantum, within_steps
from ...thermal import System

Array = NDArray[np.float64]
_QUIET = 1.3  # times its noise: a reading that never leaves it
_OFTEN = 0.05  # of the samples at the extreme reading: saturated
_LEAST = 10  # samples there
_ALIKE = 0.8  # of the runs of equal readings that are as long as most: a sensor slower than its log
_JUMP = 8.0  # times the largest change between other samples nearby
_BEYOND = 0.5  # of the width of an input's limits: farther outside, the column has another unit


def remarks(system: System, data: Sequence[Data], noise: Mapping[str, float]) -> tuple[str, ...]:
    """What these records cannot show whatever the model, a sentence each.

    Parameters
    ----------
    system : System
        Nominal system of the records.
    data : sequence of Data
        Records that are diagnosed.
    noise : mapping
        Standard deviation of every sensor [K or V].
    """
    said = [*_constant_inputs(system, data), *_beyond_limits(system, data)]
    if quiet(system, data, noise):
        said.insert(0, "The readings never leave their noise: these records hold next to nothing about the machine, "
                       "and cannot show what is missing. Apply larger inputs.")
    for one in data:
        for name, y in zip(one.sensors, one.readings.T, strict=True):
            said += _of_reading(system, name, y, one)
        said += [*_copies(one), *_jumps(one, noise)]
    said += within_steps(system, data)
    return tuple(dict.fromkeys(said))


def refuse_constant(system: System, data: Sequence[Data]) -> None:
    """Refuse records in which no reading ever changes.

    Parameters
    ----------
    system : System
        Nominal system of the records.
    data : sequence of Data
        Records that are diagnosed.
    """
    if data and all(np.ptp(one.readings, axis=0).max(initial=0.0) == 0.0 for one in data):
        one = data[0]
        said = ", ".join(f"{name} is {_shown(system, name, value)}" for name, value in
                         zip(one.sensors, one.readings[0], strict=True))
        raise InputError(f"no reading ever changes: {said} in all {len(one.readings)} samples",
                         where=f"argument records, record {one.label!r}", expected="readings that move",
                         remedy="See that the sensors are connected and within their range.")


def quiet(system: System, data: Sequence[Data], noise: Mapping[str, float]) -> bool:
    """Whether no thermometer ever leaves its noise.

    Parameters
    ----------
    system : System
        Nominal system of the records.
    data : sequence of Data
        Records that are diagnosed.
    noise : mapping
        Standard deviation of every sensor [K or V].
    """
    spread = [float(np.std(y)) / noise[name] for one in data
              for name, y in zip(one.sensors, one.readings.T, strict=True) if name in system.thermometers]
    return bool(spread) and max(spread) < _QUIET


def _beyond_limits(system: System, data: Sequence[Data]) -> Iterator[str]:
    """Inputs far outside the limits that the system gives: in percent or counts."""
    for name, limits in {**system.input_limits, **system.current_limits}.items():
        columns = [one.record[name] for one in data if limits and name in one.record.input_names]
        if limits and columns:
            far = _BEYOND * (limits[1] - limits[0])
            low, high = min(float(x.min()) for x in columns), max(float(x.max()) for x in columns)
            if low < limits[0] - far or high > limits[1] + far:
                yield (f"{name} is between {low:.4g} and {high:.4g} in the records; the system's limits are "
                       f"{limits[0]:.4g} and {limits[1]:.4g}: percent or counts? Give the system its gain, or convert "
                       "the column.")


def _copies(one: Data) -> Iterator[str]:
    """Sensors that read the same in every sample: one column twice."""
    for j, name in enumerate(one.sensors):
        y = one.readings[:, j]
        same = [one.sensors[k] for k in range(j) if np.array_equal(one.readings[:, k], y)]
        if same and np.ptp(y) > 0.0:
            yield (f"{name} and {same[0]} read the same in every sample of record {one.label!r}: one column twice? "
                   "Leave the copy out.")


def _constant_inputs(system: System, data: Sequence[Data]) -> Iterator[str]:
    said = []
    for name, limits in {**system.input_limits, **system.current_limits}.items():
        columns = [one.record[name] for one in data if name in one.record.input_names]
        if columns and len({float(value) for column in columns for value in (column.min(), column.max())}) == 1:
            value = float(columns[0][0])
            said.append(f"{name} at {value:.4g}" + (", its limit" if limits and value == limits[1] else ""))
    if said:
        yield (f"Never changed: {'; '.join(said)}. What depends on changes of an input (its gain, lag, delay or "
               "saturation) could not have been seen.")


def _of_reading(system: System, name: str, y: Array, one: Data) -> Iterator[str]:
    """Stuck, saturated, or held for several samples."""
    place = f"{name} in record {one.label!r}"
    if np.ptp(y) == 0.0:
        yield (f"{place} reads {_shown(system, name, float(y[0]))} in all {y.size} samples: stuck, saturated, not "
               "connected, or changing by less than a step. If it is not connected, leave its column out.")
        return
    every = _held_for(y)
    if every > 1:
        yield (f"{place} changes at every {every}th sample only: its readings are held, which looks like missing "
               f"physics. Keep one sample in {every}, {every * one.record.sample_time:.4g} s apart.")
        return
    if quantum(y) or _repeated(y) > _OFTEN:  # steps repeat by themselves
        return
    for extreme, what in ((y.max(), "largest"), (y.min(), "smallest")):
        share = float(np.mean(y == extreme))
        if share > _OFTEN and share * y.size >= _LEAST:
            yield (f"{place} is at its {what} reading, {_shown(system, name, float(extreme))}, in {share:.0%} of the "
                   "samples: saturated? What it does not show looks like missing physics. Cut these parts out.")
            return


def _repeated(y: Array) -> float:
    """Part of the samples that repeat the one before, other than at either end of the range."""
    same = y[1:][y[1:] == y[:-1]]
    return float(np.sum((same > y.min()) & (same < y.max()))) / y.size


def _held_for(y: Array) -> int:
    """Samples for which every reading is held, if nearly all are held as long; runs of rounded readings differ."""
    runs = np.diff(np.flatnonzero(np.diff(y)))
    if runs.size < _LEAST:
        return 1
    usual = int(np.bincount(runs).argmax())
    return usual if float(np.mean(runs == usual)) > _ALIKE else 1


def _jumps(one: Data, noise: Mapping[str, float]) -> Iterator[str]:
    """All readings jump at once by more than they ever move: a restart that the clock does not show."""
    steps = np.abs(np.diff(one.readings, axis=0)) / np.array([noise[name] for name in one.sensors])
    usual = np.quantile(steps, 0.99, axis=0)
    far = np.flatnonzero(np.all(steps > _JUMP * np.maximum(usual, 1.0), axis=1))
    if 0 < far.size <= _LEAST:
        times = ", ".join(f"{one.record.time[k + 1]:.6g} s" for k in far[:3])
        yield (f"All readings of record {one.label!r} jump at {times}: a restart? A record must be one run; split it "
               "there.")


def _shown(system: System, name: str, value: float) -> str:
    """A reading in the unit of the system's files."""
    if system.sensors[name].quantity != "temperature":
        return f"{value:.6g} V"
    return f"{value - ZERO_CELSIUS:.6g} °C" if system.temperature_unit == "degC" else f"{value:.6g} K"
