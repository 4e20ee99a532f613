"""The search for changes: parameters first in the list, then the catalog, each against its own yardstick."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...fitting import Ranges
from ..effects import Candidate, candidates
from ..evidence import ALIAS, Scores, score_candidates
from ..fit import Refit, relinearized
from ..search import Accepted, Entry, between_trials, refit_short_list
from ._excess import excess_of
from ._held import healthy_point
from ._parameter_change import NAME, parameter_changes, relative, says_again
from ._reference import Reference
from ._still_air import with_still_air
from ._yardstick import chance, effective_number, inflation, squares, within_scatter

Key = tuple[str, tuple[str, ...]]
MOST_CHANGES = 2
_ALPHA_PARAMETERS, _ALPHA_CATALOG = 0.03, 0.01  # family-wise
_WORTH_SAYING = 0.2  # chance of the best candidate that is no answer
_SAID = 3  # of those
_HOPE = 2.0  # times what the linearization promises: a refit may gain over it
_NEAR = 1e-3  # of a bound: at it
_UNSURE = 3.0  # times the difference to rivals that is asked of a size that ends at its bound


@dataclass(frozen=True, eq=False)
class Search:
    """What a search for changes found.

    Parameters
    ----------
    fit : Refit
        The new records with all changes accepted.
    rounds : tuple of Accepted
        In order of acceptance.
    scores : Scores
        Scores of all candidates where nothing has changed.
    nearest : str
        What came nearest to an answer where nothing is one, in words; empty if healthy records may well show as much.
    """

    fit: Refit
    rounds: tuple[Accepted, ...]
    scores: Scores
    nearest: str = ""


def searched(new: Refit, reference: Reference, names: Iterable[str] | None) -> Search:
    """Accept changes while any is beyond the scatter of the reference records, and something is left to explain.

    Parameters
    ----------
    new : Refit
        The new records, parameters held near those of a healthy day.
    reference : Reference
        What healthy records show.
    names : iterable of str, optional
        Effects of the catalog to try; default all.
    """
    catalog = None if names is None else list(names)
    tested = _tested(new, reference.listed, catalog)
    first = scores = score_candidates(new, tested)
    fit, rounds, nearest = new, list[Accepted](), ""
    while True:
        tried = _all_refitted(fit, scores, reference)
        found = _one(fit, tried, reference)
        if found is None:
            nearest = _nearest(tried, len(reference.each))
            break
        rounds.append(found)
        fit = found.best.fit
        if len(rounds) == MOST_CHANGES or not excess_of(fit, reference).reasons:
            break  # what is left is within the scatter of healthy records: nothing more to find
        taken = {candidate.key for candidate in fit.structure.effects}
        scores = score_candidates(fit, [candidate for candidate in _tested(fit, reference.listed, catalog)
                                        if candidate.key not in taken])
    return Search(fit, tuple(rounds), first, nearest)


def _tested(fit: Refit, ranges: Ranges, names: Sequence[str] | None) -> list[Candidate]:
    """Changes of listed parameters, and what the catalog adds to them, of parts that the reference records have too."""
    base = fit.structure.base
    there = {one.key for one in candidates(base, names, fit.drifting)}
    listed = [one for one in fit.testable(candidates(fit.system, names, fit.drifting))
              if one.key in there and not says_again(one, fit.system, ranges)]
    return [*parameter_changes(base, ranges), *listed]


def _all_refitted(fit: Refit, scores: Scores, reference: Reference) -> list[_Tried]:
    """Candidates worth a refit: changes of parameters, and what the catalog adds to them."""
    return [one for part, alpha in families(scores) for one in _refitted(fit, part, reference, alpha)]


def families(scores: Scores) -> Iterator[tuple[Scores, float]]:
    """Changes of parameters, then what the catalog adds to them, each with its family-wise chance of a false alarm.

    Parameters
    ----------
    scores : Scores
        Of all candidates.
    """
    own = np.array([candidate.effect.name == NAME for candidate in scores.candidates], bool)
    parameters, catalog = _part(scores, own), _part(scores, ~own)
    yield parameters, _ALPHA_PARAMETERS
    yield _without_repeats(catalog, parameters), _ALPHA_CATALOG


def _one(fit: Refit, tried: Sequence[_Tried], reference: Reference) -> Accepted | None:
    """The best candidate beyond the scatter, with those that the records cannot tell from it."""
    sure = [one for one in tried if one.sure]
    if not sure:
        return None
    best = max(sure, key=lambda one: one.entry.delta_bic)
    kappa = best.kappa * (_UNSURE if _at_bound(best.entry) else 1.0)
    rivals = (one for one in tried if one is not best and not _more_general(one.entry, best.entry)
              and within_scatter(best.entry.delta_bic - one.entry.delta_bic, kappa, len(reference.each)))
    accepted = replace(best.entry, fit=relinearized(best.entry.fit))
    return Accepted(fit, best=accepted, contenders=tuple(sorted((one.entry for one in rivals),
                                                                  key=lambda entry: -entry.delta_bic)))


def _at_bound(entry: Entry) -> bool:
    """Whether the size is the largest that is tried: what the records tell of it is that it is large."""
    size = entry.candidate.effect.size
    value = entry.found[size.name]
    return not size.lower + _NEAR * abs(size.lower) < value < size.upper - _NEAR * abs(size.upper)


def _nearest(tried: Sequence[_Tried], n_records: int) -> str:
    """The least likely of the candidates that are no answer, with their sizes and chances on healthy records."""
    found = sorted((one.entry for one in tried if one.entry.p_value < _WORTH_SAYING), key=lambda one: one.p_value)
    said = "; ".join(f"{one.candidate.label} ({_sizes(one)}; chance {one.p_value:.1g})" for one in found[:_SAID])
    return (f"Nearest to an answer, and no name: {said}. The chance is that healthy records show as much, as far as "
            f"{n_records} of them can tell; more reference records sharpen it.") if said else ""


def _sizes(entry: Entry) -> str:
    """Quantities of a candidate with their standard deviations."""
    candidate = entry.candidate
    values = {q.name: (*entry.values[q.name], q.unit) for q in candidate.effect.quantities}
    values = relative(values) if candidate.effect.name == NAME else values
    return ", ".join(f"{name} {value:.3g} ± {std:.1g} {unit}".rstrip(" -")
                     for name, (value, std, unit) in values.items())


@dataclass(frozen=True, eq=False)
class _Tried:
    """A candidate refitted, its yardstick, and whether it is beyond the scatter."""

    entry: Entry
    kappa: float
    sure: bool


def _refitted(fit: Refit, scores: Scores, reference: Reference, alpha: float) -> Iterator[_Tried]:
    """Candidates refitted, with the chance that healthy records give, for the family; none where none is promising."""
    n = len(reference.each)
    family = effective_number(scores.signatures, n)
    if not any(family * chance(_HOPE * squares(fit, scores, i), 1, 1.0, n) < alpha for i in scores.order):
        return
    for entry in _entries(fit, scores):
        kappa = inflation(entry.candidate, reference.each, fit.n_readings)
        dimension, decrease = len(entry.candidate.effect.free), fit.rss - entry.fit.rss
        p = min(family * _trials(entry.candidate, fit) * chance(decrease, dimension, kappa, n), 1.0)
        bic = decrease - dimension * math.log(fit.n_readings)  # the noise is known: no logarithm of the sum of squares
        yield _Tried(replace(entry, p_value=p, delta_bic=bic), kappa, p < alpha)


def _entries(fit: Refit, scores: Scores) -> list[Entry]:
    """The short lists from the fit and from the parameters of a healthy day: the better refit of every candidate.

    Without its change the fit bends the other parameters as far as their scatter lets them; what it is linear about
    there may promise nothing of the change that is true, and much of that of the next link of a chain.
    """
    healthy = healthy_point(fit)
    lists = (refit_short_list(fit, scores), refit_short_list(healthy, score_candidates(healthy, scores.candidates)))
    best: dict[Key, Entry] = {}
    for entry in (entry for short in lists for entry in short.entries):
        other = best.get(entry.candidate.key)
        if other is None or entry.fit.rss < other.fit.rss:
            best[entry.candidate.key] = entry
    return [with_still_air(entry) for entry in best.values()]


def _trials(candidate: Candidate, fit: Refit) -> float:
    """Trial values of a candidate, periods in all records; of a pair the phase is none, it is a second quantity."""
    count = max(len(candidate.trials(fit.paths[0])), 1)
    return max(0.5 * count, 1.0) * between_trials(fit.records) if candidate.effect.paired else float(count)


def _part(scores: Scores, some: NDArray[np.bool_]) -> Scores:
    """Some of the candidates."""
    at = np.flatnonzero(some)
    return Scores(tuple(scores.candidates[i] for i in at), scores.size[at], scores.std[at], scores.statistic[at],
                  scores.p_value[at], scores.possible[at], scores.identifiability[at], scores.limit[at],
                  scores.signatures[:, at], scores.n_trials)


def _without_repeats(catalog: Scores, parameters: Scores) -> Scores:
    """Without effects that act on a parameter's own part exactly as a change of it does."""
    alike = 1.0 - (parameters.signatures.T @ catalog.signatures) ** 2 < ALIAS**2
    repeats = [any(alike[i, j] and _same_part(candidate, change) for i, change in enumerate(parameters.candidates))
               for j, candidate in enumerate(catalog.candidates)]
    return _part(catalog, ~np.array(repeats, bool))


def _same_part(candidate: Candidate, change: Candidate) -> bool:
    """Whether an effect names the part whose parameter changes."""
    parts = {name.split(".", 1)[1].rpartition(".")[0] for name in change.where}
    return any(part == name or part.startswith(f"{name}.") for part in parts for name in candidate.where)


def _more_general(entry: Entry, best: Entry) -> bool:
    """Whether a rival says the same as the change of a parameter, with more quantities: a step at any time."""
    return (best.candidate.effect.name == NAME and len(entry.candidate.effect.free) > 1
            and _same_part(entry.candidate, best.candidate))
