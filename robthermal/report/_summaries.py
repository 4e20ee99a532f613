"""Reports for machines: JUnit XML and a JSON summary, so that a pipeline can gate on the claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from xml.etree import ElementTree

from ._appendix import numbered_assumptions
from ._content import Claim, Report
from ._evidence import Evidence
from ._reasons import Reason
from ._save import printable, save_json, save_text
from ._usable import summary as currents

FORMAT = "robthermal-summary/2"


def write_junit(report: Report, path: str | Path) -> Path:
    """Write claims and gates as JUnit XML: one test case per claim, and one per gate that was looked at.

    Parameters
    ----------
    report : Report
        A claim that does not hold or is not verified is a failure; so is a report that claims nothing. Of a gate,
        failures are failures, and remarks are its output.
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
    suites = _stage_suites(report) if report.stages else [(report.title, _cases(report.claims))] + (
        [(f"{report.title}: gates", _gates(report.gates, report.gate))] if report.gates else [])
    everything = [case for _, cases in suites for case in cases]
    root = ElementTree.Element("testsuites", {"name": "robthermal", **_total(everything)})
    for name, cases in suites:
        suite = ElementTree.SubElement(root, "testsuite", {"name": printable(name), **_total(cases)})
        properties = ElementTree.SubElement(suite, "properties")
        for key, value in {"generated": report.generated, **report.provenance}.items():
            ElementTree.SubElement(properties, "property", {"name": printable(key), "value": printable(value)})
        suite.extend(cases)
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode")
    return save_text(f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n', path)


def write_json(report: Report, path: str | Path) -> Path:
    """Write verdict, reasons, claims, currents and provenance as JSON.

    Parameters
    ----------
    report : Report
        What to summarize.
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
    data = dict(report.data)
    if data.get("certify"):
        data["certify"] = {**data["certify"], "nominal": _answers(report, "nominal"),
                           "robust": _answers(report, "ranges")}
    stages = {one.name: {"status": one.status, "seconds": one.seconds, "hash": one.hash} for one in report.stages}
    summary = {"format": FORMAT, "title": report.title, "label": report.label, "identity": dict(report.identity),
               "verdict": None if report.failed else report.verdict, "holds": report.holds,
               "reasons": [one.to_dict() for one in report.reasons], **({"stages": stages} if stages else {}), **data,
               "currents": currents(report.usable), "claims": [_claim(claim) for claim in report.claims],
               "certificates": [_certificate(one) for one in report.evidence], "checker": report.checker,
               "version": report.provenance.get("robthermal", ""),
               "assumptions": numbered_assumptions(report), "provenance": dict(report.provenance),
               "generated": report.generated}
    return save_json(summary, path)


def _answers(report: Report, parameters: str) -> dict[str, bool]:
    return {claim.title: claim.good for claim in report.claims
            if claim.parameters == parameters and claim.stage == "certify"}


def _certificate(one: Evidence) -> dict[str, object]:
    return {"title": one.title, "file": one.file, "sha256": one.sha256, "kind": one.kind, "claim": one.claim,
            "proven": one.proven, "valid": one.valid, "margins": dict(one.margins), "reason": one.reason,
            "seconds": one.seconds, "machine": one.machine, "second": one.second}


def _claim(claim: Claim) -> dict[str, object]:
    verified = None if claim.verified is None else bool(claim.verified)
    return {**asdict(claim), "name": claim.name, "valid": claim.good, "holds": bool(claim.holds), "verified": verified,
            "seconds": float(claim.seconds), "reason": claim.why}


def _stage_suites(report: Report) -> list[tuple[str, list[ElementTree.Element]]]:
    """One suite per stage: its claims and gates, and of a stage that could not be computed why."""
    suites = []
    for stage in report.stages:
        found = [one for one in report.gate if one.stage == stage.name]
        codes = dict.fromkeys([*(stage.gates if stage.ran else ()), *(one.code for one in found)])
        claims = [claim for claim in report.claims if claim.stage == stage.name]
        cases = (_cases(claims) if claims or stage.name == "certify" and stage.ran else []) + _gates(
            tuple(codes), found)
        if stage.status == "failed":
            cases.insert(0, _case("stage is computed", stage.seconds, stage.text or "failed", "failed", stage.text))
        suites.append((stage.name, cases))
    return suites


def _cases(claims: Sequence[Claim]) -> list[ElementTree.Element]:
    if not claims:
        return [_case("something is claimed", 0.0, "nothing is claimed", "not certified", "")]
    seen: Counter[str] = Counter()
    cases = []
    for claim in claims:
        seen[claim.name] += 1  # pipelines drop a second case of the same name
        name = claim.name if seen[claim.name] == 1 else f"{claim.name} [{seen[claim.name]}]"
        about = f"{claim.sentence}\nbox: {claim.box}\nmargin: {claim.margin}\nhow: {claim.how}\nfile: {claim.file}"
        cases.append(_case(name, claim.seconds, claim.why, _failure(claim), about))
    return cases


def _gates(codes: Sequence[str], reasons: Sequence[Reason]) -> list[ElementTree.Element]:
    cases = []
    for code in codes:
        found = [one for one in reasons if one.code == code]
        failed = [one for one in found if one.level == "fail"]
        said = "\n".join(f"{one.level}: {_words(one)}" for one in found) or "nothing found"
        cases.append(_case(code, 0.0, "; ".join(map(_words, failed)), code, said, "robthermal.gates"))
    return cases


def _words(reason: Reason) -> str:
    return f"{reason.text} {reason.remedy}".strip()


def _total(cases: list[ElementTree.Element]) -> dict[str, str]:
    failures = sum(case.find("failure") is not None for case in cases)
    seconds = sum(float(case.get("time", "0")) for case in cases)
    return {"tests": str(len(cases)), "failures": str(failures), "errors": "0", "skipped": "0",
            "time": f"{seconds:.6f}"}


def _failure(claim: Claim) -> str:
    if claim.tested:
        return "not passed"
    return "not verified" if claim.holds else "not certified"


def _case(name: str, seconds: float, why: str, kind: str, about: str,
          suite: str = "robthermal.certificates") -> ElementTree.Element:
    case = ElementTree.Element("testcase", {"classname": suite, "name": printable(name), "time": f"{seconds:.6f}"})
    if why:
        failure = ElementTree.SubElement(case, "failure", {"message": printable(why), "type": kind})
        failure.text = printable(about)
    else:
        ElementTree.SubElement(case, "system-out").text = printable(about)
    return case
