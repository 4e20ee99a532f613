"""Fit: what a calibration found, and how much of it to believe."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..errors import Outcome
from ..signals import Record
from ..thermal import System
from ._figure import draw
from ._score import Score
from ._whiteness import Whiteness

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of `calibrate`.

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
    noise : dict
        Standard deviation every sensor was weighted with [K].
    data, validation_data : tuple of Record
        What was fitted, and what was only compared.
    residuals, validation_residuals : tuple of dict
        Model minus measurement, per record and sensor, (n,) [K], free run.
    initial_temperatures, validation_temperatures : tuple of dict
        Per record and lump [K].
    train, validation : tuple of Score
        One per record.
    whiteness : dict
        `Whiteness` of the residuals by sensor.
    iterations : int
        Simulations the optimiser tried.
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
    noise: dict[str, float]
    data: tuple[Record, ...]
    validation_data: tuple[Record, ...]
    residuals: tuple[dict[str, Array], ...]
    validation_residuals: tuple[dict[str, Array], ...]
    initial_temperatures: tuple[dict[str, float], ...]
    validation_temperatures: tuple[dict[str, float], ...]
    train: tuple[Score, ...]
    validation: tuple[Score, ...]
    whiteness: dict[str, Whiteness]
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

    @property
    def rmse(self) -> dict[str, float]:
        """Free-run root mean square residual by sensor over all training records [K]."""
        return _pooled(self.residuals)

    @property
    def validation_rmse(self) -> dict[str, float]:
        """Free-run root mean square residual by sensor over all validation records [K]; empty without any."""
        return _pooled(self.validation_residuals)

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

    def plot(self) -> NDArray[Any]:
        """Measured and modelled readings [°C] with the residuals [K] below, one column per record.

        Returns
        -------
        ndarray of matplotlib.axes.Axes, shape (2, n_records)
            Training records first, then validation.
        """
        fitted = zip(self.data, self.residuals, self.train, strict=True)
        unseen = zip(self.validation_data, self.validation_residuals, self.validation, strict=True)
        return draw([*fitted, *unseen], len(self.data))

    def to_dict(self) -> dict[str, Any]:
        """Everything but signals, ready for JSON: no infinities, no arrays.

        Returns
        -------
        dict
        """
        table = self.table()
        return {
            "parameters": {name: {key: _plain(row[key]) for key in table.columns} for name, row in table.iterrows()},
            "covariance": self.covariance.tolist(),
            "undetermined": list(self.undetermined),
            "noise": self.noise,
            "initial_temperatures": list(self.initial_temperatures),
            "train": [_score(score) for score in self.train],
            "validation": [_score(score) for score in self.validation],
            "whiteness": {name: vars(test) for name, test in self.whiteness.items()},
            "iterations": self.iterations,
            "outcome": vars(self.outcome),
        }

    def __str__(self) -> str:
        wide = max((len(name) for name in self.parameters), default=9)
        lines = [f"{'parameter':<{wide}}  {'value':>12}  {'std':>9}"]
        for (name, value), std, at in zip(self.parameters.items(), self.std.values(), self.at_bound, strict=True):
            lines.append(f"{name:<{wide}}  {value:>12.6g}  {std:>9.2g}{'  at bound' if at else ''}")
        for kind, scores in (("fitted", self.train), ("validation", self.validation)):
            for one in scores:
                lines.append(f"{kind} {one.record}: " + ", ".join(f"{name} {e:.3g} K" for name, e in one.rmse.items()))
        return "\n".join([*lines, str(self.outcome)])


def _pooled(residuals: tuple[dict[str, Array], ...]) -> dict[str, float]:
    names = dict.fromkeys(name for record in residuals for name in record)
    joined = {name: np.concatenate([record[name] for record in residuals if name in record]) for name in names}
    return {name: math.sqrt(float(np.mean(e**2))) for name, e in joined.items()}


def _plain(value: Any) -> float | bool | None:
    if isinstance(value, bool | np.bool_):
        return bool(value)
    return float(value) if math.isfinite(value) else None


def _score(score: Score) -> dict[str, Any]:
    return {"record": score.record, "rmse": score.rmse,
            "fit_percent": {name: _plain(value) for name, value in score.fit_percent.items()}}
