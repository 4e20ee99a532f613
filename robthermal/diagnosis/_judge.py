"""Last stages of a diagnosis: test what the search accepted, give a verdict, and ask whether the noise explains it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..errors import Outcome
from ._outcomes import DiagnosisCode
from .data import Measured
from .effects import Candidate
from .evidence import Adequacy, Evidence, Gap, HoldOut, adequacy, hold_out
from .fit import Refit, Whitened
from .search import Accepted, SearchState, ShortList, implausible_names, ruled_out, with_wider_noise

Verdict = Literal["named", "named_with_remainder", "ambiguous", "consistent", "unexplained"]
Name = tuple[str, tuple[str, ...]]
Progress = Callable[[str], None]
_LARGE = 1.5  # whitened variance
_VISIBLE = 0.2  # of the mean square of noise: an error beyond it that effects have to lessen
_FAR = 5.0  # whitened variance that no noise within the limits explains


@dataclass(frozen=True, eq=False)
class Validation:
    """Validation data of a diagnosis, if there are any.

    Parameters
    ----------
    data : Record, FrequencyResponse, list of them, or None
        Data that no fit sees.
    operating_point : mapping, optional
        Mean inputs of frequency responses, as in `refit`.
    """

    data: Measured | Sequence[Measured] | None
    operating_point: Mapping[str, float] | None = None

    def predicted(self, before: Refit, after: Refit) -> HoldOut | None:
        """Prediction of the data with and without the effects; None without data.

        Parameters
        ----------
        before, after : Refit
            Fits without the effects, and with them.
        """
        return None if self.data is None else hold_out(before, after, self.data, operating_point=self.operating_point)


@dataclass(frozen=True, eq=False, kw_only=True)
class Judged:
    """State of a search with the tests of it and the verdict.

    Parameters
    ----------
    state : SearchState
        What was accepted.
    adequacy : Adequacy
        Tests of what is left in the training data.
    hold_out : HoldOut or None
        Prediction of the validation data; None without any.
    verdict : {"named", "named_with_remainder", "ambiguous", "consistent", "unexplained"}
        Answer of the diagnosis.
    outcome : Outcome
        Code as the verdict, and its reasons.
    plain : Refit, optional
        Where the fit of the state allows for a network that is too coarse: the same effects with the network as it is.
    evidence : tuple of Evidence
        For every effect, where the model is not exact.
    why : str
        Of an answer "unexplained" that was graded: what kept effects from being named, in words that follow "because".
    validation : Validation, optional
        Of such an answer: data that no fit has seen, by which effects were judged.
    alone : str
        Of such an answer: which effect alone predicts the validation records best, in a sentence; empty if none does.
    compared : bool
        Whether new records were compared with those of a healthy machine.
    means : str
        How else the log may be read, as means or with commands in another row; empty where that explains nothing.
    finer : str
        That a finer network explains the records as well as the one effect named; empty where it does not.
    room : str
        How ambients that were not recorded are taken to wander; empty where they stand still.
    """

    state: SearchState
    adequacy: Adequacy
    hold_out: HoldOut | None
    verdict: Verdict
    outcome: Outcome
    plain: Refit | None = None
    evidence: tuple[Evidence, ...] = ()
    why: str = ""
    validation: Validation | None = None
    alone: str = ""
    compared: bool = False
    means: str = ""
    finer: str = ""
    room: str = ""

    def __str__(self) -> str:
        return "\n".join([str(self.state), *map(str, [self.adequacy, self.hold_out] if self.hold_out else
                                                [self.adequacy]), f"{self.verdict}: {self.outcome}"])


def judge(state: SearchState, validation: Validation, progress: Progress) -> Judged:
    """Test whether anything is left, predict the validation data, and give a verdict.

    Parameters
    ----------
    state : SearchState
        Complete state of the search.
    validation : Validation
        Data that no fit has seen.
    progress : callable
        Called with a sentence before every test.
    """
    progress("testing whether anything is left")
    checks = adequacy(state.fit)
    if validation.data is not None:
        progress("predicting the validation data")
    held = validation.predicted(state.nominal, state.fit)
    verdict, outcome = _verdict(state, _faults(state, checks, held))
    return Judged(state=state, adequacy=checks, hold_out=held, verdict=verdict, outcome=outcome)


def reconsider_noise(judged: Judged, validation: Validation) -> Judged:
    """Where nothing known explains the records, or only with more noise than declared: does noise alone explain them?

    Parameters
    ----------
    judged : Judged
        Answer with the declared noise; returned as it is unless noise alone explains all data.
    validation : Validation
        Data that no fit has seen.
    """
    state, unexplained = judged.state, judged.verdict == "unexplained"
    if not unexplained and not (state.rounds and state.fit.levels.exhausted):
        return judged
    if state.nominal.variance > _FAR:
        return judged
    wider = with_wider_noise(state.nominal, state.names, unexplained)
    if wider is None:
        return judged
    fit, scores, checks = wider
    held = validation.predicted(fit, fit)
    if held is not None and not held.outcome.ok:
        return judged
    text = f"Nothing but noise is missing: the records agree with the model if {fit.levels}."
    return Judged(
        state=SearchState(nominal=fit, names=state.names, scores=scores, fit=fit, current=scores,
                          short=ShortList(fit, (), {}), complete=True),
        adequacy=checks, hold_out=held, verdict="consistent",
        outcome=DiagnosisCode.CONSISTENT.outcome(text + ("" if fit.levels.share else " Declare it.")))


def without_names_of_noise(judged: Judged) -> Judged:
    """No name, and no network to refine, on records whose readings never leave their noise.

    Where the model moves and the readings do not, effects at their bounds would follow: a mass or a conductance beyond
    measure. Returned as it is if there is nothing to withdraw.

    Parameters
    ----------
    judged : Judged
        Answer of the search.
    """
    if judged.verdict == "consistent" or not judged.state.nominal.floor.quiet:
        return judged
    text = ("The model moves and the readings do not. Which effect holds them where they are cannot be told from such "
            "records: a heater that is off, a sensor that is not attached, a wrong column.")
    return replace(judged, verdict="unexplained", evidence=(), plain=None, why="",
                   outcome=DiagnosisCode.UNEXPLAINED.outcome(
                       text, remedy="See that heaters and sensors are connected."))


def no_names(state: SearchState) -> list[str]:
    """Why accepted effects are not what they are called, a sentence each.

    Parameters
    ----------
    state : SearchState
        What was accepted, and the fit with it.
    """
    return list(implausible_names(state.fit, {one.best.candidate.key: one.best.twins for one in state.rounds}))


def _faults(state: SearchState, checks: Adequacy, held: HoldOut | None) -> list[str]:
    """Reasons, a sentence each, why nothing may be named and nothing called consistent."""
    faults = [] if checks.outcome.ok else [checks.outcome.text]
    if state.misfit_left:
        raised = state.fit.variance < _LARGE  # 1 beside noise levels at their limits says nothing of the misfit
        how = "for which noise levels were raised" if raised else f"whitened variance {state.fit.variance:.3g}"
        faults.append(f"A large misfit stays ({how}).")
    if held is not None and not held.outcome.ok:
        faults.append(held.outcome.text)
    if state.rounds and held is not None and _worse(held.gap) and not any(
            of_its_time(round_.best.candidate) for round_ in state.rounds):
        faults.append(f"With these effects the error on the validation records does not fall ({held.gap.before:.3g} to "
                      f"{held.gap.after:.3g} {held.gap.unit}).")
    if state.rounds:
        faults += no_names(state)
        if not independent_of_step(state.fit):
            faults.append("An effect moves when the integration is refined: it may be the solver's own error.")
        if not state.fit.outcome.ok:
            faults.append(state.fit.outcome.text)
    return faults


def of_its_time(candidate: Candidate) -> bool:
    """Whether an effect has a time of the training records in it: a swing, a step; it says little of other records.

    Parameters
    ----------
    candidate : Candidate
        Effect at its place.
    """
    effect = candidate.effect
    return bool(effect.paired) or any(quantity.name == "time" for quantity in effect.quantities)


def _worse(gap: Gap) -> bool:
    """Whether an error beyond noise is no smaller with the effects: weights that trust random heat do not see it."""
    return gap.before**2 > (1.0 + _VISIBLE) * gap.noise**2 and gap.after >= gap.before


def _verdict(state: SearchState, faults: Sequence[str]) -> tuple[Verdict, Outcome]:
    if faults:
        helped = "; ".join(map(str, state.rounds))
        text = "None of the known effects explains the records. " + " ".join(faults)
        text += f" Provisional, no name: {helped}." if helped else ""
        return "unexplained", DiagnosisCode.UNEXPLAINED.outcome(text)
    if not state.rounds:
        return "consistent", DiagnosisCode.CONSISTENT.outcome()
    labels = ", ".join(candidate.label for candidate in ruled_out(state.rounds))
    excluded = f" The validation records rule out {labels}, which the others could not." if labels else ""
    if any(map(alternatives, state.rounds)):
        code = DiagnosisCode.AMBIGUOUS
        return "ambiguous", code.outcome("The records cannot distinguish some effects:", remedy=code.remedy + excluded)
    return "named", DiagnosisCode.NAMED.outcome(f"One set of effects explains the records.{excluded}")


def independent_of_step(fit: Refit) -> bool:
    """Whether the sizes stay within a standard deviation when the simulation is ten times finer.

    Parameters
    ----------
    fit : Refit
        Fit with effects.
    """
    structure = replace(fit.structure, tolerance=fit.structure.tolerance / 10.0)
    finer = Whitened(structure, fit.whiteners).residual(fit.v)
    scale = np.linalg.norm(fit.J, axis=0)
    scale[scale == 0] = 1.0
    step = np.linalg.lstsq(fit.J / scale, finer - fit.z, rcond=1e-10)[0] / scale
    place = slice(structure.n_parameters, structure.n_parameters + structure.n_effects)
    return bool(np.all(np.abs(step[place]) <= 1e-12 + np.sqrt(np.maximum(np.diag(fit.covariance)[place], 0.0))))


def alternatives(round_: Accepted) -> tuple[Name, ...]:
    """Everything the records cannot distinguish from the accepted effect.

    Parameters
    ----------
    round_ : Accepted
        Accepted effect with its contenders and aliases.
    """
    listed = [*round_.best.aliases]
    for entry in round_.contenders:
        listed += [entry.candidate, *entry.aliases]
    return tuple(dict.fromkeys(c.key for c in listed if c.key != round_.best.candidate.key))
