"""Certificate files checked one by one, for people and for pipelines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ...errors import InputError
from ...verification import Certificate, verify
from ._second import INSTALL, SecondVerdict, second_verdicts


@dataclass(frozen=True)
class FileCheck:
    """What the independent check said about one file.

    Parameters
    ----------
    file : Path
        Path of the certificate file.
    valid : bool or None
        None: the file cannot be read.
    reason : str
        How it was proven, the inequality that fails, or what is wrong with the file.
    claim, kind : str
        Of the certificate; empty if it cannot be read.
    margins : dict of str to float
        Found by the check.
    seconds : float
        Duration of the check [s].
    second : SecondVerdict or None
        What the second checker said; None where it was not asked.
    """

    file: Path
    valid: bool | None
    reason: str
    claim: str
    kind: str
    margins: dict[str, float]
    seconds: float
    second: SecondVerdict | None = None

    @property
    def status(self) -> int:
        """Exit status: 0 valid, 1 not valid (for either checker), 2 unreadable."""
        if self.valid is None:
            return 2
        return 0 if self.valid and (self.second is None or self.second.status != "not valid") else 1


def verify_files(files: Sequence[Path], progress: Callable[[int, int], None] = lambda done, total: None, *,
                 second: bool = False) -> tuple[FileCheck, ...]:
    """Derive every certificate again from its file alone.

    Parameters
    ----------
    files : sequence of Path
        Paths of the certificate files.
    progress : callable, optional
        Called with how many are done, and how many there are.
    second : bool
        Whether the second checker derives them too.

    Returns
    -------
    tuple of FileCheck
        One per file; a file that cannot be read is a result too.

    Raises
    ------
    InputError
        The second checker is asked for and not installed.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> rt.jobs.verify_files([Path("none.json")])[0].status
    2
    """
    checks = []
    for i, file in enumerate(files):
        progress(i, len(files))
        one = _checked(file)
        if second and one.valid is not None:
            one = replace(one, second=_second(file))
        checks.append(one)
    return tuple(checks)


def _second(file: Path) -> SecondVerdict:
    verdict = second_verdicts([file])[0]
    if verdict.status == "absent":
        raise InputError("the second checker is not installed", where="--second", remedy=INSTALL)
    return verdict


def _checked(file: Path) -> FileCheck:
    try:
        certificate = Certificate.load(file)
        verdict = verify(certificate)
    except InputError as error:
        return FileCheck(file, None, str(error), "", "", {}, 0.0)
    return FileCheck(file, verdict.valid, verdict.reason, certificate.claim, certificate.kind, verdict.margins,
                     verdict.seconds)
