"""Stages of the search, each from state to state: shortlist, refit, accept, revise, compare, validate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..data import DataSet
from ..evidence import BIC_GAP, Scores, explains, promised, promising, score
from ..fit import Refit, coarsened, extended, with_exchanged_lags
from ._contradicted import without_contradicted
from ._decide import Accepted, decide
from ._exchange import with_exchanged
from ._joint_check import checked_jointly
from ._places import FIRST_ORDER
from ._resolve_alternatives import resolve_alternatives
from ._revise import needed, revised
from ._short_list import Entry, ShortList, leaves_large_misfit, refit_short_list
from ._state import SearchState

MOST_EFFECTS = 3
_LARGE = 1.5  # whitened variance
_NEARER = 0.5  # of the misfit beyond noise, that choosing again has to remove where a large one is left
_LEAST = 0.3  # share of a large misfit that the last effect allowed must promise: it has to explain all of it


def begin(nominal: Refit, names: Sequence[str] | None = None) -> SearchState:
    """Score every candidate on the nominal fit; nothing is accepted yet.

    Parameters
    ----------
    nominal : Refit
        Nominal system refitted.
    names : sequence of str, optional
        Effects to try; default the whole catalog.
    """
    scores = score(nominal, names)
    return SearchState(nominal=nominal, names=None if names is None else tuple(names), scores=scores, fit=nominal,
                       current=scores, short=ShortList(nominal, (), {}))


def shortlist(state: SearchState) -> SearchState:
    """Score all candidates beside the accepted ones; the search is complete where none could pass.

    Parameters
    ----------
    state : SearchState
        State with any number of effects accepted.
    """
    if len(state.rounds) == MOST_EFFECTS:
        return replace(state, complete=True)
    scores = score(state.fit, state.names) if state.rounds else state.scores
    state = replace(state, current=scores)
    if not promising(state.fit, scores) or _too_little(state.fit, scores):
        return replace(state, complete=True)
    if len(state.rounds) == MOST_EFFECTS - 1 and too_much_left(state.fit, scores):
        return replace(state, complete=True, misfit_left=True)
    return state


def refit_candidates(state: SearchState) -> SearchState:
    """Refit the best candidates together with the nominal parameters.

    Parameters
    ----------
    state : SearchState
        State from `shortlist`, not complete.
    """
    return replace(state, short=refit_short_list(state.fit, state.current))


def accept(state: SearchState) -> SearchState:
    """Accept the best refitted candidate if it is beyond doubt; else the search is complete.

    Parameters
    ----------
    state : SearchState
        State from `refit_candidates`.

    Returns
    -------
    SearchState
        `short` is empty, and `current` that of the nominal fit until candidates are scored again.
    """
    decision = decide(state.short)
    state = replace(state, short=ShortList(state.fit, (), {}))  # megabytes for every candidate of a long record
    if not isinstance(decision, Accepted):
        return replace(state, complete=True)
    if state.rounds:  # the nominal fit is asked again
        state.fit.without_derivatives()
    decision = replace(decision, best=_with_lags(decision.best))
    rounds, fit = (*state.rounds, decision), decision.best.fit
    if fit.structure.coarse:  # what a finer network changes depends on where the model is
        fit.without_derivatives()
        fit = coarsened(fit)
    left = leaves_large_misfit(state.fit, decision.best) or (len(rounds) == MOST_EFFECTS and fit.variance > _LARGE)
    return replace(state, current=state.scores, rounds=rounds, fit=fit, complete=left, misfit_left=left)


def _with_lags(best: Entry) -> Entry:
    """The accepted effect, with lags exchanged with the time constants of their lumps where that leaves far less."""
    fit = with_exchanged_lags(best.fit)
    if fit is best.fit:
        return best
    gain = extended(best.fit, fit.structure, fit.v).rss
    return replace(best, fit=fit, delta_bic=best.delta_bic + fit.n_readings * math.log(best.fit.rss / gain))


def reconsider(state: SearchState) -> SearchState:
    """Choose each effect again where they leave a large misfit: the first ones were chosen far from the truth.

    Where three effects are missing, what the first of them seems to be may be another one. The search goes on where
    what is chosen again explains clearly more, with room for another effect.

    Parameters
    ----------
    state : SearchState
        Complete state; without a large misfit, or with fewer than two effects, it is returned as it is.
    """
    if not state.misfit_left or len(state.rounds) < 2:
        return state
    rounds, fit = revised(state.rounds, state.nominal, state.names, last_is_new=True, share=_NEARER)
    again = extended(state.fit, fit.structure, fit.v)  # with the filters that the others had
    if fit.n_readings * math.log(state.fit.rss / again.rss) < BIC_GAP:
        return state
    more = len(rounds) < MOST_EFFECTS
    return replace(state, rounds=rounds, fit=fit, complete=not more, misfit_left=not more and fit.variance > _LARGE)


def revise(state: SearchState) -> SearchState:
    """Choose each effect again beside the others, and drop what is not needed any more.

    Parameters
    ----------
    state : SearchState
        Complete state; where a large misfit is left it is returned as it is.
    """
    if state.misfit_left:
        return state
    if len(state.rounds) < 2:
        rounds, fit = needed(state.rounds, state.fit, state.nominal)
    else:
        rounds, fit = revised(state.rounds, state.nominal, state.names, last_is_new=True)
    return replace(state, rounds=rounds, fit=fit)


def compare(state: SearchState) -> SearchState:
    """Compare two effects or more with a selection of all at once, and take that where it explains clearly more.

    Parameters
    ----------
    state : SearchState
        State from `revise`.
    """
    if len(state.rounds) < 2 or state.misfit_left:
        return state
    rounds, fit, joint = checked_jointly(state.rounds, state.fit, state.nominal, state.scores, state.names)
    return replace(state, rounds=rounds, fit=fit, joint=joint)


def validate(state: SearchState, data: Sequence[DataSet]) -> SearchState:
    """Take effects back that validation data contradict, and resolve sets of alternatives where the data can.

    Parameters
    ----------
    state : SearchState
        State from `compare`.
    data : sequence of DataSet
        Validation data, from `validation_data`; nothing is fitted to them.
    """
    rounds, fit = state.rounds, state.fit
    for _ in state.rounds if not state.misfit_left else ():  # a name in another's place may leave nothing of a third
        rounds, fit = resolve_alternatives(*without_contradicted(rounds, fit, state.nominal, data), data)
        fewer, less = needed(rounds, fit, state.nominal)
        if len(fewer) == len(rounds):
            break
        rounds, fit = revised(fewer, state.nominal, state.names) if fewer else (fewer, less)
    return replace(state, rounds=rounds, fit=fit)


def exchange(state: SearchState, data: Sequence[DataSet] = ()) -> SearchState:
    """List what only effects exchanged together can be: sets that explain all records as well.

    Parameters
    ----------
    state : SearchState
        State from `compare` or `validate`.
    data : sequence of DataSet
        Validation data, from `validation_data`, if there are any; nothing is fitted to them.
    """
    if not state.rounds or state.misfit_left:
        return state
    return replace(state, rounds=with_exchanged(state.rounds, state.fit, data, state.names))


def _too_little(fit: Refit, scores: Scores) -> bool:
    """Whether, beside a network that may be too coarse, no candidate explains more than that may have left."""
    least = min((promised(fit, scores, i) for i in scores.order), default=fit.rss)
    return bool(fit.structure.coarse) and least > (1.0 - FIRST_ORDER) * fit.rss


def too_much_left(fit: Refit, scores: Scores) -> bool:
    """Whether the last effect allowed cannot be what is missing: a large misfit would be left, most of this one.

    Parameters
    ----------
    fit : Refit
        Fit with all effects accepted so far.
    scores : Scores
        Scores of all candidates on it.
    """
    if fit.variance <= _LARGE:
        return False
    share = explains(fit, scores)
    return share < _LEAST and 1.0 + (1.0 - share) * (fit.variance - 1.0) > _LARGE
