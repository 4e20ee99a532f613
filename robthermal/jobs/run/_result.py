"""What the main job found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..._residual import residual
from ...calibration import Fit
from ...fitting import rmse
from ...report import Reason, Verdict
from ...signals import Record
from ...thermal import System
from ..claims import Certification
from ..diagnose import Diagnosed
from ..request import Project
from ._misfit import Misfit

Array = NDArray[np.float64]
Doubted = tuple[str, str, bool]  # why, parameter, whether the required claims hold on its whole [fit] range


@dataclass(frozen=True)
class Comparison:
    """One record beside the nominal and the calibrated model, both run freely as the calibration runs them.

    The calibrated model starts from the initial temperatures that the calibration found (training) or estimated on the
    first tenth (validation; on all of the record where that leaves them open); the nominal one from such estimates.

    Parameters
    ----------
    kind : str
        "train" or "validation".
    record : Record
        Measured record that both models follow.
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
class Calibrated:
    """A model, calibrated where there are data, beside the records.

    Parameters
    ----------
    fit : Fit or None
        Calibration; None without training data.
    system : System
        Calibrated, or nominal.
    comparisons : tuple of Comparison
        Model against data.
    misfits : tuple of Misfit
        How far the model is from every reading.
    """

    fit: Fit | None
    system: System
    comparisons: tuple[Comparison, ...]
    misfits: tuple[Misfit, ...]


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
    misfits : tuple of Misfit
        How far the model is from every reading.
    diagnosis : Diagnosed or None
        What the model lacks, where the project asks.
    doubted : tuple
        (why, parameter, whether the required claims hold on its whole [fit] range) for every parameter the records do
        not determine ("undetermined") or that ended at a bound ("bound").
    ranges : dict or None
        Ranges of the calibrated parameters; None if nothing was calibrated.
    reasons : tuple of Reason
        Reasons of the verdict beside those of the claims.
    """

    project: Project
    fit: Fit | None
    system: System
    comparisons: tuple[Comparison, ...]
    certification: Certification
    misfits: tuple[Misfit, ...] = ()
    diagnosis: Diagnosed | None = None
    doubted: tuple[Doubted, ...] = ()
    ranges: Mapping[str, tuple[float, float]] | None = None
    reasons: tuple[Reason, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether the verdict is not FAIL."""
        return self.certification.holds and not any(one.level == "fail" for one in self.reasons)

    @property
    def verdict(self) -> Verdict:
        """PASS, PASS WITH REMARKS or FAIL."""
        return "FAIL" if not self.holds else "PASS WITH REMARKS" if self.reasons else "PASS"
