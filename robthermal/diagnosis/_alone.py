"""Where nothing is named: the effect that alone predicts the validation records best.

The search adds what explains the training records best, and a wandering load may come before the loss that the file
lacks. Records of another day tell the two apart, though neither explains all that is there.
"""

from __future__ import annotations

from dataclasses import replace

from ..errors import Diverged, InputError
from ._judge import Judged, Validation, of_its_time
from ._rivals import CLOSED_SQUARE
from .evidence import Gap, left
from .fit import exact
from .search import Entry, refit_short_list


def predicting_best(judged: Judged, validation: Validation) -> Judged:
    """An answer without a name says which effect of the short list, alone, predicts the validation records best.

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
    if judged.verdict != "unexplained" or not judged.why or held is None or not state.nominal.records:
        return judged
    tried = [(entry, gap) for entry in refit_short_list(state.nominal, state.scores).entries
             if not of_its_time(entry.candidate) and (gap := _predicted(judged, entry, validation)) is not None]
    if not tried:
        return judged
    best, gap = min(tried, key=lambda one: one[1].after)
    if left(gap).share_explained < CLOSED_SQUARE or gap.after >= held.gap.after:
        return judged
    return replace(judged, alone=(
        f"Of the effects tried alone {best.candidate.label} predicts the validation records best: with it their error "
        f"falls from {gap.before:.2g} to {gap.after:.2g} {gap.unit}. That is a hint where to look, and no name."))


def _predicted(judged: Judged, entry: Entry, validation: Validation) -> Gap | None:
    try:
        held = validation.predicted(exact(judged.state.nominal), exact(entry.fit))
    except (Diverged, InputError):  # a model that runs away predicts nothing
        return None
    return None if held is None else held.gap
