"""The main job: data → calibrated model → certificates → verified."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from ..calibration import Fit, calibrate
from ..signals import Record, read_record
from ..thermal import System, simulate
from ._claims import Certification, certify_system
from ._schema import Project

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Comparison:
    """One record beside the nominal and the calibrated model, free-running from the first readings.

    Parameters
    ----------
    kind : str
        "train" or "validation".
    record : Record
        Measured.
    nominal, calibrated : Record
        Simulated with the record's inputs.
    """

    kind: str
    record: Record
    nominal: Record
    calibrated: Record

    def rmse(self, model: Record) -> dict[str, float]:
        """Root-mean-square residual of every measured sensor.

        Parameters
        ----------
        model : Record
            One of the simulations, `nominal` or `calibrated`.

        Returns
        -------
        dict
            By sensor [K].
        """
        return {name: float(np.sqrt(np.mean((self.record[name] - model[name]) ** 2)))
                for name in self.record.output_names}


@dataclass(frozen=True)
class JobResult:
    """Everything the main job found.

    Parameters
    ----------
    project : Project
        What was asked.
    fit : Fit or None
        Calibration; None without training records.
    system : System
        Calibrated, or nominal.
    comparisons : tuple of Comparison
        Model against data.
    certification : Certification
        Claims and verdicts.
    """

    project: Project
    fit: Fit | None
    system: System
    comparisons: tuple[Comparison, ...]
    certification: Certification

    @property
    def holds(self) -> bool:
        """Whether every required claim holds and is verified."""
        return self.certification.holds


@threadpool_limits.wrap(limits=1, user_api="blas")  # products are small: threads only wait for each other
def run_job(project: Project, progress: Progress = lambda stage: None) -> JobResult:
    """Run the main job of a project.

    Parameters
    ----------
    project : Project
        From `read_project`.
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
    >>> demo = rt.project.read_project(rt.project.demo_project())
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 50.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}])
    >>> result = rt.project.run_job(replace(demo, system=bar, train=(), validation=(), boxes=rt.project.Boxes()))
    >>> result.holds
    True
    """
    progress("reading records")
    train, validation = ([read_record(path, project.system, median_filter=project.median_filter) for path in paths]
                         for paths in (project.train, project.validation))
    fit, system = None, project.system
    if train:
        progress(f"calibrating {len(project.system.fit)} parameters on {sum(r.n_samples for r in train)} samples")
        fit = calibrate(project.system, train, validation=validation or None, initial=project.initial,
                        loss=project.loss)
        system = fit.system
    progress("comparing model and data")
    comparisons = tuple(Comparison(kind, record, simulate(project.system, record), simulate(system, record))
                        for kind, records in (("train", train), ("validation", validation)) for record in records)
    return JobResult(project, fit, system, comparisons, certify_system(system, project.boxes, progress))
