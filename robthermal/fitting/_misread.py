"""Records with an input of the wrong sign, with two columns exchanged, or with times in another unit: said by name.

Whatever is fitted to such a record is wrong, and effects that are not there may come nearest. The model of the system
file, unfitted, leaves less of the record read otherwise, and fitted far less. Of a record that is read right it leaves
less than of any other reading, as a rule, so that nothing more is fitted. A missing effect between two thermometers
that are nearly as warm may look like that too: what is found is no refusal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from .._arrays import Floats
from ..errors import Diverged, InputError
from ..signals import Record
from ..thermal import System
from ._data import Data
from ._problem import Problem
from ._ranges import NONE
from ._start import initial_of

_LESS = 0.3  # of the mean square that the answer leaves: what only a wrong sign or a wrong column explains
_FAR_LESS = 0.05  # of the mean square that the fit without effects leaves, where these do not reach it either
_FITTED = 3  # of the readings that are better than the record as it is; of those of its times the best one
_NOISE = 9.0  # times the mean square of the noise: records that leave less are not asked
_MOST = 60  # ways to read a record that are tried
_PART = 2000  # samples of every record that they are tried on
_TIMES = {1e-3: ("1000 times too long", "ms"), 1.0 / 60.0: ("60 times too long", "s"),
          60.0: ("60 times too short", "min"), 1e3: ("1000 times too short", "s"),
          3600.0: ("3600 times too short", "h")}  # by factor: what is wrong, and the unit to declare


@dataclass(frozen=True)
class _Reading:
    """A record read otherwise: what would be wrong with it, what to do, and how the record becomes the other one."""

    wrong: str
    remedy: str
    read: Callable[[Record], Record]


def misread(system: System, data: Sequence[Data], before: float, left: float, noise: Mapping[str, float],
            fitted: Callable[[list[Record]], float]) -> str:
    """What the records seem to have wrong, and what to do: a sign, two columns, the unit of times; empty if nothing.

    Parameters
    ----------
    system : System
        As the file describes it, before any fit.
    data : sequence of Data
        Records that were fitted.
    before, left : float
        Rms of the free-run residual, all thermometers [K]: of the fit, and of the best answer with effects, if any.
    noise : mapping
        Standard deviation of the sensors [K or V]; 0 where it is unknown.
    fitted : callable
        Fits the system to other records in the same way, and returns what `left` is of them [K].
    """
    warm = [name for name in system.thermometers if any(name in one.sensors for one in data)]
    if not warm or left**2 <= _NOISE * float(np.mean([noise.get(name, 0.0) ** 2 for name in warm])):
        return ""
    as_it_is = _mean_square(system, data, lambda record: record)
    better = [reading for readings, most in ((_readings(system, data, warm), _FITTED), (_other_times(), 1))
              for reading in _better(system, data, list(readings)[:_MOST], as_it_is)[:most]]
    rms = [_or_infinite(fitted, [reading.read(one.record) for one in data]) for reading in better]
    least = min(rms, default=np.inf)
    if least >= left or least**2 >= max(_LESS * left**2, _FAR_LESS * before**2):
        return ""
    found = [reading for reading, each in zip(better, rms, strict=True) if each**2 <= 2.0 * least**2]
    wrong = " or ".join(one.wrong for one in found)
    answer = f" ({left:.2g} K with effects)" if left < before else ""
    return (f"{wrong[0].upper()}{wrong[1:]}: so read, the fit leaves {least:.2g} K of the records instead of "
            f"{before:.2g} K{answer}. Look at the wiring and at the program; if it is so: "
            f"{' Or '.join(dict.fromkeys(one.remedy for one in found))}")


def _better(system: System, data: Sequence[Data], readings: Sequence[_Reading], as_it_is: float) -> list[_Reading]:
    """Readings of which the unfitted model leaves less than of the records as they are, the best first."""
    squares = [_mean_square(system, data, one.read) for one in readings]
    return [readings[i] for square, i in sorted(zip(squares, range(len(squares)), strict=True)) if square < as_it_is]


def _or_infinite(fitted: Callable[[list[Record]], float], records: list[Record]) -> float:
    try:
        return fitted(records)
    except (Diverged, InputError):
        return float("inf")


def _readings(system: System, data: Sequence[Data], warm: Sequence[str]) -> Iterator[_Reading]:
    """Every input with the other sign, every two heaters, modules or thermometers exchanged."""
    driven = [name for name in (*system.inputs, *system.modules) if all(name in one.record.input_names for one in data)]
    for name in driven:
        if name in system.inputs:
            yield _Reading(f"the heat of {name!r} seems to have the other sign", "give it scale = -1 in [columns].",
                           _turned(name, ()))
            continue
        volts = [sensor for sensor, own in system.sensors.items() if own.module == name]
        read = [sensor for sensor in volts if any(sensor in one.sensors for one in data)]
        yield _Reading(f"the current of {name!r}{' and its voltage seem' if read else ' seems'} to have the other sign",
                       f"give {' and '.join([name, *read])} scale = -1 in [columns], or exchange hot and cold in "
                       f"[modules.{name}].", _turned(name, volts))
    for group, kind in ((list(system.inputs), "heaters"), (list(system.modules), "modules"), (warm, "thermometers")):
        known = [name for name in group if name in driven or name in warm]
        for one, other in combinations(known, 2):
            yield _Reading(f"the columns of the {kind} {one!r} and {other!r} seem to be exchanged",
                           f"exchange {one} and {other} in [columns].", _exchanged(one, other))


def _other_times() -> Iterator[_Reading]:
    """Times that were in another unit than they were read in."""
    for factor, (wrong, unit) in _TIMES.items():
        yield _Reading(f"the time column seems to be in another unit, its times {wrong}",
                       f'declare its unit, time_format = "{unit}" in [record].', _with_times(factor))


def _with_times(factor: float) -> Callable[[Record], Record]:
    return lambda record: record.changed(sample_time=record.sample_time * factor, start_time=record.start_time * factor)


def _turned(name: str, outputs: Sequence[str]) -> Callable[[Record], Record]:
    def read(record: Record) -> Record:
        signs = np.array([-1.0 if one == name else 1.0 for one in record.input_names])
        out = np.array([-1.0 if one in outputs else 1.0 for one in record.output_names])
        return _with_inputs(record, record.inputs * signs).with_outputs(record.outputs * out)

    return read


def _exchanged(one: str, other: str) -> Callable[[Record], Record]:
    def read(record: Record) -> Record:
        for names, values, changed in ((record.input_names, record.inputs, _with_inputs),
                                       (record.output_names, record.outputs, Record.with_outputs)):
            if one in names and other in names:
                order = list(range(len(names)))
                a, b = names.index(one), names.index(other)
                order[a], order[b] = b, a
                return changed(record, np.array(values, float)[:, order])
        return record

    return read


def _with_inputs(record: Record, inputs: Floats) -> Record:
    return record.changed(inputs=inputs, ripple=record.ripple)


def _mean_square(system: System, data: Sequence[Data], read: Callable[[Record], Record]) -> float:
    """Mean square of what the unfitted model leaves of all thermometers [K²]; infinite where it runs away."""
    squares = []
    for one in data:
        record = read(one.record[:_PART])
        columns = [record.output_names.index(name) for name in one.sensors]
        missing = None if one.missing is None else one.missing[:_PART]
        other = replace(one, record=record, readings=np.array(record.outputs, float)[:, columns], missing=missing)
        try:
            start = initial_of(system, other, "measured")
            problem = Problem(system, [other], NONE, [start])
            r = problem.residuals(problem.v0)[0]
        except (Diverged, InputError):
            return np.inf
        squares.append(np.ravel(r[:, [i for i, name in enumerate(one.sensors) if name in system.thermometers]]) ** 2)
    return float(np.mean(np.concatenate(squares)))
