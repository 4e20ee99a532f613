"""Stage "diagnose": what the model lacks; a named effect goes into the certified system where the project adopts it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ..._pandas import pd
from ...diagnosis import Diagnosis, with_named_effects
from ...report import Report, Section, Table
from ..diagnose import Diagnosed, diagnose_records, diagnosis_claims, diagnosis_report, save_diagnosis
from ..request import Project
from ..run import calibrated, diagnosis_facts
from ._calibrate import calibration_part, write_calibration
from ._context import Context, StageJob
from ._measured import Data, data_key, has_training, project_data, used_responses
from ._parts import AUGMENTED, part


def _absent(project: Project) -> str:
    if not project.diagnose:
        return "The project file has no table [diagnose]."
    return "" if has_training(project) else "There are no training data to diagnose."


def _after(project: Project) -> tuple[str, ...]:
    return ("identify",) if used_responses(project) else ()


def _depends(project: Project) -> Mapping[str, Any]:
    return {**data_key(project), "session_gain": project.session_gain, "adopt": project.adopt}


def _run(context: Context, folder: Path) -> Report:
    project, data = context.project, project_data(context)
    result = diagnose_records(project.system, data.files, [*data.train, *data.responses],
                              [*data.validation, *data.held_out], context.progress, session_gain=project.session_gain)
    found = result.diagnosis
    save_diagnosis(found, folder)
    adopted = project.adopt and found.verdict == "named"  # a name beside a remainder is for a person to judge
    facts: dict[str, Any] = {"diagnosis": asdict(diagnosis_facts(found, adopted))}
    tables: dict[str, Any] = {"diagnose": {"verdict": found.verdict, "adopted": adopted,
                                           "effects": [effect.label for effect in found.effects]}}
    sections = [_tests(result), *diagnosis_report(result).sections]
    first: tuple[Section, ...] = ()
    if adopted:
        again = _adopted(context, found, data, folder)
        facts["data"] = again.data["facts"]
        tables |= {key: value for key, value in again.data.items() if key in ("residuals", "calibrate")}
        sections += [replace(one, title=f"{one.title}, with the adopted effects", anchor=f"adopted-{one.anchor}")
                     for one in again.sections]
        first = tuple(again.first)
    return part("diagnose", sections, first=first, data={**tables, "facts": facts})


def _tests(result: Diagnosed) -> Section:
    rows = [{"test": claim.title, "answer": claim.status, "what was found": claim.why or claim.sentence,
             "margin": claim.margin} for claim in diagnosis_claims(result)]
    return Section("Verdict of the diagnosis", f"{result.diagnosis.outcome.text}\n\nTests on data; nothing here is "
                   "proven.", tables=(Table(pd.DataFrame(rows), "What was tested."),), anchor="diagnosis")


def _adopted(context: Context, found: Diagnosis, data: Data, folder: Path) -> Report:
    """The system with the named effects, calibrated again: augmented.toml, augmented.json."""
    context.progress("calibrating again with the effects that were named")
    system = with_named_effects(context.project.system, found.effects)
    done = calibrated(context.project, system, data.train, data.validation, context.progress,
                      responses=data.responses, held_out=data.held_out)
    write_calibration(done, data, folder, "augmented.toml", AUGMENTED)
    return calibration_part("diagnose", done, data, context.project)


DIAGNOSE = StageJob("diagnose", _absent, _after, _depends, _run)
