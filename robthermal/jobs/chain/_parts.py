"""What stages say: parts of the report, and how they read what the stages before have said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from ...calibration import Estimates
from ...report import Evidence, Reason, Report, Section
from ...thermal import System, read_system
from ..now import now
from ..request import Project, read_calibrated
from ..run import DataFacts, DiagnosisFacts
from ._context import Context

_DATA, _DIAGNOSIS = TypeAdapter(DataFacts), TypeAdapter(DiagnosisFacts)
CALIBRATED, AUGMENTED = "calibrated.json", "augmented.json"  # estimates of the two stages that calibrate


def part(stage: str, sections: Sequence[Section] = (), *, first: Sequence[Section] = (),
         gate: Sequence[Reason] = (), data: Mapping[str, Any] | None = None) -> Report:
    """A part of the report without claims.

    Parameters
    ----------
    stage : str
        Name of the stage.
    sections, first : sequence of Section
        What it shows, below and on the first screen.
    gate : sequence of Reason, optional
        Reasons of the verdict that the stage finds by itself.
    data : mapping, optional
        Tables for the summary, and facts for later stages.
    """
    return Report(title=stage, subtitle="", label="", claims=(), sections=tuple(sections), provenance={},
                  assumptions=(), generated=now(), gate=tuple(gate), first=tuple(first), data=dict(data or {}))


def below(report: Report, folder: str, stage: str) -> Report:
    """A part whose certificates lie in a folder of its own.

    Parameters
    ----------
    report : Report
        Part with evidence.
    folder : str
        Folder within the results folder.
    stage : str
        Name of the stage.
    """
    def moved(file: str) -> str:
        return f"{folder}/{file}" if file else ""

    paired = any(claim.parameters == "ranges" for claim in report.claims)
    evidence: list[Evidence] = [replace(one, file=moved(one.file)) for one in report.evidence]
    claims = [replace(claim, file=moved(claim.file), stage=stage, parameters=claim.parameters if paired else "")
              for claim in report.claims]
    return replace(report, claims=tuple(claims), evidence=tuple(evidence), sections=(*report.first, *report.sections),
                   first=(), numbers=())  # the first screen of a chain is about the machine


def facts_of(context: Context) -> DataFacts:
    """Facts about the data beside the model that is certified.

    Parameters
    ----------
    context : Context
        With the stages that have run.
    """
    adopted = context.data("diagnose").get("facts", {}).get("data")
    return _DATA.validate_python(adopted or context.data("calibrate").get("facts", {}))


def diagnosis_of(context: Context) -> DiagnosisFacts | None:
    """Facts about the diagnosis; None where there was none.

    Parameters
    ----------
    context : Context
        With the stages that have run.
    """
    found = context.data("diagnose").get("facts", {}).get("diagnosis")
    return _DIAGNOSIS.validate_python(found) if found else None


def certified_system(context: Context) -> tuple[System, Estimates | None]:
    """The system that is certified, and the estimates it comes from; None if nothing was calibrated.

    Parameters
    ----------
    context : Context
        With the stages that have run.
    """
    diagnosed = diagnosis_of(context)
    if diagnosed is not None and diagnosed.adopted:
        system = read_system(context.out / "augmented.toml")
        place = context.out / AUGMENTED
        return system, read_calibrated(place, system) if place.is_file() else None
    return _calibrated(context.project, context.out / CALIBRATED,
                       CALIBRATED in context.finished["calibrate"].files if "calibrate" in context.finished else False)


def _calibrated(project: Project, path: Path, there: bool) -> tuple[System, Estimates | None]:
    """From the estimates, not from calibrated.toml: a conversion to degrees Celsius would cost a last digit."""
    if not there:
        return project.system, None
    found = read_calibrated(path, project.system)
    values = {own: value for name, value in found.parameters.items() for own in name.split(" = ")}
    return project.system.with_parameters(values), found
