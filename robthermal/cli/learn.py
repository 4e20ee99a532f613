"""Commands for those who begin: a project to start from, what a name means, a module from its datasheet."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

import robthermal as rt

from .terminal import Json, answer, exit_unless, place, say, there


def new(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to make.")], as_json: Json = False) -> None:
    """Write a commented starter project with simulated records, ready to run; nothing is overwritten.

    Example: robthermal new bench
    """
    project = rt.jobs.new_project(folder)
    summary = {"project": str(project), "files": sorted(str(file) for file in folder.iterdir())}
    answer(summary, as_json, lambda: say(*summary["files"], f"next: robthermal run {project} --out results"))


def explain(name: Annotated[str | None, typer.Argument(
                metavar="NAME", help="An effect, a kind of certificate, a code of an outcome, a word of a report; "
                "without one: a list.")]
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


def datasheet(
    sheets: Annotated[list[str] | None, typer.Argument(
        metavar="NAME|SHEETS.csv", help="Sheets known to the package, or files of sheets.")] = None,
    rating: Annotated[list[str] | None, typer.Option(
        "--rating", metavar="'Th=27, Vmax=14.3, Imax=4.4, dTmax=60, Qmax=37.7'",
        help="One hot-side column of a sheet [°C V A K W]; repeat it for the others.")] = None,
    name: Annotated[str, typer.Option("--name", help="Name of the module of --rating.")] = "module",
    basis: Annotated[str, typer.Option("--basis", help="voltage: reproduces Vmax; heat: reproduces Qmax.")] = "voltage",
    cold: Annotated[float | None, typer.Option("--cold", help="Cold face of an operating point [°C].")] = None,
    hot: Annotated[float | None, typer.Option("--hot", help="Hot face [°C].")] = None,
    ambient: Annotated[float | None, typer.Option(
        "--ambient", help="Around the heat sink [°C], instead of --hot: sizes the sink.")] = None,
    load: Annotated[float | None, typer.Option("--load", help="Heat to absorb [W].")] = None,
    current: Annotated[float | None, typer.Option("--current", help="Current instead of a load [A].")] = None,
    sink: Annotated[float | None, typer.Option("--sink", help="Thermal resistance of a heat sink [K/W].")] = None,
    out: Annotated[Path | None, typer.Option("--out", help="File for the [modules.NAME] tables, TOML.",
                                             callback=place)] = None, as_json: Json = False) -> None:
    """Invert datasheets of thermoelectric modules both ways; operating point, heat sink, comparison, module table.

    Example: robthermal datasheet "TM 127-1.4-4.0" --cold 10 --ambient 25 --load 8 --out module.toml
    """
    there(*(Path(one) for one in sheets or [] if one.lower().endswith(".csv")))
    wanted = rt.jobs.datasheet.wanted_in_celsius(cold=cold, hot=hot, ambient=ambient, load=load, current=current,
                                                 sink=sink)
    found = rt.jobs.compare_modules(rt.jobs.read_sheets(sheets or [], rating or [], name), wanted,
                                    rt.jobs.datasheet.checked_basis(basis))
    if out is not None:
        rt.jobs.write_modules(found, out)
    answer({**found.to_dict(), "out": None if out is None else str(out)}, as_json,
           lambda: say(str(found), *([] if out is None else [f"module tables: {out}"])))
    exit_unless(any(one.holds for one in found.modules))
