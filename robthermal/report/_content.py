"""What a report is made of: claims, sections, the whole. All text is plain; layout is done elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from ..errors import InputError
from ._evidence import Evidence
from ._figure import Figure
from ._table import Printed, Table


@dataclass(frozen=True)
class Claim:
    """One certified statement, and what the independent check said about it.

    Parameters
    ----------
    title : str
        Short name.
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
        Heading.
    text : str
        Plain paragraphs separated by blank lines.
    figures : sequence of Figure, optional
        Drawn below the text.
    tables : sequence of Table or Printed, optional
        Set below the figures.
    anchor : str, optional
        Address within the page; default from the title.

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
        First screen.
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

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.report.Report("Setup", "", "", (), (), {}, (), "today").holds
    False
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

    @property
    def holds(self) -> bool:
        """Whether something is claimed, and all of it holds and is verified."""
        return bool(self.claims) and all(claim.good for claim in self.claims)

    @property
    def reasons(self) -> list[str]:
        """Why the answer is no, one sentence per claim; empty if it is yes."""
        if not self.claims:
            return ["nothing is claimed"]
        return [f"{claim.title}: {claim.why}" for claim in self.claims if not claim.good]
