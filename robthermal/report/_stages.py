"""Stages of a chain, as its report lists them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Literal

from ..errors import InputError

Status = Literal["done", "cached", "skipped", "failed"]
STATUSES: tuple[Status, ...] = ("done", "cached", "skipped", "failed")


@dataclass(frozen=True)
class Stage:
    """One stage of a chain, and what became of it.

    Parameters
    ----------
    name : str
        Name of the stage, for example "certify"; claims and reasons name it.
    status : {"done", "cached", "skipped", "failed"}
        Computed now; taken from an earlier run; not asked for; could not be computed.
    seconds : float, optional
        Time the stage took when it was computed [s].
    hash : str, optional
        Hash of everything the stage depends on; empty where it was not computed.
    text : str, optional
        Why it was skipped, or what failed.
    gates : sequence of str, optional
        Codes of reasons that the stage looked for, found or not.

    Raises
    ------
    InputError
        Another status, a duration that is not a number ≥ 0.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.report.Stage("design", "skipped", text="The project file has no table [design].").ran
    False
    """

    name: str
    status: Status
    seconds: float = 0.0
    hash: str = ""
    text: str = ""
    gates: Sequence[str] = ()

    def __post_init__(self) -> None:
        if self.status not in STATUSES:
            raise InputError(f"status is {self.status!r}", where=f"stage {self.name!r}", expected=", ".join(STATUSES))
        if not (isfinite(self.seconds) and self.seconds >= 0.0):
            raise InputError(f"seconds is {self.seconds!r}", where=f"stage {self.name!r}", expected="a duration ≥ 0")

    @property
    def ran(self) -> bool:
        """Whether there is a result of it, of now or of an earlier run."""
        return self.status in ("done", "cached")
