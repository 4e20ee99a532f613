"""What a report is made of: claims, sections, the whole. All text is plain; layout is done elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import numpy as np

from ..errors import InputError
from ._evidence import Evidence
from ._figure import Figure
from ._reasons import NO_VERDICT, Reason, Verdict, contradicts, told, verdict_of
from ._stages import Stage
from ._table import Printed, Table
from ._usable import Parameters, UsableRange


@dataclass(frozen=True)
class Claim:
    """One certified statement, and what the independent check said about it.

    Parameters
    ----------
    title : str
        Short name of the claim.
    sentence : str
        What is claimed, in full.
    holds : bool
        Whether the proof was found.
    verified : bool or None
        Whether the independent check confirmed it; None if it was not run.
    box : str
        Ranges in which the claim is made, separated by semicolons.
    margin : str
        How far from failing.
    how : str
        How it was proven.
    reason : str, optional
        Why it does not hold, or is not verified.
    file : str, optional
        Certificate file, relative to the report.
    kind : str, optional
        Kind of certificate.
    seconds : float, optional
        Duration of the check [s].
    tested : bool, optional
        Whether it is the result of a test on data: nothing is proven then, and `verified` is None.
    parameters : str, optional
        "nominal" or "ranges": for which parameters, where the same is claimed for both; then both have one title.
    stage : str, optional
        Stage of a chain that claims it.

    Raises
    ------
    InputError
        A verdict that is not a truth value, a duration that is not a number ≥ 0.

    Examples
    --------
    >>> import robthermal as rt
    >>> claim = rt.report.Claim("Contraction", "Trajectories meet.", True, None, "m1: 0 to 1 A", "0.01 1/s", "energy")
    >>> claim.good, claim.why
    (False, 'the independent check was not run')
    """

    title: str
    sentence: str
    holds: bool
    verified: bool | None
    box: str
    margin: str
    how: str
    reason: str = ""
    file: str = ""
    kind: str = ""
    seconds: float = 0.0
    tested: bool = False
    parameters: Parameters = ""
    stage: str = "certify"

    def __post_init__(self) -> None:
        # "no" and NaN are true in Python; here they would turn a badge green.
        where = f"claim {self.title!r}"
        if not isinstance(self.holds, (bool, np.bool_)):
            raise InputError(f"holds is {self.holds!r}", where=where, expected="True or False")
        if self.verified is not None and not isinstance(self.verified, (bool, np.bool_)):
            raise InputError(f"verified is {self.verified!r}", where=where, expected="True, False or None")
        if self.tested and self.verified is not None:
            raise InputError(f"verified is {self.verified!r}", where=where, expected="None: a test proves nothing")
        if not (isfinite(self.seconds) and self.seconds >= 0.0):
            raise InputError(f"seconds is {self.seconds!r}", where=where, expected="a duration ≥ 0 in seconds")

    @property
    def good(self) -> bool:
        """Holds, and the independent check confirmed it, where it is a proof."""
        return bool(self.holds) and bool(self.tested or self.verified)

    @property
    def status(self) -> str:
        """In words, for people."""
        if self.tested:
            return "Passed" if self.holds else "Not passed"
        if not self.holds:
            return "Not proven"
        return "Proven and verified" if self.verified else "Not verified"

    @property
    def name(self) -> str:
        """Title, the stage that claims it if that is not the certification, and for which parameters, where said."""
        title = self.title if self.stage == "certify" else f"{self.title} ({self.stage})"
        return f"{title}, for the parameter ranges" if self.parameters == "ranges" else title

    @property
    def why(self) -> str:
        """Why it is not good; empty if it is."""
        if self.good:
            return ""
        if self.reason:
            return self.reason
        if not self.holds:
            return "the test failed" if self.tested else "no proof was found"
        return f"the independent check {'was not run' if self.verified is None else 'did not confirm it'}"


@dataclass(frozen=True)
class Section:
    """A part of the report.

    Parameters
    ----------
    title : str
        Heading of the section.
    text : str
        Plain paragraphs separated by blank lines.
    figures : sequence of Figure, optional
        Drawn below the text.
    tables : sequence of Table or Printed, optional
        Set below the figures.
    anchor : str, optional
        Address within the page; default from the title.
    chapter : str, optional
        Heading above it; sections of one chapter follow each other.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.report.Section("Limits", "First paragraph.\\n\\nSecond.").paragraphs
    ['First paragraph.', 'Second.']
    """

    title: str
    text: str
    figures: Sequence[Figure] = ()
    tables: Sequence[Table | Printed] = ()
    anchor: str = ""
    chapter: str = ""

    @property
    def paragraphs(self) -> list[str]:
        """Text, one entry per paragraph."""
        pieces = self.text.replace("\r\n", "\n").split("\n\n")
        return [piece.strip() for piece in pieces if piece.strip()]


@dataclass(frozen=True)
class Report:
    """Everything a report says.

    Parameters
    ----------
    title : str
        Of the page.
    subtitle : str
        About which machine.
    label : str
        Banner such as "SIMULATED DATA"; empty for none.
    claims : sequence of Claim
        Claims for the first screen.
    sections : sequence of Section
        Below, in order.
    provenance : mapping
        Versions and SHA-256 of inputs, by name.
    assumptions : sequence of str
        What every claim rests on; what only one rests on stands with its evidence.
    generated : str
        When, as text.
    answer : str, optional
        In a word, for the badge of a report whose claims are tests on data; nothing is called certified then.
    evidence : sequence of Evidence, optional
        Every certificate file with what the independent check said.
    checker : str, optional
        Which version of what made that check.
    gate : sequence of Reason, optional
        Reasons of the verdict beside those that the claims give.
    gates : sequence of str, optional
        Codes that were looked for, found or not: test cases of the pipeline.
    usable : sequence of UsableRange, optional
        Usable currents, for the first screen.
    first : sequence of Section, optional
        Sections that belong on the first screen: model against data.
    data : mapping, optional
        Tables for the JSON summary, by key.
    stages : sequence of Stage, optional
        Stages of a chain in their order; none in the report of a single job.
    headline : str, optional
        The answer in a sentence, beside the verdict; the reasons then stand with the claims only.
    numbers : sequence of (str, str, str), optional
        The number that matters: what it is, the number, and what to compare it with.
    identity : mapping, optional
        Which machine and which document, by name: serial number, operator, revision, date.
    kind : str, optional
        What kind of report stands above the title; default from what it claims.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.report.Report("Setup", "", "", (), (), {}, (), "today").verdict
    'FAIL'
    """

    title: str
    subtitle: str
    label: str
    claims: Sequence[Claim]
    sections: Sequence[Section]
    provenance: Mapping[str, str]
    assumptions: Sequence[str]
    generated: str
    answer: str = ""
    evidence: Sequence[Evidence] = ()
    checker: str = ""
    gate: Sequence[Reason] = ()
    gates: Sequence[str] = ()
    usable: Sequence[UsableRange] = ()
    first: Sequence[Section] = ()
    data: Mapping[str, Any] = field(default_factory=dict)
    stages: Sequence[Stage] = ()
    headline: str = ""
    numbers: Sequence[tuple[str, str, str]] = ()
    identity: Mapping[str, str] = field(default_factory=dict)
    kind: str = ""

    @property
    def holds(self) -> bool:
        """Whether the verdict is PASS or PASS WITH REMARKS."""
        return self.verdict not in ("FAIL", NO_VERDICT)

    @property
    def verdict(self) -> Verdict:
        """PASS, PASS WITH REMARKS or FAIL: the worst reason decides; none where a stage could not be computed."""
        return NO_VERDICT if self.failed else verdict_of(self.reasons)

    @property
    def failed(self) -> list[Stage]:
        """Stages that could not be computed."""
        return [stage for stage in self.stages if stage.status == "failed"]

    @property
    def reasons(self) -> list[Reason]:
        """Everything that is not as it should be, failures first."""
        found = [*self._of_claims(), *self.gate]
        return sorted(found, key=lambda one: one.level != "fail")

    @property
    def told(self) -> list[Reason]:
        """The same for a reader: of three or more of one kind the worst, with what else it is about."""
        return told(self.reasons)

    @property
    def contradicted(self) -> bool:
        """Whether the data contradict the model that the claims are about."""
        return contradicts(self.gate)

    def status(self, claim: Claim) -> str:
        """Status of a claim in words; nothing is called proven about a model that the data contradict.

        Parameters
        ----------
        claim : Claim
            One of the claims of this report.
        """
        return "Holds for the model in the file" if self.contradicted and claim.good and not claim.tested else (
            claim.status)

    def _of_claims(self) -> list[Reason]:
        if not self.claims and self.failed:
            return []  # nothing is decided
        if not self.claims:
            return [Reason("fail", "not_certified", "certify", "claims", "Nothing is claimed.")]
        bad = {(claim.stage, claim.title) for claim in self.claims if claim.parameters != "ranges" and not claim.good}
        return [_reason(claim) for claim in self.claims
                if not claim.good and not (claim.parameters == "ranges" and (claim.stage, claim.title) in bad)]


_CODES = {True: "not_verified", False: "not_certified"}


def _reason(claim: Claim) -> Reason:
    if claim.tested:
        return Reason("fail", "not_passed", "diagnose", claim.title, f"{claim.title}: {claim.why}")
    code = "not_robust" if claim.parameters == "ranges" else _CODES[bool(claim.holds)]
    words = "It holds for the parameters as they stand, not for all of their ranges: " if code == "not_robust" else ""
    return Reason("fail", code, claim.stage, claim.title, f"{claim.title}: {words}{claim.why}")
