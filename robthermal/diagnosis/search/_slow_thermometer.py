"""The other beginning of a search in which thermometers lag: they are slower than the lumps that they read.

By itself a lump with a lagged thermometer is the same either way round, and the search takes the way that is nearer to
the declared parameters. What else is missing looks different from there: heat that reaches a neighbor through a quick
lump is no heat that reaches it at once.
"""

from __future__ import annotations

from dataclasses import replace

from ...errors import Diverged, InputError
from ..fit import Refit, exchanged, extended, fitted, lag_name, lags_of
from ._decide import Accepted
from ._short_list import Entry
from ._stages import begin
from ._state import SearchState

_LAG = "sensor_lag"


def from_slow_thermometer(state: SearchState) -> SearchState | None:
    """The search with nothing but the first lag of a thermometer accepted, exchanged with its lump's time constant.

    Where the nominal system has lags of thermometers that are estimated: nothing accepted, all of them exchanged.

    Parameters
    ----------
    state : SearchState
        Complete state of the search.

    Returns
    -------
    SearchState or None
        None where no lag of a thermometer was accepted, could not be told from what was, or is estimated; or where
        nothing of its lump is.
    """
    lags = {name: lump for name, lump in lags_of(state.nominal).items() if name.startswith("sensors.")}
    if lags:
        nominal = _renewed(exchanged(state.nominal, lags))
        return None if nominal is None else begin(nominal, state.names)
    lag = next((entry for round_ in state.rounds for entry in (round_.best, *round_.contenders)
                if entry.candidate.effect.name == _LAG), None)
    other = None if lag is None else _exchanged(state.nominal, lag)
    if lag is None or other is None:
        return None
    first = Accepted(state.nominal, best=replace(lag, fit=other, delta_bic=state.rounds[0].best.delta_bic))
    return replace(state, rounds=(first,), fit=other, complete=False, misfit_left=False)


def _exchanged(nominal: Refit, lag: Entry) -> Refit | None:
    """The nominal system with the lag alone, exchanged with the time constant of its lump."""
    structure = nominal.structure.with_effect(lag.candidate)
    try:
        alone = extended(nominal, structure, structure.carried(nominal.structure, nominal.v, [lag.found]))
        other = exchanged(alone, {name: lump for name, lump in lags_of(alone).items()
                                  if name == lag_name(*lag.candidate.key)})
    except (Diverged, InputError):
        return None
    return _renewed(other)


def _renewed(fit: Refit | None) -> Refit | None:
    """With filters and noise levels of its own; None where the model runs away from there."""
    try:
        return None if fit is None else fitted(fit.structure, fit.v, fit.floor, fit.levels)
    except (Diverged, InputError):
        return None
