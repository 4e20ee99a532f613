"""A finer look at what shapes an effect where the sum of squares has several minima: a time, a dew point.

A step of a conductance at the wrong side of a change of the inputs is a minimum of its own. Residuals are cheap, and
the other unknowns are nearly right there already.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..errors import Diverged, InputError
from ._refit import Refit
from ._refitting import LIMIT, extended
from ._whitened import Whitened

Array = NDArray[np.float64]
_FINE = 12  # values on either side, as far as the next value tried when candidates were scored
_LOWER = 1e-3  # of the sum of squares: a minimum of its own


def scanned(fit: Refit) -> Refit:
    """The fit, or a better one from another value of a quantity that shapes its last effect.

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
