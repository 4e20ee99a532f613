"""What was understood of a file and done to it: the import report, which travels with the record."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ..._celsius import ZERO_CELSIUS

FORMAT = "robthermal-import/1"
_HEADS = ("column", "name", "role", "unit", "min … max", "missing", "glitches")


@dataclass(frozen=True)
class ImportedColumn:
    """One column of the file.

    Parameters
    ----------
    column, name : str
        Header in the file, and name in the record; empty where it is not used.
    role : str
        "sensor", "ambient", "input", "current", "time" or "unused".
    unit_read, unit : str
        Unit of the cells, and unit that is kept; empty where nobody says.
    scale, offset : float
        Declared conversion, 1 and 0 without one.
    min, max : float or None
        Of the kept values, in the kept unit.
    missing, glitches : int
        Cells without a value, and readings that jump away and back.
    """

    column: str
    name: str
    role: str
    unit_read: str = ""
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0
    min: float | None = None
    max: float | None = None
    missing: int = 0
    glitches: int = 0


@dataclass(frozen=True)
class Import:
    """How a measured file was read.

    Parameters
    ----------
    file : str
        Name of the file, or the kind of source.
    sha256 : str
        Hash of the file's bytes; empty for sources that are no files.
    encoding, delimiter, decimal : str
        Of a text file, else empty.
    header_line, skipped_lines : int
        Line of the header, counted from 1, and how many lines before it were skipped.
    time : dict
        columns, format, timezone, origin.
    sample_time : float
        Of the record [s].
    rows : dict
        "file": data rows in the file; "used": rows in some record.
    parts : tuple of dict
        start [s], samples, first_line, last_line of every part.
    columns : tuple of ImportedColumn
        Every column of the file.
    actions : tuple of dict
        What was done: what, n, column, lines, times [s], text, rows.
    absent : tuple of str
        Names of the system without a column.
    """

    file: str
    sha256: str
    encoding: str
    delimiter: str
    decimal: str
    header_line: int
    skipped_lines: int
    time: dict[str, Any]
    sample_time: float
    rows: dict[str, int]
    parts: tuple[dict[str, Any], ...]
    columns: tuple[ImportedColumn, ...]
    actions: tuple[dict[str, Any], ...]
    absent: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """The report as plain objects, ready for JSON.

        Returns
        -------
        dict
        """
        plain = {
            key: getattr(self, key)
            for key in (
                "file",
                "sha256",
                "encoding",
                "delimiter",
                "decimal",
                "header_line",
                "skipped_lines",
                "time",
                "sample_time",
                "rows",
            )
        }
        return {
            "format": FORMAT,
            **plain,
            "parts": list(self.parts),
            "columns": [vars(column) for column in self.columns],
            "actions": list(self.actions),
            "absent": list(self.absent),
        }

    def __str__(self) -> str:
        table = [_HEADS, *(_row(column) for column in self.columns)]
        widths = [max(len(row[k]) for row in table) for k in range(len(_HEADS))]
        lines = [f"{self.file}"]
        lines += [
            "  " + "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in table
        ]
        lines.append(
            f"  rows: {self.rows['used']} of {self.rows['file']} used, in {_parts(self.parts, self.sample_time)}"
        )
        if self.delimiter:
            delimiter = {"\t": "tab"}.get(self.delimiter, repr(self.delimiter))
            header = f"header in line {self.header_line}" if self.header_line else "headers declared"
            lines.append(
                f"  text: {self.encoding}, delimiter {delimiter}, decimal {self.decimal!r}, {header}"
                + (f", {self.skipped_lines} lines skipped" if self.skipped_lines else "")
            )
        zone = f", zone {self.time['timezone']}" if self.time.get("timezone") else ""
        origin = f", zero is {self.time['origin']}" if self.time.get("origin") else ""
        lines.append(f"  time: {', '.join(self.time['columns']) or 'counted'} as {self.time['format']}{zone}{origin}")
        plain = {f"{column.name} from {column.unit_read} to {column.unit}" for column in self.columns}
        lines += [f"  {action['what']}: {action['text']}" for action in self.actions
                  if action["what"] != "mapped" and action["text"] not in plain]  # the table says these
        if self.absent:
            lines.append(f"  no column for: {', '.join(self.absent)}")
        return "\n".join(lines)


_DURATIONS = (("days", 86400.0), ("h", 3600.0), ("min", 60.0))
# A technician compares the table with the file: temperatures are told as they stand there.
_AS_READ: dict[str, Callable[[float], float]] = {
    "degC": lambda kelvin: kelvin - ZERO_CELSIUS, "degF": lambda kelvin: (kelvin - ZERO_CELSIUS) * 9.0 / 5.0 + 32.0}


def _row(column: ImportedColumn) -> tuple[str, ...]:
    unit = column.unit_read if column.unit_read == column.unit else f"{column.unit_read or '-'} → {column.unit or '-'}"
    back = _AS_READ.get(column.unit_read or "") if column.unit == "K" else None
    ends = [end if end is None or back is None else back(end) for end in (column.min, column.max)]
    span = "" if ends[0] is None or ends[1] is None else f"{ends[0]:.6g} … {ends[1]:.6g}"
    return (
        column.column or "(no name)",
        column.name or "-",
        column.role,
        unit or "-",
        span,
        str(column.missing),
        str(column.glitches),
    )


def _parts(parts: Sequence[dict[str, Any]], sample_time: float) -> str:
    words, long = _in_words(sample_time), _in_words(sample_time * sum(part["samples"] for part in parts))
    step = f"{sample_time:.10g} s" + f" ({words})" * (not words.endswith(" s"))
    if len(parts) == 1:
        return f"one part of {parts[0]['samples']} samples of {step}, from {parts[0]['start']:.10g} s, {long} long"
    shown = "; ".join(f"{part['start']:.6g} s: {part['samples']}" for part in parts[:6])
    return f"{len(parts)} parts of {step} ({shown}{'; …' if len(parts) > 6 else ''} samples), {long} in all"


def _in_words(seconds: float) -> str:
    """A duration as people say it: a time column in the wrong unit is seen by it."""
    unit, size = next(((unit, size) for unit, size in _DURATIONS if seconds >= 2.0 * size), ("s", 1.0))
    return f"{seconds / size:.3g} {unit}"
