"""Certificates into a folder, and what the report says of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path

from ..errors import InputError
from ..report import Evidence, Report, file_hash, versions, write_content, write_html, write_json, write_junit
from ..verification import Certificate, Verdict, machine_hash
from ._assumptions import kind_assumptions
from ._checked import Checked


def write_certification(checked: Sequence[Checked], report: Report, folder: Path) -> Report:
    """Certificates, and the report with what their checks found, into an existing folder.

    Parameters
    ----------
    checked : sequence of Checked
        Certificates.
    report : Report
        What to show, as yet without evidence.
    folder : Path
        Where.

    Returns
    -------
    Report
        As written.
    """
    (folder / "certificates").mkdir()
    evidence = tuple(_saved(one, folder) for one in checked)
    return write_report(replace(report, evidence=evidence, checker=checker()), folder)


def _saved(one: Checked, folder: Path) -> Evidence:
    one.certificate.save(folder / one.file)
    return judged(one.title, one.file, file_hash(folder / one.file), one.certificate, one.verdict)


def judged(title: str, file: str, sha256: str, certificate: Certificate, verdict: Verdict | None) -> Evidence:
    """Evidence of one certificate; `verdict` None where it says itself that its claim does not hold."""
    margins = {} if verdict is None else {k: v for k, v in verdict.margins.items() if isfinite(v)}
    reason = certificate.reason if verdict is None else "" if verdict.valid else verdict.reason
    return Evidence(title, file, sha256, certificate.kind, certificate.claim, certificate.holds,
                    None if verdict is None else verdict.valid, reason, margins,
                    0.0 if verdict is None else verdict.seconds, kind_assumptions(certificate.kind),
                    machine_of(certificate))


def machine_of(certificate: Certificate) -> str:
    """Short hash of the machine a certificate is about; empty where it names none."""
    try:
        return machine_hash(certificate.system)
    except InputError:  # an honest no may come without a system
        return ""


def write_report(report: Report, folder: Path) -> Report:
    """Page, JUnit and summary, and everything from which they can be written again.

    Parameters
    ----------
    report : Report
        What to show.
    folder : Path
        Where.
    """
    write_html(report, folder / "report.html")
    write_junit(report, folder / "junit.xml")
    write_json(report, folder / "summary.json")
    write_content(report, folder / "report.json")
    return report


def checker() -> str:
    """What checks certificates, with versions."""
    found = versions()
    return f"robthermal {found['robthermal']} with python-flint {found['python-flint']}"
