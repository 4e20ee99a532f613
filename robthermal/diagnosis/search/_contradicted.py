"""An accepted effect that the validation records contradict is taken back."""

from __future__ import annotations

from collections.abc import Sequence

from ..data import DataSet
from ..evidence import BIC_GAP, negative_log_predictive_density
from ..fit import Refit, fitted
from ._decide import Accepted
from ._revise import without


def without_contradicted(rounds: tuple[Accepted, ...], fit: Refit, nominal: Refit, data: Sequence[DataSet]
              ) -> tuple[tuple[Accepted, ...], Refit]:
    """Drop effects, the worst first, without which the validation records are predicted beyond doubt better.

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
        with_all, *others = negative_log_predictive_density(tried, fit, data)
        gains = [with_all - other if other < with_all else 0.0 for other in others]  # not inf - inf
        worst = max(range(len(gains)), key=gains.__getitem__)
        less = lesser[worst]
        if less is None or not gains[worst] > BIC_GAP:
            return rounds, fit
        rounds = rounds[:worst] + rounds[worst + 1:]
        fit = fitted(less.structure, less.v, less.floor, less.levels) if rounds else nominal
    return rounds, fit
