"""Whether a log of means, taken for readings at their stamps, explains what was found (docs: Measured files)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

from ..signals import Record, as_means
from ._judge import Judged
from ._outcomes import DiagnosisCode
from .data import records_of, responses_of
from .fit import Refit

_LESS = 0.8  # of the mean square that the answer leaves: means are the better answer
_ALIKE = 1.05  # of it: they are as good a one
_MUCH = 0.5  # of the mean square of the nominal model: worth a word beside no answer
_SHORT = 20  # samples

_WORDS: dict[Literal["after", "readings"], tuple[str, str]] = {
    "after": ("every value of the log is a mean over a step (loggers and data bases that average)",
              'averaged = "after", or "before" where stamps are at the end'),
    "readings": ("the readings are means over the step before their stamp", 'averaged = "readings"'),
}


def asked_of_means(judged: Judged, refitted: Callable[[Sequence[Record]], Refit]) -> Judged:
    """Refit the nominal model with the records taken as means over a step, and say whether that explains more.

    A name is withdrawn where the model without any effect is then better than with it. Returned as it is where nothing
    is missing, and for records that are means, or beside frequency responses.

    Parameters
    ----------
    judged : Judged
        Answer of the search.
    refitted : callable
        Fits the nominal system to other records.
    """
    records = _askable(judged.state.nominal)
    if judged.verdict == "consistent" or not records:
        return judged
    nominal, found = judged.state.nominal, judged.plain or judged.state.fit
    least, how = min((refitted([as_means(one, how) for one in records]).rms, how) for how in _WORDS)
    named = judged.verdict != "unexplained"
    better = least**2 < _LESS * found.rms**2
    if not (better and least**2 < _MUCH * nominal.rms**2 or named and least**2 < _ALIKE * found.rms**2):
        return judged
    what, declare = _WORDS[how]
    falls = f"the error falls from {nominal.rms:.2g} to {least:.2g} {nominal.unit} without any effect"
    if not better:
        return replace(judged, means=f"If {what}, {falls}, about as far as with what is named: then "
                                     f"declare {declare} in [record], and diagnose again.")
    text = f"If {what}, {falls}: declare {declare} in [record], and diagnose again."
    return replace(judged, verdict="unexplained", evidence=(), plain=None, means=text,
                   outcome=judged.outcome if not named else DiagnosisCode.UNEXPLAINED.outcome(
                       "No name: the records are explained better as means over a step.", remedy="Declare it."))


def _askable(nominal: Refit) -> list[Record]:
    """The records of a fit, if all of them may be means: of temperatures, not declared, and not too short."""
    data = nominal.structure.data
    records = [one.record for one in records_of(data)]
    sampled = not any(one.averaged or len(one) < _SHORT for one in records)
    return records if sampled and not responses_of(data) and "V" not in nominal.system.sensor_units.values() else []
