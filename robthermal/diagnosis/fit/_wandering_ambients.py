"""A fit whose ambients wander where no record holds them."""

from __future__ import annotations

from ...errors import Diverged
from ._noise_scaling import with_wandering_ambients
from ._refit import Refit
from ._refitting import fitted

_CLEAR = 50.0  # by which -2 log likelihood has to fall: a room that stands still is the simpler answer


def with_random_ambients(fit: Refit) -> Refit | None:
    """The same structure refitted with ambients that wander about what it says; None where they need not.

    Parameters
    ----------
    fit : Refit
        Fit to records, with ambients that stand still.
    """
    found = with_wandering_ambients(fit.records, fit.floor, fit.levels.declared) if fit.records else None
    if found is None or found[1] < _CLEAR:
        return None
    try:
        return fitted(fit.structure, fit.v, fit.floor, found[0])
    except Diverged:
        return None
