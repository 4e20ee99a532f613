"""Fit: what a calibration found, and how much of it to believe."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from .._arrays import Complex, Floats
from .._html import short_table
from ..export import plain
from ..fitting import rmse_by_sensor
from ..signals import Record
from ..thermal import parameter_label
from ._estimates import Estimates
from ._figure import draw
from ._response_comparison import ResponseComparison
from ._score import Score
from ._whiteness import Whiteness


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit(Estimates):
    """Result of `calibrate`, on records, frequency responses or both.

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
        Covariance of the estimates, in the order of `parameters`, initial temperatures marginalized, residuals taken as
        correlated in time. A direction the data leave open has the spread of its prior or of its bounds.
    undetermined : tuple of str
        Directions the data do not determine, in words.
    undetermined_parameters : tuple of str
        Parameters with weight in such a direction, by name.
    bounded : ndarray of bool, shape (p,)
        Those of them that no prior determines either: their range is their bounds.
    logarithmic : ndarray of bool, shape (p,)
        Parameters that are estimated by their logarithm, in which their range is symmetric.
    degrees_of_freedom : float
        Of the estimated noise: how many independent samples it was estimated from, less those the fit has used.
    covariance_scale : float
        Factor on `covariance` in `ranges`, at least 1: residuals larger or more correlated than `covariance` accounts
        for.
    iterations : int
        Model evaluations the optimizer tried.
    outcome : Outcome
        Codes "converged", "at_bound", "undetermined" (not ok), "not_converged" (not ok).
    other_optima : tuple of ndarray, shape (p,)
        Other values of all parameters that explain the data as well; `ranges` hold these too.
    remarks : tuple of str
        What was taken for granted about the records, a sentence or three each: an ambient that they do not hold, when
        their means were taken.
    noise : dict
        Standard deviation every sensor was weighted with [K or V].
    data, validation_data : tuple of Record
        What was fitted, and what was only compared.
    residuals, validation_residuals : tuple of dict
        Measured − modelled, per record and sensor, (n,) [K or V], free run.
    initial_temperatures, validation_temperatures : tuple of dict
        Per record and lump [K].
    train, validation : tuple of Score
        One per record.
    whiteness : dict
        `Whiteness` of the residuals by sensor.
    responses, validation_responses : tuple of ResponseComparison
        Frequency responses beside the model: fitted, and only compared.
    """

    noise: dict[str, float]
    data: tuple[Record, ...]
    validation_data: tuple[Record, ...]
    residuals: tuple[dict[str, Floats], ...]
    validation_residuals: tuple[dict[str, Floats], ...]
    initial_temperatures: tuple[dict[str, float], ...]
    validation_temperatures: tuple[dict[str, float], ...]
    train: tuple[Score, ...]
    validation: tuple[Score, ...]
    whiteness: dict[str, Whiteness]
    responses: tuple[ResponseComparison, ...]
    validation_responses: tuple[ResponseComparison, ...]

    @property
    def rmse(self) -> dict[str, float]:
        """Free-run root mean square residual by sensor over all training records [K or V]."""
        return rmse_by_sensor(self.residuals)

    @property
    def validation_rmse(self) -> dict[str, float]:
        """Free-run root mean square residual by sensor over all validation records [K or V]; empty without any."""
        return rmse_by_sensor(self.validation_residuals)

    @property
    def response_residuals(self) -> tuple[Complex, ...]:
        """Measured − modelled of every fitted response, (n_y, n_u, n_b) [output unit / input unit]."""
        return tuple(one.residuals for one in self.responses)

    @property
    def misfit(self) -> float:
        """Largest misfit of the fitted responses, near 1 if the model explains them [-]; nan without any."""
        return max((one.misfit for one in self.responses), default=float("nan"))

    def plot(self) -> NDArray[Any]:
        """Measured and modelled readings [°C] with the residuals [K] below, one column per record.

        Returns
        -------
        ndarray of matplotlib.axes.Axes, shape (2, n_records), or (4, n_records) with voltages
            Training records first, then validation; voltages [V] and their residuals stand below the temperatures.
            Without records: as the first response's own `plot`.
        """
        if not self.data and not self.validation_data:
            return self.responses[0].plot()
        fitted = zip(self.data, self.residuals, self.train, strict=True)
        held_out = zip(self.validation_data, self.validation_residuals, self.validation, strict=True)
        return draw([*fitted, *held_out], len(self.data), self.system.sensor_units)

    def to_dict(self) -> dict[str, Any]:
        """Everything but signals, ready for JSON: no infinities, no arrays.

        Returns
        -------
        dict
        """
        return self._plain_table() | {
            "noise": self.noise,
            "initial_temperatures": list(self.initial_temperatures),
            "train": [_score(score) for score in self.train],
            "validation": [_score(score) for score in self.validation],
            "whiteness": {name: vars(test) for name, test in self.whiteness.items()},
            "responses": [one.to_dict() for one in self.responses],
            "validation_responses": [one.to_dict() for one in self.validation_responses],
        }

    def _repr_html_(self) -> str:
        units, deviations = self.system.sensor_units, self.std
        rows = [(parameter_label(name), f"{value:.6g} ± {deviations[name]:.2g}")
                for name, value in self.parameters.items()]
        for kind, scores in (("fitted", self.train), ("validation", self.validation)):
            rows += [(f"RMSE, {kind} {one.record}", ", ".join(f"{name} {e:.3g} {units.get(name, 'K')}"
                                                              for name, e in one.rmse.items())) for one in scores]
        return short_table("Calibration: parameter, value ± standard deviation", rows,
                           " ".join([*self.remarks, str(self.outcome)]))

    def __str__(self) -> str:
        lines, units = self._lines(), self.system.sensor_units
        for kind, scores in (("fitted", self.train), ("validation", self.validation)):
            for one in scores:
                said = (f"{name} {e:.3g} {units.get(name, 'K')}" for name, e in one.rmse.items())
                lines.append(f"{kind} {one.record}: " + ", ".join(said))
        for kind, found in (("fitted", self.responses), ("validation", self.validation_responses)):
            lines += [f"{kind} response {one}" for one in found]
        return "\n".join([*lines, *self.remarks, str(self.outcome)])


def _score(score: Score) -> dict[str, Any]:
    return {"record": score.record, "rmse": score.rmse,
            "fit_percent": {name: plain(value) for name, value in score.fit_percent.items()}}
