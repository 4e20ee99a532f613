"""The graded verdict: where no set of effects explains the records down to the noise, is one reproducibly better?

The network is then allowed to be too coarse, and the search is repeated. What stays is named if it holds in block after
block, keeps its size over the records, explains most of the gap, and closes it on validation data too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..errors import Diverged, InputError
from ._explained_away import closing, predicting_alone, saying_so
from ._judge import Judged, Progress, Validation, Verdict, independent_of_step, judge, no_names
from ._lasting import evidence_of, lasting
from ._outcomes import DiagnosisCode
from ._rivals import CLOSED_SQUARE, predicting, predicts, with_rivals
from ._searching import coarsely_searched, validated
from .evidence import NEEDED, Gap, expected_rms, left
from .fit import Refit, coarsened, exact
from .search import SearchState, ShortList, one_place, revise, revised

_SHARE = 0.5  # of the excess mean square, that the set must explain on the training records
_MOST = 0.8  # of the excess mean square of validation records: an answer that removes it stays as it is
_SMALL = 0.1  # of the mean square beyond the noise that an answer leaves of validation records: more effects leave less
_NOISE = 2.0  # whitened variance that a finer network must leave, to be all that is missing


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
    judged = replace(judged, why="more than noise is left beside it", validation=validation)
    try:
        finer = coarsened(state.nominal)
        if finer.structure.n_coarse:
            state = coarsely_searched(finer, state, progress)
        else:
            finer = state.nominal
        progress("testing over blocks, segments and validation data what may be named")
        tried = len(state.rounds)
        state = lasting(state, finer, validation)
        if 0 < len(state.rounds) < tried and finer.structure.n_coarse:  # what is dropped may have hidden a wrong place
            state = lasting(chosen_again(state, finer), finer, validation)
        elif len(state.rounds) > 1 and finer.structure.n_coarse:  # each was chosen before the others were known
            state = lasting(revise(replace(state, misfit_left=False)), finer, validation)
        if not state.rounds:
            return _alone(judged, finer, validation) or _nothing_lasts(judged, finer)
        state = _predicting(replace(state, misfit_left=False), finer, validation, progress)
        kept = validated(state, validation, progress)
        if len(kept.rounds) < len(state.rounds):  # what is left has been tested beside what is gone
            kept = lasting(kept, finer, validation)
        state = _predicting(kept, finer, validation, progress)
        answer = _graded(judged, with_rivals(state, finer, validation), finer, validation)
        if answer.verdict == "unexplained":
            return _alone(judged, finer, validation, answer) or answer
        return _with_more(judged, answer, finer, validation) or answer
    except (Diverged, InputError):  # a model that runs away is no explanation
        return judged


def _alone(judged: Judged, finer: Refit, validation: Validation, instead: Judged | None = None) -> Judged | None:
    """The answer with the effects found with the network as it is, where they alone predict; else None.

    Instead of effects that last beside a finer network and are no answer, only with a name.
    """
    if not finer.structure.n_coarse or (instead is not None and not closing(judged.state, validation)):
        return None
    alone = predicting_alone(judged.state, finer, validation)
    if alone is None:
        return None
    answer = saying_so(_graded(judged, alone, judged.state.nominal, validation), finer)
    return None if instead is not None and answer.verdict == "unexplained" else answer


def _with_more(judged: Judged, answer: Judged, finer: Refit, validation: Validation) -> Judged | None:
    """The answer with more effects than its own, if with the network as it is they leave a small part of what it does.

    A finer network takes over a mass or a lag that is there, and without it another day is not predicted. Where most of
    that day's gap is closed the answer stays: what is coarse in a network looks like a mass and a gain, too.
    """
    if answer.hold_out is None or left(answer.hold_out.gap).share_explained > _MOST:
        return None
    named = {round_.best.candidate.key for round_ in answer.state.rounds}
    if not named < {round_.best.candidate.key for round_ in judged.state.rounds}:
        return None
    more = _alone(judged, finer, validation, answer)
    if more is None or more.hold_out is None or not named < {one.best.candidate.key for one in more.state.rounds}:
        return None
    rest, less = left(answer.hold_out.gap).rms, left(more.hold_out.gap).rms
    return more if less**2 < _SMALL * rest**2 else None


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


def _predicting(state: SearchState, finer: Refit, validation: Validation, progress: Progress) -> SearchState:
    """The state with a rival in the place of an effect with which the validation data keep their gap, the rest anew."""
    instead = predicting(state, finer, validation)
    if instead is None:
        return state
    progress("choosing the others again beside a rival with which the validation data are predicted")
    for tried in (chosen_again(instead, finer), instead):
        kept = lasting(tried, finer, validation)
        if kept.rounds and predicts(kept.fit, finer, validation):
            return kept
    return state


def _graded(judged: Judged, state: SearchState, finer: Refit, validation: Validation) -> Judged:
    """The verdict on what lasts."""
    if not state.rounds:
        return replace(judged, why="the validation records contradict what holds over parts of the training records")
    if faults := no_names(state):
        return replace(judged, why=_beside(state, ("is no name", "are no names"), f": {' '.join(faults)}"))
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
        return replace(judged, why=_beside(
            state, ("takes", "take"), f" {_shares(gaps)} off the excess mean square, less than the "
            f"{100.0 * CLOSED_SQUARE:.0f} % asked for on validation records or, without any, the "
            f"{100.0 * _SHARE:.0f} % on training records"))
    if not independent_of_step(fit):
        return replace(judged, why=_beside(state, ("moves", "move"), " when the integration is refined"))
    ambiguous = not all(one_place(round_, nominal.structure.base) for round_ in state.rounds)
    verdict: Verdict = "ambiguous" if ambiguous else "named_with_remainder"
    code = DiagnosisCode.AMBIGUOUS if ambiguous else DiagnosisCode.NAMED_WITH_REMAINDER
    return Judged(state=kept, adequacy=down.adequacy, hold_out=held, verdict=verdict, outcome=code.outcome(),
                  plain=plain, evidence=evidence_of(state.rounds, fit, finer, validation))


def _beside(state: SearchState, verb: tuple[str, str], what: str) -> str:
    """Why the effects that last are no names, with their labels; the verb for one of them, and for several."""
    labels, several = [round_.best.candidate.label for round_ in state.rounds], len(state.rounds) > 1
    beside = f", which {('lasts', 'last')[several]} beside a network with its lumps split,"
    where = beside if state.fit.structure.n_coarse else ""
    return f"{' and '.join(labels)}{where} {verb[several]}{what.rstrip('.')}"


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
