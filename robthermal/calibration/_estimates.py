"""Estimates: what every calibration finds, whatever the data were."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..errors import Outcome
from ..thermal import System

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Estimates:
    """Parameters with their uncertainty.

    Parameters
    ----------
    system : System
        With the estimated parameters.
    parameters, start : dict
        Estimates and starting values by name, in the unit of each parameter.
    lower, upper, sigma : ndarray, shape (p,)
        Bounds, and prior standard deviations (infinite: no prior).
    at_bound : ndarray of bool, shape (p,)
        Estimates that ran into a bound; their standard deviation ignores it.
    covariance : ndarray, shape (p, p)
        Covariance of the estimates, in the order of `parameters`, initial temperatures marginalised, residuals taken as
        correlated in time. A direction the data leave open has the spread of its prior or of its bounds.
    undetermined : tuple of str
        Directions the data do not determine, in words.
    iterations : int
        Model evaluations the optimiser tried.
    outcome : Outcome
        Codes "converged", "at_bound", "undetermined" (not ok), "not_converged" (not ok).
    """

    system: System
    parameters: dict[str, float]
    start: dict[str, float]
    lower: Array
    upper: Array
    sigma: Array
    at_bound: NDArray[np.bool_]
    covariance: Array
    undetermined: tuple[str, ...]
    iterations: int
    outcome: Outcome

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation of every estimate, in its unit."""
        return dict(zip(self.parameters, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlation(self) -> Array:
        """Correlation of the estimates, (p, p) [-]."""
        deviation = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(deviation, deviation)

    def table(self) -> pd.DataFrame:
        """Estimates as a table.

        Returns
        -------
        pandas.DataFrame
            Index: parameter. Columns: value, std, start, lower, upper, prior (its standard deviation), at_bound.
        """
        columns = {"value": list(self.parameters.values()), "std": list(self.std.values()),
                   "start": list(self.start.values()), "lower": self.lower, "upper": self.upper,
                   "prior": np.where(np.isfinite(self.sigma), self.sigma, np.nan), "at_bound": self.at_bound}
        return pd.DataFrame(columns, index=pd.Index(self.parameters, name="parameter"))

    def _lines(self) -> list[str]:
        wide = max((len(name) for name in self.parameters), default=9)
        lines = [f"{'parameter':<{wide}}  {'value':>12}  {'std':>9}"]
        for (name, value), std, at in zip(self.parameters.items(), self.std.values(), self.at_bound, strict=True):
            lines.append(f"{name:<{wide}}  {value:>12.6g}  {std:>9.2g}{'  at bound' if at else ''}")
        return lines

    def _plain_table(self) -> dict[str, Any]:
        """What `to_dict` says of the parameters."""
        table = self.table()
        return {
            "parameters": {name: {key: plain(row[key]) for key in table.columns} for name, row in table.iterrows()},
            "covariance": self.covariance.tolist(),
            "undetermined": list(self.undetermined),
            "iterations": self.iterations,
            "outcome": vars(self.outcome),
        }


def plain(value: Any) -> float | bool | None:
    """A number ready for JSON."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    return float(value) if math.isfinite(value) else None


def outcome_of(fit: Estimates, converged: bool) -> Outcome:
    """What to say of an estimate, and what to do."""
    if not converged:
        return Outcome(False, "not_converged", f"Stopped after {fit.iterations} iterations without converging. "
                       "Raise max_iterations, start closer, or calibrate fewer parameters.")
    if fit.undetermined:
        return Outcome(False, "undetermined", f"Converged, but the data leave open: {'; '.join(fit.undetermined)}. "
                       "Fix one of these parameters, give it a prior (sigma), or excite the system differently.")
    stuck = [name for name, at in zip(fit.parameters, fit.at_bound, strict=True) if at]
    if stuck:
        return Outcome(True, "at_bound", f"Converged with {', '.join(stuck)} at a bound; standard deviations there "
                       "ignore the bound. Widen it if the physics allow, else doubt the structure of the model.")
    return Outcome(True, "converged", f"Converged in {fit.iterations} iterations.")
