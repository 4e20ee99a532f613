"""A second look at what shapes an effect where the sum of squares has several minima.

A step of a conductance at the wrong side of a change of the inputs is a minimum of its own; residuals are cheap, and
the other unknowns are nearly right there already. A capacity beside the capacity of a measured lump has two, a fast
and a slow one; there the nominal parameters have to follow.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...errors import Diverged, InputError
from ..fit import ENOUGH, LIMIT, Refit, Whitened, descend, extended

Array = NDArray[np.float64]
_FINE = 12  # values on either side, as far as the next value tried when candidates were scored
_LOWER = 1e-3  # of the sum of squares: a minimum of its own
_FACTORS = (0.1, 0.25, 0.5, 2.0, 4.0, 10.0)  # other time constants than the one found
_WITH_FIXED = 4  # evaluations with such a time constant held
_NEAR = 30.0  # ΔBIC that releasing it may well bring


def scanned(fit: Refit) -> Refit:
    """The fit, or a better one from another time or level that shapes its last effect.

    Parameters
    ----------
    fit : Refit
        Converged, with one effect or more.

    Returns
    -------
    Refit
    """
    effect = fit.structure.effects[-1].effect
    for place, quantity in enumerate(effect.free):
        if place and callable(quantity.grid) and not effect.paired:
            fit = _along(fit, place)
    return fit


def _along(fit: Refit, place: int) -> Refit:
    """The same for one quantity of the last effect."""
    structure, (low, high) = fit.structure, fit.structure.bounds
    last = structure.effects[-1]
    quantity = last.effect.free[place]
    assert callable(quantity.grid)
    tried = np.sort([math.log(x) if quantity.lower > 0 else x for x in quantity.grid(fit.paths[0], last.where)])
    at = structure.n_parameters + structure.n_effects - len(last.effect.free) + place
    values = fit.v[at] + np.median(np.diff(tried)) * np.arange(-_FINE, _FINE + 1) / _FINE
    problem, best, least = Whitened(structure, fit.whiteners), fit.v, (1.0 - _LOWER) * fit.rss
    for value in values[(values > low[at]) & (values < high[at])]:
        v = fit.v.copy()
        v[at] = value
        try:
            z = problem.residual(v)
        except (Diverged, InputError):
            continue
        if z @ z < least:
            best, least = v, float(z @ z)
    return fit if best is fit.v else extended(fit, structure, best, LIMIT)


def retried(fit: Refit, before: Refit) -> Refit:
    """The fit, or a better one from another time constant of its last effect.

    Parameters
    ----------
    fit : Refit
        Converged, with one effect or more.
    before : Refit
        Without the last one: its parameters are another start.

    Returns
    -------
    Refit
    """
    quantities = fit.structure.effects[-1].effect.free
    first = fit.structure.n_parameters + fit.structure.n_effects - len(quantities)
    for at, quantity in enumerate(quantities[1:], start=first + 1):
        if not callable(quantity.grid) and quantity.lower > 0:
            fit = min((fit, *_from_other_times(fit, before, at)), key=lambda new: new.rss)
    return fit


def _from_other_times(fit: Refit, before: Refit, at: int) -> Iterator[Refit]:
    """Fits from other values of one time constant, of which no smaller sum of squares can be ruled out.

    The parameters begin as they are in the fit, and where that leads nowhere as they were before the effect: at a wrong
    time constant they have gone far away.
    """
    structure = fit.structure
    as_before = structure.carried(before.structure, before.v, structure.quantities(fit.v))
    for factor in _FACTORS:
        for start in (fit.v, as_before):
            v, (low, high) = start.copy(), (bound.copy() for bound in structure.bounds)
            v[at] = low[at] = high[at] = fit.v[at] + math.log(factor)
            try:
                held = descend(Whitened(structure, fit.whiteners), v, (low, high), _WITH_FIXED, ENOUGH).at
                if held.z @ held.z < fit.rss * math.exp(_NEAR / fit.n_readings):
                    yield extended(fit, structure, held.v, LIMIT)
                    break
            except (Diverged, InputError):
                continue
