"""Calibration of the command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ...calibration import Fit, calibrate
from ...errors import InputError
from ...identify import FrequencyResponse
from ...thermal import System
from ._import import ReadTable
from ._measured import read_measured


def calibrate_files(system: System, records: Sequence[Path], validation: Sequence[Path] = (), *,
                    median_filter: float | None = None, operating_point: Mapping[str, float] | None = None,
                    tables: Sequence[ReadTable] = (), max_iterations: int = 200) -> Fit:
    """Calibrate a system with files of records and of frequency responses together.

    Parameters
    ----------
    system : System
        With starting values and a [fit] table.
    records : sequence of Path
        Training records and frequency responses, in any order.
    validation : sequence of Path
        Records and responses that the fit does not see.
    median_filter : float, optional
        Length of a median filter over the sensors of records [s].
    operating_point : mapping, optional
        Of the frequency responses: means of heaters [unit], module currents [A] and ambients [K], instead of those in
        their files.
    tables : sequence
        How the files are read, from `reading_from_text`.
    max_iterations : int
        After how many iterations the calibration stops.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        As the readers and `rt.calibrate`; for an operating point of records.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.measured.calibrate_files(rt.systems.two_module(), [])
    Traceback (most recent call last):
    ...
    robthermal.errors.InputError: records: no file is given. Expected records, frequency responses or both.
    """
    if not records:
        raise InputError("no file is given", where="records", expected="records, frequency responses or both")
    train, held_out = (read_measured(paths, system, median_filter=median_filter, tables=tables)
                       for paths in (records, validation))
    refuse_without_ranges(system, "[fit]", "[fit] of the system file")
    if operating_point and not any(isinstance(one, FrequencyResponse) for one in (*train, *held_out)):
        raise InputError("an operating point is given with records", where="--operating-point",
                         remedy="Leave it out: a record brings its own inputs.")
    return calibrate(system, train, validation=held_out or None, operating_point=operating_point or None,
                     max_iterations=max_iterations)


def refuse_without_ranges(system: System, where: str, tables: str) -> None:
    """Refuse a calibration of nothing, in the words of files.

    Parameters
    ----------
    system : System
        With its [fit] table, or what stands in its place.
    where : str
        Table that is missing or empty, for the message.
    tables : str
        Tables that may hold the ranges.

    Raises
    ------
    InputError
        There is no range.
    """
    if not system.fit:
        name, lump = next(iter(system.lumps.items()))
        raise InputError("nothing to calibrate: no parameter has a range", where=where,
                         expected="a range for every parameter that may change",
                         remedy=f'For example in {tables}: "lumps.{name}.capacity" = '
                                f"{{ lower = {lump.capacity / 5:g}, upper = {lump.capacity * 5:g} }}.")
