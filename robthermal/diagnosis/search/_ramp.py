"""A sine of which the record sees no whole period may be a ramp: the simpler of the two, where it does as well.

Beside a constant that is unknown as well (an ambient that was not recorded) half a period and a ramp leave nearly the
same of one record, and continue differently. A ramp is the limit of long periods, with one quantity less: by BIC it
stands where the sine gains less than log N.
"""

from __future__ import annotations

import math

import numpy as np

from ...errors import Diverged, InputError
from ..fit import ENOUGH, Refit, Whitened, descend, extended

_LONG = 16.0  # lengths of the record: of such a sine it sees a straight line to 1 % of its change
_WITH_FIXED = 6  # evaluations with the long period held


def as_ramp(fit: Refit) -> Refit:
    """The fit, or one with a long period where the last effect is a sine and a ramp explains the records as well.

    Parameters
    ----------
    fit : Refit
        Converged, with one effect or more.
    """
    structure, last = fit.structure, fit.structure.effects[-1]
    if not last.effect.paired or not fit.records:
        return fit
    values, span = structure.quantities(fit.v)[-1], max(path.span for path in fit.records)
    if not span < values["period"] < _LONG * span:
        return fit
    time = fit.records[0].time
    middle, slow = 0.5 * (time[0] + time[-1]), 2.0 * math.pi / (_LONG * span)
    size = last.effect.size.name
    slope = values[size] * math.cos(2.0 * math.pi * middle / values["period"] + values[last.effect.paired])
    slope *= 2.0 * math.pi / values["period"]
    phase = -slow * middle + (0.0 if slope > 0 else math.pi)
    ramp = {**values, "period": _LONG * span, size: abs(slope) / slow,
            last.effect.paired: math.remainder(phase, 2.0 * math.pi)}
    low, high = (bound.copy() for bound in structure.bounds)
    v = fit.v.copy()
    first = structure.n_parameters + structure.n_effects - len(last.effect.free)
    for at, quantity in enumerate(last.effect.free, start=first):
        v[at] = math.log(ramp[quantity.name]) if quantity.lower > 0 else ramp[quantity.name]
        if quantity.name == "period":
            low[at] = high[at] = v[at]
    try:
        v = descend(Whitened(structure, fit.whiteners), np.clip(v, low, high), (low, high), _WITH_FIXED, ENOUGH).at.v
        slower = extended(fit, structure, v)
    except (Diverged, InputError):
        return fit
    longer = structure.quantities(slower.v)[-1]["period"] > values["period"]
    n = fit.n_readings
    return slower if longer and n * math.log(slower.rss / fit.rss) < math.log(n) else fit
