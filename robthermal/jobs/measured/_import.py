"""Measured files for the commands: all parts of each, read as the system and the command line say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...signals import Import, Record, inspect_file, options_from_text, read_records
from ...thermal import System

ReadTable = tuple[Mapping[str, Any], Mapping[str, Any], str]  # keys of [record], of [columns], and where they stand


def reading_from_text(record: Sequence[str], column: Sequence[str]) -> tuple[ReadTable, ...]:
    """How files are read, from the command line's ``--record KEY=VALUE`` and ``--column NAME=HEADER``.

    Parameters
    ----------
    record, column : sequence of str
        Command-line values, each KEY=VALUE or NAME=HEADER.

    Returns
    -------
    tuple
        For `read_files`; empty where nothing is given.

    Raises
    ------
    InputError
        A text without "=".

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.measured.reading_from_text(["gaps=fill"], ["T1=NTC 1"])
    (({'gaps': 'fill'}, {'T1': 'NTC 1'}, 'command line'),)
    """
    options, columns = options_from_text(record, column)
    return ((options, columns, "command line"),) if options or columns else ()


def single_rows_filled(system: System, tables: Sequence[ReadTable]) -> tuple[ReadTable, ...]:
    """Tables by which single missing rows are interpolated, unless the system or one of them says what gaps do.

    A diagnosis takes every part as a record that begins anywhere: a log of parts says less of what is slow.

    Parameters
    ----------
    system : System
        With its own [record].
    tables : sequence
        How the files are read, from `reading_from_text`.

    Returns
    -------
    tuple
        For `read_files` and `read_measured`.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.measured.single_rows_filled(rt.systems.two_module(), ())
    (({'gaps': 'fill', 'fill_up_to': 1}, {}, 'diagnose'),)
    >>> rt.jobs.measured.single_rows_filled(rt.systems.two_module(), [({"gaps": "split"}, {}, "command line")])
    (({'gaps': 'split'}, {}, 'command line'),)
    """
    said = {key for record in (system.record or {}, *(table[0] for table in tables)) for key in record}
    if said & {"gaps", "fill_up_to"}:
        return tuple(tables)
    return (({"gaps": "fill", "fill_up_to": 1}, {}, "diagnose"), *tables)


def read_files(paths: Sequence[Path], system: System | None = None, *, tables: Sequence[ReadTable] = (),
               inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None,
               median_filter: float | None = None) -> list[Record]:
    """All uninterrupted parts of all files, in order.

    Parameters
    ----------
    paths : sequence of Path
        Paths of the measured files.
    system : System, optional
        Gives the columns, and its own [record] and [columns].
    tables : sequence
        From `reading_from_text` or a project file; later ones win.
    inputs, outputs : sequence of str, optional
        Columns, where there is no system.
    median_filter : float, optional
        Length of a median filter over the sensors [s].

    Returns
    -------
    list of Record

    Raises
    ------
    InputError
        As `rt.read_records`.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.measured.read_files([], rt.systems.two_module())
    []
    """
    return [part for path in paths for part in read_records(path, system, inputs=inputs, outputs=outputs, tables=tables,
                                                            median_filter=median_filter)]


def import_reports(paths: Sequence[Path], system: System | None = None, *,
                   tables: Sequence[ReadTable] = ()) -> list[Import]:
    """What is understood of measured files, with or without a system.

    Parameters
    ----------
    paths : sequence of Path
        Paths of the measured files.
    system : System, optional
        Gives the columns; without one every column is listed as unused.
    tables : sequence
        Tables [record] and [columns], as `reading_from_text` returns them.

    Returns
    -------
    list of Import
        One per file.

    Raises
    ------
    InputError
        As `rt.read_records`.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> _ = Path("log.txt").write_text("time;T1\\n0;20,5\\n1;20,6\\n2;20,7\\n")
    >>> [column.role for column in rt.jobs.measured.import_reports([Path("log.txt")])[0].columns]
    ['time', 'unused']
    """
    if system is None:
        return [inspect_file(path, tables) for path in paths]
    reports = [read_records(path, system, tables=tables)[0].imported for path in paths]
    return [report for report in reports if report is not None]
