"""Whether a log of means, taken for readings at their stamps, explains what was found (docs: Measured files)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..errors import Diverged, InputError
from ..signals import Record
from ._as_means import (
    CLEARLY,
    AsMeans,
    Reading,
    Refitted,
    as_means_of_both_kinds,
    simplest,
    square,
    with_one_effect,
    with_some,
)
from ._judge import Judged, Validation
from ._outcomes import DiagnosisCode
from .data import records_of, responses_of
from .fit import Refit

_LESS = 0.8  # of the mean square that the answer leaves: means without any effect are the better answer
_NEARLY = 0.005  # of what the answer takes off the mean square: who takes all but this off explains as much
_MOSTLY = 0.02  # of what the best takes off: what an effect more has to take off beside it
_CHANCE = 6.0  # readings' worth of the mean square by which equally good answers differ
_LATE = 0.06  # of a step: means of eight samples; those of less are as good as any delay
_SHORT, _PART = 20, 1500  # samples

_WORDS: dict[Reading, tuple[str, str]] = {
    "after": ("every value of the log is a mean over a step (loggers and data bases that average)",
              'averaged = "after", or "before" where stamps are at the end'),
    "readings": ("the readings are means over the step before their stamp", 'averaged = "readings"'),
}


@dataclass(frozen=True, eq=False)
class _Compared:
    """Mean squares of the free-run residual [K²] without effects and with those found, and how they were found."""

    before: float
    left: float
    n_effects: int
    n_readings: int
    down: bool  # to the noise
    named: bool

    @property
    def alike(self) -> float:
        """Mean square of an answer as good as the one found."""
        return self.left + _NEARLY * max(self.before - self.left, 0.0) + _CHANCE / self.n_readings * self.left

    def clearly(self, one: AsMeans) -> bool:
        """Whether records as means are clearly better explained."""
        if not one.labels and one.square < min(_LESS * self.left, CLEARLY * self.before):
            return True
        return one.square < CLEARLY * self.left

    def as_well(self, one: AsMeans) -> bool:
        """Whether they are explained as well with fewer effects: of an answer without a name, much must be."""
        much = self.named or one.square < CLEARLY * self.before
        return much and len(one.labels) < self.n_effects and one.square <= self.alike and one.late <= _LATE


def asked_of_means(judged: Judged, refitted: Refitted, validation: Validation) -> Judged:
    """Refit the system with the records taken as means over a step, and say whether that explains more.

    Names are withdrawn where the model is then clearly better, and where it is as good with at least two effects less.
    With one effect less the records cannot tell. Returned as it is where nothing is missing, and for records that are
    means, or beside frequency responses.

    Parameters
    ----------
    judged : Judged
        Answer of the search.
    refitted : callable
        Fits the nominal system to other records.
    validation : Validation
        Data that no fit has seen: where training cannot tell names from means, they may.
    """
    records = _askable(judged.state.nominal)
    if judged.verdict == "consistent" or not records:
        return judged
    nominal, found = judged.state.nominal, judged.plain or judged.state.fit
    part = [one[:_PART] for one in records]
    if sum(map(len, records)) > 2 * sum(map(len, part)):
        asked = _compared(judged, square(nominal, _PART), square(found, _PART))
        if _explained(part, refitted, judged, asked) is None:
            return judged
    asked = _compared(judged, square(nominal), square(found))
    answer = _explained(records, refitted, judged, asked)
    if answer is None:
        return judged
    if not asked.clearly(answer) and _distinguished([*records, *_sampled(validation)], refitted, judged):
        return judged
    return _answered(judged, asked, answer)


def _compared(judged: Judged, before: float, left: float) -> _Compared:
    return _Compared(before, left, len(judged.state.fit.structure.effects), judged.state.nominal.n_readings,
                     judged.verdict in ("named", "ambiguous") and judged.plain is None,
                     judged.verdict != "unexplained")


def _explained(records: Sequence[Record], refitted: Refitted, judged: Judged, asked: _Compared) -> AsMeans | None:
    """The fit as means that explains clearly more, or as much with fewer effects; None if none does."""
    fits = as_means_of_both_kinds(records, refitted, judged.plain or judged.state.fit, asked.alike, asked.down)
    if not asked.down and not any(map(asked.clearly, fits)):
        plain = [one for one in fits if not one.labels]
        fits += filter(None, (with_one_effect(one, judged.state.names, CLEARLY * asked.left) for one in plain))
    better = [one for one in fits if asked.clearly(one)]
    if better:
        least = min(one.square for one in better)
        return simplest(better, least + _MOSTLY * max(asked.before - least, 0.0))
    return simplest([one for one in fits if asked.as_well(one)], asked.alike)


def _distinguished(records: Sequence[Record], refitted: Refitted, judged: Judged) -> bool:
    """Whether all records together are not explained as well as means with fewer effects."""
    nominal, found = judged.state.nominal, judged.plain or judged.state.fit
    if len(records) == len(nominal.records):
        return False
    try:
        plain = refitted(records)
        both = next(with_some(plain, found, len(found.structure.effects)), None)
    except (Diverged, InputError):  # a model that runs away tells nothing
        return False
    if both is None:
        return False
    asked = replace(_compared(judged, square(plain), square(both)), n_readings=plain.n_readings)
    return not any(map(asked.as_well, as_means_of_both_kinds(records, refitted, both, asked.alike, asked.down)))


def _sampled(validation: Validation) -> list[Record]:
    """Validation records, if they may be means."""
    listed = validation.data if isinstance(validation.data, list | tuple) else [validation.data]
    records = [one for one in listed if isinstance(one, Record) and not one.averaged and len(one) >= _SHORT]
    return records if len(records) == len(listed) else []


def _answered(judged: Judged, asked: _Compared, answer: AsMeans) -> Judged:
    """The answer with what is to be said of means, and without names that they make doubtful."""
    what, declare = _WORDS[answer.how]
    beside = f"with {' and '.join(answer.labels)}" if answer.labels else "without any effect"
    unit = judged.state.nominal.unit
    falls = f"the error falls from {asked.before**0.5:.2g} to {answer.square**0.5:.2g} {unit} {beside}"
    clear = asked.clearly(answer)
    if not clear and asked.n_effects - len(answer.labels) == 1 and asked.named:
        text = (f"The log may hold means: if {what}, {falls}, about as far as with what is listed. Then declare "
                f"{declare} in [record], and diagnose again.")
        return replace(judged, verdict="ambiguous", means=text, outcome=DiagnosisCode.AMBIGUOUS.outcome(
            "The records cannot distinguish what is listed from a log of means over a step.",
            remedy="Look up whether the logger averages."))
    text = (f"The log {'seems to' if clear else 'may'} hold means: if {what}, {falls}, against {asked.left**0.5:.2g} "
            f"{unit} with readings at their stamps. Declare {declare} in [record], and diagnose again.")
    return replace(judged, verdict="unexplained", evidence=(), plain=None, means=text,
                   outcome=judged.outcome if not asked.named else DiagnosisCode.UNEXPLAINED.outcome(
                       f"No name: the records are explained {'better' if clear else 'as well'} as means over a step.",
                       remedy="Declare it, if that is what they are."))


def _askable(nominal: Refit) -> list[Record]:
    """The records of a fit, if all of them may be means: of temperatures, not declared, and not too short."""
    data = nominal.structure.data
    records = [one.record for one in records_of(data)]
    sampled = not any(one.averaged or len(one) < _SHORT for one in records)
    return records if sampled and not responses_of(data) and "V" not in nominal.system.sensor_units.values() else []
