"""Certificates into a folder, and what the report says of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path

from ..errors import InputError
from ..report import Claim, Evidence, Report, file_hash, versions
from ..verification import Certificate, Verdict, machine_hash
from .claims import Checked, kind_assumptions
from .report_files import write_report
from .verify import SecondVerdict, second_verdicts


def write_certification(checked: Sequence[Checked], report: Report, folder: Path) -> Report:
    """Certificates, and the report with what their checks found, into an existing folder.

    Parameters
    ----------
    checked : sequence of Checked
        Certificates with their independent checks.
    report : Report
        What to show, as yet without evidence.
    folder : Path
        Existing folder to write into.

    Returns
    -------
    Report
        As written.
    """
    return write_report(with_evidence(checked, report, folder), folder)


def with_evidence(checked: Sequence[Checked], report: Report, folder: Path) -> Report:
    """Certificates into an existing folder, and the report with what their checks found, as yet not written.

    Parameters
    ----------
    checked : sequence of Checked
        Certificates with their independent checks.
    report : Report
        What to show, as yet without evidence.
    folder : Path
        Existing folder without certificates.
    """
    (folder / "certificates").mkdir()
    evidence = twice_checked([_saved(one, folder) for one in checked],
                             {one.file: one.certificate for one in checked if one.required and one.good})
    by_file = {one.file: one for one in evidence}
    claims = tuple(no_better(claim, by_file[claim.file]) if claim.file in by_file else claim
                   for claim in report.claims)
    return replace(report, claims=claims, evidence=evidence, checker=checker())


def twice_checked(evidence: Sequence[Evidence], certificates: Mapping[str, Certificate]) -> tuple[Evidence, ...]:
    """Evidence with what the second checker says of these certificates, where it is installed.

    Parameters
    ----------
    evidence : sequence of Evidence
        What the first check said.
    certificates : mapping
        Certificates the second checker is asked about, by file.
    """
    said = dict(zip(certificates, second_verdicts(list(certificates.values())), strict=True))
    return tuple(_with_second(one, said.get(one.file)) for one in evidence)


def _with_second(one: Evidence, said: SecondVerdict | None) -> Evidence:
    if said is None or said.status == "absent":
        return one
    if said.status == "not valid":
        return replace(one, second=said.status, reason=f"the second checker says that it is not valid: {said.reason}")
    return replace(one, second=said.status)


def no_better(claim: Claim, evidence: Evidence) -> Claim:
    """A claim that is not better than its evidence.

    Parameters
    ----------
    claim : Claim
        Claim as the job states it.
    evidence : Evidence
        Of its certificate.
    """
    if not claim.good or evidence.good:
        return claim
    return replace(claim, verified=False, margin="none", reason=evidence.reason)


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
    except InputError:  # a claim that is not proven may come without a system
        return ""


def checker() -> str:
    """What checks certificates, with versions."""
    found = versions()
    return f"robthermal {found['robthermal']} with python-flint {found['python-flint']}"
