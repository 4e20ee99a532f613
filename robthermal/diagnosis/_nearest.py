"""Where nothing is named: what came nearest, what it takes off the error, and why it is no name."""

from __future__ import annotations

import re
from collections.abc import Mapping

from ._judge import Judged
from ._lasting import evidence_of
from .evidence import Gap, left

_TRAINED = {False: "training", True: "new"}  # what the records of the fit are called, between two days
_LABEL = re.compile(r"\w+\(")  # of an effect at its place


def nearest(judged: Judged, gap: Mapping[str, Gap]) -> str:
    """What came nearest to an answer, and what alone predicts best; empty where there is neither, or no grading.

    Parameters
    ----------
    judged : Judged
        Answer with the effects that the search accepted.
    gap : mapping
        `Gap` of "train" and, if given, "validation", after being with these effects.
    """
    return " ".join(filter(None, [_accepted(judged, gap), judged.alone])) if judged.why else ""


def _accepted(judged: Judged, gap: Mapping[str, Gap]) -> str:
    """What the search accepted, in two sentences."""
    labels = [round_.best.candidate.label for round_ in judged.state.rounds]
    if not labels:
        return ""
    seen = "validation" if "validation" in gap else "train"
    records = "the validation records" if seen == "validation" else f"the {_TRAINED[judged.compared]} records"
    one = gap[seen]
    what, them, comes = " and ".join(labels), "it" if len(labels) == 1 else "them", "s" if len(labels) == 1 else ""
    if left(one).share_explained <= 0.0:
        return (f"Nearest come{comes} {what}, with which the error on {records} does not fall ({one.before:.2g} to "
                f"{one.after:.2g} {one.unit}): no name.")
    before, after = _with_digits(one.before, one.after)
    return (f"Nearest come{comes} {what}: with {them} the error on {records} falls from {before} to "
            f"{after} {one.unit}, noise alone would give {one.noise:.2g}. No name, because "
            f"{_why(judged)}.")


def _with_digits(before: float, after: float) -> tuple[str, str]:
    """Two numbers with two digits, or with as many more as show which is smaller."""
    for digits in (2, 3):
        if f"{before:.{digits}g}" != f"{after:.{digits}g}":
            return f"{before:.{digits}g}", f"{after:.{digits}g}"
    return f"{before:.4g}", f"{after:.4g}"


def _why(judged: Judged) -> str:
    """Why each of the effects is no name: the first of its own tests that fails, or what was wrong beside others."""
    if judged.compared:
        return judged.why
    state = judged.state
    found = evidence_of(state.rounds, state.fit, state.nominal, judged.validation)
    labels = [round_.best.candidate.label for round_ in state.rounds]
    short = [f"{label} {one.short_of}" for label, one in zip(labels, found, strict=True) if not one.lasting]
    holding = [label for label, one in zip(labels, found, strict=True) if one.lasting]
    why = judged.why
    if _LABEL.match(why) and not why.startswith(tuple(labels)):  # of what the graded search has found instead
        why = f"{'it is' if len(labels) == 1 else 'they are'} not what lasts: {why}"
    if not short or not holding or why.startswith(tuple(holding)):
        return "; ".join([*short, *([why] if holding else [])])
    hold = "holds" if len(holding) == 1 else "hold"
    return "; ".join([*short, f"{' and '.join(holding)} {hold} over parts of the records, but {why}"])
