"""Measured data of a project for calibration and diagnosis: records, and the frequency responses of earlier stages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...identify import FrequencyResponse
from ...report import file_hash
from ...signals import Record
from ..measured import read_measured
from ..request import Project
from ..run import job_records
from ._context import Context, read_files_key

RESPONSES = "responses"  # folder of the estimated frequency responses


@dataclass(frozen=True)
class Data:
    """Measured data, in the order in which calibration and diagnosis take them.

    Parameters
    ----------
    train, validation : sequence of Record
        Fitted, and only compared.
    responses, held_out : sequence of FrequencyResponse
        Fitted, and only compared.
    files : tuple of Path
        System file and every measured file.
    """

    train: Sequence[Record]
    validation: Sequence[Record]
    responses: Sequence[FrequencyResponse]
    held_out: Sequence[FrequencyResponse]
    files: tuple[Path, ...]


def project_data(context: Context) -> Data:
    """Read the data of a project.

    Parameters
    ----------
    context : Context
        With the stage "identify" before, where the project asks for it.
    """
    project = context.project
    train, validation = job_records(project, context.progress)
    fitted, held_out = (_responses(context, use) for use in ("train", "validation"))
    return Data(train, validation, [*fitted, *_read(project.responses, project)], held_out,
                tuple(path for path in project.files if path != project.path))


def _responses(context: Context, use: str) -> list[FrequencyResponse]:
    paths = tuple(context.out / RESPONSES / f"{one.name}.json" for one in context.project.identify if one.use == use)
    return _read(paths, context.project)


def _read(paths: Sequence[Path], project: Project) -> list[FrequencyResponse]:
    return [one for one in read_measured(paths, project.system) if isinstance(one, FrequencyResponse)]


def has_data(project: Project) -> bool:
    """Whether anything was measured that calibration and diagnosis take.

    Parameters
    ----------
    project : Project
        What is asked for.
    """
    return bool(project.train or project.validation or project.responses or used_responses(project))


def has_training(project: Project) -> bool:
    """Whether anything is to be fitted.

    Parameters
    ----------
    project : Project
        What is asked for.
    """
    return bool(project.train or project.responses or any(one.use == "train" for one in project.identify))


def used_responses(project: Project) -> tuple[str, ...]:
    """Names of the identified responses that calibration and diagnosis take.

    Parameters
    ----------
    project : Project
        What is asked for.
    """
    return tuple(one.name for one in project.identify if one.use != "none")


def data_key(project: Project) -> dict[str, Any]:
    """What the data contribute to the key of a stage.

    Parameters
    ----------
    project : Project
        What is asked for.
    """
    return {"train": read_files_key(project, project.train),
            "validation": read_files_key(project, project.validation),
            "responses": [[path.name, file_hash(path)] for path in project.responses],
            "use": {one.name: one.use for one in project.identify}, "median_filter": project.median_filter,
            "fit": project.system.model_dump(mode="json")["fit"], "initial": project.initial, "loss": project.loss,
            "max_iterations": project.max_iterations}
