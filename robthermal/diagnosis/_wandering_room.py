"""An ambient that no record holds, and that does not stand still: the search once more beside random states for it.

A room under air conditioning wanders by some tenths of a kelvin within minutes, and every path to it carries that into
the machine. Beside a room that stands still such a record is "unexplained", whatever else is missing. As random states
of the filter the room takes what it can have caused, which moves all lumps joined to it together; what the heaters
cause stays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..errors import Diverged, InputError
from ._judge import Judged, Progress, Validation, Verdict, no_names
from ._lasting import evidence_of
from ._outcomes import DiagnosisCode
from ._rivals import at_neighboring_lumps
from .evidence import BIC_GAP, SURE, Evidence, HoldOut
from .fit import Refit, coarsened, extended, with_random_ambients
from .search import SearchState, delta_bic, one_place, without

_EXPLAINED = 0.49  # of the whitened excess on validation records, that names may leave: 70 % of its root
_WORTH = 0.03  # of ΔBIC for every reading beside a finer network: what is coarse in a plate gained half of it
_FAR = 3.0  # K, of a room within an hour; within a shorter time less, as in a random walk
_REST = 0.1  # of the whitened excess on validation records: the rest of a coarse network
_NEARLY = 1.5  # whitened variance, of training and of validation records, beside which the rest is small


def beside_a_wandering_room(judged: Judged, again: Callable[[Refit], Judged], validation: Validation,
                            progress: Progress) -> Judged | None:
    """The answer with ambients that wander where no record holds them; None unless one was needed, and more is said.

    Parameters
    ----------
    judged : Judged
        Answer with ambients that stand still.
    again : callable
        Searches and judges from a fit of the nominal system.
    validation : Validation
        Data that no fit has seen.
    progress : callable
        Called with a sentence before the search.
    """
    if judged.verdict != "unexplained" or (moving := with_random_ambients(judged.state.nominal)) is None:
        return None
    progress("once more, with a room that wanders")
    try:
        return _answer(judged, moving, again(moving), validation)
    except (Diverged, InputError):  # a model that runs away is no explanation
        return None


def _answer(judged: Judged, moving: Refit, other: Judged, validation: Validation) -> Judged | None:
    """What is said beside a room that wanders."""
    still = judged.state.nominal
    if other.verdict == "consistent":
        return replace(judged, room=f"{_wanders(moving)}, which explains these records: nothing else need be missing.")
    if other.verdict == "unexplained":
        other = _with_remainder(other, moving, validation)
    if other.verdict == "unexplained" or not _confirmed(other.hold_out):
        return None
    held = validation.predicted(still, other.plain or other.state.fit)  # the gap is that of the system as it was
    return replace(other, state=replace(other.state, nominal=still), hold_out=held,
                   room=f"{_wanders(other.state.fit)}; what is named is told from what the room can have done."
                        f"{_too_much(other.state.fit)}")


def _with_remainder(judged: Judged, moving: Refit, validation: Validation) -> Judged:
    """Names with what little is left beside them: those that last, and are needed on data that no fit has seen."""
    if not judged.state.rounds or judged.hold_out is None or not _small(judged.state.fit, judged.hold_out):
        return judged
    state, evidence = _lasting(judged.state, moving, validation)
    held = validation.predicted(moving, state.fit) if state.rounds else None
    if held is None or not _small(state.fit, held) or no_names(state):
        return judged
    state = at_neighboring_lumps(state)
    ambiguous = not all(one_place(round_, moving.structure.base) for round_ in state.rounds)
    verdict: Verdict = "ambiguous" if ambiguous else "named_with_remainder"
    code = DiagnosisCode.AMBIGUOUS if ambiguous else DiagnosisCode.NAMED_WITH_REMAINDER
    return replace(judged, state=state, hold_out=held, verdict=verdict, outcome=code.outcome(), plain=state.fit,
                   evidence=evidence)


def _small(fit: Refit, held: HoldOut) -> bool:
    """Whether little more than noise is left: of training records at most beside what a finer network would change."""
    if held.variance_after > _NEARLY and not held.excess_ratio <= _REST:
        return False
    return fit.variance <= _NEARLY or coarsened(fit).variance <= _NEARLY


def _lasting(state: SearchState, moving: Refit, validation: Validation) -> tuple[SearchState, tuple[Evidence, ...]]:
    """Effects that hold over blocks and segments and are needed, one taken out after the other; and their evidence."""
    evidence = evidence_of(state.rounds, state.fit, moving)
    for place, one in enumerate(evidence):
        less = without(state.fit, place, moving, state.rounds[place].before)
        if (one.stability.constant and one.reproducible >= SURE and _needed(state.fit, less, validation)
                and _beside_a_finer_network(state.fit, less)):
            continue
        rounds = [round_ for at, round_ in enumerate(state.rounds) if at != place]
        if less is None or not rounds:
            return replace(state, rounds=()), ()
        rounds[-1] = replace(rounds[-1], best=replace(rounds[-1].best, fit=less))
        return _lasting(replace(state, rounds=tuple(rounds), fit=less), moving, validation)
    return state, evidence


def _needed(fit: Refit, less: Refit | None, validation: Validation) -> bool:
    """Whether validation records, whitened, are predicted much better with an effect than without it."""
    held = None if less is None else validation.predicted(less, fit)
    return held is not None and held.excess_ratio <= _EXPLAINED


def _beside_a_finer_network(fit: Refit, less: Refit | None) -> bool:
    """Whether an effect is worth its unknowns beside what a finer network would change."""
    if less is None:
        return False
    whole, other = coarsened(fit), coarsened(less)
    gained = delta_bic(extended(whole, other.structure, other.v), whole)
    return gained > max(BIC_GAP, _WORTH * whole.n_readings)


def _confirmed(held: HoldOut | None) -> bool:
    """Whether data that no fit has seen are predicted, or most of what was left of them without the effects is gone."""
    return held is None or held.outcome.ok or held.excess_ratio <= _EXPLAINED


def _too_much(fit: Refit) -> str:
    """That no room does so, where it stands for more than a room."""
    names, levels = " and ".join(fit.unrecorded), fit.levels
    return (f" No room does that: a path to {names} that changes, such as a fan or a door, or a heat at what is joined "
            f"to it may be missing, too." if levels.wander > _FAR * (levels.pace / 3600.0) ** 0.5 else "")


def _wanders(fit: Refit) -> str:
    names, levels = fit.unrecorded, fit.levels
    return (f"{' and '.join(names)}, which {'was' if len(names) == 1 else 'were'} not recorded, "
            f"{'is' if len(names) == 1 else 'are'} taken to wander by {levels.wander:.2g} K within "
            f"{levels.pace / 60.0:.0f} min")
