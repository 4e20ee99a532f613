"""Evidence: a certificate file, and what the independent check said about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite

from ..errors import InputError


@dataclass(frozen=True)
class Evidence:
    """One certificate file with its check.

    Parameters
    ----------
    title : str
        Short name of the claim.
    file : str
        Certificate file, relative to the report.
    sha256 : str
        Of that file, hexadecimal.
    kind : str
        Kind of certificate.
    claim : str
        The exact sentence of the certificate.
    proven : bool
        Whether the certificate says that its claim holds.
    valid : bool or None
        What the independent check said; None if there was nothing to check.
    reason : str, optional
        Why the check did not confirm it.
    margins : mapping of str to float, optional
        Margins the check found again [unit of each margin].
    seconds : float, optional
        Duration of the check [s].
    assumptions : sequence of str, optional
        What this claim rests on, beside what every claim of the report rests on.
    machine : str, optional
        Short hash of the machine it is about.
    second : str, optional
        What a second, independent checker said: "valid", "not valid" or "not covered"; empty if it did not run.

    Raises
    ------
    InputError
        A verdict that is not a truth value, margins that are not finite numbers.

    Examples
    --------
    >>> import robthermal as rt
    >>> one = rt.report.Evidence("Contraction", "certificates/c.json", "9f" * 32, "contraction", "It contracts.", True,
    ...                          None)
    >>> one.good
    False
    """

    title: str
    file: str
    sha256: str
    kind: str
    claim: str
    proven: bool
    valid: bool | None
    reason: str = ""
    margins: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    assumptions: Sequence[str] = ()
    machine: str = ""
    second: str = ""

    def __post_init__(self) -> None:
        where = f"evidence {self.title!r}"
        if not isinstance(self.proven, bool) or not (self.valid is None or isinstance(self.valid, bool)):
            raise InputError(f"proven is {self.proven!r} and valid is {self.valid!r}", where=where,
                             expected="truth values")
        if not all(isfinite(value) for value in (*self.margins.values(), self.seconds)):
            raise InputError(f"margins are {dict(self.margins)!r}", where=where, expected="finite numbers")

    @property
    def good(self) -> bool:
        """Proven, the independent check confirmed it, and no second check says otherwise."""
        return self.proven and self.valid is True and self.second != "not valid"
