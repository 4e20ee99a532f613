"""Checks of certificate files as a pipeline reads them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...report import Claim, Report, versions, write_junit
from ..now import now
from ._check_files import FileCheck


def write_checks(checks: Sequence[FileCheck], path: str | Path) -> Path:
    """Write the checks as JUnit XML, one test case per file.

    Parameters
    ----------
    checks : sequence of FileCheck
        From `verify_files`. What is not valid, or cannot be read, is a failure.
    path : str or Path
        File to write.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        The file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> file = rt.jobs.verify.write_checks(rt.jobs.verify_files([Path("none.json")]), "junit.xml")
    >>> 'failures="1"' in file.read_text()
    True
    """
    claims = [Claim(str(one.file), one.claim, one.valid is not None, one.valid, "as in the file", _margin(one),
                    "re-derived in ball arithmetic", "" if one.valid else one.reason, str(one.file), one.kind,
                    one.seconds) for one in checks]
    return write_junit(Report("robthermal verify", "", "", claims, (), versions(), (), now()), path)


def _margin(one: FileCheck) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in one.margins.items()) or "none"
