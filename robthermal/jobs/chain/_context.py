"""What a stage of the chain is, and what it is given."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

from ...report import Report, file_hash
from ..request import Project

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Finished:
    """Result of one stage, computed now or in an earlier run.

    Parameters
    ----------
    report : Report
        Its part of the report: claims, sections, reasons, evidence, data.
    files : dict
        SHA-256 of every file it wrote, by place in the results folder.
    key : str
        Hash of everything it depends on.
    seconds : float
        Time it took when it was computed [s].
    cached : bool
        Whether it is of an earlier run.
    """

    report: Report
    files: Mapping[str, str]
    key: str
    seconds: float
    cached: bool = False

    @property
    def digest(self) -> str:
        """Hash of its results, as later stages take them: files and facts, without times."""
        return digest({"files": dict(self.files), "facts": self.report.data.get("facts", {})})


@dataclass
class Context:
    """What a stage is given: the project, the results folder, and the stages before it.

    Parameters
    ----------
    project : Project
        What is asked for.
    out : Path
        Results folder, with the files of the stages before.
    progress : callable
        Called with a sentence before every step.
    finished : dict
        Results of the stages before, by name.
    """

    project: Project
    out: Path
    progress: Progress
    finished: dict[str, Finished] = field(default_factory=dict)

    def data(self, stage: str) -> Mapping[str, Any]:
        """Tables of a stage; empty where it did not run."""
        return self.finished[stage].report.data if stage in self.finished else {}


@dataclass(frozen=True)
class StageJob:
    """One stage of the chain.

    Parameters
    ----------
    name : str
        Name of the stage, on the command line and in the summary.
    absent : callable
        Why a project does not ask for it; empty if it does.
    after : callable
        Names of the earlier stages whose results it takes.
    depends : callable
        What it takes from the project: plain values and hashes of input files.
    run : callable
        Computes it, writes its files into a folder that is laid out as the results folder, and says what to report.
    check : callable, optional
        Refuses what can be seen to be wrong before any stage is computed.
    """

    name: str
    absent: Callable[[Project], str]
    after: Callable[[Project], tuple[str, ...]]
    depends: Callable[[Project], Mapping[str, Any]]
    run: Callable[[Context, Path], Report]
    check: Callable[[Project], None] = lambda project: None

    def key(self, context: Context, version: str) -> str:
        """Hash of everything the stage depends on.

        Parameters
        ----------
        context : Context
            With the results of the stages before.
        version : str
            Version of the package.
        """
        project = context.project
        earlier = {name: context.finished[name].digest for name in self.after(project) if name in context.finished}
        return digest({"stage": self.name, "version": version, "system": file_hash(project.system_file),
                       "own": self.depends(project), "earlier": earlier})


def digest(value: object) -> str:
    """SHA-256 of plain values, whatever their order in a mapping."""
    text = json.dumps(value, sort_keys=True, default=str, ensure_ascii=False)
    return sha256(text.encode("utf-8", "replace")).hexdigest()


def read_files_key(project: Project, paths: tuple[Path, ...]) -> list[Any]:
    """What measured files contribute to a key: name, bytes, and how they are read."""
    return [[path.name, file_hash(path), project.reading.get(path, ())] for path in paths]
