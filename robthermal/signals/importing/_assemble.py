"""From values and parts to records, with the report of how the file was read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._glitches import filter_note, filtered, glitch_rows, window_samples
from .._means import as_means, block_means
from .._record import Record
from .._shift import shift_inputs
from .._stated import KEY
from ._channel import Channel
from ._columns import SystemLike
from ._options import Declared
from ._parts import Part
from ._report import Import, ImportedColumn
from ._table import Action, Array, Table
from ._times import Clock
from ._units import split_header, unit_of
from ._values import Values

_LOUD = (
    "split",
    "filled",
    "resampled",
    "clock",
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
    glitches: dict[str, int] = {}
    notes: list[str] = []
    smooth = [c for c in read if c.role != "voltage"]  # which jumps with its current, in both directions and at once
    for part in parts:
        for c in smooth:
            n = _say_glitches(table, part, c, values.column(c)[part.rows])
            if n:
                glitches[c.name] = glitches.get(c.name, 0) + n
        if median_filter is not None:  # before resampling: interpolation would smear a glitch over two samples
            samples = window_samples(median_filter, part.sample_time, part.n_rows, "median_filter")
            for c in smooth:
                column = values.column(c)
                column[part.rows] = filtered(column[part.rows], samples)
            notes = [filter_note(median_filter, samples)]
    ripples = [_ripple(part, values) for part in parts]  # before the values give their place to samples
    made = [(_sampled(part, values.inputs, driven), _sampled(part, values.outputs, read)) for part in parts]
    for matrix in (values.inputs, values.outputs, *(one for both in made for one in both)):
        _freeze(matrix)
    averaged = choice.record.averaged
    say_declared(table, len(parts), choice)
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
    records = (
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
            ripple=ripple,
        )
        for k, (part, (U, Y), ripple) in enumerate(zip(parts, made, ripples, strict=True))
    )
    of, shift = choice.record.means_of, choice.record.input_shift
    commands = [c.name for c in driven if c.role != "ambient"]
    moved = (shift_inputs(record, shift, commands) if shift else record for record in records)
    short = (as_means(record, averaged) if averaged else record for record in moved)
    return tuple(block_means(record, of) if of else record for record in short)


def say_declared(table: Table, n_parts: int, choice: Declared) -> None:
    """Say of values that are means over which step, and who says so; and of inputs that act in another row."""
    if shift := choice.record.input_shift:
        rows, which = "a row" if abs(shift) == 1 else f"{abs(shift)} rows", "later" if shift > 0 else "earlier"
        table.actions.append(Action("shifted", n_parts, f"inputs act {rows} {which} than they stand, as declared"))
    averaged, who = choice.record.averaged, "the file says" if table.facts.get(KEY) else "declared"
    if averaged:
        text = (f"readings are means over the step before their stamp, as {who}" if averaged == "readings" else
                f"every value is the mean over the step {averaged} its stamp, as {who}: readings stand where their "
                "step ends, inputs where theirs begins")
        if any(action.what == "resampled" for action in table.actions):
            text += "; means over steps of unequal length are interpolated like samples, so they are means only nearly"
        table.actions.append(Action("averaged", n_parts, text))
    if choice.record.means_of:
        table.actions.append(Action("averaged", n_parts, f"every {choice.record.means_of} samples became one step by "
                                                         "their means, as declared"))


def _say_glitches(table: Table, part: Part, channel: Channel, column: Array) -> int:
    """How many readings of a part jump away and back; they are said."""
    there = np.isfinite(column)
    found = glitch_rows(column if there.all() else column[there])
    if not found.size:
        return 0
    if not there.all():
        found = np.flatnonzero(there)[found]
    text = (
        f"{channel.name!r} has {found.size} glitch{'es' if found.size > 1 else ''} at {_times(part, found)} (kept; "
        "median_filter= [s] removes them)"
    )
    lines, times = table.lines.of(part.rows.start + found), [float(part.stamps[x]) for x in found[:50]]
    table.actions.append(Action("glitches", int(found.size), text, table.headers[channel.place], lines, times))
    return int(found.size)


def _sampled(part: Part, matrix: Array, channels: Sequence[Channel]) -> Array:
    """Columns of a part on its grid: where the rows stand, unless the grid has more samples than there are rows."""
    rows = matrix[part.rows]
    fits = part.samples <= part.n_rows
    out = rows[: part.samples] if fits else np.empty((part.samples, len(channels)))
    for k, channel in enumerate(channels):
        whole = bool(np.isfinite(rows[:, k]).all())
        if part.exact and whole:
            continue
        reading = channel.role not in ("input", "current") and not (channel.role == "voltage" and whole)
        values = rows[:, k].copy()
        for span, sampled in (part.interpolated if reading else part.held)(values):
            out[span, k] = sampled
    return out


def _ripple(part: Part, values: Values) -> dict[str, Array]:
    """What the currents are off their means within samples (rms), where they are means."""
    found = {}
    for channel in values.of("current") if part.means and not part.exact else ():
        column = values.column(channel)[part.rows]
        found[channel.name] = np.concatenate([some for _, some in part.ripple(column)])
    return found


def _freeze(matrix: Array) -> None:
    """Make an array and the one it is a part of read-only: a record then takes it as it is."""
    matrix.flags.writeable = False
    if isinstance(matrix.base, np.ndarray):
        matrix.base.flags.writeable = False


def _times(part: Part, rows: Any) -> str:
    shown = ", ".join(f"{part.stamps[row]:.10g} s" for row in rows[:3])
    return shown + (" ..." if len(rows) > 3 else "")


def say_dropped(table: Table, values: Values, time: tuple[int, ...]) -> None:
    used = {*time, *(c.place for c in values.channels)}
    for k, header in enumerate(table.headers):
        if k not in used and (not header or k in table.empty):
            words = f"column {header!r} without a value" if header else f"column {k + 1} without a name"
            table.actions.append(Action("dropped_column", 1, f"{words} left out", header))


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
    used = sum(part.n_rows for part in parts)
    facts = table.facts
    by_place = {c.place: c for c in values.channels}
    columns = []
    for k, header in enumerate(table.headers):
        channel = by_place.get(k)
        if channel is None:
            unit = (split_header(header)[1] if k in time else table.unit_text(k)) or ""
            columns.append(ImportedColumn(header, "", "time" if k in time else "unused", unit, unit))
            continue
        columns.append(
            ImportedColumn(
                header,
                channel.name,
                {"output": "sensor", "voltage": "sensor"}.get(channel.role, channel.role),
                _unit_read(table, channel),
                channel.unit,
                channel.scale,
                channel.offset,
                *values.ranges[channel.name],
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
                "first_line": table.lines[part.rows.start],
                "last_line": table.lines[part.rows.stop - 1],
            }
            for part in parts
        ),
        columns=tuple(columns),
        actions=tuple(action.to_dict() for action in table.actions),
        absent=absent,
    )


def _unit_read(table: Table, channel: Channel) -> str:
    """Unit of the cells: as it is known, else as the file says it."""
    if channel.unit_read is not None:
        return channel.unit_read.name
    text = table.unit_text(channel.place, channel.name) or ""
    known = unit_of(text)
    return known.name if known is not None else text


def system_names(system: SystemLike) -> tuple[str, ...]:
    return (*system.input_names, *system.module_names, *system.ambient_names, *system.sensor_names)
