"""Files that a calibration or a diagnosis takes: records and frequency responses together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...errors import InputError
from ...identify import FrequencyResponse, is_response, read_response
from ...signals import Record
from ...thermal import System
from ._import import ReadTable, read_files


def read_measured(paths: Sequence[Path], system: System, *, median_filter: float | None = None,
                  tables: Sequence[ReadTable] = ()) -> list[Record | FrequencyResponse]:
    """Read what a calibration or a diagnosis takes: records, and frequency responses as `robthermal frf` writes them.

    Parameters
    ----------
    paths : sequence of Path
        Records and responses in any order; the content tells which is which.
    system : System
        Gives the columns of records.
    median_filter : float, optional
        Length of a median filter over the sensors of records [s].
    tables : sequence
        How the files are read, from `reading_from_text`.

    Returns
    -------
    list of Record or FrequencyResponse

    Raises
    ------
    InputError
        As the readers; also for a response without covariance, whose misfit cannot be weighed.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.measured.read_measured([], rt.systems.two_module())
    []
    """
    found: list[Record | FrequencyResponse] = []
    for path in paths:
        found += [_response(path)] if is_response(path) else read_files([path], system, tables=tables,
                                                                        median_filter=median_filter)
    return found


def _response(path: Path) -> FrequencyResponse:
    found = read_response(path)
    if not found.has_covariance:
        raise InputError("is a frequency response without covariance and without names of channels", where=str(path),
                         expected="the .json, .npz or .mat file that robthermal frf writes",
                         remedy="Without a covariance no misfit can be called large.")
    return found
