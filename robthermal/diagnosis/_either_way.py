"""Which lags may change places with the time constants of their lumps, and leave as much: then both are said."""

from __future__ import annotations

from ..fitting import is_elsewhere, own_times
from ..thermal import parameter_in_words
from ._judge import Verdict
from .fit import Refit, exchanged, lags_of

_AS_GOOD = 10.0  # of the sum of squares, in what a reading adds to it: the records do not tell one from the other


def either_way(fit: Refit, verdict: Verdict) -> dict[str, float]:
    """The other value [s] of every estimated lag that the records do not tell from its lump's time constant.

    Parameters
    ----------
    fit : Refit
        Fit with lags or without.
    verdict : str
        Nothing is asked of a fit that explains nothing.
    """
    out = {}
    for name, lump in lags_of(fit).items() if verdict != "unexplained" else ():
        other = exchanged(fit, {name: lump})
        if other is None or other.rss - fit.rss > _AS_GOOD * max(fit.variance, 1.0):
            continue
        lag, new = fit.system.parameter(name), other.system.parameter(name)
        own = own_times(fit.system)[lump]
        if is_elsewhere(lag, own, new):
            out[name] = new
    return out


def either_way_in_words(fit: Refit, others: dict[str, float]) -> list[str]:
    """What it means that lags may have another value, a sentence or three each.

    Parameters
    ----------
    fit : Refit
        Fit with the lags.
    others : dict
        Other values, from `either_way`.
    """
    return [f"The records are explained as well with {parameter_in_words(name)} {other:.3g} s as {now:.3g} s: it and "
            f"the time constant of {lump} may change places. The temperature of {lump} itself is another one then, its "
            f"reading the same. Measure the lag by itself, or give what else is known of {lump} (capacity, gain of its "
            "heater, losses) with its standard deviation under [fit]."
            for name, other in others.items()
            for now, lump in [(fit.system.parameter(name), lags_of(fit)[name])]]
