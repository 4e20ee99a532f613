"""The main job: data → calibrated model → certificates → verified."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from .._fitting import as_data, free_run, residual, rmse
from ..calibration import Fit, calibrate
from ..signals import Record, read_record
from ..thermal import System
from ._claims import Certification, certify_system
from ._schema import Project

Progress = Callable[[str], None]
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Comparison:
    """One record beside the nominal and the calibrated model, both run freely as the calibration runs them.

    The calibrated model starts from the initial temperatures that the calibration found (training) or estimated on the
    first tenth (validation); the nominal one from those estimated on the first tenth.

    Parameters
    ----------
    kind : str
        "train" or "validation".
    record : Record
        Measured.
    nominal, calibrated : Record
        The record with modelled readings in place of the measured ones.
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
        return {name: rmse([e]) for name, e in self.residuals(model).items()}

    def residuals(self, model: Record) -> dict[str, Array]:
        """Measured − modelled of every measured sensor.

        Parameters
        ----------
        model : Record
            One of the simulations, `nominal` or `calibrated`.

        Returns
        -------
        dict
            By sensor, (n,) [K].
        """
        return {name: residual(self.record[name], model[name]) for name in model.output_names}


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
    comparisons = _comparisons(project, fit, train, validation)
    return JobResult(project, fit, system, comparisons, certify_system(system, project.boxes, progress))


def _comparisons(project: Project, fit: Fit | None, train: Sequence[Record], validation: Sequence[Record]
                 ) -> tuple[Comparison, ...]:
    """What the calibration computed, beside free runs of the nominal model."""
    noise = fit.noise if fit else {name: sensor.noise for name, sensor in project.system.sensors.items()}
    found = (*fit.residuals, *fit.validation_residuals) if fit else ()
    out = []
    for i, record in enumerate([*train, *validation]):
        nominal = free_run(project.system, as_data(project.system, record, "records")[0], project.initial, noise)
        before = _modelled(record, nominal.by_sensor)
        after = _modelled(record, found[i]) if found else before
        out.append(Comparison("train" if i < len(train) else "validation", record, before, after))
    return tuple(out)


def _modelled(record: Record, residuals: Mapping[str, Array]) -> Record:
    """A record with what the model reads, from its residuals."""
    return record.with_outputs(np.column_stack([record[name] - e for name, e in residuals.items()]), list(residuals))
