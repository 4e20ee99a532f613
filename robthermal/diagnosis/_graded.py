"""The graded verdict: where no set of effects explains the records down to the noise, is one reproducibly better?

The network is then allowed to be too coarse, and the search is repeated. What stays is named if it holds in block after
block, keeps its size over the records, explains most of the gap, and closes it on validation data too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..errors import Diverged, InputError
from ._judge import Judged, Progress, Validation, Verdict, independent_of_step, judge, no_names
from ._outcomes import DiagnosisCode
from ._rivals import CLOSED_SQUARE, predicting, predicts, with_rivals
from ._searching import coarsely_searched, validated
from .evidence import NEEDED, Evidence, Gap, Stability, expected_rms, left, reproducible, stability
from .fit import Refit, coarsened, exact
from .search import (
    Accepted,
    Entry,
    SearchState,
    ShortList,
    one_place,
    revise,
    revised,
    without,
)

_SHARE = 0.5  # of the excess mean square, that the set must explain on the training records
_NOISE = 2.0  # whitened variance that a finer network must leave, to be all that is missing


def evidence_of(rounds: Sequence[Accepted], fit: Refit, nominal: Refit, validation: Validation | None = None
                ) -> tuple[Evidence, ...]:
    """Evidence for every effect of a fit.

    Parameters
    ----------
    rounds : sequence of Accepted
        In the order of the effects of the fit.
    fit, nominal : Refit
        With all of them; without any.
    validation : Validation, optional
        Data that no fit has seen: an effect may be needed there that the training records hide.
    """
    if not rounds:
        return ()
    whole, bare = exact(fit), exact(nominal)
    noise = expected_rms(whole) ** 2
    excess = [max(bare.rms**2 - noise, 0.0)]
    excess += [max(one.rms**2 - noise, 0.0) for one in _prefixes(whole, bare)]
    out = []
    for place, round_ in enumerate(rounds):
        less = without(fit, place, nominal, round_.before)
        plain = bare if len(rounds) == 1 else without(whole, place, bare)
        before = max((whole if plain is None else plain).rms ** 2 - noise, 0.0)
        needed = 1.0 - excess[-1] / before if before > 0 else 0.0
        if needed < NEEDED and plain is not None and validation is not None:
            needed = max(needed, _needed_held_out(whole, plain, validation))
        out.append(Evidence(
            share=(excess[place] - excess[place + 1]) / excess[0] if excess[0] > 0 else 0.0,
            reproducible=0.0 if less is None else reproducible(fit, less),
            stability=_stability(fit, place), needed=needed))
    return tuple(out)


def _needed_held_out(whole: Refit, less: Refit, validation: Validation) -> float:
    """Part of the excess mean square of the validation data left without an effect that it removes; 0 without data."""
    try:
        held = validation.predicted(less, whole)
    except (Diverged, InputError):
        return 0.0
    return 0.0 if held is None else left(held.gap).share_explained


def lasting_beyond_steps(judged: Judged) -> Judged:
    """Names from readings in coarse steps have to hold in block after block: errors of rounding are not white.

    Parameters
    ----------
    judged : Judged
        Answer with the network taken to be right; returned as it is where no sensor is quantized.
    """
    state = judged.state
    rounded = [name for name in state.nominal.floor.quantized if name in state.nominal.system.thermometers]
    if judged.verdict not in ("named", "ambiguous") or not rounded:
        return judged
    found = evidence_of(state.rounds, state.fit, state.nominal)
    fleeting = [round_.best.candidate.label for round_, one in zip(state.rounds, found, strict=True) if not one.lasting]
    if not fleeting:
        return judged
    text = (f"{', '.join(fleeting)} would explain the records, but does not hold over parts of them: it may be the "
            f"error of rounding, because the steps of {', '.join(rounded)} are larger than the noise.")
    return replace(judged, verdict="unexplained", outcome=DiagnosisCode.UNEXPLAINED.outcome(
        text, remedy="Read finer, or let the noise reach the converter and average."))


def _stability(fit: Refit, place: int) -> Stability:
    """Of the size of an effect, relative to it."""
    structure = fit.structure
    at = structure.column_of(place)
    found, size = stability(fit, at), structure.effects[place].effect.size
    scale = 1.0 if size.lower > 0 else abs(fit.v[at])  # a logarithm's spread is relative
    return Stability(found.segments, found.spread / scale if scale > 0 else float("inf"))


def _prefixes(whole: Refit, bare: Refit) -> list[Refit]:
    """Fits with the first effect, the first two, and so on."""
    out = [whole]
    for place in range(len(whole.structure.effects) - 1, 0, -1):
        out.append(without(out[-1], place, bare) or out[-1])
    return out[::-1]


def graded(judged: Judged, validation: Validation, progress: Progress) -> Judged:
    """Grade an answer that does not explain the records down to the noise.

    Parameters
    ----------
    judged : Judged
        Answer with the network taken to be right; returned as it is unless it is "unexplained" on records.
    validation : Validation
        Data that no fit has seen.
    progress : callable
        Called with a sentence before every stage.
    """
    state = judged.state
    if judged.verdict != "unexplained" or not state.nominal.records:
        return judged
    judged = replace(judged, why="more than noise is left beside it")
    try:
        finer = coarsened(state.nominal)
        if finer.structure.n_coarse:
            state = coarsely_searched(finer, state, progress)
        else:
            finer = state.nominal
        progress("testing over blocks, segments and validation data what may be named")
        tried = len(state.rounds)
        state, found = _lasting(state, finer, validation)
        if 0 < len(found) < tried and finer.structure.n_coarse:  # what is dropped may have made up for a wrong place
            state, found = _lasting(chosen_again(state, finer), finer, validation)
        elif len(found) > 1 and finer.structure.n_coarse:  # each was chosen before the others were known
            state, found = _lasting(revise(replace(state, misfit_left=False)), finer, validation)
        if not found:
            return _nothing_lasts(judged, finer)
        state = _predicting(replace(state, misfit_left=False), finer, validation, progress)
        state = _predicting(validated(state, validation, progress), finer, validation, progress)
        return _graded(judged, with_rivals(state, finer, validation), finer, validation)
    except (Diverged, InputError):  # a model that runs away is no explanation
        return judged


def chosen_again(state: SearchState, nominal: Refit) -> SearchState:
    """The state with every effect chosen again among all candidates, beside the others that are left.

    Parameters
    ----------
    state : SearchState
        With fewer effects than were accepted.
    nominal : Refit
        Without any effect.
    """
    rounds, fit = revised(state.rounds, nominal, state.names)
    if rounds and fit.structure.coarse:  # what a finer network changes depends on where the model is
        fit = coarsened(fit)
        rounds = (*rounds[:-1], replace(rounds[-1], best=replace(rounds[-1].best, fit=fit)))
    return replace(state, rounds=rounds, fit=fit, misfit_left=False)


def _lasting(state: SearchState, finer: Refit, validation: Validation) -> tuple[SearchState, tuple[Evidence, ...]]:
    """The effects that hold over blocks and segments and are needed, the least needed one dropped first.

    What the records cannot tell from it is asked first: a rival that holds and is needed takes its place.
    """
    rounds, fit = state.rounds, state.fit
    found = evidence_of(rounds, fit, finer, validation)
    while not all(one.lasting for one in found):
        worst = min(range(len(found)), key=lambda i: (found[i].lasting, found[i].needed))
        instead = in_its_place(rounds, worst, finer, validation)
        if instead is not None:
            rounds, fit = instead
            found = evidence_of(rounds, fit, finer, validation)
            continue
        less = finer if len(rounds) == 1 else without(fit, worst, finer, rounds[worst].before)
        if less is None:
            return replace(state, rounds=(), fit=finer), ()
        rounds, fit = rounds[:worst] + rounds[worst + 1:], less
        if rounds and fit.structure.coarse:
            fit = coarsened(fit)
        if rounds:
            rounds = (*rounds[:-1], replace(rounds[-1], best=replace(rounds[-1].best, fit=fit)))
        found = evidence_of(rounds, fit, finer, validation)
    return replace(state, nominal=finer, rounds=rounds, fit=fit), found


def in_its_place(rounds: tuple[Accepted, ...], place: int, finer: Refit, validation: Validation | None = None
                 ) -> tuple[tuple[Accepted, ...], Refit] | None:
    """The effects with a rival in the place of one that does not last; None if none of its rivals lasts.

    Beside unknowns of a finer network an effect may have the smallest sum of squares and remove nothing where the
    network is as it is: it could not be named itself, and so it is no rival of one that could.

    Parameters
    ----------
    rounds : tuple of Accepted
        In the order of the effects of the fit.
    place : int
        Of the effect that does not last.
    finer : Refit
        Without any effect.
    validation : Validation, optional
        Data that no fit has seen.
    """
    tried = filter(None, (_instead(rounds, place, entry) for entry in rounds[place].contenders))
    lasting = [(new, at) for new, at in tried if evidence_of(new, new[at].best.fit, finer, validation)[at].lasting]
    if not lasting:
        return None
    (chosen, at), *others = lasting
    own = replace(chosen[at], contenders=tuple(new[i].best for new, i in others))
    return (*chosen[:at], own, *chosen[at + 1:]), own.best.fit


def _instead(rounds: tuple[Accepted, ...], place: int, rival: Entry) -> tuple[tuple[Accepted, ...], int] | None:
    """The effects with a rival in one place, and where it stands; None if it was not fitted beside the others."""
    others = [round_.best.candidate.key for i, round_ in enumerate(rounds) if i != place]
    keys = [candidate.key for candidate in rival.fit.structure.effects]
    if [key for key in keys if key != rival.candidate.key] != others:
        return None
    fit = coarsened(rival.fit) if rival.fit.structure.coarse else rival.fit
    at, out = keys.index(rival.candidate.key), [*rounds[:place], *rounds[place + 1:]]
    out.insert(at, replace(rounds[place], best=replace(rival, fit=fit), contenders=()))
    out[-1] = replace(out[-1], best=replace(out[-1].best, fit=fit))
    return tuple(out), at


def _predicting(state: SearchState, finer: Refit, validation: Validation, progress: Progress) -> SearchState:
    """The state with a rival in the place of an effect with which the validation data keep their gap, the rest anew."""
    instead = predicting(state, finer, validation)
    if instead is None:
        return state
    progress("choosing the others again beside a rival with which the validation data are predicted")
    for tried in (chosen_again(instead, finer), instead):
        kept, found = _lasting(tried, finer, validation)
        if found and predicts(kept.fit, finer, validation):
            return kept
    return state


def _graded(judged: Judged, state: SearchState, finer: Refit, validation: Validation) -> Judged:
    """The verdict on what lasts."""
    if not state.rounds:
        return replace(judged, why="the validation records contradict what holds over parts of the training records")
    if faults := no_names(state):
        return replace(judged, why=_beside(state, f"are no names: {' '.join(faults)}"))
    fit, nominal = state.fit, judged.state.nominal
    plain, bare = exact(fit), exact(nominal)
    kept = replace(state, nominal=nominal, scores=judged.state.scores, short=ShortList(fit, (), {}), complete=True,
                   joint=None)
    down = judge(replace(kept, fit=plain), validation, lambda stage: None)
    if down.verdict in ("named", "ambiguous"):
        return down
    held = validation.predicted(bare, plain)
    gaps = [Gap(nominal.rms, plain.rms, expected_rms(plain))] + ([] if held is None else [held.gap])
    if not _closes(gaps):
        return replace(judged, why=_beside(state, f"take {_shares(gaps)} off the excess mean square, less than the "
                                           f"{100.0 * CLOSED_SQUARE:.0f} % asked for on validation records or, without "
                                           f"any, the {100.0 * _SHARE:.0f} % on training records"))
    if not independent_of_step(fit):
        return replace(judged, why=_beside(state, "move when the integration is refined"))
    ambiguous = not all(one_place(round_, nominal.structure.base) for round_ in state.rounds)
    verdict: Verdict = "ambiguous" if ambiguous else "named_with_remainder"
    code = DiagnosisCode.AMBIGUOUS if ambiguous else DiagnosisCode.NAMED_WITH_REMAINDER
    return Judged(state=kept, adequacy=down.adequacy, hold_out=held, verdict=verdict, outcome=code.outcome(),
                  plain=plain, evidence=evidence_of(state.rounds, fit, finer, validation))


def _beside(state: SearchState, what: str) -> str:
    """Why the effects that last are no names, with their labels."""
    labels = " and ".join(round_.best.candidate.label for round_ in state.rounds)
    where = ", which last beside a network with its lumps split," if state.fit.structure.n_coarse else ""
    return f"{labels}{where} {what.rstrip('.')}"


def _shares(gaps: Sequence[Gap]) -> str:
    return " and ".join(f"{100.0 * max(left(gap).share_explained, 0.0):.0f} %" for gap in gaps)


def _closes(gaps: Sequence[Gap]) -> bool:
    """Whether most of the excess is gone on the validation records, or without any on the training records.

    Training records may hide what is missing behind a remainder that another effect leaves: then some of it is enough.
    """
    train, *held_out = (left(gap).share_explained for gap in gaps)
    return train > 0.0 and all(share >= CLOSED_SQUARE for share in held_out) if held_out else train >= _SHARE


def _nothing_lasts(judged: Judged, finer: Refit) -> Judged:
    """The answer as it was; it says so if a finer network alone explains most of what is left."""
    if not finer.structure.n_coarse:
        return judged
    judged = replace(judged, why="beside a network with its lumps split nothing holds over the records and is needed")
    if exact(judged.state.nominal).variance < 1.0 or finer.variance > _NOISE:
        return judged
    share = 1.0 - max(finer.variance - 1.0, 0.0) / max(judged.state.nominal.variance - 1.0, 1e-9)
    if share < 1.0 - NEEDED:
        return judged
    text = ("No effect of the catalog is reproducibly better than none. What is left is what a finer network would "
            "change: split the lumps where heat flows.")
    return replace(judged, why="a network with its lumps split explains the training records without any effect",
                   outcome=DiagnosisCode.UNEXPLAINED.outcome(text, remedy="Refine the network."))
