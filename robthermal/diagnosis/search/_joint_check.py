"""Check effects accepted one after the other against a selection of all at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from ..effects import Candidate
from ..evidence import BIC_GAP, Scores
from ..fit import Refit, extended
from ._decide import Accepted
from ._joint import JointSelection, select_jointly
from ._joint_sets import EffectSet, Key, bic
from ._revise import revised
from ._short_list import Entry


@dataclass(frozen=True, eq=False)
class JointCheck:
    """The stepwise search and the joint selection compared.

    Parameters
    ----------
    selection : JointSelection
        Of all candidates at once.
    stepwise : tuple of Candidate
        What the stepwise search had accepted.
    advantage : float
        BIC of the stepwise set less that of the best other set, same filters; above 10 the other set was taken.
        -inf if no other set was found.
    """

    selection: JointSelection
    stepwise: tuple[Candidate, ...]
    advantage: float

    def __str__(self) -> str:
        if self.advantage > BIC_GAP:
            what = "the joint selection explains more, and was taken"
        elif self.advantage > -BIC_GAP:
            what = "both explain the records"
        else:
            what = "the stepwise search stands"
        return f"{self.selection.compared(self.stepwise)}: {what} (ΔBIC of the other set {self.advantage:.1f})"


def checked_jointly(rounds: tuple[Accepted, ...], fit: Refit, nominal: Refit, scores: Scores,
                    effects: Iterable[str] | None) -> tuple[tuple[Accepted, ...], Refit, JointCheck]:
    """Replace the accepted set where another explains clearly more, and list others that explain as much.

    Parameters
    ----------
    rounds : tuple of Accepted
        Accepted effects, two or more.
    fit : Refit
        With all of them.
    nominal : Refit
        Fit without any effect.
    scores : Scores
        On the nominal fit.
    effects : iterable of str, optional
        Effects of the catalog to try.
    """
    stepwise = fit.structure.effects
    selection = select_jointly(nominal, scores, known=fit)
    known = {_representative(key, scores) for key in (candidate.key for candidate in stepwise)}
    others = []
    for found in selection.sets:
        names = {_representative(key, scores) for key in found.keys}
        if names != known:
            again = extended(fit, found.fit.structure, found.fit.v)  # with the filters of the accepted set
            gain = bic(fit) - bic(again)
            if gain > BIC_GAP or not names > known:  # the accepted effects and one more, for little, are no rival
                others.append((gain, EffectSet(found.candidates, again, found.delta_bic)))
    advantage, best = max(others, key=lambda item: item[0], default=(-float("inf"), None))
    check = JointCheck(selection, stepwise, advantage)
    if best is not None and advantage > BIC_GAP:
        start = tuple(Accepted(nominal, best=_entry(best, candidate, scores, advantage))
                      for candidate in best.candidates)
        return *revised(start, nominal, effects), check
    rivals = [(gap, found) for gap, found in others if gap > -BIC_GAP]
    return tuple(_listed(round_, rivals, stepwise, scores) for round_ in rounds), fit, check


def _listed(round_: Accepted, rivals: list[tuple[float, EffectSet]], stepwise: tuple[Candidate, ...],
            scores: Scores) -> Accepted:
    """A round with the effects of equally good sets that do without its own."""
    own = _representative(round_.best.candidate.key, scores)
    accepted = {_representative(candidate.key, scores) for candidate in stepwise}
    more = []
    for gap, found in rivals:
        names = {candidate.key: _representative(candidate.key, scores) for candidate in found.candidates}
        if own not in names.values():
            more += [_entry(found, candidate, scores, round_.best.delta_bic + gap) for candidate in found.candidates
                     if names[candidate.key] not in accepted]
    there = {entry.candidate.key for entry in (round_.best, *round_.contenders)}
    return replace(round_, contenders=(*round_.contenders, *(e for e in more if e.candidate.key not in there)))


def _entry(found: EffectSet, candidate: Candidate, scores: Scores, delta_bic: float) -> Entry:
    keys = [one.key for one in scores.candidates]
    i = keys.index(candidate.key)
    return Entry(candidate, found.fit, delta_bic, float(scores.p_value[i]), scores.twins(i))


def _representative(key: Key, scores: Scores) -> Key:
    """One key for all exact aliases."""
    keys = [candidate.key for candidate in scores.candidates]
    i = keys.index(key)
    return min([key, *(keys[j] for j in scores.aliases(i))])
