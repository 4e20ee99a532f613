"""Sets of alternatives that the training records cannot resolve, and the validation records can."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..data import DataSet
from ..effects import Candidate
from ..evidence import BIC_GAP, negative_log_predictive_density
from ..fit import Refit, fitted
from ._decide import Accepted, Decision
from ._short_list import Entry, Key, delta_bic, refiltered


def resolve_alternatives(rounds: tuple[Accepted, ...], fit: Refit, data: Sequence[DataSet]
               ) -> tuple[tuple[Accepted, ...], Refit]:
    """Order the names of every ambiguous set by the evidence of all records, and drop those beyond doubt worse.

    BIC stands for -2 log p(training); -2 log p(validation | training) is added. Nothing is fitted to the validation
    records, and no name comes back that the training records have excluded.

    Parameters
    ----------
    rounds : tuple of Accepted
        In the order of the effects of the fit.
    fit : Refit
        Fit with these effects.
    data : sequence of DataSet
        Validation data, which no fit has seen.
    """
    for round_ in rounds:
        rivals = [entry for entry in round_.contenders if takes_the_place(entry, round_, fit)]
        if rivals:
            decision, fit = _weighed(round_, rivals, fit, data)
            rounds = tuple(decision if one is round_ else one for one in rounds)
    places = [candidate.key for candidate in fit.structure.effects]
    return tuple(sorted(rounds, key=lambda one: places.index(one.best.candidate.key))), fit


def ruled_out(rounds: Sequence[Decision]) -> tuple[Candidate, ...]:
    """Everything that the validation records have dropped from the sets."""
    return tuple(entry.candidate for round_ in rounds for entry in round_.ruled_out)


def _weighed(round_: Accepted, rivals: Sequence[Entry], fit: Refit, data: Sequence[DataSet]
             ) -> tuple[Accepted, Refit]:
    """One set with all records, and the fit with its best name."""
    best = round_.best
    own = replace(best, fit=fit, delta_bic=delta_bic(round_.before, fit))
    entries = [own, *refiltered(round_.before, fit, rivals)]
    validation = negative_log_predictive_density([entry.fit for entry in entries], fit, data)
    evidence = [density - entry.delta_bic for density, entry in zip(validation, entries, strict=True)]
    order = sorted(range(len(entries)), key=evidence.__getitem__)
    most = evidence[order[0]] + BIC_GAP
    alike = [entries[i] for i in order if evidence[i] <= most]
    worse = tuple(entries[i] for i in order if evidence[i] > most)
    first = alike[0]
    if first is not own:
        fit = fitted(first.fit.structure, first.fit.v, first.fit.floor, first.fit.levels)
    first = replace(first, fit=fit, delta_bic=best.delta_bic + first.delta_bic - own.delta_bic)
    unweighed = (entry for entry in round_.contenders if not any(entry is rival for rival in rivals))
    return replace(round_, best=first, contenders=(*alike[1:], *unweighed), ruled_out=worse), fit


def takes_the_place(entry: Entry, round_: Accepted, fit: Refit) -> bool:
    """Whether a rival was fitted beside all the other accepted effects.

    Parameters
    ----------
    entry : Entry
        Rival of an effect.
    round_ : Accepted
        Round that accepted the effect.
    fit : Refit
        Fit with all accepted effects.
    """
    def others(one: Refit, name: Entry) -> set[Key]:
        return {candidate.key for candidate in one.structure.effects} - {name.candidate.key}

    return others(entry.fit, entry) == others(fit, round_.best)
