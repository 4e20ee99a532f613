"""Reasons of a verdict: what makes a report fail, and what a reader has to know although it passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from math import isfinite
from typing import Literal

from ..errors import InputError

Level = Literal["fail", "remark"]
Verdict = Literal["PASS", "PASS WITH REMARKS", "FAIL", "NO VERDICT"]
NO_VERDICT: Verdict = "NO VERDICT"  # a stage could not be computed: nothing is decided
_ALIKE, _NAMED = 3, 8  # reasons of one kind from which one stands for all; what is listed of the others
_OF_CLAIMS = ("not_certified", "not_verified", "not_robust", "not_passed")  # each claim has a reason of its own
CONTRADICTED = ("validation_misfit", "training_misfit")  # codes that say: the data contradict the model


@dataclass(frozen=True)
class Reason:
    """One reason of a verdict.

    Parameters
    ----------
    level : {"fail", "remark"}
        Whether the verdict is FAIL because of it.
    code : str
        What kind of reason, for programs; `robthermal explain CODE` says what it means.
    stage : str
        Stage of the job it comes from, for example "certify".
    about : str
        Claim, parameter, module, sensor or record it is about.
    text : str
        What was found, one sentence with its numbers.
    remedy : str, optional
        What to do about it.
    value, limit : float or None, optional
        Number that was found, and the number it is compared with [unit as in the text].

    Raises
    ------
    InputError
        Another level, numbers that are not finite.

    Examples
    --------
    >>> import robthermal as rt
    >>> print(rt.report.Reason("remark", "no_validation", "calibrate", "records", "No record was held out."))
    no_validation: No record was held out.
    """

    level: Level
    code: str
    stage: str
    about: str
    text: str
    remedy: str = ""
    value: float | None = None
    limit: float | None = None

    def __post_init__(self) -> None:
        where = f"reason {self.code!r}"
        if self.level not in ("fail", "remark"):
            raise InputError(f"level is {self.level!r}", where=where, expected='"fail" or "remark"')
        if not all(number is None or isfinite(number) for number in (self.value, self.limit)):
            raise InputError(f"value is {self.value!r} and limit is {self.limit!r}", where=where,
                             expected="finite numbers, or None")

    def to_dict(self) -> dict[str, object]:
        """For JSON, in the order of the summary."""
        found = asdict(self)
        return {key: found[key] for key in ("level", "code", "stage", "about", "value", "limit", "text", "remedy")}

    def __str__(self) -> str:
        return f"{self.code}: {self.text}" + (f" {self.remedy}" if self.remedy else "")


def told(reasons: Sequence[Reason]) -> list[Reason]:
    """Reasons as a reader sees them: of three or more of one kind the worst, and what else it is about.

    Parameters
    ----------
    reasons : sequence of Reason
        All reasons, in order.

    Returns
    -------
    list of Reason

    Examples
    --------
    >>> import robthermal as rt
    >>> alike = [rt.report.Reason("remark", "undetermined_parameter", "calibrate", name, f"{name} is open.")
    ...          for name in ("a", "b", "c")]
    >>> [one.text for one in told(alike)]
    ['a is open. Likewise: b, c.']
    """
    kinds: dict[tuple[str, str], list[Reason]] = {}
    for one in reasons:
        kinds.setdefault((one.level, one.code), []).append(one)
    out: list[Reason] = []
    for alike in kinds.values():
        if len(alike) < _ALIKE or alike[0].code in _OF_CLAIMS:
            out += alike
            continue
        worst = max(alike, key=_excess)
        others = list(dict.fromkeys(one.about for one in alike if one is not worst))
        named = ", ".join(others[:_NAMED]) + (f" and {len(others) - _NAMED} more" if len(others) > _NAMED else "")
        out.append(replace(worst, text=f"{worst.text} Likewise: {named}."))
    return out


def _excess(one: Reason) -> float:
    """What was found, in units of the limit; 0 where nobody says."""
    return abs(one.value / one.limit) if one.value is not None and one.limit else 0.0


def verdict_of(reasons: Sequence[Reason]) -> Verdict:
    """The worst reason decides."""
    if any(one.level == "fail" for one in reasons):
        return "FAIL"
    return "PASS WITH REMARKS" if reasons else "PASS"


def contradicts(reasons: Sequence[Reason]) -> bool:
    """Whether the data contradict the model that the claims are about."""
    return any(one.level == "fail" and one.code in CONTRADICTED for one in reasons)
