"""Whether a log read otherwise explains what was found: means, or commands a row from where they act.

Docs: Measured files.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..errors import Diverged, InputError
from ..signals import Record
from ._judge import Judged, Validation
from ._outcomes import DiagnosisCode
from ._read_otherwise import (
    CLEARLY,
    MEANS,
    ReadAs,
    Reading,
    Refitted,
    read_otherwise,
    simplest,
    square,
    stands,
    with_one_effect,
    with_some,
)
from .data import records_of, responses_of
from .fit import Refit

_LESS = 0.8  # of the mean square that the answer leaves: means without any effect are the better answer
_NEARLY = 0.005  # of what the answer takes off the mean square: who takes all but this off explains as much
_MORE = 0.25  # of what the answer leaves: no more may be left by one that explains as much
_MOSTLY = 0.02  # of what the best takes off: what an effect more has to take off beside it, or _MORE of what is left
_REST = 0.1  # of the mean square without effects: names stay in two readings of a log where the better leaves less
_CHANCE = 6.0  # readings' worth of the mean square by which equally good answers differ
_LATE = 0.06  # of a step: means of eight samples; those of less are as good as any delay
_SHORT, _PART = 20, 1500  # samples


@dataclass(frozen=True)
class _Words:
    """How a log is read otherwise: what it would do, what that means, what is declared, and what one looks up."""

    off: str
    what: str
    declare: str
    better: str
    look_up: str


_MEAN = ("as means over a step", "Look up whether the logger averages.")
_SHIFT = ("with commands in another row", "Look up when the program logs commands, and when it sends them.")
_WORDS: dict[Reading, _Words] = {
    "after": _Words("hold means", "every value of the log is a mean over a step (loggers and data bases that average)",
                    'averaged = "after", or "before" where stamps are at the end', *_MEAN),
    "readings": _Words("hold means", "the readings are means over the step before their stamp",
                       'averaged = "readings"', *_MEAN),
    "earlier": _Words("have its commands a row too late",
                      "the commands of a row act from the stamp before on (a program that logs what it sent before)",
                      "input_shift = -1", *_SHIFT),
    "later": _Words("have its commands a row too early",
                    "the commands of a row act from the next stamp on (a program that logs before it sends)",
                    "input_shift = 1", *_SHIFT),
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
        nearly = min(_NEARLY * max(self.before - self.left, 0.0), _MORE * self.left)
        return self.left + nearly + _CHANCE / self.n_readings * self.left

    def clearly(self, one: ReadAs) -> bool:
        """Whether records as means are clearly better explained."""
        if not one.labels and one.square < min(_LESS * self.left, CLEARLY * self.before):
            return True
        return one.square < CLEARLY * self.left

    def as_well(self, one: ReadAs) -> bool:
        """Whether they explain as well with fewer effects: of an answer without a name, much must be explained."""
        if one.how == "later":  # heaters with a dead time do so, too
            return False
        much = self.named or one.square < CLEARLY * self.before
        return much and len(one.labels) < self.n_effects and one.square <= self.alike and one.late <= _LATE


def asked_of_log(judged: Judged, refitted: Refitted, validation: Validation) -> Judged:
    """Refit the system with the log read otherwise, and say whether that explains more.

    Names are withdrawn where the model is then clearly better, unless the same effects are chosen then, too, and where
    it is as good with at least two effects less. With one effect less the records cannot tell. Returned as it is where
    nothing is missing, and for records that are means, or beside frequency responses.

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
        if _explained(part, refitted, judged, _on_part(judged, part, refitted)) is None:
            return judged
    asked = _compared(judged, square(nominal), square(found))
    answer = _explained(records, refitted, judged, asked)
    if answer is None:
        return judged
    asked = replace(asked, left=min(asked.left, _as_it_stands(nominal, answer)))
    if not asked.clearly(answer) and not asked.as_well(answer):
        return judged
    if not asked.clearly(answer) and _distinguished([*records, *_sampled(validation)], refitted, judged):
        return judged
    return _answered(judged, asked, answer)


def _as_it_stands(nominal: Refit, answer: ReadAs) -> float:
    """Mean square of the log as it stands with the same effects, fitted from where they are in the other reading [K²].

    A fit that ended beside its best is no evidence for another reading.
    """
    again = next(with_some(nominal, answer.fit, len(answer.labels)), None) if answer.labels else None
    return math.inf if again is None else square(again)


def _on_part(judged: Judged, part: Sequence[Record], refitted: Refitted) -> _Compared:
    """What the first samples are compared by: fits to them alone leave less there than fits to all samples do."""
    nominal, found = judged.state.nominal, judged.plain or judged.state.fit
    before, left = square(nominal, _PART), square(found, _PART)
    try:
        plain = refitted(part)
        both = next(with_some(plain, found, len(found.structure.effects)), plain)
    except (Diverged, InputError):  # too short, or they lead where the model runs away
        return _compared(judged, before, left)
    return _compared(judged, min(before, square(plain)), min(left, square(both)))


def _compared(judged: Judged, before: float, left: float) -> _Compared:
    return _Compared(before, left, len(judged.state.fit.structure.effects), judged.state.nominal.n_readings,
                     judged.verdict in ("named", "ambiguous") and judged.plain is None,
                     judged.verdict != "unexplained")


def _explained(records: Sequence[Record], refitted: Refitted, judged: Judged, asked: _Compared) -> ReadAs | None:
    """The fit as means that explains clearly more, or as much with fewer effects; None if none does."""
    fits = read_otherwise(records, refitted, judged.plain or judged.state.fit, asked.alike, asked.down)
    if not asked.down and not any(map(asked.clearly, fits)):
        plain = [one for one in fits if not one.labels and one.how in MEANS]
        fits += filter(None, (with_one_effect(one, judged.state.names, CLEARLY * asked.left) for one in plain))
    better = [one for one in fits if asked.clearly(one)]
    if better:
        least = min(one.square for one in better)
        return simplest(better, least + min(_MOSTLY * max(asked.before - least, 0.0), _MORE * least))
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
    return not any(map(asked.as_well, read_otherwise(records, refitted, both, asked.alike, asked.down)))


def _sampled(validation: Validation) -> list[Record]:
    """Validation records, if they may be means."""
    listed = validation.data if isinstance(validation.data, list | tuple) else [validation.data]
    records = [one for one in listed if isinstance(one, Record) and not one.averaged and len(one) >= _SHORT]
    return records if len(records) == len(listed) else []


def _answered(judged: Judged, asked: _Compared, answer: ReadAs) -> Judged:
    """The answer with what is to be said of the log, and without names that it makes doubtful."""
    words, clear, unit = _WORDS[answer.how], asked.clearly(answer), judged.state.nominal.unit
    rounds, names = judged.state.rounds, judged.state.names
    explained = asked.named and answer.square < _REST * asked.before
    if explained and len(answer.labels) == len(rounds) and stands(answer, rounds, names):
        return replace(judged, means=f"The log seems to {words.off}: if {words.what}, the error falls further, from "
                       f"{asked.left**0.5:.2g} to {answer.square**0.5:.2g} {unit}, with the same effects of other "
                       f"sizes. Then declare {words.declare} in [record], and diagnose again.")
    beside = f"with {' and '.join(answer.labels)}" if answer.labels else "without any effect"
    falls = (f"if {words.what}, the error falls from {asked.before**0.5:.2g} to {answer.square**0.5:.2g} {unit} "
             f"{beside}")
    if not clear and asked.n_effects - len(answer.labels) == 1 and asked.named:
        text = (f"The log may {words.off}: {falls}, about as far as with what is listed. Then declare "
                f"{words.declare} in [record], and diagnose again.")
        return replace(judged, verdict="ambiguous", means=text, outcome=DiagnosisCode.AMBIGUOUS.outcome(
            f"What is listed explains the records, and so does the log {words.better}.", remedy=words.look_up))
    text = (f"The log {'seems to' if clear else 'may'} {words.off}: {falls}, against {asked.left**0.5:.2g} {unit} as "
            f"it stands. Declare {words.declare} in [record], and diagnose again.")
    return replace(judged, verdict="unexplained", evidence=(), plain=None, means=text,
                   outcome=judged.outcome if not asked.named else DiagnosisCode.UNEXPLAINED.outcome(
                       f"No name: the records are explained {'better' if clear else 'as well'} {words.better}.",
                       remedy=f"{words.look_up} If it is so, declare it."))


def _askable(nominal: Refit) -> list[Record]:
    """The records of a fit, if all of them may be means: of temperatures, not declared, and not too short."""
    data = nominal.structure.data
    records = [one.record for one in records_of(data)]
    sampled = not any(one.averaged or len(one) < _SHORT for one in records)
    return records if sampled and not responses_of(data) and "V" not in nominal.system.sensor_units.values() else []
