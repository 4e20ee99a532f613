"""Tables of a job for summary.json."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ...calibration import Estimates
from ...signals import Record
from ..certify import certify_table
from ._misfit import Misfit
from ._result import JobResult


def summary_tables(result: JobResult) -> dict[str, Any]:
    """Calibration, residuals and certification, by the keys of the summary.

    Parameters
    ----------
    result : JobResult
        Result of the main job, as `run_job` returns it.
    """
    tables: dict[str, Any] = {"residuals": residual_table(result.misfits),
                              "certify": certify_table(result.certification)}
    tables["imports"] = import_table(one.record for one in result.comparisons)
    if result.fit is not None:
        tables["calibrate"] = {"parameters": parameter_table(result.fit, result.ranges),
                               "outcome": result.fit.outcome.code}
    return tables


def parameter_table(fit: Estimates, ranges: Mapping[str, tuple[float, float]] | None) -> dict[str, Any]:
    """Calibrated parameters by name.

    Parameters
    ----------
    fit : Estimates
        Calibration of the system.
    ranges : mapping or None
        Ranges for which claims are made.
    """
    ranges = ranges or {}
    found = {}
    for i, (name, value) in enumerate(fit.parameters.items()):
        bound = ("lower" if value - fit.lower[i] < fit.upper[i] - value else "upper") if fit.at_bound[i] else None
        found[name] = {"value": value, "std": fit.std[name], "range": list(ranges[name]) if name in ranges else None,
                       "determined": name not in fit.undetermined_parameters, "bound": bound}
    return found


def import_table(records: Iterable[Record]) -> list[dict[str, Any]]:
    """How every file was read, once per file.

    Parameters
    ----------
    records : iterable of Record
        All parts of all files.
    """
    reports = {record.imported.file: record.imported for record in records if record.imported}
    return [report.to_dict() for report in reports.values()]


def residual_table(misfits: Iterable[Misfit]) -> Mapping[str, Any]:
    """Residuals by kind of record, file and sensor.

    Parameters
    ----------
    misfits : iterable of Misfit
        How far the model is from every reading.
    """
    found: dict[str, dict[str, dict[str, dict[str, float]]]] = {}
    for one in misfits:
        row = {"mean": one.mean, "rms": one.rms, "noise": one.noise, "excess": one.excess,
               "tolerance": one.tolerance, "p": one.p_value}
        found.setdefault(one.kind, {}).setdefault(one.record, {})[one.sensor] = row
    return found
