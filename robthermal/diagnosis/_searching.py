"""The search from its first stage to its last, with the network taken to be right and with one that is too coarse."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ._judge import Progress, Validation
from .evidence import promised, validation_data
from .fit import Refit, coarsened, extended, leaves_far_less
from .search import (
    Accepted,
    SearchState,
    accept,
    begin,
    beside,
    compare,
    exchange,
    from_slow_thermometer,
    reconsider,
    refit_candidates,
    revise,
    shortlist,
    validate,
)

_FEW = 5  # evaluations with other filters, from the optimum with its own
_NOISE_ONLY = 1.2  # whitened variance up to which a fit leaves noise, its level renewed
_RAISED = 1.1  # factor on a declared level from which it may hold what a finer network would change


def searched(nominal: Refit, names: tuple[str, ...] | None, validation: Validation, progress: Progress) -> SearchState:
    """Search for effects with the network taken to be right.

    Parameters
    ----------
    nominal : Refit
        Nominal system refitted.
    names : tuple of str, optional
        Effects to try; None for the whole catalog.
    validation : Validation
        Data that no fit has seen; they may take names back.
    progress : callable
        Called with a sentence before every stage.
    """
    progress("trying every effect of the catalog at every place")
    state = accepted_effects(begin(nominal, names), progress)
    if len(state.rounds) > 1 and not state.misfit_left:
        progress(f"choosing each of {len(state.rounds)} effects again beside the others")
    state = revise(state)
    if len(state.rounds) > 1 and not state.misfit_left:
        progress("selecting all effects at once, to compare")
    return exchanged(validated(compare(state), validation, progress), validation)


def coarsely_searched(finer: Refit, exact: SearchState, progress: Progress) -> SearchState:
    """Search for effects beside a network that may be too coarse; nothing is revised yet.

    Parameters
    ----------
    finer : Refit
        Nominal system refitted together with what a finer network would change.
    exact : SearchState
        Search with the network taken to be right; its first effect is tried from where it was found.
    progress : callable
        Called with a sentence before every stage.
    """
    progress("allowing for a network that is too coarse, and searching again")
    return accepted_effects(begin(finer, exact.names), progress, exact.rounds[0] if exact.rounds else None)


def validated(state: SearchState, validation: Validation, progress: Progress) -> SearchState:
    """Take back what validation data contradict.

    Parameters
    ----------
    state : SearchState
        Complete state of the search.
    validation : Validation
        Data that no fit has seen.
    progress : callable
        Called with a sentence before every stage.
    """
    if not state.rounds or validation.data is None or state.misfit_left:
        return state
    progress("testing on the validation data whether any effect is contradicted")
    return validate(state, validation_data(state.fit, validation.data, validation.operating_point))


def exchanged(state: SearchState, validation: Validation) -> SearchState:
    """List what effects may be together that none may be alone.

    Parameters
    ----------
    state : SearchState
        Complete state of the search.
    validation : Validation
        Data that no fit has seen.
    """
    if not state.rounds or validation.data is None:
        return exchange(state)
    return exchange(state, validation_data(state.fit, validation.data, validation.operating_point))


def accepted_effects(state: SearchState, progress: Progress, known: Accepted | None = None) -> SearchState:
    """Add effects one by one while any is beyond doubt.

    Parameters
    ----------
    state : SearchState
        State from `begin`.
    progress : callable
        Called with a sentence before every stage.
    known : Accepted, optional
        Effect found before, on the same nominal system; it is a candidate of the first round.
    """
    found = _added(state, progress, known)
    if _noise_only(found.fit):
        return found
    begun = from_slow_thermometer(found)
    if begun is None:
        return found
    progress("searching again from thermometers slower than the lumps that they read")
    other = _added(begun, progress)
    return other if leaves_far_less(other.fit, found.fit) else found


def _added(state: SearchState, progress: Progress, known: Accepted | None = None) -> SearchState:
    """Add effects one by one while any is beyond doubt."""
    again = False
    while not state.complete or (state.misfit_left and not again):
        if state.complete:
            again, state = True, reconsider(state)
            continue
        if state.rounds:
            progress(f"trying every effect again beside {len(state.rounds)} accepted")
        state = shortlist(state)
        if state.rounds and not state.misfit_left and _only_coarse(state):
            return replace(state, complete=True, misfit_left=True)
        if not state.complete:
            progress("refitting the best candidates")
            state = refit_candidates(state)
            if known is not None and not state.rounds:
                state = replace(state, short=beside(state.short, known.best))
            state = accept(state)
    return replace(state, current=state.scores)  # signatures of all candidates, once more for every effect


def _only_coarse(state: SearchState) -> bool:
    """Whether what is left beside the effects accepted is what a finer network would change: no more effects then.

    It is not where one more effect promises to explain it with fewer unknowns, by their evidence.
    """
    fit = state.fit
    if fit.structure.coarse or not fit.records or _noise_only(fit):
        return False
    finer = coarsened(fit)
    # random heat is a guess more often than the noise of a sensor: at its limit it is no sign of missing physics
    if not finer.structure.n_coarse or finer.variance >= _NOISE_ONLY or finer.levels.sensors_exhausted:
        return False
    least = fit.rss if state.complete else min(promised(fit, state.current, i) for i in state.current.order)
    alike = extended(fit, finer.structure, finer.v, _FEW)
    gain = fit.n_readings * math.log(least / alike.rss)
    return gain > 0.0 and gain > _price(alike)


def _price(finer: Refit) -> float:
    """Twice the logarithm of what the unknowns of a finer network cost in evidence (Laplace), which BIC approximates.

    BIC counts log n for each; they have priors, and what records say of some of them is little.
    """
    structure = finer.structure
    a = structure.n_common - structure.n_coarse
    own = np.arange(a, structure.n_common)
    R = np.linalg.qr(np.concatenate([np.delete(finer.J, own, axis=1), finer.J[:, own]], axis=1)).R
    return 2.0 * float(np.sum(np.log(np.abs(np.diag(R)[-own.size:]))))


def _noise_only(fit: Refit) -> bool:
    """Whether a fit leaves noise of the declared level: where more is left, a level has been raised."""
    return fit.variance < _NOISE_ONLY and max([fit.levels.disturbance, *fit.levels.noise.values()]) < _RAISED
