"""Stage "design": a controller for the certified system, in the folder design."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...design import cold_side, feedback_linearization
from ...errors import InputError
from ...report import Report
from ..certify import claim_ranges
from ..design import design_from_table, design_report, design_system, save_design
from ..evidence import with_evidence
from ..request import Project
from ._certify import certified_after
from ._context import Context, StageJob
from ._parts import below, certified_system

FOLDER = "design"


def _absent(project: Project) -> str:
    return "" if project.design else "The project file has no table [design]."


def _depends(project: Project) -> Mapping[str, Any]:
    table = project.design.model_dump(mode="json") if project.design else {}
    return {"table": table, "boxes": asdict(project.boxes)}


def _run(context: Context, folder: Path) -> Report:
    project = context.project
    assert project.design is not None
    system, estimates = certified_system(context)
    table = project.design.model_dump(exclude_unset=True)
    try:
        request = design_from_table(system, table, project.boxes, claim_ranges(project.boxes, estimates))
        result = design_system(system, request, context.progress)
    except InputError as error:
        raise _of_table(error, project) from None
    (folder / FOLDER).mkdir()
    report = with_evidence(result.certification.checked, design_report(result, ()), folder / FOLDER)
    save_design(result, folder / FOLDER)
    return below(report, FOLDER, "design")


def _check(project: Project) -> None:
    """What does not depend on numbers: modules, set-points, points to regulate, their influence on each other."""
    assert project.design is not None
    try:
        request = design_from_table(project.system, project.design.model_dump(exclude_unset=True), project.boxes)
        cold_side(feedback_linearization(project.system), regulate=request.regulate)
    except InputError as error:
        raise _of_table(error, project) from None


def _of_table(error: InputError, project: Project) -> InputError:
    """A refusal that names an option of the command, or an argument, names the key of the table instead."""
    option, _, value = error.where.partition(" ")
    if str(project.path) in error.where:
        return error
    if option in ("design", "argument"):
        key = ""
    elif option == "[design]":
        key = value
    else:
        key = f"{option.removeprefix('--').replace('-', '_')} {value}"
    return InputError(error.what, where=f"{project.path} [design] {key}".strip(), expected=error.expected,
                      remedy=error.remedy)


DESIGN = StageJob("design", _absent, certified_after, _depends, _run, _check)
