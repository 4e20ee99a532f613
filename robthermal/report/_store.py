"""A report as JSON beside its page, so that the page can be built again: text, drawings and tables as they stand."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from ..errors import InputError
from ._content import Claim, Report, Section
from ._evidence import Evidence
from ._figure import Figure
from ._reasons import Reason
from ._save import printable, save_json
from ._stages import Stage
from ._table import Printed, printed
from ._usable import UsableRange

STORE = "robthermal-report-content/2"
_LARGEST = 50_000_000  # bytes
_REMEDY = "Is this the report.json of a results folder? Run the job again."


class _Strict(BaseModel):
    # Strict: "yes" and 1 are not true here, a badge depends on it.
    model_config = ConfigDict(extra="forbid", strict=True)


class _Section(_Strict):
    title: str
    text: str
    figures: list[Figure]
    tables: list[Printed]
    anchor: str
    chapter: str = ""


class _Stored(_Strict):
    format: Literal["robthermal-report-content/2"]
    title: str
    subtitle: str
    label: str
    claims: list[Claim]
    sections: list[_Section]
    provenance: dict[str, str]
    assumptions: list[str]
    generated: str
    answer: str
    evidence: list[Evidence]
    checker: str
    gate: list[Reason]
    gates: list[str]
    usable: list[UsableRange]
    first: list[_Section]
    data: dict[str, Any]
    stages: list[Stage] = []
    headline: str = ""
    numbers: list[tuple[str, str, str]] = []
    identity: dict[str, str] = {}
    kind: str = ""
    digest: str


def write_content(report: Report, path: str | Path) -> Path:
    """Write everything a report says as JSON, for `read_content`.

    Parameters
    ----------
    report : Report
        What to keep. Of a table it keeps what is printed.
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
    >>> report = rt.report.Report("Set-up", "", "", (), (), {}, ("One temperature per lump.",), "today")
    >>> path = rt.report.write_content(report, tempfile.mkdtemp() + "/report.json")
    >>> rt.report.read_content(path).assumptions
    ['One temperature per lump.']
    """
    content = {"format": STORE, "title": report.title, "subtitle": report.subtitle, "label": report.label,
               "claims": [_claim(claim) for claim in report.claims], "sections": _stored(report.sections),
               "provenance": dict(report.provenance), "assumptions": list(report.assumptions),
               "generated": report.generated, "answer": report.answer,
               "evidence": [asdict(one) for one in report.evidence], "checker": report.checker,
               "gate": [asdict(one) for one in report.gate], "gates": list(report.gates),
               "usable": [asdict(one) for one in report.usable], "first": _stored(report.first),
               "data": dict(report.data), "stages": [asdict(one) for one in report.stages],
               "headline": report.headline, "numbers": [list(one) for one in report.numbers],
               "identity": dict(report.identity), "kind": report.kind}
    return save_json({**content, "digest": _digest(content)}, path)


def is_unchanged(path: str | Path) -> bool:
    """Whether a stored report still is what `write_content` wrote: a digest of its contents stands in it.

    It shows a file that was edited; it is no signature, and who knows the digest can compute it again.

    Parameters
    ----------
    path : str or Path
        Stored report that `read_content` accepts.

    Returns
    -------
    bool

    Examples
    --------
    >>> import pathlib, tempfile, robthermal as rt
    >>> report = rt.report.Report("Set-up", "", "", (), (), {}, (), "today")
    >>> path = rt.report.write_content(report, tempfile.mkdtemp() + "/report.json")
    >>> rt.report.is_unchanged(path)
    True
    >>> _ = path.write_text(path.read_text().replace("Set-up", "Other"))
    >>> rt.report.is_unchanged(path)
    False
    """
    content = json.loads(Path(path).read_text(encoding="utf-8"))
    return content.pop("digest") == _digest(content)


def _digest(content: dict[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True, allow_nan=False, ensure_ascii=False)
    return sha256(printable(text).encode("utf-8")).hexdigest()


def _stored(sections: Sequence[Section]) -> list[dict[str, Any]]:
    return [{"title": one.title, "text": one.text, "figures": [asdict(figure) for figure in one.figures],
             "tables": [asdict(printed(table)) for table in one.tables], "anchor": one.anchor, "chapter": one.chapter}
            for one in sections]


def read_content(path: str | Path) -> Report:
    """Read a report that `write_content` wrote. Nothing it says is checked: that is the caller's work.

    Parameters
    ----------
    path : str or Path
        File to read.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        The file cannot be read, or is no such report; drawings with scripts or outside resources are refused.

    Examples
    --------
    >>> import pathlib, tempfile, robthermal as rt
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "report.json"
    >>> _ = path.write_text("{}")
    >>> rt.report.read_content(path)
    Traceback (most recent call last):
    ...
    robthermal.errors.InputError: ...report.json: is not a stored report: format, Field required. ...
    """
    file = Path(path)
    try:
        if file.stat().st_size > _LARGEST:
            raise InputError(f"is larger than {_LARGEST / 1e6:g} MB", where=str(file), remedy=_REMEDY)
        stored = _Stored.model_validate_json(file.read_bytes())
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=str(file), remedy=_REMEDY) from None
    except ValidationError as error:
        fault: Any = error.errors(include_url=False)[0]
        place = ".".join(map(str, fault["loc"])) or "the file"
        raise InputError(f"is not a stored report: {place}, {fault['msg']}", where=str(file), remedy=_REMEDY) from None
    sections, first = (tuple(Section(one.title, one.text, one.figures, one.tables, one.anchor, one.chapter)
                             for one in part) for part in (stored.sections, stored.first))
    return Report(stored.title, stored.subtitle, stored.label, stored.claims, sections, stored.provenance,
                  stored.assumptions, stored.generated, stored.answer, stored.evidence, stored.checker, stored.gate,
                  stored.gates, stored.usable, first, stored.data, stored.stages, stored.headline, stored.numbers,
                  stored.identity, stored.kind)


def _claim(claim: Claim) -> dict[str, object]:
    verified = None if claim.verified is None else bool(claim.verified)
    return {**asdict(claim), "holds": bool(claim.holds), "verified": verified, "seconds": float(claim.seconds)}
