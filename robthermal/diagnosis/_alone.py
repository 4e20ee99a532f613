"""Effects that alone predict the validation records better than an answer, with a name or without.

The search adds what explains the training records best, and a wandering load may come before the loss that the file
lacks. Records of another day tell the two apart, though neither explains all that is there.
"""

from __future__ import annotations

from dataclasses import replace

from ..errors import Diverged, InputError
from ._judge import Judged, Validation, alternatives, of_its_time
from ._outcomes import DiagnosisCode
from ._rivals import CLOSED_SQUARE
from ._steep_power import beyond_metals, loses_heat
from .evidence import Gap, left
from .fit import exact
from .search import Entry, one_place, refit_short_list

_BETTER = 0.6  # of the mean square beyond the noise that a name leaves of validation records: a rival leaves less


def predicting_best(judged: Judged, validation: Validation) -> Judged:
    """What alone predicts the validation records better than an answer: said without a name, a rival beside a name.

    Only where it closes as much of their gap as a name has to, and more than what the search accepted. A swing or a
    step at a time of the training records is left out: on another day it fits by accident.

    Parameters
    ----------
    judged : Judged
        Graded answer, with the prediction of what the search accepted.
    validation : Validation
        Data that no fit has seen.
    """
    state, held = judged.state, judged.hold_out
    graded = judged.why if judged.verdict == "unexplained" else judged.plain is not None and len(state.rounds) == 1
    if not graded or held is None or not state.nominal.records:
        return judged
    tried = _closing(judged, validation)
    if judged.verdict != "unexplained":
        return _beside(judged, [(entry, gap) for entry, gap in tried if _is_rival(judged, entry, gap, held.gap)])
    tried = [(entry, gap) for entry, gap in tried if gap.after < held.gap.after]
    if not tried:
        return judged
    best, gap = min(tried, key=lambda one: one[1].after)
    return replace(judged, alone=(
        f"Of the effects tried alone {best.candidate.label} predicts the validation records best: with it their error "
        f"falls from {gap.before:.2g} to {gap.after:.2g} {gap.unit}. That is a hint where to look, and no name."))


def _closing(judged: Judged, validation: Validation) -> list[tuple[Entry, Gap]]:
    """Effects of the short list that alone close the gap of the validation records as a name has to."""
    entries = refit_short_list(judged.state.nominal, judged.state.scores).entries
    return [(entry, gap) for entry in entries
            if not of_its_time(entry.candidate) and (gap := _predicted(judged, entry, validation)) is not None
            and left(gap).share_explained >= CLOSED_SQUARE]


def _is_rival(judged: Judged, entry: Entry, gap: Gap, named: Gap) -> bool:
    """Whether an effect leaves much less of the validation records; beside a power of no metal: is it a loss?"""
    name = judged.state.rounds[0].best
    if beyond_metals(name.candidate.effect.name, name.found[name.candidate.effect.size.name]):
        return loses_heat(entry.candidate.effect.name)
    return _excess(gap) < _BETTER * _excess(named)


def _beside(judged: Judged, better: list[tuple[Entry, Gap]]) -> Judged:
    """The answer with rivals beside its one name."""
    named, held = judged.state.rounds[0], judged.hold_out
    known = {named.best.candidate.key, *alternatives(named)}
    new = [(entry, gap) for entry, gap in better if entry.candidate.key not in known]
    if not new or held is None:
        return judged
    round_ = replace(named, contenders=(*named.contenders, *(entry for entry, _ in new)))
    state = replace(judged.state, rounds=(round_,))
    if one_place(round_, state.nominal.structure.base):
        return replace(judged, state=state)
    left_by = " and ".join(f"{gap.after:.2g} {gap.unit} with {entry.candidate.label}" for entry, gap in new)
    text = (f"The training records prefer {named.best.candidate.label}, which leaves {held.gap.after:.2g} "
            f"{held.gap.unit} of the validation records, against {left_by}: what is missing may be neither.")
    return replace(judged, state=state, verdict="ambiguous", outcome=DiagnosisCode.AMBIGUOUS.outcome(text))


def _excess(gap: Gap) -> float:
    """Mean square that is left beyond the noise [K²]."""
    return left(gap).rms ** 2


def _predicted(judged: Judged, entry: Entry, validation: Validation) -> Gap | None:
    try:
        held = validation.predicted(exact(judged.state.nominal), exact(entry.fit))
    except (Diverged, InputError):  # a model that runs away predicts nothing
        return None
    return None if held is None else held.gap
