"""From values and parts to records, with the report of how the file was read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._glitches import filter_note, filtered, glitch_rows, window_samples
from .._record import Record
from ._columns import SystemLike
from ._options import Declared
from ._parts import Part
from ._report import Import, ImportedColumn
from ._stamps import Clock
from ._table import Action, Array, Table
from ._units import split_header
from ._values import Values

_LOUD = (
    "split",
    "filled",
    "resampled",
    "counted",
    "duplicates",
    "left_out",
    "dropped_row",
    "fault_code",
    "glitches",
    "timezone",
)


def make_records(
    source: Any,
    table: Table,
    clock: Clock,
    time: tuple[int, ...],
    values: Values,
    parts: list[Part],
    choice: Declared,
    median_filter: float | None,
    system: SystemLike | None,
) -> tuple[Record, ...]:
    driven, read = values.of("input", "current", "ambient"), values.of("sensor", "voltage", "output")
    made: list[tuple[Array, Array]] = []
    glitches: dict[str, int] = {}
    notes: list[str] = []
    for part in parts:
        U = (
            np.column_stack(
                [part.linear(values.column(c)) if c.role == "ambient" else part.held(values.column(c)) for c in driven]
            )
            if driven
            else np.zeros((part.samples, 0))
        )
        Y = np.empty((part.samples, len(read)))
        for k, c in enumerate(read):
            column = values.column(c)
            if c.role == "voltage":  # jumps with its current, in both directions and at once
                Y[:, k] = part.linear(column) if np.isnan(column[part.rows]).any() else part.held(column)
                continue
            found = glitch_rows(column[part.rows][np.isfinite(column[part.rows])])
            if found.size:
                glitches[c.name] = glitches.get(c.name, 0) + int(found.size)
                table.actions.append(
                    Action(
                        "glitches",
                        int(found.size),
                        f"{c.name!r} has {found.size} glitch"
                        f"{'es' if found.size > 1 else ''} at {_times(part, found)} (kept; median_filter= [s] "
                        "removes them)",
                        table.headers[c.place],
                        [int(x) for x in table.lines[part.rows[found[:50]]]],
                        [float(part.stamps[x]) for x in found[:50]],
                    )
                )
            if median_filter is not None:  # before resampling: interpolation would smear a glitch over two samples
                samples = window_samples(median_filter, part.sample_time, len(part.rows), "median_filter")
                column = column.copy()
                column[part.rows] = filtered(column[part.rows], samples)
                notes = [filter_note(median_filter, samples)]
            Y[:, k] = part.linear(column)
        made.append((U, Y))
    say_dropped(table, values, time)
    report = make_report(source, table, clock, time, values, parts, glitches, choice, system)
    said = [action.text for action in table.actions if action.what in _LOUD]
    unknown = [column.column for column in report.columns if column.role == "unused" and column.column]
    if unknown:
        said.append(
            ("unknown columns, not read: " if system is not None else "columns not read: ")
            + ", ".join(map(repr, unknown[:12]))
            + (" …" if len(unknown) > 12 else "")
        )
    units = {c.name: c.unit for c in (*driven, *read) if c.unit}
    return tuple(
        Record(
            sample_time=part.sample_time,
            inputs=U,
            outputs=Y,
            input_names=[c.name for c in driven],
            output_names=[c.name for c in read],
            start_time=part.start,
            units=units,
            name=report.file if len(parts) == 1 else f"{report.file} part {k + 1}",
            notes=said + notes,
            imported=report,
        )
        for k, (part, (U, Y)) in enumerate(zip(parts, made, strict=True))
    )


def _times(part: Part, rows: Any) -> str:
    shown = ", ".join(f"{part.stamps[row]:.10g} s" for row in rows[:3])
    return shown + (" ..." if len(rows) > 3 else "")


def say_dropped(table: Table, values: Values, time: tuple[int, ...]) -> None:
    used = {*time, *(c.place for c in values.channels)}
    for k, header in enumerate(table.headers):
        if k in used:
            continue
        cells = table.columns[k]
        empty = (
            bool(np.isnan(cells).all())
            if getattr(cells, "dtype", None) is not None and cells.dtype.kind == "f"
            else False
        )
        if not header or empty:
            table.actions.append(
                Action(
                    "dropped_column",
                    1,
                    f"column {k + 1} without a name left out"
                    if not header
                    else f"column {header!r} without a value left out",
                    header,
                )
            )


def make_report(
    source: Any,
    table: Table,
    clock: Clock,
    time: tuple[int, ...],
    values: Values,
    parts: list[Part],
    glitches: Mapping[str, int],
    choice: Declared,
    system: SystemLike | None,
) -> Import:
    used = sum(len(part.rows) for part in parts)
    facts = table.facts
    by_place = {c.place: c for c in values.channels}
    columns = []
    for k, header in enumerate(table.headers):
        channel = by_place.get(k)
        if channel is None:
            unit = split_header(header)[1] or ""
            columns.append(ImportedColumn(header, "", "time" if k in time else "unused", unit, unit))
            continue
        kept = values.column(channel)
        columns.append(
            ImportedColumn(
                header,
                channel.name,
                {"output": "sensor", "voltage": "sensor"}.get(channel.role, channel.role),
                channel.unit_read.name if channel.unit_read else "",
                channel.unit,
                channel.scale,
                channel.offset,
                float(np.nanmin(kept)),
                float(np.nanmax(kept)),
                values.missing[k],
                glitches.get(channel.name, 0),
            )
        )
    names = {c.name for c in values.channels}
    absent = tuple(name for name in system_names(system) if name not in names) if system is not None else ()
    return Import(
        file=Path(source).name if isinstance(source, str | Path) else table.where,
        sha256=facts.get("sha256", ""),
        encoding=facts.get("encoding", ""),
        delimiter=facts.get("delimiter", ""),
        decimal=facts.get("decimal", ""),
        header_line=facts.get("header_line", 0),
        skipped_lines=facts.get("skipped_lines", 0),
        time={
            "columns": [table.headers[k] for k in time],
            "format": clock.format,
            "timezone": choice.record.timezone,
            "origin": clock.origin or facts.get("origin"),
        },
        sample_time=parts[0].sample_time,
        rows={"file": int(facts.get("rows", len(table.lines))), "used": used},
        parts=tuple(
            {
                "start": part.start,
                "samples": part.samples,
                "first_line": int(table.lines[part.rows[0]]),
                "last_line": int(table.lines[part.rows[-1]]),
            }
            for part in parts
        ),
        columns=tuple(columns),
        actions=tuple(action.to_dict() for action in table.actions),
        absent=absent,
    )


def system_names(system: SystemLike) -> tuple[str, ...]:
    return (*system.input_names, *system.module_names, *system.ambient_names, *system.sensor_names)
