"""Stage "couple": two controlled subsystems coupled, in the folder coupling."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...report import Report, file_hash
from ..couple import couple_subsystems, coupling_from_tables, coupling_report, save_coupling
from ..evidence import with_evidence
from ..request import Project, read_text
from ._context import Context, StageJob
from ._measured import RESPONSES
from ._parts import below

FOLDER, PREFIX = "coupling", "identify."
_RESPONSES = ("frf_1", "frf_2", "frf")


def _absent(project: Project) -> str:
    return "" if project.couple else "The project file has no table [couple]."


def _after(project: Project) -> tuple[str, ...]:
    return ("identify",) if project.couple and _named(tables_of(project)) else ()


def _depends(project: Project) -> Mapping[str, Any]:
    tables = tables_of(project)
    folder = _place(project).parent
    files = [folder / name for name in _files(tables)]
    return {"tables": tables, "confidence": project.boxes.confidence,
            "files": {path.name: file_hash(path) for path in files if path.is_file()}}


def _run(context: Context, folder: Path) -> Report:
    project = context.project
    tables = tables_of(project)
    responses = {f"{PREFIX}{one.name}": str((context.out / RESPONSES / f"{one.name}.json").resolve())
                 for one in project.identify}
    asked = tables.get("uncertainty", {})
    for key in _RESPONSES:
        if key in asked:
            asked[key] = [_response(name, responses, project) for name in asked[key]]
    result = couple_subsystems(coupling_from_tables(tables, _place(project)), context.progress)
    (folder / FOLDER).mkdir()
    report = with_evidence(result.checked, coupling_report(result), folder / FOLDER)
    save_coupling(result, folder / FOLDER)
    return below(report, FOLDER, "couple")


def tables_of(project: Project) -> dict[str, Any]:
    """Tables of the coupling as in SPEC.toml: of the file that is named, with those of the project file over them.

    Parameters
    ----------
    project : Project
        With a table [couple].
    """
    table = project.couple
    assert table is not None
    found: dict[str, Any] = {}
    if table.spec is not None:
        path = _place(project)
        try:
            found = tomllib.loads(read_text(path, "TOML"))
        except tomllib.TOMLDecodeError as error:
            raise InputError(f"is not valid TOML: {error}", where=str(path),
                             remedy="Correct the line it names.") from None
    head = {"name": table.name, "sample_time": table.sample_time, "export": table.export or None}
    measured = {key: getattr(table, key) for key in (*_RESPONSES, "circles")}
    own = {"coupling": {**table.coupling, **_given(head)}, "subsystems": table.subsystems,
           "uncertainty": {**table.uncertainty, **_given(measured)}, "design": table.design}
    for key, values in own.items():
        if values:
            found[key] = {**found.get(key, {}), **values}
    if "coupling" in found:
        found["coupling"].setdefault("name", project.name)
    if "uncertainty" in found:
        found["uncertainty"].setdefault("confidence", project.boxes.confidence)
    return found


def _given(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}


def _place(project: Project) -> Path:
    """File whose folder the files of the coupling are relative to."""
    assert project.couple is not None
    return project.path.parent / project.couple.spec if project.couple.spec else project.path


def _named(tables: Mapping[str, Any]) -> list[str]:
    asked = tables.get("uncertainty", {})
    return [name for key in _RESPONSES for name in asked.get(key, []) if str(name).startswith(PREFIX)]


def _files(tables: Any) -> list[str]:
    """Names of files anywhere in the tables: responses, and systems { file = ... }."""
    if isinstance(tables, Mapping):
        return [name for key, value in tables.items() for name in (
            [value] if key == "file" and isinstance(value, str) else _files(value))]
    if isinstance(tables, list):
        return [name for value in tables for name in ([value] if isinstance(value, str) else _files(value))]
    return []


def _response(name: Any, responses: Mapping[str, str], project: Project) -> Any:
    if not (isinstance(name, str) and name.startswith(PREFIX)):
        return name
    if name not in responses:
        raise InputError(f"there is no response {name!r}", where=f"{project.path} [couple]",
                         expected="one of " + (", ".join(responses) or "none: the file has no [identify.NAME]"))
    return responses[name]


def _check(project: Project) -> None:
    """Names of responses that [identify] has to make."""
    made = {f"{PREFIX}{one.name}": "" for one in project.identify}
    for key in _RESPONSES:
        for name in tables_of(project).get("uncertainty", {}).get(key) or ():
            _response(name, made, project)


COUPLE = StageJob("couple", _absent, _after, _depends, _run, _check)
