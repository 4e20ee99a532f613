"""Commands for those who begin: a project to start from, and what a name means."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

import robthermal as rt

from .terminal import Json, answer, say


def new(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to make.")], as_json: Json = False) -> None:
    """Write a commented starter project with simulated records, ready to run; nothing is overwritten.

    Example: robthermal new bench
    """
    project = rt.jobs.new_project(folder)
    summary = {"project": str(project), "files": sorted(str(file) for file in folder.iterdir())}
    answer(summary, as_json, lambda: say(*summary["files"], f"next: robthermal run {project} --out results"))


def explain(name: Annotated[str | None, typer.Argument(
                metavar="NAME", help="An effect, a kind of certificate, a code of an outcome; without one: a list.")]
            = None, as_json: Json = False) -> None:
    """Say what a name in a report, a diagnosis, a certificate or a message means.

    Example: robthermal explain sensor_lag
    """
    if name is None:
        known = rt.jobs.explainable()
        answer(known, as_json, lambda: say(*(f"{what}s: {', '.join(names)}\n" for what, names in known.items())))
    else:
        found = rt.jobs.explain(name)
        answer([asdict(one) for one in found], as_json, lambda: say("\n\n".join(map(str, found))))
