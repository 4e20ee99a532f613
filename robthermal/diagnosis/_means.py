"""Whether a log of means, taken for readings at their stamps, explains what was found (docs: Measured files)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

from ..fitting import rmse
from ..signals import Record, as_means
from ._judge import Judged
from ._outcomes import DiagnosisCode
from .data import records_of, responses_of
from .fit import Refit

_LESS = 0.8  # of the mean square that the answer leaves: means are the better answer
_ALIKE = 1.05  # of it: they are as good a one
_MUCH = 0.5  # of the mean square of the nominal model: worth a word beside no answer
_SHORT, _PART = 20, 1500  # samples

Reading = Literal["after", "readings"]

_WORDS: dict[Reading, tuple[str, str]] = {
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
    named, part = judged.verdict != "unexplained", [one[:_PART] for one in records]
    long = sum(map(len, records)) > 2 * sum(map(len, part))
    if long and not _explained(part, refitted, _rms(nominal), _rms(found), named):
        return judged
    answer = _explained(records, refitted, nominal.rms, found.rms, named)
    if answer is None:
        return judged
    least, how = answer
    better = least**2 < _LESS * found.rms**2
    what, declare = _WORDS[how]
    falls = f"the error falls from {nominal.rms:.2g} to {least:.2g} {nominal.unit} without any effect"
    if not better:
        return replace(judged, means=f"If {what}, {falls}, about as far as with what is named: then "
                                     f"declare {declare} in [record], and diagnose again.")
    text = f"If {what}, {falls}: declare {declare} in [record], and diagnose again."
    return replace(judged, verdict="unexplained", evidence=(), plain=None, means=text,
                   outcome=judged.outcome if not named else DiagnosisCode.UNEXPLAINED.outcome(
                       "No name: the records are explained better as means over a step.", remedy="Declare it."))


def _explained(records: Sequence[Record], refitted: Callable[[Sequence[Record]], Refit], before: float, left: float,
               named: bool) -> tuple[float, Reading] | None:
    """What the nominal model leaves of records taken as means, and as which, if that is less or as little."""
    least, how = min((refitted([as_means(one, how) for one in records]).rms, how) for how in _WORDS)
    less = least**2 < _LESS * left**2 and least**2 < _MUCH * before**2
    return (least, how) if less or named and least**2 < _ALIKE * left**2 else None


def _rms(fit: Refit) -> float:
    """Root mean square of the free-run residual on the first part of every record [K]."""
    return rmse([path.residual[:_PART] for path in fit.records])


def _askable(nominal: Refit) -> list[Record]:
    """The records of a fit, if all of them may be means: of temperatures, not declared, and not too short."""
    data = nominal.structure.data
    records = [one.record for one in records_of(data)]
    sampled = not any(one.averaged or len(one) < _SHORT for one in records)
    return records if sampled and not responses_of(data) and "V" not in nominal.system.sensor_units.values() else []
