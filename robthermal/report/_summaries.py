"""Reports for machines: JUnit XML and a JSON summary, so that a pipeline can gate on the claims."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from xml.etree import ElementTree

from ._appendix import numbered_assumptions
from ._content import Claim, Report
from ._evidence import Evidence
from ._save import printable, save_json, save_text

FORMAT = "robthermal-report/1"


def write_junit(report: Report, path: str | Path) -> Path:
    """Write the claims as JUnit XML, one test case per claim.

    Parameters
    ----------
    report : Report
        A claim that does not hold or is not verified is a failure; so is a report that claims nothing.
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
    >>> import tempfile, robthermal as rt
    >>> claim = rt.report.Claim("Contraction", "Trajectories meet.", True, None, "m1: 0 to 1 A", "0.01 1/s", "energy")
    >>> report = rt.report.Report("Set-up", "", "", (claim,), (), {}, (), "today")
    >>> path = rt.report.write_junit(report, tempfile.mkdtemp() + "/junit.xml")
    >>> 'failures="1"' in path.read_text(encoding="utf-8")
    True
    """
    cases = _cases(report)
    failures = str(sum(case.find("failure") is not None for case in cases))
    total = {"tests": str(len(cases)), "failures": failures, "errors": "0", "skipped": "0",
             "time": f"{sum(claim.seconds for claim in report.claims):.6f}"}
    root = ElementTree.Element("testsuites", {"name": "robthermal", **total})
    suite = ElementTree.SubElement(root, "testsuite", {"name": printable(report.title), **total})
    properties = ElementTree.SubElement(suite, "properties")
    for name, value in {"generated": report.generated, **report.provenance}.items():
        ElementTree.SubElement(properties, "property", {"name": printable(name), "value": printable(value)})
    suite.extend(cases)
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode")
    return save_text(f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n', path)


def write_json(report: Report, path: str | Path) -> Path:
    """Write the claims and the provenance as JSON.

    Parameters
    ----------
    report : Report
        What to summarise.
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
    >>> import json, tempfile, robthermal as rt
    >>> report = rt.report.Report("Set-up", "", "", (), (), {}, (), "today")
    >>> path = rt.report.write_json(report, tempfile.mkdtemp() + "/summary.json")
    >>> json.loads(path.read_text())["holds"]
    False
    """
    summary = {"format": FORMAT, "title": report.title, "label": report.label, "holds": report.holds,
               "reasons": report.reasons, "claims": [_claim(claim) for claim in report.claims],
               "certificates": [_certificate(one) for one in report.evidence], "checker": report.checker,
               "version": report.provenance.get("robthermal", ""),
               "assumptions": numbered_assumptions(report), "provenance": dict(report.provenance),
               "generated": report.generated}
    return save_json(summary, path)


def _certificate(one: Evidence) -> dict[str, object]:
    return {"title": one.title, "file": one.file, "sha256": one.sha256, "kind": one.kind, "claim": one.claim,
            "proven": one.proven, "valid": one.valid, "margins": dict(one.margins), "reason": one.reason,
            "seconds": one.seconds}


def _claim(claim: Claim) -> dict[str, object]:
    verified = None if claim.verified is None else bool(claim.verified)
    return {**asdict(claim), "valid": claim.good, "holds": bool(claim.holds), "verified": verified,
            "seconds": float(claim.seconds), "reason": claim.why}


def _cases(report: Report) -> list[ElementTree.Element]:
    if not report.claims:
        return [_case("something is claimed", 0.0, "nothing is claimed", "not certified", "")]
    seen: Counter[str] = Counter()
    cases = []
    for claim in report.claims:
        seen[claim.title] += 1  # pipelines drop a second case of the same name
        name = claim.title if seen[claim.title] == 1 else f"{claim.title} [{seen[claim.title]}]"
        about = f"{claim.sentence}\nbox: {claim.box}\nmargin: {claim.margin}\nhow: {claim.how}\nfile: {claim.file}"
        cases.append(_case(name, claim.seconds, claim.why, _failure(claim), about))
    return cases


def _failure(claim: Claim) -> str:
    if claim.tested:
        return "not passed"
    return "not verified" if claim.holds else "not certified"


def _case(name: str, seconds: float, why: str, kind: str, about: str) -> ElementTree.Element:
    case = ElementTree.Element("testcase", {"classname": "robthermal.certificates", "name": printable(name),
                                            "time": f"{seconds:.6f}"})
    if why:
        failure = ElementTree.SubElement(case, "failure", {"message": printable(why), "type": kind})
        failure.text = printable(about)
    else:
        ElementTree.SubElement(case, "system-out").text = printable(about)
    return case
