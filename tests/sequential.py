"""Sequential test of a probability: as many repetitions as the answer needs, with stated errors of both kinds."""

from __future__ import annotations

import math
from collections.abc import Callable

MOST = 2000  # repetitions; the test ends long before with any probability


def probable(happens: Callable[[int], bool], *, least: float, not_below: float, error: float = 0.005) -> bool:
    """Whether an event has a probability of at least `least`, told from one of at most `not_below`.

    Parameters
    ----------
    happens : callable
        Whether it happened in repetition 0, 1, …, independent of one another.
    least, not_below : float
        Probabilities that are told apart; between them either answer may come.
    error : float
        Chance of a wrong answer, at most, for a probability of `least` or more and of `not_below` or less [-].

    Notes
    -----
    Wald, Sequential Tests of Statistical Hypotheses, Ann. Math. Stat. 16, 1945: the likelihood ratio of the two
    probabilities, until it is beyond (1 - error)/error on either side.
    """
    hit, miss = math.log(least / not_below), math.log((1 - least) / (1 - not_below))
    edge, ratio = math.log((1 - error) / error), 0.0
    for repetition in range(MOST):
        ratio += hit if happens(repetition) else miss
        if abs(ratio) > edge:
            return ratio > 0
    raise AssertionError(f"undecided after {MOST} repetitions")
