"""Stamps that jitter: whether the rows were read when their stamps say, or evenly.

A reading on a ramp tells: its distance from the middle of both neighbors is the slope times what the time of its row is
off the middle of theirs, if the stamps are right, and nothing, if they are wrong. Bends do not know the jitter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .._glitches import quantum
from ._parts import Part
from ._table import Action, Array, Table

Clock = Literal["stamps", "rows"]
_EVEN = 1.5  # median steps: more is a gap
_SURE = 3.0  # standard deviations from one half
_LEAST = 50  # rows on ramps: fewer are no evidence
_STEEP = 5.0  # times its noise: less of a slope is none
_LITTLE = 1e-3  # of the jitter on a ramp: smaller noise says no more
_STRAIGHT = 0.8  # share of the rows of which none is taken for a bend
_ENOUGH = 200_000  # rows that are looked at


@dataclass(frozen=True)
class Followed:
    """How much of the jitter of the stamps is in the readings.

    Parameters
    ----------
    share : float
        Most likely part of the jitter that the readings follow: 1 if the stamps are right, 0 if rows are even [-].
    std : float
        Standard deviation of `share` [-].
    """

    share: float
    std: float

    @property
    def clock(self) -> Clock | None:
        """What the readings follow; None if they do not tell."""
        if abs(self.share - 0.5) <= _SURE * self.std:
            return None
        return "stamps" if self.share > 0.5 else "rows"

    def __str__(self) -> str:
        return f"the readings show {100 * self.share:.0f} ± {max(100 * self.std, 1):.0f} % of the jitter"


def settled(table: Table, parts: Sequence[Part], readings: Sequence[Array], declared: Clock | None) -> list[Part]:
    """Parts whose stamps jitter, as what is declared or what the readings show has it.

    Where the stamps are right, held inputs act by their means over the samples of the grid. Where they are wrong, the
    rows are the samples. Where nobody knows, parts stay as they are.

    Parameters
    ----------
    table : Table
        For lines, and its actions.
    parts : sequence of Part
        On one grid.
    readings : sequence of ndarray
        Temperatures of all rows of the table; nan where missing.
    declared : {"stamps", "rows"}, optional
        Which of the two is right.
    """
    moved = [part for part in parts if not part.exact]
    if not moved:
        return list(parts)
    found = None if declared else followed([part.stamps for part in moved],
                                           [[column[part.rows] for part in moved] for column in readings])
    clock, why = declared or (found and found.clock), "as declared" if declared else str(found)
    if clock is None:
        return list(parts)
    if clock == "stamps":
        text = f"the stamps are right ({why}): an input that changes within a sample acts by its mean"
        table.actions.append(Action("clock", len(moved), text))
        return [part if part.exact else replace(part, means=True) for part in parts]
    n, h = sum(part.n_rows for part in moved), moved[0].sample_time
    text = f"the stamps jitter and the rows do not ({why}): rows were counted on a uniform grid of {h:.10g} s"
    table.actions.append(Action("counted", n, text, lines=[table.lines[moved[0].rows.start]]))
    return [part if part.exact else _counted(part) for part in parts]


def followed(stamps: Sequence[Array], readings: Sequence[Sequence[Array]]) -> Followed | None:
    """Compare readings with the jitter of the stamps; None where nothing is steep enough.

    Least squares over the rows that either of the two explains best: at the others a reading bends.

    Parameters
    ----------
    stamps : sequence of ndarray
        Time of the rows of every part [s].
    readings : sequence of sequence of ndarray
        Of every sensor its readings in every part; nan where missing.
    """
    sensors = [some for sensor in readings if (some := _expected_and_found(stamps, sensor)) is not None]
    if not sensors:
        return None
    expected, found = (np.concatenate([one[i] for one in sensors]) for i in (0, 1))
    power = float(expected @ expected)
    share = float(expected @ found) / power
    return Followed(share, float(np.linalg.norm(expected * (found - share * expected))) / power)


def _expected_and_found(stamps: Sequence[Array], sensor: Sequence[Array]) -> tuple[Array, Array] | None:
    """What the jitter would do to rows on ramps of a sensor, and what they show, in units of what both leave.

    None where its steps are larger than that: rounding can hide the jitter of every row of a ramp.
    """
    slope, late, found = (np.concatenate(one) for one in zip(*_triples(stamps, sensor), strict=True))
    steep = np.abs(slope) > _STEEP * _rms(found[_smallest(np.abs(found))])
    expected, found = (slope * late)[steep], found[steep]
    left = np.minimum(np.abs(found), np.abs(found - expected))
    kept = _smallest(left)
    expected, found, left = expected[kept], found[kept], left[kept]
    read = np.concatenate(sensor)[:_ENOUGH]
    step = quantum(read[np.isfinite(read)])
    if kept.size < _LEAST or _rms(expected) <= step:
        return None
    unit = max(_rms(left), _LITTLE * _rms(expected))
    return expected / unit, found / unit


def _triples(stamps: Sequence[Array], values: Sequence[Array]) -> Iterator[tuple[Array, Array, Array]]:
    """Of rows between two others: change per sample, lateness in samples, distance from the middle of the two."""
    left = _ENOUGH
    for t, y in zip(stamps, values, strict=True):
        step, rise = np.diff(t[:left]), np.diff(y[:left])
        step = step / np.median(step) if step.size else step
        left -= len(t[:left])
        even = (step[1:] < _EVEN) & (step[:-1] < _EVEN) & np.isfinite(rise[1:] + rise[:-1])
        yield (0.5 * (rise[:-1] + rise[1:])[even], 0.5 * (step[:-1] - step[1:])[even],
               0.5 * (rise[:-1] - rise[1:])[even])


def _smallest(values: Array) -> NDArray[np.intp]:
    """Places of the smallest values, without those that bends may have made."""
    return np.argsort(values, kind="stable")[:math.ceil(_STRAIGHT * values.size)]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _counted(part: Part) -> Part:
    """The same rows one sample after the other; missing ones keep their place."""
    index = np.concatenate([[0.0], np.cumsum(np.maximum(np.ceil(np.diff(part.stamps) / part.sample_time - 0.5), 1.0))])
    start = float(np.mean(part.stamps - part.sample_time * index))
    samples = int(index[-1]) + 1
    return replace(part, stamps=start + part.sample_time * index, samples=samples, exact=samples == part.n_rows)
