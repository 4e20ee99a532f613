"""Certificates with their checks, and everything that was certified about a system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...certify import CurrentLimit, Runaway, RunawayFree
from ...report import Parameters, UsableRange
from ...thermal import System
from ...verification import Certificate, Verdict
from ..request import Boxes


@dataclass(frozen=True)
class Checked:
    """A certificate with its independent check.

    Parameters
    ----------
    key : str
        File name without ending.
    title : str
        Short name of the claim.
    certificate : Certificate
        What is claimed.
    verdict : Verdict or None
        Of `rt.verify`; None if there is nothing to verify because the claim does not hold.
    required : bool
        Whether the job's answer is no without it.
    parameters : str, optional
        "nominal" or "ranges" where the same is claimed for both.
    breaks : str, optional
        What makes a claim fail for the parameter ranges, in words.
    """

    key: str
    title: str
    certificate: Certificate
    verdict: Verdict | None
    required: bool
    parameters: Parameters = ""
    breaks: str = ""

    @property
    def good(self) -> bool:
        """Holds and is verified."""
        return self.certificate.holds and self.verdict is not None and self.verdict.valid

    @property
    def file(self) -> str:
        """Place in a results folder."""
        return f"certificates/{self.key}.json"


@dataclass(frozen=True)
class Certification:
    """Everything that was certified about a system.

    Parameters
    ----------
    system : System
        About which system.
    boxes : Boxes
        For which ranges of temperatures, currents, ambients and heats.
    checked : tuple of Checked
        Certificates with verdicts; the required ones first.
    limits : tuple of CurrentLimit
        Contraction limits by method and direction, where they were searched one by one.
    runaway : Runaway or None
        Fold of the regulated network; None without set-points.
    safe : RunawayFree
        The box that is never left, with contraction in it.
    usable : tuple of UsableRange
        Usable currents by direction, nominal and for the parameter ranges.
    parameters : dict or None
        Ranges of the parameters for which the claims are made too; None: only as they stand.
    """

    system: System
    boxes: Boxes
    checked: tuple[Checked, ...]
    limits: tuple[CurrentLimit, ...]
    runaway: Runaway | None
    safe: RunawayFree
    usable: Sequence[UsableRange] = ()
    parameters: Mapping[str, tuple[float, float]] | None = None

    @property
    def holds(self) -> bool:
        """Whether everything required holds and is verified."""
        return all(c.good for c in self.checked if c.required)

    @property
    def current(self) -> dict[str, tuple[float, float]]:
        """Currents that the claims are about, by module [A]."""
        found = self.safe.invariance.region.get("current", {})
        return {name: (float(low), float(high)) for name, (low, high) in found.items()}
