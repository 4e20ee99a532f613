"""Rows of an input that the readings did not follow: cells that a logger misread.

A model is simulated with such a row, and with the mean of both beside it in its place; the difference d is what the row
would have done to the readings. Of what the model leaves with the row as it stands, r = measured - modelled, the part
along d says which share of the row acted: r = (share - 1) d and noise. What is slow in both is taken out in a window
about the row; how much of d comes about by itself, from noise and from whatever the model lacks, is read off the rest
of the record.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .._arrays import Floats
from .._lone_rows import lone_rows
from ..errors import Diverged, InputError
from ..signals import Record
from ..thermal import System, trajectory
from ._data import Data, as_data
from ._free_run import free_run
from ._start import initial_of, start_values

Rows = Mapping[str, Sequence[int]]  # of inputs, by name
Answer = Literal["misread", "open", "acted", "small"]
_WRONG = ", and the readings did not follow: misread, the mean of the rows beside it is taken."
_OPEN = "; whether it acted the readings do not tell. If it was misread, correct the log."
_BEFORE, _AFTER = 15, 30  # samples of the window about a row
_DEGREE = 3  # of the polynomial that is slow in it
_SEEN = 25.0  # sum of squares of what a row does, in noise: five standard deviations
_SHARE = 0.3  # of the row: what acted less did not act
_BY_ITSELF = 0.14  # standard deviation of the share: one is then seven away
_LEAST = 1.5  # windows that a record is to be long
_MOST = 20  # rows of a record that are asked about
_NORMAL = 1.4826  # standard deviations in the median of the size of what is normally distributed


@dataclass(frozen=True)
class Mended:
    """Records without misread rows of their inputs.

    Parameters
    ----------
    records, validation : list of Record
        As given, such rows replaced by the mean of both beside them.
    said : tuple of str
        What was replaced, a sentence for every input of a record; empty if nothing was.
    doubted : tuple of str
        Of which rows the readings do not tell, in the same way.
    """

    records: list[Record]
    validation: list[Record]
    said: tuple[str, ...] = ()
    doubted: tuple[str, ...] = ()


def mended(system: System, records: Sequence[Record], validation: Sequence[Record],
           fitted: Callable[[list[Record]], System]) -> Mended:
    """Records without rows of heaters and currents that their readings did not follow.

    Parameters
    ----------
    system : System
        As the file describes it.
    records, validation : sequence of Record
        Measured records, for the fit and beside it.
    fitted : callable
        Fits the system to records; called only where a row is in doubt, with the mean of both beside it in its place.
    """
    every = [*records, *validation]
    lone = [_lone_rows_of(system, record) for record in every]
    if not any(lone):
        return Mended([*records], [*validation])
    held = [_held(record, rows) for record, rows in zip(every, lone, strict=True)]
    try:
        model = fitted(held[:len(records)])
    except (Diverged, InputError):  # the fit proper will say so
        return Mended([*records], [*validation])
    said: list[str] = []
    doubted: list[str] = []
    out = []
    for record, rows in zip(every, lone, strict=True):
        found = _asked(model, record, rows)
        said += [_in_words(record, name, which, _WRONG) for name, which in found["misread"].items()]
        doubted += [_in_words(record, name, which, _OPEN) for name, which in found["open"].items()]
        out.append(_held(record, found["misread"]))
    return Mended(out[:len(records)], out[len(records):], tuple(said), tuple(doubted))


def _lone_rows_of(system: System, record: Record) -> Rows:
    """Rows in which a heater or a current of the system stands apart for one sample, by name."""
    found = {name: lone_rows(record[name]).tolist()[:_MOST] for name in (*system.inputs, *system.modules)
             if name in record.input_names}
    return {name: rows for name, rows in found.items() if rows}


def _held(record: Record, rows: Rows) -> Record:
    """The record with the mean of both rows beside them in some rows of its inputs."""
    if not rows:
        return record
    inputs = np.array(record.inputs, float)
    for name, places in rows.items():
        column = record.input_names.index(name)
        for row in places:
            inputs[row, column] = 0.5 * (inputs[row - 1, column] + inputs[row + 1, column])
    return record.changed(inputs=inputs)


def _asked(model: System, record: Record, lone: Rows) -> dict[Answer, dict[str, list[int]]]:
    """Rows of every input by what the readings say of them."""
    found: dict[Answer, dict[str, list[int]]] = {"misread": {}, "open": {}, "acted": {}, "small": {}}
    if not lone:
        return found
    one = as_data(model, record, "records")[0]
    try:
        run = free_run(model, one, "free", {name: sensor.noise for name, sensor in model.sensors.items()})
    except (Diverged, InputError):  # the diagnosis proper will say so
        return found
    at = model.with_parameters(start_values(initial_of(model, one, "free"), run.initial_temperatures))
    weights = 1.0 / np.array([_level(at.sensors[name].noise, r) for name, r in run.by_sensor.items()])
    left = one.where_read(run.residual) * weights
    rows = [_Row(name, row, one.where_read(_change(at, one, name, row)) * weights, left)
            for name, places in lone.items() for row in places]
    for each in rows:
        found[each.answer(left - sum(other.part * other.change for other in rows))].setdefault(each.name, []
                                                                                              ).append(each.row)
    return found


def _change(at: System, one: Data, name: str, row: int) -> Floats:
    """What a row of an input does to the readings, (n, n_sensors) [K or V]; nothing where a model runs away."""
    try:
        runs = [trajectory(at, record).readings[:, one.columns]
                for record in (one.record, _held(one.record, {name: [row]}))]
    except Diverged:
        return np.zeros(one.readings.shape)
    return np.asarray(runs[0] - runs[1])


class _Row:
    """A row of an input beside what the readings say of it.

    Parameters
    ----------
    name, row
        Input, and row of the record.
    change, left : ndarray, shape (n, n_sensors)
        What the row does to the readings, and what the model leaves [standard deviations of noise].
    """

    def __init__(self, name: str, row: int, change: Floats, left: Floats):
        self.name, self.row, self.change = name, row, change
        self.window = slice(max(row - _BEFORE, 0), min(row + _AFTER, len(left)))
        self.template = _without_slow(change[self.window])
        self.energy = float(np.sum(self.template**2))
        self.part = float(np.sum(self.template * left[self.window])) / self.energy if self.energy >= _SEEN else 0.0

    def answer(self, others: Floats) -> Answer:
        """Misread where the share that acted is nothing, beside what comes about by itself in `others`."""
        width = self.window.stop - self.window.start
        if self.energy < _SEEN:
            return "small"
        if self.window.stop - self.row < _DEGREE + 2 or len(others) < _LEAST * width:
            return "open"
        anywhere = sum(np.correlate(others[:, i], self.template[:, i], mode="valid")
                       for i in range(others.shape[1])) / self.energy
        if float(np.sqrt(np.mean(anywhere**2))) >= _BY_ITSELF or float(np.max(np.abs(anywhere))) >= 1.0 - _SHARE:
            return "open"  # a row that acts late is found elsewhere
        return "misread" if abs(1.0 + self.part) < _SHARE else "acted" if abs(self.part) < 1.0 - _SHARE else "open"


def _in_words(record: Record, name: str, rows: Sequence[int], what: str) -> str:
    row, values = rows[0], record[name]
    time, others = float(record.time[row]), len(rows) - 1
    more = f", and so in {others} more row{'s' * (others > 1)}" if others else ""
    return (f"{name!r} in {record.name or 'the record'} is {values[row]:.4g} at {time:.6g} s, between "
            f"{values[row - 1]:.4g} and {values[row + 1]:.4g}{more}{what}")


def _level(noise: float, r: Floats) -> float:
    """Standard deviation of a sensor [K or V], from second differences of the residual where it is unknown."""
    return max(noise, _NORMAL * float(np.median(np.abs(np.diff(r, 2)))) / np.sqrt(6.0), 1e-9)


def _without_slow(values: Floats) -> Floats:
    """What a polynomial in time does not explain of the columns."""
    slow = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, len(values)), _DEGREE)
    return np.asarray(values - slow @ np.linalg.lstsq(slow, values, rcond=None)[0])
