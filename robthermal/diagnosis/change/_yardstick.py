"""The yardstick of a change: what the same candidate makes of the reference records, where nothing has changed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..._distributions import f_isf, f_sf
from ..effects import Candidate
from ..evidence import Scores, score_candidates
from ..fit import Refit
from ._scatter import COUNTS

_TIED = 0.01  # chance below which the difference of two candidates is no scatter
_LEAST = 10.0  # of the sum of squares, as ΔBIC elsewhere
_DRAWS, _SEED = 4000, 1


def squares(fit: Refit, scores: Scores, i: int) -> float:
    """Decrease of the sum of squares that candidate i promises, in units of the declared noise."""
    statistic, power = float(scores.statistic[i]), float(fit.rest @ fit.rest)
    return statistic * power / (max(fit.degrees_of_freedom - 1, 1) + statistic)


def length_of(fit: Refit, scores: Scores, i: int) -> float:
    """Length of the signature of candidate i per unit of its size; 0 for one without a signature.

    Parameters
    ----------
    fit : Refit
        That was scored.
    scores : Scores
        Scores on that fit.
    i : int
        Place in `candidates`.
    """
    if not np.any(scores.signatures[:, i]):
        return 0.0
    left = float(fit.rest @ fit.rest) - squares(fit, scores, i)
    return math.sqrt(left / max(fit.degrees_of_freedom - 1, 1)) / float(scores.std[i])


def freedom_of(n_reference: int) -> float:
    """Degrees of freedom of the scatter that so many reference records tell.

    Parameters
    ----------
    n_reference : int
        Number of reference records.
    """
    return COUNTS + n_reference - 1


def inflation(candidate: Candidate, each: Sequence[Refit], n_new: int) -> float:
    """By how much the squares of a candidate exceed those of white noise and scatter on the reference records.

    Parameters
    ----------
    candidate : Candidate
        With its time constants, which are held.
    each : sequence of Refit
        Every reference record as if it were new.
    n_new : int
        Readings of the new records: the squares of a misfit grow with them, those of noise do not.
    """
    tried, total = with_held_shape(candidate), 0.0
    for fit in each:
        scores = score_candidates(fit, [tried])
        if scores.candidates:
            own = squares(fit, scores, 0)
            total += own + max(own - 1.0, 0.0) * max(n_new / fit.n_readings - 1.0, 0.0)
    n = len(each)
    return max(1.0, (COUNTS + (n + 1) / n * total) / freedom_of(n))


def chance(decrease: float, dimension: int, kappa: float, n_reference: int) -> float:
    """Chance of such a decrease if nothing has changed.

    Parameters
    ----------
    decrease : float
        Of the sum of squares, in units of the declared noise.
    dimension : int
        Quantities of the candidate.
    kappa : float
        Its `inflation` on reference records.
    n_reference : int
        Number of reference records.
    """
    return float(f_sf(max(decrease, 0.0) / dimension / kappa, dimension, freedom_of(n_reference)))


def effective_number(signatures: NDArray[np.float64], n_reference: int) -> float:
    """How many independent candidates have the same chance to show anything on a healthy day as these together.

    The largest of correlated t variates exceeds a high threshold E max|g|^ν / E|g|^ν times as often as one of them,
    with g normal and of their correlations: they share the yardstick, and therefore the large values.

    Parameters
    ----------
    signatures : ndarray, shape (m, k)
        Of the candidates, of unit length; one of length 0 is none.
    n_reference : int
        Number of reference records.
    """
    seen = signatures[:, np.linalg.norm(signatures, axis=0) > 0.0]
    if seen.shape[1] < 2:
        return 1.0
    freedom = freedom_of(n_reference)
    values, vectors = np.linalg.eigh(seen.T @ seen)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    g = np.random.default_rng(_SEED).standard_normal((_DRAWS, seen.shape[1])) @ root.T
    one = 2.0 ** (freedom / 2.0) * math.gamma((freedom + 1.0) / 2.0) / math.sqrt(math.pi)
    return float(np.clip(np.mean(np.max(np.abs(g), axis=1) ** freedom) / one, 1.0, seen.shape[1]))


def within_scatter(difference: float, kappa: float, n_reference: int) -> bool:
    """Whether two candidates differ by no more than the scatter may make."""
    return bool(difference < max(_LEAST, kappa * f_isf(_TIED, 1, freedom_of(n_reference))))


def with_held_shape(candidate: Candidate) -> Candidate:
    """With the only trial value of every shape that it has; a phase is chosen by each record.

    Parameters
    ----------
    candidate : Candidate
        With the shape that was found.
    """
    effect = candidate.effect
    quantities = tuple(replace(q, grid=(candidate.shape[q.name],)) if q.grid and q.name in candidate.shape
                       and q.name != effect.paired and q is not effect.size else q for q in effect.quantities)
    return Candidate(replace(effect, quantities=quantities), candidate.where)
