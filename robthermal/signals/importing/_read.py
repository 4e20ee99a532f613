"""read_record and read_records: from a measured file to uniformly sampled records with a report of what was done."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

from ...errors import InputError
from .._checks import channel_names, distinct, positive_number
from .._record import Record
from .._stated import KEY
from ._assemble import make_records, system_names
from ._clock import time_columns, time_reader
from ._columns import SystemLike, channels_of_names, channels_of_system
from ._constants import with_constants
from ._open import open_source
from ._options import declared, with_own_word
from ._shorten import short_errors
from ._values import check_limits, find_parts, read_values

_QUIET = ("outputs replaced", "columns not read")


def read_records(
    source: Any,
    system: SystemLike | None = None,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    columns: Mapping[str, Any] | None = None,
    median_filter: float | None = None,
    max_bytes: float | None = None,
    tables: Sequence[tuple[Mapping[str, Any], Mapping[str, Any], str]] = (),
    **options: Any,
) -> tuple[Record, ...]:
    """Read a measured file or table as one record per uninterrupted part.

    What the file or its declaration says unambiguously is done and reported in `Record.imported`; what would be a guess
    is an error that names the declaration to write.

    Parameters
    ----------
    source : str, Path, DataFrame, Series, mapping of name to array, or structured ndarray
        CSV or other delimited text, xlsx, ods, Parquet, MATLAB .mat (to version 7), NI .tdms, or a table in memory.
    system : System, optional
        Heaters and module currents must have a column; ambients and sensors may.
    inputs, outputs : sequence of str, optional
        Without a system: the columns to read.
    columns : mapping, optional
        Name in the system to header in the file, or to ``{"column": …, "unit": …, "scale": …, "offset": …,
        "thermistor": …, "resistance": …}``, or to ``{"constant": …}`` of what never changed.
    median_filter : float, optional
        Width of a running median over the outputs [s]; default none, glitches are only reported.
    max_bytes : float, optional
        Refuse larger data [bytes]; default 2 GiB or a quarter of the memory.
    tables : sequence of (record, columns, place), optional
        Tables [record] and [columns] of a project file; they win over the system's, `options` over them.
    **options
        Keys of [record]: time, time_format, timezone, sample_time, delimiter, decimal, thousands, encoding,
        header_line, units_line, sheet, variable, header, temperature_unit, missing, gaps, fill_up_to,
        shortest, jitter, clock, duplicates, restarts, averaged, means_of, input_shift.

    Returns
    -------
    tuple of Record
        Temperatures in kelvin, currents in ampere; the sample time is the same in all.

    Raises
    ------
    InputError
        What cannot be read without a guess: file, line, column, value, and the option to write.

    Warns
    -----
    UserWarning
        What was done to samples: split, filled, resampled, dropped; glitches; values outside declared limits.

    Examples
    --------
    >>> import pandas as pd, robthermal as rt
    >>> log = pd.DataFrame({"time": [0.0, 1.0, 2.0, 9.0, 10.0], "I [mA]": 500.0,
    ...                     "T1 [°C]": [20.0, 20.1, 20.2, 20.9, 21.0]})
    >>> import warnings; warnings.simplefilter("ignore")
    >>> parts = rt.read_records(log, inputs=["I"], outputs=["T1"])
    >>> [part.n_samples for part in parts], float(parts[0]["I"][0])
    ([3, 2], 0.5)
    """
    found = _read(source, system, inputs, outputs, columns, median_filter, max_bytes, tables, options)
    _warn(found)
    return found


def read_record(
    source: Any,
    system: SystemLike | None = None,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    columns: Mapping[str, Any] | None = None,
    median_filter: float | None = None,
    max_bytes: float | None = None,
    tables: Sequence[tuple[Mapping[str, Any], Mapping[str, Any], str]] = (),
    **options: Any,
) -> Record:
    """Read a measured file or table that is one uninterrupted record.

    Parameters
    ----------
    source : str, Path, DataFrame, Series, mapping of name to array, or structured ndarray
        As for `read_records`.
    system : System, optional
        Heaters and module currents must have a column; ambients and sensors may.
    inputs, outputs : sequence of str, optional
        Without a system: the columns to read.
    columns : mapping, optional
        Name in the system to header in the file, or to ``{"column": …, "unit": …, "scale": …, "offset": …,
        "thermistor": …, "resistance": …}``, or to ``{"constant": …}`` of what never changed.
    median_filter : float, optional
        Width of a running median over the outputs [s].
    max_bytes : float, optional
        Refuse larger data [bytes].
    tables : sequence of (record, columns, place), optional
        Tables of a project file.
    **options
        Keys of [record], as for `read_records`.

    Returns
    -------
    Record
        Temperatures in kelvin.

    Raises
    ------
    InputError
        As `read_records`; and a file that falls into several parts.

    Examples
    --------
    >>> import tempfile, pathlib, robthermal as rt
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "run.csv"
    >>> _ = path.write_text("Time [s],Q1 [%],T1 [degC]\\n0,50,20.58\\n1,50,20.9\\n2,50,21.22\\n")
    >>> print(rt.read_record(path, inputs=["Q1"], outputs=["T1"]))
    Record 'run.csv': 3 samples of 1 s, from 0 s
              channel     min     max  unit
      input   Q1           50      50  %
      output  T1       293.73  294.37  K
    """
    found = _read(source, system, inputs, outputs, columns, median_filter, max_bytes, tables, options)
    if len(found) > 1:
        imported = found[0].imported
        where = imported.file if imported is not None else "source"
        first = found[1].start_time
        why = next(
            (action["text"] for action in (imported.actions if imported else ()) if action["what"] == "split"), ""
        )
        raise InputError(
            f"the record falls into {len(found)} parts, the second from {first:.10g} s ({why})",
            where=where,
            expected="one uninterrupted record",
            remedy='Take all parts with rt.read_records, or fill short gaps with gaps = "fill".',
        )
    _warn(found)
    return found[0]


def _warn(found: tuple[Record, ...]) -> None:
    """Say what was done, at the caller of the reader."""
    imported = found[0].imported
    for note in found[0].notes:
        if imported is not None and not note.startswith(_QUIET):
            warnings.warn(f"{imported.file}: {note}", UserWarning, stacklevel=3)


def _read(
    source: Any,
    system: SystemLike | None,
    inputs: Sequence[str] | None,
    outputs: Sequence[str] | None,
    columns: Mapping[str, Any] | None,
    median_filter: float | None,
    max_bytes: float | None,
    tables: Sequence[tuple[Mapping[str, Any], Mapping[str, Any], str]],
    options: Mapping[str, Any],
) -> tuple[Record, ...]:
    with short_errors():
        own = (getattr(system, "record", None) or {}, getattr(system, "columns", None) or {}, "system file")
        given = {key: value for key, value in options.items() if value is not None}
        choice = declared(own, *tables, (given, columns or {}, "arguments"))
        limit = None if max_bytes is None else positive_number(max_bytes, "max_bytes", "B")
        ins, outs = _names(system, inputs, outputs)
        wanted = frozenset((*ins, *outs, *(system_names(system) if system is not None else ())))
        sensors = outs if system is None else tuple(system.sensor_names)
        opened, choice = with_constants(open_source(source, choice.record, limit), choice, sensors)
        table = opened.table
        asked = declared(*tables, (given, {}, "arguments"))
        choice = with_own_word(choice, asked, table.facts.get(KEY, ""), table.where)
        place = time_columns(table, choice.record, wanted)
        channels = (
            channels_of_names(table, ins, outs, choice, place)
            if system is None
            else channels_of_system(table, system, choice, place)
        )
        values, clock = read_values(opened, channels, choice, time_reader(opened, place, choice.record))
        if system is not None:
            check_limits(table, values, system)
        parts = find_parts(table, clock, values, choice)
        return make_records(source, table, clock, place, values, parts, choice, median_filter, system)


def _names(
    system: SystemLike | None, inputs: Sequence[str] | None, outputs: Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if system is not None:
        if inputs is not None or outputs is not None:
            raise InputError(
                "a system and column names are given",
                where="arguments system, inputs and outputs",
                expected="one of the two",
                remedy="Use record.select(outputs=[...]) afterwards.",
            )
        return (), ()
    ins, outs = channel_names(inputs or (), "inputs"), channel_names(outputs or (), "outputs")
    distinct(ins, outs)
    if not ins and not outs:
        raise InputError(
            "neither a system nor column names are given",
            where="arguments system, inputs and outputs",
            remedy="Write read_record(path, system), or inputs=['heater'], outputs=['T1'].",
        )
    return ins, outs
