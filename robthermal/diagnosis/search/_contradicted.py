"""An accepted effect that the validation records contradict is taken back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import Diverged, InputError
from ..data import DataSet, records_of
from ..evidence import BIC_GAP, NEEDED, hold_out, left, negative_log_predictive_density
from ..fit import Refit, exact, fitted
from ._decide import Accepted
from ._revise import without


def without_contradicted(rounds: tuple[Accepted, ...], fit: Refit, nominal: Refit, data: Sequence[DataSet]
              ) -> tuple[tuple[Accepted, ...], Refit]:
    """Drop effects, the worst first, without which the validation records are predicted beyond doubt better.

    None without which the free run misses them by much more: the density trusts the declared random heat with whatever
    is slow, and where that is a guess the two may disagree.

    Parameters
    ----------
    rounds : tuple of Accepted
        In the order of the effects of the fit.
    fit, nominal : Refit
        With them, without any.
    data : sequence of DataSet
        Validation data. They only take names back: no parameter and no name comes from them.
    """
    while rounds:
        lesser = [nominal if len(rounds) == 1 else without(fit, place, nominal, round_.before)
                  for place, round_ in enumerate(rounds)]
        tried = [fit, *(fit if less is None else less for less in lesser)]
        worst = _worst(fit, lesser, negative_log_predictive_density(tried, fit, data), data)
        less = None if worst is None else lesser[worst]
        if worst is None or less is None:
            return rounds, fit
        rounds = rounds[:worst] + rounds[worst + 1:]
        fit = fitted(less.structure, less.v, less.floor, less.levels) if rounds else nominal
    return rounds, fit


def _worst(fit: Refit, lesser: Sequence[Refit | None], densities: Sequence[float], data: Sequence[DataSet]
           ) -> int | None:
    """Place of the effect that the validation records contradict most and the free run does not need; else None."""
    with_all, *others = densities
    gains = [with_all - other if other < with_all else 0.0 for other in others]  # not inf - inf
    against = [i for i in sorted(range(len(gains)), key=lambda i: -gains[i]) if gains[i] > BIC_GAP]
    return next((i for i in against if np.isinf(with_all) or not _needed(fit, lesser[i], data)), None)


def _needed(fit: Refit, less: Refit | None, data: Sequence[DataSet]) -> bool:
    """Whether an effect removes much of the excess mean square that the free run leaves of the validation records.

    Of the networks as they are: a free run leaves out what a finer network would change.
    """
    records = [one.record for one in records_of(data)]
    if less is None or len(records) < len(data):
        return False
    try:
        if fit.structure.coarse:
            less, fit = exact(less), exact(fit)
        return left(hold_out(less, fit, records).gap).share_explained >= NEEDED
    except (Diverged, InputError):  # a model that runs away predicts nothing
        return False
