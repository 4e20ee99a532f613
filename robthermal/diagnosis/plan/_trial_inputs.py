"""Inputs that a next experiment could apply, within limits: fast and slow, together and one at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ...fitting import Data
from ...signals import Record
from ...thermal import System

Array = NDArray[np.float64]
Limits = tuple[float, float]
Shape = Callable[[int, Limits, np.random.Generator], Array]
_BLOCKS = 4
_LEVELS = 12
_SHORTEST = 8  # samples of the shortest sine


def _levels(limits: Limits) -> Array:
    """Lowest, rest, highest: the extremes separate most."""
    low, high = limits
    return np.unique([low, float(np.clip(0.0, low, high)), high])


def switched(shortest: float, longest: float) -> Shape:
    """Extreme levels held for random times between two shares of the record, short and long ones equally likely."""

    def shape(n: int, limits: Limits, rng: np.random.Generator) -> Array:
        low, high = max(shortest * n, 1.0), max(longest * n, 2.0)
        out: list[Array] = []
        while sum(map(len, out)) < n:
            dwell = round(float(np.exp(rng.uniform(np.log(low), np.log(high)))))
            out.append(np.full(dwell, rng.choice(_levels(limits))))
        return np.concatenate(out)[:n]

    return shape


def staircase(dwell: float) -> Shape:
    """Random levels, each held for that share of the record."""

    def shape(n: int, limits: Limits, rng: np.random.Generator) -> Array:
        each = max(round(dwell * n), 1)
        return np.repeat(rng.uniform(*limits, n // each + 1), each)[:n]

    return shape


def sines(n: int, limits: Limits, rng: np.random.Generator) -> Array:
    """Sines with logarithmically spaced periods and random phases, in steps that any instrument can play."""
    rates = 2.0 * np.pi / np.geomspace(_SHORTEST, n, 8)
    wave = np.cos(np.outer(np.arange(n), rates) + rng.uniform(0.0, 2.0 * np.pi, rates.size)).sum(axis=1)
    share = np.round((wave - wave.min()) / np.ptp(wave) * _LEVELS) / _LEVELS
    return np.asarray(limits[0] + share * (limits[1] - limits[0]), np.float64)


SHAPES: tuple[Shape, ...] = (switched(0.002, 0.02), switched(0.005, 0.2), switched(0.05, 0.3), sines, staircase(0.03))


def limits_of(system: System, record: Record) -> dict[str, Limits]:
    """Limits of every input that can be chosen: as declared, else what the record has had."""
    declared = {**system.input_limits, **system.current_limits}
    out = {}
    for name in record.input_names:
        if name in declared:
            out[name] = declared[name] or (float(record[name].min()), float(record[name].max()))
    return {name: limits for name, limits in out.items() if limits[0] < limits[1]}


def drawn(one: Data, limits: Mapping[str, Limits], number: int, rng: np.random.Generator, faster: float = 1.0
          ) -> Record:
    """A trial: every input of its own shape; every third trial one input at a time, the others at rest.

    As many samples as the record has, at its sample time divided by `faster`.
    """
    record, n = one.record, len(one.record)
    chosen = {name: SHAPES[(number + place) % len(SHAPES)](n, own, rng) for place, (name, own) in
              enumerate(limits.items())}
    if number % 3 == 2 and len(chosen) > 1:
        part = np.arange(n) * len(chosen) // n
        for place, (name, own) in enumerate(limits.items()):
            chosen[name] = np.where(part == place, chosen[name], np.clip(0.0, *own))
    return with_inputs(record, chosen, record.sample_time / faster)


def crossed(best: Record, other: Record, limits: Mapping[str, Limits], rng: np.random.Generator) -> Record:
    """One quarter, or all, of one input of another trial put into the best: a step of a coordinate search."""
    name = str(rng.choice(list(limits)))
    n, values = len(best), best[name].copy()
    block = int(rng.integers(_BLOCKS + 1))
    here = slice(0, n) if block == _BLOCKS else slice(block * n // _BLOCKS, (block + 1) * n // _BLOCKS)
    values[here] = other[name][here]
    return with_inputs(best, {name: values})


def towards_rest(record: Record, limits: Mapping[str, Limits], share: float) -> Record:
    """All inputs brought nearer to rest."""
    return with_inputs(record, {name: np.clip(0.0, *own) + share * (record[name] - np.clip(0.0, *own))
                                for name, own in limits.items()})


def repeated(record: Record, times: int) -> Record:
    """The same record several times, one after the other."""
    return Record(sample_time=record.sample_time, inputs=np.tile(record.inputs, (times, 1)),
                  outputs=np.tile(record.outputs, (times, 1)), input_names=record.input_names,
                  output_names=record.output_names, averaged=record.averaged, name=record.name)


def with_inputs(record: Record, values: Mapping[str, Array], sample_time: float | None = None) -> Record:
    """The same record with other inputs and, where given, another sample time [s]."""
    inputs = np.array(record.inputs, np.float64)
    for name, column in values.items():
        inputs[:, record.input_names.index(name)] = column
    return Record(sample_time=sample_time or record.sample_time, inputs=inputs, outputs=record.outputs,
                  input_names=record.input_names, output_names=record.output_names, averaged=record.averaged,
                  name="next experiment")
