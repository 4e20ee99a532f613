"""Periods that records of different times cannot distinguish, and the one that all of them support.

A record of length T tells a frequency to 1/T. Two records whose middles are D apart tell it to a fraction of 1/D, but
for how many periods went by in between: every 1/D there is another minimum of the sum of squares, and a refit ends in
the one it began at. So all of them within 1/T are compared before a refit begins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..effects import Candidate
from ..evidence import BIC_GAP, Scores, promised, score_candidates
from ..fit import Refit
from ..path import LinearizedRecord

Array = NDArray[np.float64]
_PERIOD = "period"
_PER_MINIMUM = 2  # frequencies tried per 1/D
_MOST = 200  # frequencies tried
_ALIKE = 0.9  # of what the best explains: beside a remainder another period that reaches it may be the right one


def on_all_records(fit: Refit, scores: Scores) -> Scores:
    """Scores with every periodic effect at the period near its own trial value that explains most of all records.

    At trial values of one record two places of the same heat would be compared at two different minima.

    Parameters
    ----------
    fit : Refit
        That was scored.
    scores : Scores
        Scores on that fit; returned as they are unless there are several records.
    """
    places = [i for i, candidate in enumerate(scores.candidates) if _near(fit.records, candidate).size]
    if not places:
        return scores
    tried = [scores.candidates[i] for i in places]
    new = score_candidates(fit, [_with_periods(one, _near(fit.records, one)) for one in tried])
    found = dict(zip(places, new.candidates, strict=True))

    def merged(name: str) -> Any:
        out = getattr(scores, name).copy()
        out[..., places] = getattr(new, name)
        return out

    p, n_trials = merged("p_value"), scores.n_trials + new.n_trials
    p[places] = np.minimum(new.p_value * n_trials / new.n_trials, 1.0)
    candidates = tuple(replace(one, shape=found[i].shape) if i in found else one
                       for i, one in enumerate(scores.candidates))
    names = ("size", "std", "statistic", "possible", "identifiability", "limit", "signatures")
    rest = {name: merged(name) for name in names}
    return replace(scores, candidates=candidates, p_value=p, n_trials=n_trials, **rest)


def between_trials(records: Sequence[LinearizedRecord]) -> float:
    """Minima of all records together per trial period of one record: by so much more is tried; 1 of one record.

    Parameters
    ----------
    records : sequence of LinearizedRecord
        Records with the times at which they were taken.
    """
    return max(_apart(records) / max(one.span for one in records), 1.0) if records else 1.0


def other_periods(before: Refit, candidate: Candidate, remainder: bool) -> list[float]:
    """Other periods of an accepted effect that the records do not exclude, the likeliest first [s].

    Parameters
    ----------
    before : Refit
        Fit without the effect.
    candidate : Candidate
        With the period and phase found as trial values.
    remainder : bool
        Whether something is left beyond the noise: then what explains nearly as much is not excluded, either.
    """
    periods = _near(before.records, candidate)
    if not periods.size:
        return []
    left = np.array([_left(before, candidate, period) for period in periods])
    explained = before.rss - left
    own = int(np.argmin(np.abs(periods - candidate.shape[_PERIOD])))
    behind = before.n_readings * np.log(left / left[own])
    close = (behind < BIC_GAP) | (remainder & (explained > _ALIKE * explained[own]))
    ends = np.concatenate([[np.inf], left, [np.inf]])
    minimum = (left <= ends[:-2]) & (left <= ends[2:])
    apart = np.abs(np.arange(periods.size) - own) >= _PER_MINIMUM
    order = [int(i) for i in np.argsort(left) if close[i] and minimum[i] and apart[i]]
    return [float(periods[i]) for i in order]


def _near(records: Sequence[LinearizedRecord], candidate: Candidate) -> Array:
    """Periods within the resolution of the longest record, its own in the middle; none for fewer than two records."""
    if not candidate.effect.paired or len(records) < 2:
        return np.zeros(0)
    apart, longest = _apart(records), max(one.span for one in records)
    if apart <= 0.0 or candidate.shape[_PERIOD] > longest:  # a drift is no matter of whole periods
        return np.zeros(0)
    count = min(int(_PER_MINIMUM * apart / longest), _MOST // 2)
    frequencies = 1.0 / candidate.shape[_PERIOD] + np.arange(-count, count + 1) / (_PER_MINIMUM * apart)
    return np.asarray(1.0 / frequencies[frequencies * longest > 0.5], np.float64)


def _apart(records: Sequence[LinearizedRecord]) -> float:
    """Time between the middles of the first and the last record [s]."""
    middles = [0.5 * float(one.time[0] + one.time[-1]) for one in records]
    return max(middles) - min(middles)


def _with_periods(candidate: Candidate, periods: Array) -> Candidate:
    """The candidate with these trial periods alone."""
    quantities = tuple(replace(one, grid=lambda context, where: list(periods)) if one.name == _PERIOD else one
                       for one in candidate.effect.quantities)
    return replace(candidate, effect=replace(candidate.effect, quantities=quantities))


def _left(before: Refit, candidate: Candidate, period: float) -> float:
    """Sum of squares that the effect leaves at one period, its phase the best."""
    return promised(before, score_candidates(before, [_with_periods(candidate, np.array([period]))]), 0)
