"""Tables of a job for summary.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..certify import certify_table
from ._result import JobResult


def summary_tables(result: JobResult) -> dict[str, Any]:
    """Calibration, residuals and certification, by the keys of the summary.

    Parameters
    ----------
    result : JobResult
        Result of the main job, as `run_job` returns it.
    """
    tables: dict[str, Any] = {"residuals": _residuals(result), "certify": certify_table(result.certification)}
    reports = {one.record.imported.file: one.record.imported for one in result.comparisons if one.record.imported}
    tables["imports"] = [report.to_dict() for report in reports.values()]
    if result.fit is not None:
        tables["calibrate"] = {"parameters": _parameters(result), "outcome": result.fit.outcome.code}
    return tables


def _parameters(result: JobResult) -> dict[str, Any]:
    fit, ranges = result.fit, result.ranges or {}
    assert fit is not None
    found = {}
    for i, (name, value) in enumerate(fit.parameters.items()):
        bound = ("lower" if value - fit.lower[i] < fit.upper[i] - value else "upper") if fit.at_bound[i] else None
        found[name] = {"value": value, "std": fit.std[name], "range": list(ranges[name]) if name in ranges else None,
                       "determined": name not in fit.undetermined_parameters, "bound": bound}
    return found


def _residuals(result: JobResult) -> Mapping[str, Any]:
    found: dict[str, dict[str, dict[str, dict[str, float]]]] = {}
    for one in result.misfits:
        row = {"mean": one.mean, "rms": one.rms, "noise": one.noise, "excess": one.excess,
               "tolerance": one.tolerance, "p": one.p_value}
        found.setdefault(one.kind, {}).setdefault(one.record, {})[one.sensor] = row
    return found
