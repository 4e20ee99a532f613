"""A fit with lags and the time constants of their lumps exchanged: another optimum (`fitting.exchanged_lags`).

A lag is a parameter of the fit table, or the quantity of an effect that has been added.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...errors import Diverged, InputError
from ...fitting import choices_of, exchanged_lags, lagged_parts
from ._refit import Refit
from ._refitting import exact, extended, fitted
from ._whitened import Whitened

_TIME = "time_constant"
_FAR_LESS = 0.5  # of the sum of squares: what is left with the times exchanged, where these are taken
_FEW = 5  # evaluations with other filters, from the optimum with its own
_LARGE = 1.5  # whitened variance
_NEAR = 20.0  # times the sum of squares: what exchanged times leave before they are fitted, where an optimum is near
_EVALUATIONS = 20  # from times exchanged
_NAMES = {"sensor_lag": "sensors.{}.time_constant", "input_lag": "inputs.{}.drive.time_constant"}


def lag_name(effect: str, where: tuple[str, ...]) -> str:
    """Name of the parameter that a lag adds; empty for other effects.

    Parameters
    ----------
    effect : str
        Name of the effect.
    where : tuple of str
        Parts that it acts on.
    """
    return _NAMES[effect].format(where[0]) if effect in _NAMES else ""


def lags_of(fit: Refit) -> dict[str, str]:
    """Lump of every lag that is estimated, by the name of the parameter.

    Parameters
    ----------
    fit : Refit
        Fit whose table or effects may hold lags.
    """
    estimated = {*fit.structure.ranges.flat, *_effects(fit)}
    return {name: lump for name, lump in lagged_parts(fit.structure.base).items() if name in estimated}


def exchanged(fit: Refit, lags: Mapping[str, str]) -> Refit | None:
    """The fit with some lags and the time constants of their lumps exchanged, with the same filters.

    Parameters
    ----------
    fit : Refit
        Fit to start from.
    lags : mapping of str to str
        Lumps, by the names of the lags, from `lags_of`.

    Returns
    -------
    Refit or None
        None where nothing of a lump is estimated, its model runs away from there, or no optimum is near.
    """
    structure, ranges = fit.structure, fit.structure.ranges
    values = ranges.values(fit.v[:structure.n_parameters])
    quantities, places = structure.quantities(fit.v), _effects(fit)
    at = {name: i for i, group in enumerate(ranges.members) for name in group}
    before = {name: quantities[places[name]][_TIME] if name in places else float(values[at[name]]) for name in lags}
    found = exchanged_lags(fit.system, ranges, values, {lump: before[name] for name, lump in lags.items()})
    if found is None:
        return None
    start, own = found
    for name, lump in lags.items():
        if name in places:
            quantities[places[name]][_TIME] = own[lump]
        else:
            start[at[name]] = np.clip(own[lump], ranges.lower[at[name]], ranges.upper[at[name]])
    v = structure.start(start, quantities)
    first = structure.n_common - structure.n_coarse
    v[first:] = fit.v[first:]
    v = np.clip(v, *structure.bounds)
    try:
        if float(np.sum(Whitened(structure, fit.whiteners).residual(v) ** 2)) > _NEAR * fit.rss:
            return None
        return extended(fit, structure, v, _EVALUATIONS)
    except (Diverged, InputError):
        return None


def with_exchanged_lags(fit: Refit) -> Refit:
    """The fit, or one with lags exchanged with the time constants of their lumps where that leaves far less.

    Where no large misfit is left nothing is tried.

    Parameters
    ----------
    fit : Refit
        Fit with lags or without.
    """
    for _ in range(1 + len(lags_of(fit))):  # each may have to be exchanged beside the others
        if fit.variance < _LARGE:
            return fit
        try:
            better = next((other for other in (exchanged(fit, some) for some in choices_of(lags_of(fit)))
                           if other is not None and other.rss < _FAR_LESS * fit.rss and leaves_far_less(other, fit)),
                          None)
            if better is None:
                return fit
            fit = fitted(better.structure, better.v, better.floor, better.levels)
        except (Diverged, InputError):  # the model runs away from there: the fit stays
            return fit
    return fit


def leaves_far_less(other: Refit, fit: Refit) -> bool:
    """Whether another fit leaves less than half of the sum of squares, with the same filters.

    In the network as it is: what a finer one would change stands in for a lag, in either optimum.

    Parameters
    ----------
    other : Refit
        Fit with lags exchanged, and perhaps with other effects.
    fit : Refit
        Fit that it is compared with.
    """
    if not fit.structure.coarse:
        return extended(fit, other.structure, other.v, _FEW).rss < _FAR_LESS * fit.rss
    return leaves_far_less(exact(other), exact(fit))


def _effects(fit: Refit) -> dict[str, int]:
    """Place of every effect that is a lag, by the name of the parameter that it adds."""
    return {lag_name(one.effect.name, one.where): place for place, one in enumerate(fit.structure.effects)
            if one.effect.name in _NAMES}
