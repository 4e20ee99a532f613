"""The second checker, a program of its own: found where it is installed, never needed."""

from __future__ import annotations

import importlib
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...verification import Certificate

INSTALL = "Install it from the source of robthermal: pip install ./recheck"


@dataclass(frozen=True)
class SecondVerdict:
    """What the second checker said about one certificate.

    Parameters
    ----------
    status : str
        "valid", "not valid", "not covered" (no verdict: it does not know the kind, or decides nothing), or "absent"
        where the second checker is not installed.
    reason : str
        How it was proven, what is violated, or why there is no verdict.
    """

    status: str
    reason: str

    def __bool__(self) -> bool:
        return self.status == "valid"


def second_verdicts(certificates: Sequence[Certificate | Path]) -> tuple[SecondVerdict, ...]:
    """Let the second checker derive certificates again.

    Parameters
    ----------
    certificates : sequence of Certificate or Path
        Certificates, or their files.

    Returns
    -------
    tuple of SecondVerdict
        One for every certificate. "Two independent checkers" may be said only where the status is "valid" and the first
        checker says so too.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> rt.jobs.verify.second_verdicts([Path("none.json")])[0].status in ("not covered", "absent")
    True
    """
    checker = _checker()
    if checker is None:
        return (SecondVerdict("absent", f"the second checker is not installed. {INSTALL}"),) * len(certificates)
    return tuple(_verdict(checker, certificate) for certificate in certificates)


def _verdict(checker: Any, certificate: Certificate | Path) -> SecondVerdict:
    try:
        if isinstance(certificate, Path):
            found = checker.check(certificate)
        else:
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "certificate.json"
                certificate.save(file)  # what is checked is what would be in the file
                found = checker.check(file)
    except (InputError, checker.Unreadable) as error:
        return SecondVerdict("not covered", str(error))
    return SecondVerdict(found.status, found.reason)


def _checker() -> Any:
    """Return the package recheck: installed, or beside the package in its source tree; None where there is none."""
    beside = Path(__file__).resolve().parents[3] / "recheck"
    for folder in ("", str(beside)):
        if folder and not (beside / "recheck" / "__init__.py").is_file():
            continue
        if folder and folder not in sys.path:
            sys.path.append(folder)
        try:
            found = importlib.import_module("recheck")
        except ModuleNotFoundError:
            continue
        if hasattr(found, "check"):
            return found
        del sys.modules["recheck"]  # a folder of that name in the working directory, not the package
    return None
