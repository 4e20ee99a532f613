"""A report built again from its results folder, with every certificate checked anew."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from .._write import whole_file
from ..errors import InputError
from ..report import (
    Claim,
    Evidence,
    Reason,
    Report,
    UsableRange,
    file_hash,
    is_unchanged,
    read_content,
    versions,
    write_html,
    write_json,
    write_junit,
)
from ..verification import Certificate, Verdict, same_system, verify
from .certify import CODES, box_stays_inside, current_reasons, rest_on_certificates, within_usable
from .claims import ARITHMETIC, GateCode, claim_of, kind_assumptions
from .evidence import checker, judged, twice_checked
from .folder import check_results
from .now import now

_FOLDERS = ("certificates", "design/certificates", "coupling/certificates")
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
    >>> done = rt.jobs.certify_system(rt.systems.tclab(), rt.jobs.Boxes())
    >>> rt.jobs.write_certify(done, (), "certified").holds
    True
    >>> file = Path("certified/certificates/contraction.json")
    >>> _ = file.write_text(file.read_text().replace('"rate"', '"Rate"'))
    >>> rt.jobs.rebuild_report("certified").holds
    False
    """
    folder = Path(folder)
    check_results(folder)
    stored = read_content(folder / "report.json")
    report = replace(checked_again(stored, folder, progress), checker=checker(), generated=now())
    if not is_unchanged(folder / "report.json"):
        report = _distrusted(report, folder)
    _write(report, folder)
    return report


def checked_again(stored: Report, folder: Path, progress: Callable[[int, int], None] = lambda done, total: None
                  ) -> Report:
    """A report with what its certificates say now: claims, evidence, usable currents and the reasons that rest on them.

    Parameters
    ----------
    stored : Report
        Report, or part of one, of an earlier run.
    folder : Path
        Results folder with the certificates.
    progress : callable, optional
        Called with how many certificates are checked, and how many there are.
    """
    found = []
    for i, one in enumerate(stored.evidence):
        progress(i, len(stored.evidence))
        found.append(_checked_again(one, folder))
    found = _checked_twice(_of_one_machine(found), {claim.file for claim in stored.claims})
    good = {one.evidence.file: one.certificate for one in found if one.evidence.good and one.certificate is not None}
    usable = tuple(rest_on_certificates(stored.usable, good))
    boxes = [claim.file for claim in stored.claims if claim.kind == "invariance" and claim.stage == "certify"]
    inside = box_stays_inside(good, boxes, (stored.data.get("certify") or {}).get("temperature_lower") == "held")
    by_file = {one.evidence.file: one for one in found}
    current = _current(by_file.get("certificates/box.json"))
    runaway_free = bool(good) and within_usable(current, usable, inside)
    claims = tuple(_claimed_again(claim, by_file.get(claim.file), runaway_free and claim.stage == "certify")
                   for claim in stored.claims)
    return replace(stored, claims=claims, evidence=tuple(one.evidence for one in found), usable=usable,
                   gate=_gate_again(stored, current, usable, inside))


@dataclass(frozen=True)
class _Found:
    """A certificate file as it is now: its evidence, the certificate if it can be read, and what the check said."""

    evidence: Evidence
    certificate: Certificate | None = None
    verdict: Verdict | None = None


def _checked_again(one: Evidence, folder: Path) -> _Found:
    place = PurePosixPath(one.file)
    if str(place.parent) not in _FOLDERS or place.name in ("", ".."):
        return _Found(_lost(one, "is not in the folder of certificates"))
    try:
        certificate = Certificate.load(folder / one.file)
        verdict = verify(certificate) if certificate.holds else None
        found = judged(one.title, one.file, file_hash(folder / one.file), certificate, verdict)
    except InputError as error:
        return _Found(_lost(one, str(error).replace(f"{folder}{os.sep}", "")))
    if found.good and found.sha256 != one.sha256:
        return _Found(replace(found, valid=False, reason="valid by itself, but not the file of this report: its "
                              "SHA-256 is another one"), certificate)
    # How long the check took is no result: with the first duration the same results give the same bytes.
    resting = tuple(dict.fromkeys([*one.assumptions, *found.assumptions]))
    return _Found(replace(found, seconds=one.seconds, assumptions=resting), certificate, verdict)


def _of_one_machine(found: list[_Found]) -> list[_Found]:
    """A certificate of another machine than that of the first claim, however valid, is no evidence here."""
    first = next((one.certificate for one in found if one.certificate is not None and one.evidence.good
                  and "lumps" in one.certificate.system), None)
    if first is None:
        return found
    system = {key: value for key, value in first.system.items() if key in _NETWORK}
    return [one if one.certificate is None or "lumps" not in one.certificate.system
            or same_system(one.certificate, system) else
            replace(one, evidence=replace(one.evidence, valid=False, margins={}, reason="valid by itself, but about "
                                          f"another machine ({one.evidence.machine}) than the first claim"))
            for one in found]


def _checked_twice(found: list[_Found], files: set[str]) -> list[_Found]:
    """What the second checker says of the certificates of the claims, where it is installed."""
    asked = {one.evidence.file: one.certificate for one in found
             if one.certificate is not None and one.evidence.good and one.evidence.file in files}
    evidence = twice_checked([one.evidence for one in found], asked)
    return [replace(one, evidence=checked) for one, checked in zip(found, evidence, strict=True)]


_NETWORK = ("name", "lumps", "ambients", "links", "modules", "inputs")


def _lost(one: Evidence, reason: str) -> Evidence:
    return replace(one, claim="", proven=False, valid=False, reason=reason, margins={})


def _claimed_again(claim: Claim, found: _Found | None, usable: bool) -> Claim:
    """What its certificate says now, and no better than it was. A test on data has no certificate: it stays."""
    if claim.tested:
        return claim
    if found is None or found.certificate is None:
        why = claim.reason or "no proof was found" if not claim.holds else (
            found.evidence.reason if found else _NO_EVIDENCE)
        return replace(claim, sentence="", box="", verified=False, margin="none", reason=why)
    verdict = found.verdict if found.evidence.good and claim.good else None
    again = claim_of(claim.file, found.certificate, verdict, title=claim.title, seconds=claim.seconds,
                     usable=usable)
    again = replace(again, stage=claim.stage, parameters=claim.parameters)
    if claim.good and not found.evidence.good:
        return replace(again, verified=False, margin="none", reason=found.evidence.reason)
    return again if claim.good else replace(again, holds=claim.holds and again.holds, verified=False, margin="none",
                                            reason=claim.reason)


def _gate_again(stored: Report, current: Mapping[str, tuple[float, float]], usable: Sequence[UsableRange],
                inside: bool) -> tuple[Reason, ...]:
    """Stored reasons, with the failures about the claimed currents found again from the certificates."""
    if not stored.usable or not current:
        return tuple(stored.gate)
    codes = {code.code for code in CODES.values()}
    kept = [one for one in stored.gate if not (one.code in codes and one.about in current and
                                               one.text.startswith(f"{one.about} is to have"))]
    return (*kept, *current_reasons(current, {}, usable, inside))


def _current(box: _Found | None) -> dict[str, tuple[float, float]]:
    """Currents that the claims of a job are about, by module [A]."""
    pairs = box.certificate.region.get("current") if box is not None and box.certificate is not None else None
    if not isinstance(pairs, Mapping):
        return {}
    return {name: (float(low), float(high)) for name, (low, high) in pairs.items()}


def _distrusted(report: Report, folder: Path) -> Report:
    """What is left of a report whose report.json was edited: only what the certificates say."""
    reason = Reason("fail", GateCode.REPORT_CHANGED.code, "report", "report.json", "report.json was changed after it "
                    "was written: its text, drawings, tables and reasons are left out, and only what the certificates "
                    "say is shown.", GateCode.REPORT_CHANGED.remedy)
    claims = tuple(replace(claim, sentence="", box="", margin="", holds=False, reason="report.json was changed")
                   if claim.tested else claim for claim in report.claims)
    return replace(report, title=f"Results in {folder.resolve().name}", subtitle="", label="", claims=claims,
                   evidence=tuple(replace(one, assumptions=kind_assumptions(one.kind)) for one in report.evidence),
                   sections=(), first=(), usable=(), gate=(reason,), gates=(reason.code,), answer="", data={},
                   assumptions=(ARITHMETIC,), provenance=versions(), stages=(), headline="", numbers=(), identity={},
                   kind="")


def _write(report: Report, folder: Path) -> None:
    """All files beside the old ones first: an interrupt leaves those."""
    with ExitStack() as written:
        page, junit, summary = (written.enter_context(whole_file(folder / name))
                                for name in ("report.html", "junit.xml", "summary.json"))
        write_html(report, page)
        write_junit(report, junit)
        write_json(report, summary)
