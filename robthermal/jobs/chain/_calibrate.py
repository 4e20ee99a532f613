"""Stage "calibrate": parameters with their covariance, from records and frequency responses together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ...report import Report
from ...thermal import write_system
from ..request import Project, write_calibrated
from ..run import (
    Calibrated,
    calibrated,
    comparison_section,
    data_facts,
    first_section,
    import_table,
    parameter_section,
    parameter_table,
    residual_table,
    response_sections,
)
from ._context import Context, StageJob
from ._measured import Data, data_key, has_data, has_training, project_data, used_responses
from ._parts import CALIBRATED, part


def _absent(project: Project) -> str:
    return "" if has_data(project) else "No data are given: the system is taken as it is."


def _after(project: Project) -> tuple[str, ...]:
    return ("identify",) if used_responses(project) else ()


def _depends(project: Project) -> Mapping[str, Any]:
    return data_key(project)


def _run(context: Context, folder: Path) -> Report:
    project, data = context.project, project_data(context)
    done = calibrated(project, project.system, data.train, data.validation, context.progress,
                      responses=data.responses, held_out=data.held_out)
    write_calibration(done, data, folder, "calibrated.toml", CALIBRATED)
    if done.fit is not None:
        done.fit.table().to_csv(folder / "parameters.csv", index_label="parameter")
    return calibration_part("calibrate", done, data, project)


def write_calibration(done: Calibrated, data: Data, folder: Path, system: str, estimates: str) -> None:
    """Write the calibrated system, and its estimates if there are any.

    Parameters
    ----------
    done : Calibrated
        Model beside the data.
    data : Data
        Data it was calibrated on, for their hashes.
    folder : Path
        Folder to write into.
    system, estimates : str
        Names of the two files.
    """
    write_system(done.system, folder / system)
    if done.fit is not None:
        write_calibrated(done.fit, data.files, folder / estimates)


def calibration_part(stage: str, done: Calibrated, data: Data, project: Project) -> Report:
    """What a calibration says.

    Parameters
    ----------
    stage : str
        Stage that has calibrated.
    done : Calibrated
        Model beside the data.
    data : Data
        Data it was calibrated on.
    project : Project
        What is asked for.
    """
    kinds = [*(["train"] if has_training(project) else []), *(["validation"] if data.held_out else [])]
    # Tolerances are the gate's: whoever changes them need not calibrate again.
    misfits = [replace(one, tolerance=0.0) for one in done.misfits]
    facts = data_facts(done.system, done.comparisons, misfits, kinds, done.fit)
    tables: dict[str, Any] = {"facts": asdict(facts), "residuals": residual_table(done.misfits),
                              "imports": import_table([*data.train, *data.validation])}
    order = done.system.sensor_names
    above = stage == "diagnose" or not project.diagnose  # else the first screen may be of the diagnosed model
    sections = [comparison_section(done.comparisons, done.fit, order, done.misfits if above else ())
                ] if done.comparisons else []
    if done.fit is not None:
        sections += [*response_sections(done.fit), parameter_section(done.fit, None)]
        tables["calibrate"] = {"parameters": parameter_table(done.fit, None), "outcome": done.fit.outcome.code}
    first = [first_section(done.comparisons, done.misfits, order)] if done.misfits else []
    return part(stage, sections, first=first, data=tables)


CALIBRATE = StageJob("calibrate", _absent, _after, _depends, _run)
