"""Commands about finished results: build a report again, check certificates again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import robthermal as rt

from .terminal import Json, answer, place, progress_bar, say, show_report

_WORDS = {True: "valid     ", False: "NOT VALID ", None: "unreadable"}


def report(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results folder of any command.")],
           as_json: Json = False) -> None:
    """Build report.html, junit.xml and summary.json of a results folder again; every certificate is checked anew.

    Example: robthermal report results
    """
    rt.jobs.folder.check_results(folder)  # before the checker is loaded
    with progress_bar("certificates") as done:
        rebuilt = rt.jobs.rebuild_report(folder, done)
    show_report(rebuilt, folder, as_json)


def verify(certificates: Annotated[list[Path], typer.Argument(
        help="Certificates, or folders of results with all of theirs.", metavar="CERT.json|DIR")],
           junit: Annotated[Path | None, typer.Option("--junit", help="JUnit file to write, for a pipeline.",
                                                      callback=place)] = None,
           second: Annotated[bool, typer.Option("--second", help="Let the second checker derive them too.")] = False,
           as_json: Json = False) -> None:
    """Re-derive certificates from their files alone, in ball arithmetic. Exit 0 valid, 1 not valid, 2 unreadable.

    Example: robthermal verify certified --junit junit.xml
    """
    files = rt.jobs.verify.certificate_files(certificates)
    with progress_bar("certificates") as done:
        checks = rt.jobs.verify_files(files, done, second=second)
    if junit is not None:
        rt.jobs.verify.write_checks(checks, junit)
    rows: list[dict[str, Any]] = [{"file": str(one.file), "valid": one.valid, "reason": one.reason, "claim": one.claim,
                                   "kind": one.kind, "margins": one.margins, "seconds": one.seconds} for one in checks]
    for row, one in zip(rows, checks, strict=True):
        if one.second is not None:
            row["second"] = {"status": one.second.status, "reason": one.second.reason}
    answer(rows, as_json, lambda: say(*(line for one in checks for line in _lines(one))))
    raise typer.Exit(max(one.status for one in checks))


def _lines(one: rt.jobs.verify.FileCheck) -> list[str]:
    """File and finding; of a valid certificate also what is now proven."""
    lines = [f"{_WORDS[one.valid]}  {one.file}: {one.reason}"]
    if one.valid:
        lines.append(f"            {one.claim}")
    if one.second is not None:
        lines.append(f"            second checker: {one.second.status}: {one.second.reason}")
    return lines
