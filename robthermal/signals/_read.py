"""read_record: one door for all file formats."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from ..errors import InputError
from ._checks import Array, positive_number
from ._columns import Layout, SystemLike, layout_for_names, layout_for_system
from ._csv import CsvSource
from ._glitches import filter_note, filtered, glitch_rows, window_samples
from ._matlab import MatlabSource
from ._parquet import ParquetSource
from ._plausible import check_temperature, limit_notes
from ._record import Record
from ._source import Source, check_file
from ._tdms import TdmsSource
from ._timebase import TimeBase, uniform
from ._units import celsius_to_kelvin

_SUFFIXES = (".csv", ".txt", ".tsv", ".parquet", ".mat", ".tdms")
_LISTED = 3


def read_record(
    path: str | Path,
    system: SystemLike | None = None,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    temperature_unit: Literal["K", "degC"] | None = None,
    jitter: float = 0.05,
    median_filter: float | None = None,
    max_bytes: float | None = None,
) -> Record:
    """Read a record file: CSV, Parquet, MATLAB .mat (to version 7) or NI .tdms.

    Columns are found by name: ``time`` [s] (any case), then either those of a system, or those listed. Headers may
    carry a unit, ``m1 [A]``, which is checked. What was done to the data is a warning and a note of the record.

    Parameters
    ----------
    path : str or Path
        The suffix tells the format.
    system : System, optional
        Heaters and module currents must have a column; ambients and sensors may. Inputs of the record are heaters,
        currents and the ambients present, outputs the sensors present, each in the order of the system.
    inputs, outputs : sequence of str, optional
        Without a system: the columns to read.
    temperature_unit : {"K", "degC"}, optional
        Unit of the temperatures in the file: of ambients and sensors (default: that of the system), or of the columns
        listed in `outputs` (default: kelvin). A column with another unit in its header is not a temperature.
    jitter : float, optional
        Largest deviation of a time step from the median step, as a fraction of it [-], that is resampled. Above one
        half, missing samples are filled; 1 also accepts repeated time stamps when the rows fit a uniform grid.
    median_filter : float, optional
        Width [s] of a running median over the outputs. Default: no filter, glitches are only reported.
    max_bytes : float, optional
        Refuse more data than this [B]. Default: 2 GiB or a quarter of the memory.

    Returns
    -------
    Record
        Temperatures in kelvin.

    Raises
    ------
    InputError
        Everything that could be wrong with a file, by file, line, column and time: unreadable or binary files, missing
        or misspelt columns, text or nothing in a number cell, gaps, repeated or backward time, too much jitter, Celsius
        declared kelvin and the reverse, currents in mA.

    Warns
    -----
    UserWarning
        Jitter resampled, unknown columns, glitches, values outside declared limits.

    Examples
    --------
    >>> import tempfile, pathlib, robthermal as rt
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "run.csv"
    >>> _ = path.write_text("Time [s],Q1 [%],T1 [degC]\\n0,50,20.58\\n1,50,20.9\\n2,50,21.22\\n")
    >>> print(rt.read_record(path, inputs=["Q1"], outputs=["T1"], temperature_unit="degC"))
    Record 'run.csv': 3 samples of 1 s, from 0 s
              channel     min     max  unit
      input   Q1           50      50  %
      output  T1       293.73  294.37  K
    """
    file = _path(path)
    source = _opened(file, max_bytes)
    if system is None:
        layout = layout_for_names(source.headers, inputs, outputs, temperature_unit, f"{file}")
    elif inputs is None and outputs is None:
        layout = layout_for_system(source.headers, system, temperature_unit, f"{file}")
    else:
        raise InputError(
            "a system and column names are given",
            where="arguments system, inputs and outputs",
            expected="one of the two",
            remedy="Use record.select(outputs=[...]) afterwards.",
        )
    names = layout.inputs + layout.outputs
    columns = _finite_columns(source, [layout.time, *(layout.headers[name] for name in names)])
    stamps, raw = columns[layout.time], {name: columns[layout.headers[name]] for name in names}
    base = uniform(stamps, jitter=jitter, row=source.row, where=f"{file}")
    if layout.unit_declared:
        for name in layout.temperatures:
            check_temperature(name, raw[name], stamps, layout.temperature_unit, source.row, f"{file}")
    said = _unknown_columns(layout, system) + ([base.note] if base.note else [])
    if system is not None:
        said += limit_notes(raw, system.current_limits, system.input_limits, f"{file}")
    said += _glitches(raw, stamps, layout)
    for text in said:
        warnings.warn(f"{file}: {text}", UserWarning, stacklevel=2)
    quiet = _filter_outputs(raw, layout, base, median_filter)
    if system is None and layout.unknown:
        quiet += [f"columns not read: {', '.join(map(repr, layout.unknown))}"]
    return _record(file, layout, base, raw, said + quiet)


def _path(path: object) -> Path:
    if not isinstance(path, (str, Path)):
        raise InputError(f"path is {path!r}", where="argument path", expected="the name of a file")
    return Path(path)


def _opened(path: Path, max_bytes: float | None) -> Source:
    limit = None if max_bytes is None else positive_number(max_bytes, "max_bytes", "B")
    suffix = path.suffix.lower()
    if suffix not in _SUFFIXES:
        raise InputError(
            f"the file name ends in {path.suffix!r}", where=f"{path}", expected=f"one of {', '.join(_SUFFIXES)}"
        )
    check_file(path, limit)
    if suffix == ".parquet":
        return ParquetSource(path, limit)
    if suffix == ".mat":
        return MatlabSource(path, limit)
    if suffix == ".tdms":
        return TdmsSource(path, limit)
    return CsvSource(path)


def _finite_columns(source: Source, wanted: Sequence[str]) -> dict[str, Array]:
    columns = source.read(wanted)
    stamps = columns[wanted[0]]
    for header, column in columns.items():
        wrong = np.flatnonzero(~np.isfinite(column))
        if wrong.size:
            k = int(wrong[0])
            raise InputError(
                f"column {header!r} is {column[k]} (not finite) in {source.row(k)}, time {stamps[k]:.10g} s "
                f"({wrong.size} of {len(column)} rows)",
                where=f"{source.path}",
                expected="a finite number in every cell",
                remedy="Missing values are not filled: cut the file there, or repair it.",
            )
    return columns


def _unknown_columns(layout: Layout, system: SystemLike | None) -> list[str]:
    if system is None or not layout.unknown:
        return []
    return [f"unknown columns, not read: {', '.join(map(repr, layout.unknown))}"]


def _glitches(raw: dict[str, Array], stamps: Array, layout: Layout) -> list[str]:
    said = []
    for name in layout.outputs:
        rows = glitch_rows(raw[name])
        if rows.size:
            first = ", ".join(f"{stamps[k]:.10g} s" for k in rows[:_LISTED]) + (" ..." if rows.size > _LISTED else "")
            said.append(
                f"{name!r} has {rows.size} glitch{'es' if rows.size > 1 else ''} at {first} (kept; "
                "median_filter= [s] removes them)"
            )
    return said


def _filter_outputs(raw: dict[str, Array], layout: Layout, base: TimeBase, window: float | None) -> list[str]:
    """Filter in place, before resampling: interpolation would smear a glitch over two samples."""
    if window is None:
        return []
    samples = window_samples(window, base.sample_time, len(base.stamps), "median_filter")
    for name in layout.outputs:
        raw[name] = filtered(raw[name], samples)
    return [filter_note(window, samples)]


def _record(path: Path, layout: Layout, base: TimeBase, raw: dict[str, Array], notes: list[str]) -> Record:
    def column(name: str) -> Array:
        held = name in layout.inputs and name not in layout.interpolated_inputs
        values = base.held(raw[name]) if held else base.interpolated(raw[name])
        celsius = name in layout.temperatures and layout.temperature_unit == "degC"
        return celsius_to_kelvin(values) if celsius else values

    def matrix(names: Sequence[str]) -> Array:
        values = np.empty((base.n_samples, len(names)))
        for i, name in enumerate(names):
            values[:, i] = column(name)
        return values

    return Record(
        sample_time=base.sample_time,
        inputs=matrix(layout.inputs),
        outputs=matrix(layout.outputs),
        input_names=layout.inputs,
        output_names=layout.outputs,
        start_time=base.start_time,
        units=layout.units,
        name=path.name,
        notes=notes,
    )
