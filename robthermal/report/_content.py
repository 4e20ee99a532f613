"""What a report is made of: claims, sections, tables. All text is plain; layout is done elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
import pandas as pd

from ..errors import InputError
from ._figure import Figure

MAX_ROWS = 200  # of a table on the page; a network may have 100 000 lumps, a reader has less time


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
class Table:
    """A table with a caption.

    Parameters
    ----------
    frame : pandas.DataFrame
        Contents. A default index is not shown.
    caption : str
        What it shows.
    digits : int, optional
        Significant digits of numbers that are not integers.

    Raises
    ------
    InputError
        Not a DataFrame, or no digits.

    Examples
    --------
    >>> import pandas as pd, robthermal as rt
    >>> rt.report.Table(pd.DataFrame({"module": ["m1"], "I* [A]": [2.30149]}), "Runaway limits.").rows
    [['m1', '2.301']]
    """

    frame: pd.DataFrame
    caption: str
    digits: int = 4

    def __post_init__(self) -> None:
        if not isinstance(self.frame, pd.DataFrame):
            raise InputError(f"frame is a {type(self.frame).__name__}", where=f"table {self.caption!r}",
                             expected="a pandas DataFrame")
        if self.digits < 1:
            raise InputError(f"digits is {self.digits!r}", where=f"table {self.caption!r}",
                             expected="a whole number ≥ 1")

    @property
    def header(self) -> list[str]:
        """Column titles."""
        return [str(name) for name in self._shown().columns]

    @property
    def rows(self) -> list[list[str]]:
        """Cells as text, at most the first 200 rows."""
        shown = self._shown().head(MAX_ROWS)
        columns = [[_cell(value, self.digits) for value in shown.iloc[:, j]] for j in range(shown.shape[1])]
        return [list(row) for row in zip(*columns, strict=True)]

    @property
    def numeric(self) -> list[bool]:
        """Which columns hold numbers, and are set flush right."""
        shown = self._shown()
        types = [shown.iloc[:, j].dtype for j in range(shown.shape[1])]
        return [pd.api.types.is_numeric_dtype(kind) and not pd.api.types.is_bool_dtype(kind) for kind in types]

    @property
    def left_out(self) -> int:
        """Rows that are not shown."""
        return max(len(self.frame) - MAX_ROWS, 0)

    def _shown(self) -> pd.DataFrame:
        plain = isinstance(self.frame.index, pd.RangeIndex) and self.frame.index.name is None
        if plain:
            return self.frame
        index = self.frame.index
        levels = [pd.Series(index.get_level_values(i), name=name or "") for i, name in enumerate(index.names)]
        return pd.concat([*levels, self.frame.reset_index(drop=True)], axis=1)


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
    tables : sequence of Table, optional
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
    tables: Sequence[Table] = ()
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
        Everything the claims rest on.
    generated : str
        When, as text.
    answer : str, optional
        In a word, for the badge of a report whose claims are tests on data; nothing is called certified then.

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


def _cell(value: object, digits: int) -> str:
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (float, np.floating)):
        return _number(float(value), digits)
    return "–" if value is None or value is pd.NaT or value is pd.NA else str(value)


def _number(value: float, digits: int) -> str:
    if np.isnan(value):
        return "–"
    if isfinite(value) and 10.0 ** digits <= abs(value) < 1e9:
        return f"{value:.0f}"  # 86400, not 8.64e+04
    return f"{value:.{digits}g}"
