"""What the report says of its inputs: every file with its hash, and how every measured file was read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..._pandas import pd
from ...report import Section, Table, file_hash
from ..request import Project


def input_section(project: Project, imports: Sequence[Mapping[str, Any]]) -> Section:
    """Files with their hashes, and import reports.

    Parameters
    ----------
    project : Project
        What is asked for.
    imports : sequence of mapping
        Import reports, as in the summary.
    """
    uses: dict[str, list[str]] = {}
    named = [(project.path, "project"), (project.system_file, "system"),
             *((path, "training") for path in project.train),
             *((path, "validation") for path in project.validation),
             *((path, f"identify {one.name}") for one in project.identify for path in one.records),
             *((path, "response") for path in project.responses)]
    for path, use in named:
        uses.setdefault(str(path), []).append(use)
    hashes = {str(path): file_hash(path) for path in project.files}
    files = pd.DataFrame([{"file": path.name, "used for": ", ".join(uses.get(str(path), ())),
                           "SHA-256": hashes[str(path)]} for path in project.files])
    tables = [Table(files, "Input files.")]
    if imports:
        tables += [Table(pd.DataFrame([_row(one) for one in imports]), "Measured files, as they were read."),
                   *_actions(imports)]
    text = "Every input file, and how measured files were read." if imports else "Every input file."
    return Section("Input files", text, tables=tuple(tables), chapter="Inputs", anchor="inputs")


def _row(one: Mapping[str, Any]) -> dict[str, object]:
    used = [f"{column['name']} [{column['unit']}]" for column in one["columns"]
            if column["role"] not in ("unused", "time")]
    return {"file": one["file"], "rows": one["rows"]["file"], "used": one["rows"]["used"], "parts": len(one["parts"]),
            "sample time [s]": one["sample_time"], "time": one["time"].get("format", ""), "columns": ", ".join(used)}


def _actions(imports: Sequence[Mapping[str, Any]]) -> list[Table]:
    """What was done, once for all files to which the same was done."""
    files: dict[tuple[str, str, str], list[str]] = {}
    for one in imports:
        for action in one["actions"]:
            said = action["what"], action.get("column") or "", action.get("text", "")
            files.setdefault(said, []).append(one["file"])
    rows = [{"what": what, "column": column, "said": text, "files": "all" if len(names) == len(imports) > 1 else
             ", ".join(dict.fromkeys(names))} for (what, column, text), names in files.items()]
    return [Table(pd.DataFrame(rows), "What was done to them.")] if rows else []
