"""Rivals where the model or its noise is not exact: what ΔBIC excludes too soon, and what validation data do."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from ..errors import Diverged, InputError
from ._judge import Validation
from ._lasting import lasts
from .evidence import SURE, left, reproducible, score, validation_data
from .fit import Refit, exact
from .search import (
    ALIKE,
    Accepted,
    Entry,
    SearchState,
    heats_instead,
    other_laws,
    other_thermometers,
    refit_short_list,
    resolve_places,
    with_neighbors,
    with_other_end,
    without,
)

CLOSED_SQUARE = 1.0 - (1.0 - 0.3) ** 2  # of the excess mean square of the validation records: 30 % of its rms


def with_rivals(state: SearchState, finer: Refit, validation: Validation) -> SearchState:
    """List beside every effect the rivals that it does not beat in block after block, refitted beside the others.

    ΔBIC excludes them too soon where the model is not exact. Beside a finer network they were compared when the effect
    was accepted; the same effect at neighboring lumps and the lag of a lump's other end are added there, and places
    that training and validation records exclude together are dropped. A rival with which the validation data keep their
    gap could not be named itself, and is none. An offset of another thermometer is asked by itself, from its opposite.

    Parameters
    ----------
    state : SearchState
        With the effects that may be named.
    finer : Refit
        Without any effect.
    validation : Validation
        Data that no fit has seen.
    """
    if finer.structure.n_coarse:
        listed = _with_other_thermometers(at_neighboring_lumps(state, validation), finer, validation)
        return _with_other_laws(_at_one_place(listed, finer, validation), finer, validation)
    rounds = []
    for place, round_ in enumerate(state.rounds):
        known = [entry for entry in round_.contenders if len(entry.fit.structure.effects) < len(state.rounds)
                 or predicts(entry.fit, finer, validation)]
        rivals = (entry for entry in _rivals(state, place, finer) if predicts(entry.fit, finer, validation))
        rounds.append(replace(round_, contenders=(*known, *rivals)))
    listed = _with_other_thermometers(replace(state, rounds=tuple(rounds)), finer, validation)
    return _with_other_laws(listed, finer, validation)


def _with_other_thermometers(state: SearchState, finer: Refit, validation: Validation) -> SearchState:
    """List beside an offset of a thermometer others, and heats at its lump, that do nearly as much and predict."""
    return _with_others(state, finer, validation, lambda round_, less: (
        *other_thermometers(round_, state.fit, less), *heats_instead(round_, state.fit, less, state.names)))


def _with_other_laws(state: SearchState, finer: Refit, validation: Validation) -> SearchState:
    """List radiation beside natural convection, and the reverse, where it does nearly as much and predicts."""
    return _with_others(state, finer, validation,
                        lambda round_, less: other_laws(round_, state.fit, less, state.names))


def _with_others(state: SearchState, finer: Refit, validation: Validation,
                 asked: Callable[[Accepted, Refit], Iterable[Entry]]) -> SearchState:
    """List beside every effect what is asked for of it and of the fit without it, where that predicts."""
    def others(place: int, round_: Accepted) -> list[Entry]:
        less = without(state.fit, place, finer, round_.before)
        return [] if less is None else [entry for entry in asked(round_, less)
                                        if predicts(entry.fit, finer, validation)]

    return replace(state, rounds=tuple(replace(round_, contenders=(*round_.contenders, *others(place, round_)))
                                       for place, round_ in enumerate(state.rounds)))


def _at_one_place(state: SearchState, finer: Refit, validation: Validation) -> SearchState:
    """The state without the places that training and validation records exclude.

    A place that takes that of the first one has to last and to predict as that one had to; else all of them stay.
    """
    if validation.data is None or not state.rounds:
        return state
    data = validation_data(state.fit, validation.data, validation.operating_point)
    try:
        rounds, fit = resolve_places(state.rounds, state.fit, data)
    except (Diverged, InputError):  # the model with one of them runs away: nothing is decided
        return state
    if rounds[-1].best.candidate.key != state.rounds[-1].best.candidate.key:
        if not (lasts(rounds, fit, finer, len(rounds) - 1, validation) and predicts(fit, finer, validation)):
            return state
    return replace(state, rounds=rounds, fit=fit)


def at_neighboring_lumps(state: SearchState, validation: Validation | None = None) -> SearchState:
    """List beside every effect the same one at neighboring lumps, and the lag of a lump's other end.

    Parameters
    ----------
    state : SearchState
        With the effects that may be named.
    validation : Validation, optional
        Data that no fit has seen: places that predict them better are listed sooner.
    """
    named = {one.best.candidate.key for one in state.rounds}

    def better(entry: Entry) -> bool:
        others = {one.key for one in entry.fit.structure.effects} - {entry.candidate.key}
        if validation is None or validation.data is None or len(others) < len(named) - 1 or not others < named:
            return False  # beside fewer effects than the answer has
        after, own = (_left_held_out(fit, state.nominal, validation) for fit in (entry.fit, state.fit))
        return after < own

    return replace(state, rounds=tuple(with_other_end(with_neighbors(one, state.names, better), named, state.names)
                                       for one in state.rounds))


def _left_held_out(fit: Refit, nominal: Refit, validation: Validation) -> float:
    """Free-run error that a fit leaves of validation data; infinite where the model runs away."""
    try:
        held = validation.predicted(exact(nominal), exact(fit))
    except (Diverged, InputError):
        return math.inf
    return math.inf if held is None or not math.isfinite(held.gap.after) else held.gap.after


def predicting(state: SearchState, finer: Refit, validation: Validation) -> SearchState | None:
    """The state with a rival in the place of an effect, where only so the validation data lose their gap; else None.

    Training records may prefer the wrong one of two names that they cannot distinguish; data under other conditions
    distinguish them at once, but can say so only if the other one is tried.

    Parameters
    ----------
    state : SearchState
        With the effects that hold over the training records.
    finer : Refit
        Without any effect.
    validation : Validation
        Data that no fit has seen.
    """
    if validation.data is None or not state.rounds or predicts(state.fit, finer, validation):
        return None
    tried = [(place, entry) for place, round_ in enumerate(state.rounds)
             for entry in _all_rivals(state, place, finer) if predicts(entry.fit, finer, validation)]
    if not tried:
        return None
    place, best = min(tried, key=lambda one: one[1].fit.rss)
    others = tuple(entry for at, entry in tried if at == place and entry is not best)
    kept = (*state.rounds[:place], *state.rounds[place + 1:])
    own = replace(state.rounds[place], best=best, contenders=others)
    return replace(state, rounds=(*kept, own), fit=best.fit)


def predicts(fit: Refit, nominal: Refit, validation: Validation) -> bool:
    """Whether a fit closes enough of the gap of the validation data, if there are any.

    Parameters
    ----------
    fit, nominal : Refit
        With effects, and without any.
    validation : Validation
        Data that no fit has seen.
    """
    try:
        held = validation.predicted(exact(nominal), exact(fit))
    except (Diverged, InputError):  # a model that runs away predicts nothing
        return False
    return held is None or left(held.gap).share_explained >= CLOSED_SQUARE


def _all_rivals(state: SearchState, place: int, finer: Refit) -> list[Entry]:
    """What the training records cannot distinguish from an effect, fitted beside the others as they are."""
    others = [round_.best.candidate.key for at, round_ in enumerate(state.rounds) if at != place]
    known = [entry for entry in state.rounds[place].contenders
             if [one.key for one in entry.fit.structure.effects] == [*others, entry.candidate.key]]
    return [*known, *([] if finer.structure.n_coarse else _rivals(state, place, finer))]


def _rivals(state: SearchState, place: int, finer: Refit) -> Sequence[Entry]:
    """Candidates that do as much as an effect in its place, but for the error of the model; no contenders of it."""
    round_ = state.rounds[place]
    less = without(state.fit, place, finer, round_.before)
    if less is None:
        return []
    known = {round_.best.candidate.key, *(entry.candidate.key for entry in round_.contenders)}
    return [entry for entry in refit_short_list(less, score(less, state.names)).entries
            if entry.candidate.key not in known
            and (reproducible(state.fit, entry.fit) < SURE or _nearly(state.fit, entry.fit, less))]


def _nearly(fit: Refit, rival: Refit, less: Refit) -> bool:
    """Whether a rival does nearly all that the effect does: the model error decides between them, not the records."""
    return less.rss - rival.rss > ALIKE * (less.rss - fit.rss)
