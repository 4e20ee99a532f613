"""A report built again from its results folder, with every certificate checked anew."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path, PurePosixPath

from ..errors import InputError
from ..report import Claim, Evidence, Report, file_hash, read_content, write_html, write_json, write_junit
from ..verification import Certificate, verify
from ._evidence import checker, judged
from ._now import now

_NO_EVIDENCE = "it names no certificate that could be checked"


def rebuild_report(folder: str | Path, progress: Callable[[int, int], None] = lambda done, total: None) -> Report:
    """Check every certificate of a results folder again, and write its report.html, junit.xml and summary.json anew.

    Text, figures and tables come from ``report.json``. A claim is only as good as its certificate file is now: one
    that is missing, changed or not valid turns it into "not verified". With nothing changed the files are the same
    bytes as before, but for the date.

    Parameters
    ----------
    folder : str or Path
        What `run`, `demo`, `certify`, `design`, `map`, `couple` or `diagnose` wrote.
    progress : callable, optional
        Called with how many certificates are checked, and how many there are.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        No results folder, or one that cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> done = rt.project.certify_system(rt.systems.tclab(), rt.project.Boxes())
    >>> rt.project.write_certify(done, (), "certified").holds
    True
    >>> file = Path("certified/certificates/contraction.json")
    >>> _ = file.write_text(file.read_text().replace('"rate"', '"Rate"'))
    >>> rt.project.rebuild_report("certified").holds
    False
    """
    folder = Path(folder)
    stored = _stored(folder)
    evidence = []
    for i, one in enumerate(stored.evidence):
        progress(i, len(stored.evidence))
        evidence.append(_checked_again(one, folder))
    by_file = {one.file: one for one in evidence}
    claims = tuple(_claimed_again(claim, by_file.get(claim.file)) for claim in stored.claims)
    report = replace(stored, claims=claims, evidence=tuple(evidence), checker=checker(), generated=now())
    _write(report, folder)
    return report


def _stored(folder: Path) -> Report:
    if not (folder / "report.json").is_file():
        raise InputError("holds no report.json", where=str(folder),
                         expected="a folder that run, demo, certify, design, map, couple or diagnose wrote")
    return read_content(folder / "report.json")


def _checked_again(one: Evidence, folder: Path) -> Evidence:
    place = PurePosixPath(one.file)
    if place.parent != PurePosixPath("certificates") or place.name in ("", ".."):
        return _lost(one, "is not in the folder of certificates")
    try:
        certificate = Certificate.load(folder / one.file)
        verdict = verify(certificate) if certificate.holds else None
        found = judged(one.title, one.file, file_hash(folder / one.file), certificate, verdict)
    except InputError as error:
        return _lost(one, str(error).replace(f"{folder}{os.sep}", ""))
    if found.good and found.sha256 != one.sha256:
        return replace(found, valid=False, reason="valid by itself, but not the file of this report: its SHA-256 is "
                       "another one")
    # How long the check took is no result: with the first duration the same results give the same bytes.
    return replace(found, seconds=one.seconds)


def _lost(one: Evidence, reason: str) -> Evidence:
    return replace(one, valid=False, reason=reason, margins={})


def _claimed_again(claim: Claim, evidence: Evidence | None) -> Claim:
    """No better than it was, and no better than its certificate is now."""
    if claim.tested or not claim.good:
        return claim
    if evidence is None:
        return replace(claim, verified=False, margin="none", reason=_NO_EVIDENCE)
    if not evidence.good:
        return replace(claim, verified=False, margin="none", reason=evidence.reason)
    return claim


def _write(report: Report, folder: Path) -> None:
    """All files beside the folder first: an interrupt leaves the old ones."""
    try:
        partial = Path(tempfile.mkdtemp(prefix=".report.", dir=folder))
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", where=str(folder)) from None
    try:
        written = [write_html(report, partial / "report.html"), write_junit(report, partial / "junit.xml"),
                   write_json(report, partial / "summary.json")]
        for file in written:
            os.replace(file, folder / file.name)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
