"""Stage "design": a controller for the certified system, in the folder design."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ...report import Report
from ...thermal import System
from ..design import DesignRequest, design_from_text, design_report, design_system, save_design
from ..evidence import with_evidence
from ..request import Boxes, DesignTable, Project, in_kelvin
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
    system, _ = certified_system(context)
    request = _request(system, project.design, project.boxes, f"{project.path} [design]")
    result = design_system(system, request, context.progress)
    (folder / FOLDER).mkdir()
    report = with_evidence(result.certification.checked, design_report(result, ()), folder / FOLDER)
    save_design(result, folder / FOLDER)
    return below(report, FOLDER, "design")


def _request(system: System, table: DesignTable, boxes: Boxes, where: str) -> DesignRequest:
    """The table in kelvin, within the boxes of [certify]."""
    base = design_from_text(system, bandwidth=table.bandwidth or DesignRequest.bandwidth,
                            sample_time=table.sample_time, method=table.method,
                            sensors=None if table.sensors is None else ",".join(table.sensors),
                            regulate=[f"{module}={name}" for module, name in table.regulate.items()])
    points = {name: in_kelvin(value, system.temperature_unit, f"{where} setpoint.{name}")
              for name, value in table.setpoint.items()}
    given = points or boxes.setpoint or dict.fromkeys(system.modules, boxes.temperature[0])
    request = replace(base, setpoint=given, current=dict(table.current), ambient=boxes.ambient,
                      temperature=boxes.temperature)
    request.check(system)
    return request


DESIGN = StageJob("design", _absent, certified_after, _depends, _run)
