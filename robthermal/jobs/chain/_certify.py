"""Stage "certify": claims about the calibrated system, nominal and for the ranges of its parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ..._pandas import pd
from ...calibration import Estimates
from ...report import Report, Section, Table
from ...thermal import parameter_label
from ..certify import certification_report, certify_system, claim_ranges
from ..evidence import with_evidence
from ..request import Project
from ..run import claim_reasons, doubted_claims
from ._context import Context, StageJob
from ._measured import has_data
from ._parts import certified_system, facts_of


def certified_after(project: Project) -> tuple[str, ...]:
    """Stages that the certified system comes from.

    Parameters
    ----------
    project : Project
        What is asked for.
    """
    adopted = project.diagnose and project.adopt
    return (*(["calibrate"] if has_data(project) else []), *(["diagnose"] if adopted else []))


def _depends(project: Project) -> Mapping[str, Any]:
    return asdict(project.boxes)


def _run(context: Context, folder: Path) -> Report:
    boxes = context.project.boxes
    system, estimates = certified_system(context)
    ranges = claim_ranges(boxes, estimates)
    found = certify_system(system, boxes, context.progress, parameters=ranges)
    uncertain = doubted_claims(estimates, system, boxes, context.progress)
    report = certification_report(found, ())
    sections = (*_ranges(ranges, estimates, boxes.confidence), *report.sections)
    report = replace(report, gate=tuple(claim_reasons(found, uncertain, facts_of(context))), sections=sections,
                     data={**report.data, "ranges": {name: list(pair) for name, pair in (ranges or {}).items()}})
    return with_evidence(found.checked, report, folder)


def _ranges(ranges: Mapping[str, tuple[float, float]] | None, estimates: Estimates | None, confidence: float
            ) -> Iterator[Section]:
    if not ranges:
        return
    values = {own: value for name, value in (estimates.parameters if estimates else {}).items()
              for own in name.split(" = ")}
    rows = [{"parameter": name, "quantity": parameter_label(name), "estimate": values.get(name, float("nan")),
             "lowest": low, "highest": high} for name, (low, high) in ranges.items()]
    origin = (f"They cover the true values of all parameters at once with a probability of {confidence:g}, if the "
              "structure of the model is right." if estimates else "They are those of the project file.")
    yield Section("Ranges of the parameters", "The claims for the parameter ranges hold for all of them from lowest to "
                  f"highest, in any combination. {origin}",
                  tables=(Table(pd.DataFrame(rows), "Ranges of the robust claims.", digits=6),), anchor="ranges")


CERTIFY = StageJob("certify", lambda project: "", certified_after, _depends, _run)
