"""Estimates: what every calibration finds, whatever the data were."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from .._pandas import pd
from ..errors import InputError, Outcome
from ..export import plain
from ..thermal import System, parameter_label
from ._outcomes import CalibrationCode
from ._parameter_ranges import Set, check_request, factor


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
        Covariance of the estimates, in the order of `parameters`. A direction the data leave open has the spread of its
        prior or of its bounds.
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
    """

    system: System
    parameters: dict[str, float]
    start: dict[str, float]
    lower: Floats
    upper: Floats
    sigma: Floats
    at_bound: NDArray[np.bool_]
    covariance: Floats
    undetermined: tuple[str, ...]
    undetermined_parameters: tuple[str, ...]
    bounded: NDArray[np.bool_]
    logarithmic: NDArray[np.bool_]
    degrees_of_freedom: float
    covariance_scale: float
    iterations: int
    outcome: Outcome
    remarks: tuple[str, ...] = ()
    other_optima: tuple[Floats, ...] = ()

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation of every estimate, in its unit."""
        return dict(zip(self.parameters, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlation(self) -> Floats:
        """Correlation of the estimates, (p, p) [-]."""
        deviation = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(deviation, deviation)

    def ranges(self, confidence: float = 0.95, set: Set = "ellipsoid") -> dict[str, tuple[float, float]]:
        """Simultaneous ranges: all true values are inside at once with a probability of at least `confidence`.

        For estimates of a model whose structure is right, and true values within the bounds of the calibration; the
        covariance is taken times `covariance_scale`. May be passed as `parameters=` to the certify functions.

        Parameters
        ----------
        confidence : float
            Probability that all ranges hold, for example 0.95.
        set : {"ellipsoid", "box"}
            Box around the joint confidence ellipsoid; or the smaller box of simultaneous intervals (Bonferroni).

        Returns
        -------
        dict
            {parameter: (lower, upper)} in the unit of each; tied parameters one by one. What neither data nor prior
            determine has the bounds of the calibration. Ranges end at those bounds. Where the data are explained as
            well elsewhere (`other_optima`) they reach from one optimum to the other.

        Raises
        ------
        InputError
            A calibration that did not converge; an impossible confidence; an unknown set.

        Notes
        -----
        Seber and Wild, *Nonlinear Regression*, 1989, section 5.1; derivation in the documentation, "Calibration".
        """
        ends = zip(self.parameters, *self._ends(confidence, set), strict=True)
        return {own: (float(low), float(high)) for name, low, high in ends for own in name.split(" = ")}

    def _ends(self, confidence: float, shape: str) -> tuple[Floats, Floats]:
        """Lower and upper ends (p,) of the ranges, in the unit of each parameter.

        In the coordinates q of the optimizer (logarithms of positive parameters) the ends are q̂ ± c s, s the standard
        deviation, which leaves positive parameters positive; then cut at the bounds. Parameters that neither data nor
        prior determine have their bounds.
        """
        check_request(confidence, shape)
        self._expect_covariance()
        values = np.array(list(self.parameters.values()))
        slopes = np.where(self.logarithmic, values, 1.0)
        reach = factor(shape, int(np.sum(~self.bounded)), self.degrees_of_freedom, confidence) * np.sqrt(
            np.diag(self.covariance) * self.covariance_scale) / slopes
        with np.errstate(over="ignore"):  # beyond every bound, at which it is cut
            low, high = (np.where(self.logarithmic, values * np.exp(np.where(self.logarithmic, side, 0.0)),
                                  values + side) for side in (-reach, reach))
        centers = [values, *self.other_optima]  # as wide at each, in the same coordinates
        low, high = (choose([np.where(self.logarithmic, end * other / np.where(self.logarithmic, values, 1.0),
                                      end + other - values) for other in centers], axis=0)
                     for choose, end in ((np.min, low), (np.max, high)))
        low, high = np.clip(low, self.lower, self.upper), np.clip(high, self.lower, self.upper)
        return np.where(self.bounded, self.lower, low), np.where(self.bounded, self.upper, high)

    def _expect_covariance(self) -> None:
        if self.outcome.code == CalibrationCode.NOT_CONVERGED.code:
            raise InputError("the calibration did not converge: its covariance is that of no estimate",
                             where="fit.ranges",
                             remedy=f"{self.outcome.text} Or give the certificate parameters= yourself.")
        if not np.isfinite(self.covariance).all():
            raise InputError("the calibration has no covariance", where="fit.ranges",
                             remedy="Calibrate with data, or give parameters=.")

    def range_table(self, confidence: float = 0.95) -> pd.DataFrame:
        """Estimates with their simultaneous ranges ("ellipsoid"), for reports.

        Parameters
        ----------
        confidence : float
            Probability that all ranges hold, for example 0.95.

        Returns
        -------
        pandas.DataFrame
            Index: parameter. Columns: value, std, low, high, determined (by the data), ends_at ("" or which bound).
        """
        low, high = self._ends(confidence, "ellipsoid")
        at = np.array([["", "upper bound"], ["lower bound", "both bounds"]])
        columns = {"value": list(self.parameters.values()), "std": list(self.std.values()), "low": low, "high": high,
                   "determined": [name not in self.undetermined_parameters for name in self.parameters],
                   "ends_at": at[(low <= self.lower).astype(int), (high >= self.upper).astype(int)]}
        return pd.DataFrame(columns, index=pd.Index(self.parameters, name="parameter"))

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
        lines = [f"{'parameter':<{wide}}  {'value':>12}  {'std':>9}  quantity"]
        for (name, value), std, at in zip(self.parameters.items(), self.std.values(), self.at_bound, strict=True):
            quantity = parameter_label(name) + ("  at bound" if at else "")
            lines.append(f"{name:<{wide}}  {value:>12.6g}  {std:>9.2g}  {quantity}")
        return lines

    def _plain_table(self) -> dict[str, Any]:
        """What `to_dict` says of the parameters."""
        table = self.table()
        return {
            "parameters": {name: {key: plain(row[key]) for key in table.columns} for name, row in table.iterrows()},
            "logarithmic": dict(zip(self.parameters, self.logarithmic.tolist(), strict=True)),
            "bounded": dict(zip(self.parameters, self.bounded.tolist(), strict=True)),
            "covariance": self.covariance.tolist() if np.isfinite(self.covariance).all() else None,
            "covariance_scale": plain(self.covariance_scale),
            "degrees_of_freedom": plain(self.degrees_of_freedom),
            "undetermined": list(self.undetermined),
            "undetermined_parameters": list(self.undetermined_parameters),
            "ranges": None if self.outcome.code == CalibrationCode.NOT_CONVERGED.code else {
                name: list(ends) for name, ends in self.ranges().items()},
            "iterations": self.iterations,
            "outcome": vars(self.outcome),
            "remarks": list(self.remarks),
        }


def _of_priors(fit: Estimates) -> str | None:
    """What to do about parameters that the data leave open, some of which have a prior; None where none has."""
    given = {name for name, sigma in zip(fit.parameters, fit.sigma, strict=True) if np.isfinite(sigma)}
    without = [name for name in fit.undetermined_parameters if name not in given]
    if not given.intersection(fit.undetermined_parameters):
        return None
    if not without:
        return ("Each of these parameters has a prior (sigma), and its prior decides it: see that it is right, fix the "
                "parameter, or excite the system differently.")
    names = " or ".join([*filter(None, [", ".join(without[:-1])]), without[-1]])
    return (f"Fix one of these parameters, give {names} a prior (sigma), or excite the system differently. Each of the "
            "others has a prior, and its prior decides it.")


def outcome_of(fit: Estimates, converged: bool) -> Outcome:
    """What to say of an estimate, and what to do."""
    if not converged:
        return CalibrationCode.NOT_CONVERGED.outcome(f"Stopped after {fit.iterations} iterations without converging.")
    if fit.undetermined:
        return CalibrationCode.UNDETERMINED.outcome(
            f"Converged, but the data leave open: {'; '.join(fit.undetermined)}.", remedy=_of_priors(fit))
    stuck = [name for name, at in zip(fit.parameters, fit.at_bound, strict=True) if at]
    if stuck:
        return CalibrationCode.AT_BOUND.outcome(
            f"Converged with {', '.join(stuck)} at a bound; standard deviations there ignore the bound.")
    return CalibrationCode.CONVERGED.outcome(f"Converged in {fit.iterations} iterations.")
