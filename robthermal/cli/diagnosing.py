"""The command that finds what a model lacks, or what has changed between two days."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

import robthermal as rt

from .terminal import (
    ColumnMap,
    Json,
    OperatingPoint,
    Out,
    ReadOption,
    SystemFile,
    answer,
    exit_unless,
    free,
    progress,
    reading,
    say,
    there,
)


def diagnose(system: SystemFile,
             records: Annotated[list[Path], typer.Argument(
                 help="Training records, or frequency responses from `robthermal frf`.",
                 metavar="TRAIN.csv")],
             validation: Annotated[list[Path] | None, typer.Option(
                 "--validation", help="Record or response that no fit sees, may repeat.",
                 metavar="FILE")] = None,
             reference: Annotated[list[Path] | None, typer.Option(
                 "--reference", help="Records of the healthy machine: what has changed since? Takes all files up to "
                 "the next option, may repeat.", metavar="OLD.csv...")] = None,
             augment: Annotated[bool, typer.Option(
                 "--augment", help="With --reference: compare with a model that has what the records of the healthy "
                 "machine name by themselves.")] = False,
             session_gain: Annotated[bool, typer.Option(
                 "--session-gain", help="Every record may have a gain of its own of every heater and module.")] = False,
             refine: Annotated[bool, typer.Option(
                 "--refine", help="Split the lump in which something is left in two, and diagnose again.")] = False,
             operating_point: OperatingPoint = None, column: ColumnMap = None, record: ReadOption = None,
             out: Out = Path("robthermal-diagnosis"), as_json: Json = False) -> None:
    """Find where records and simulation part: the missing effect, the system with it, the gap before and after.

    Example: robthermal diagnose setup.toml train.csv --validation held_out.csv --out diagnosed
    """
    there(system, *records, *(validation or []), *(reference or []))
    found = rt.read_system(system)
    tables = rt.jobs.measured.single_rows_filled(found, reading(record, column))
    point = rt.jobs.request.point_from_text(found, operating_point or [])
    free(out)
    with progress() as stage:
        stage("reading measured files")
        train, held_out, healthy = (rt.jobs.measured.read_measured(paths, found, tables=tables)
                                    for paths in (records, validation or [], reference or []))
        files = (system, *records, *(validation or []), *(reference or []))
        result = rt.jobs.diagnose_records(found, files, train, held_out, stage, operating_point=point,
                                          session_gain=session_gain, reference=healthy, augment=augment, refine=refine)
        stage("writing the report")
        rt.jobs.write_diagnosis(result, out)
    summary = {**json.loads((out / "diagnosis.json").read_text(encoding="utf-8")), "out": str(out),
               "report": str(out / "report.html")}
    split = ["finer network: no lump was split, nothing is left beyond the noise"] * (
        refine and result.diagnosis.remainder is None)
    answer(summary, as_json, lambda: say(str(result.diagnosis), *split, f"augmented system: {out / 'augmented.toml'}",
                                         f"report: {out / 'report.html'}"))
    exit_unless(result.holds)
