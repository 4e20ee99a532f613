"""The main job: data → calibrated model → certificates → verified."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ...calibration import Estimates, Fit, calibrate
from ...errors import InputError
from ...fitting import as_data, free_run
from ...identify import FrequencyResponse
from ...signals import Record
from ...thermal import System
from ..certify import certify_system, claim_ranges, claims_hold, doubted
from ..diagnose import Diagnosed, diagnose_records
from ..measured import read_files, refuse_without_ranges
from ..request import Boxes, Gate, Project
from ._gate import gate_reasons
from ._misfit import Misfit, misfit, noise_of_readings
from ._result import Calibrated, Comparison, Doubted, JobResult

Progress = Callable[[str], None]
Array = NDArray[np.float64]


@threadpool_limits.wrap(limits=1, user_api="blas")  # products are small: threads only wait for each other
def run_job(project: Project, progress: Progress = lambda stage: None) -> JobResult:
    """Run the main job of a project.

    Parameters
    ----------
    project : Project
        Project, as `read_project` returns it.
    progress : callable, optional
        Called with a sentence before every stage.

    Returns
    -------
    JobResult

    Raises
    ------
    InputError
        Anything wrong with records, parameters or boxes.

    Examples
    --------
    The demo's project without its records, for a bar in a room:

    >>> from dataclasses import replace
    >>> import robthermal as rt
    >>> demo = rt.jobs.read_project(rt.jobs.demo_project())
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 50.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}])
    >>> result = rt.jobs.run_job(replace(demo, system=bar, train=(), validation=(), boxes=rt.jobs.Boxes()))
    >>> result.holds
    True
    """
    train, validation = job_records(project, progress)
    done = calibrated(project, project.system, train, validation, progress)
    ranges = claim_ranges(project.boxes, done.fit)
    certification = certify_system(done.system, project.boxes, progress, parameters=ranges)
    found = JobResult(project, done.fit, done.system, done.comparisons, certification, done.misfits,
                      _diagnosis(project, train, validation, progress),
                      doubted_claims(done.fit, done.system, project.boxes, progress), ranges)
    return replace(found, reasons=gate_reasons(found))


def job_records(project: Project, progress: Progress = lambda stage: None) -> tuple[list[Record], list[Record]]:
    """Training and validation records of a project, every uninterrupted part one record.

    Parameters
    ----------
    project : Project
        Project, as `read_project` returns it.
    progress : callable, optional
        Called with a sentence before every stage.
    """
    progress("reading records")
    train, validation = ([part for path in paths for part in read_files(
        [path], project.system, tables=project.reading.get(path, ()), median_filter=project.median_filter)]
                         for paths in (project.train, project.validation))
    return train, validation


def calibrated(project: Project, system: System, train: Sequence[Record], validation: Sequence[Record],
               progress: Progress = lambda stage: None, *, responses: Sequence[FrequencyResponse] = (),
               held_out: Sequence[FrequencyResponse] = ()) -> Calibrated:
    """Calibrate a system, and compare it with the records.

    Parameters
    ----------
    project : Project
        Options of the calibration, and tolerances.
    system : System
        System with nominal parameters, of the project or with effects added.
    train, validation : sequence of Record
        Fitted, and only compared.
    progress : callable, optional
        Called with a sentence before every stage.
    responses, held_out : sequence of FrequencyResponse
        Fitted together with `train`, and only compared.

    Raises
    ------
    InputError
        No parameter has a range; as `rt.calibrate`.
    """
    fit = None
    if train or responses:
        table = "[calibrate.parameters]"
        refuse_without_ranges(system, table, f"{table}, or in [fit] of the system file")
        data = [f"{sum(r.n_samples for r in train)} samples"] if train else []
        data += [f"{sum(map(len, responses))} bins"] if responses else []
        progress(f"calibrating {len(system.fit)} parameters on {' and '.join(data)}")
        fitted, compared = [*train, *responses], [*validation, *held_out]
        of_records: Any = {"initial": project.initial, "loss": project.loss} if train else {}
        of_records["max_iterations"] = project.max_iterations
        fit = calibrate(system, fitted, validation=compared or None, **of_records)
    progress("comparing model and data")
    comparisons = _comparisons(project, system, fit, train, validation)
    model = fit.system if fit else system
    return Calibrated(fit, model, comparisons, _misfits(comparisons, model, project.gate))


def _misfits(comparisons: Sequence[Comparison], system: System, gate: Gate) -> tuple[Misfit, ...]:
    found = []
    for one in comparisons:
        for name, e in one.residuals(one.calibrated).items():
            noise = system.sensors[name].noise or noise_of_readings(one.record[name])
            found.append(misfit(one.kind, one.record.name or "record", name, e, noise, gate.of(name, noise),
                                system.sensors[name].unit))
    return tuple(found)


def _diagnosis(project: Project, train: Sequence[Record], validation: Sequence[Record], progress: Progress
               ) -> Diagnosed | None:
    if not (project.diagnose and train):
        return None
    return diagnose_records(project.system, project.files, train, validation, progress,
                            session_gain=project.session_gain)


def doubted_claims(fit: Estimates | None, system: System, boxes: Boxes, progress: Progress = lambda stage: None
                   ) -> tuple[Doubted, ...]:
    """Parameters that the records leave open or that ended at a bound, and whether the claims hold on all of [fit].

    Parameters
    ----------
    fit : Estimates or None
        Calibration of the system; None if nothing was calibrated.
    system : System
        Calibrated system of the claims.
    boxes : Boxes
        Ranges of the claims.
    progress : callable, optional
        Called with a sentence before every stage.
    """
    if fit is None:
        return ()
    found = []
    for what, name, whole in doubted(fit):
        progress(f"certifying for the whole range of {name}")
        try:
            holds = claims_hold(system, boxes, whole)
        except InputError:  # a parameter that no certificate covers, or a range that is none
            holds = False
        found.append((what, name, holds))
    return tuple(found)


def _comparisons(project: Project, system: System, fit: Fit | None, train: Sequence[Record],
                 validation: Sequence[Record]) -> tuple[Comparison, ...]:
    """What the calibration computed, beside free runs of the nominal model."""
    noise = fit.noise if fit else {name: sensor.noise for name, sensor in system.sensors.items()}
    found = (*fit.residuals, *fit.validation_residuals) if fit else ()
    out = []
    for i, record in enumerate([*train, *validation]):
        nominal = free_run(system, as_data(system, record, "records")[0], project.initial, noise)
        before = _modelled(record, nominal.by_sensor)
        after = _modelled(record, found[i]) if found else before
        out.append(Comparison("train" if i < len(train) else "validation", record, before, after))
    return tuple(out)


def _modelled(record: Record, residuals: Mapping[str, Array]) -> Record:
    """A record with what the model reads, from its residuals."""
    return record.with_outputs(np.column_stack([record[name] - e for name, e in residuals.items()]), list(residuals))
