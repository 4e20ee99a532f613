"""Calibration on a frequency response, weighted by its covariance. Evers (2.12)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from .._arrays import Floats
from ..errors import InputError
from ..fitting import Choice, OperatingPoint, chosen_ranges
from ..identify import FrequencyResponse
from ..thermal import System
from ._covariance import with_priors
from ._directions import in_words, named, weights
from ._estimates import Estimates, outcome_of
from ._outcomes import CalibrationCode
from ._response_bins import bins_of, independent_freedom, spread_of_score
from ._response_model import ResponseProblem


@dataclass(frozen=True, eq=False, kw_only=True)
class ResponseFit(Estimates):
    """Result of `calibrate` on a frequency response.

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
        Covariance of the estimates, in the order of `parameters`, from the covariance of the response, that between
        neighboring bins included. A direction the data leave open has the spread of its prior or of its bounds.
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
    response : FrequencyResponse
        What was fitted.
    bins : ndarray of int, shape (n_b,)
        Positions of the frequencies that were used: determined, not suspect.
    outputs, inputs : tuple of str
        Channels that were used.
    model : ndarray, shape (n_y, n_u, n_b)
        Response of the calibrated model at those frequencies and channels.
    misfit : float
        Mean squared distance in standard deviations [-]: near 1 if the model explains the response within its noise.
    """

    response: FrequencyResponse
    bins: NDArray[np.intp]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    model: NDArray[np.complex128]
    misfit: float

    def plot(self) -> NDArray[Any]:
        """Estimated response with its 95 % band, and the model on top.

        Returns
        -------
        ndarray of matplotlib.axes.Axes
            As `FrequencyResponse.plot`.
        """
        axes: NDArray[Any] = self.response.plot()
        grid = np.reshape(axes, (2 * len(self.response.output_names), len(self.response.input_names)))
        frequencies = self.response.frequencies[self.bins]
        for o, name in enumerate(self.outputs):
            row = 2 * self.response.output_names.index(name)
            for i, source in enumerate(self.inputs):
                place = grid[row, self.response.input_names.index(source)]
                place.plot(frequencies, np.abs(self.model[o, i]), "k--", linewidth=1.0, label="model")
        return axes

    def to_dict(self) -> dict[str, Any]:
        """Parameters and misfit, ready for JSON.

        Returns
        -------
        dict
        """
        return self._plain_table() | {"misfit": self.misfit, "n_frequencies": int(self.bins.size)}

    def __str__(self) -> str:
        return "\n".join([*self._lines(), f"{self.bins.size} frequencies, misfit {self.misfit:.3g} (1 is noise alone)",
                          str(self.outcome)])


def calibrate_response(system: System, response: FrequencyResponse, parameters: Choice,
                       operating_point: Mapping[str, float], max_iterations: int) -> ResponseFit:
    """Fit the linearization of a system to a frequency response."""
    ranges = chosen_ranges(system, parameters)
    problem = ResponseProblem(system, response, bins_of(system, response), ranges,
                              OperatingPoint(operating_point))
    _refuse(problem)
    start = ranges.coordinates(ranges.start)
    bounds = ranges.coordinates(ranges.lower), ranges.coordinates(ranges.upper)
    run = least_squares(problem.vector, start, problem.jacobian, bounds=bounds, x_scale="jac",
                        max_nfev=max_iterations, ftol=1e-9, xtol=1e-9, gtol=1e-9)
    return _result(problem, run.x, run.status > 0, int(run.nfev))


def _result(problem: ResponseProblem, q: Floats, converged: bool, iterations: int) -> ResponseFit:
    ranges, G, bins = problem.ranges, problem.response, problem.bins
    values, J, z = ranges.values(q), problem.slopes(q), problem.whitened(q)
    H = 2.0 * np.einsum("kap,kaq->pq", J.conj(), J).real
    slopes, freedom = ranges.slopes(values), G.degrees_of_freedom[bins.index].astype(float)
    # E zᴴz = m q/(q - n_y) with a covariance that is estimated with q degrees of freedom
    misfit = float(np.mean(np.abs(z) ** 2 * ((freedom - len(G.output_names)) / freedom)[:, None]))
    known = with_priors(ranges, values, H, spread_of_score(G, bins, J), independent_freedom(G, bins), max(misfit, 1.0))
    fit = ResponseFit(
        system=problem.system_at(q),
        parameters=dict(zip(ranges.names, values.tolist(), strict=True)),
        start=dict(zip(ranges.names, ranges.start.tolist(), strict=True)),
        lower=ranges.lower, upper=ranges.upper, sigma=ranges.sigma, at_bound=ranges.at_bound(values),
        covariance=known.covariance * np.outer(slopes, slopes),
        undetermined=in_words(ranges, known.undetermined),
        undetermined_parameters=named(ranges, known.undetermined), bounded=weights(ranges, known.bounded),
        logarithmic=ranges.logarithmic, degrees_of_freedom=known.degrees_of_freedom, covariance_scale=known.scale,
        iterations=iterations, outcome=CalibrationCode.CONVERGED.outcome(),
        response=G, bins=bins.index, outputs=bins.outputs, inputs=bins.inputs,
        model=problem.model(q).reshape(-1, len(bins.inputs), len(bins.outputs)).transpose(2, 1, 0),
        misfit=misfit,
    )
    return replace(fit, outcome=outcome_of(fit, converged))


def _refuse(problem: ResponseProblem) -> None:
    """Fewer numbers than unknowns; a parameter that the response does not feel."""
    names = problem.ranges.names
    if 2 * problem.bins.measured.size <= len(names):
        raise InputError(f"{problem.bins.measured.size} complex numbers for {len(names)} unknowns",
                         where="argument data", remedy="Use more frequencies, or calibrate fewer parameters.")
    slopes = problem.slopes(problem.ranges.coordinates(problem.ranges.start))
    reach = np.abs(slopes).max(axis=(0, 1)) * problem.ranges.spread
    idle = np.flatnonzero(reach < 1e-9)
    if idle.size:
        raise InputError(f"{names[idle[0]]!r} has no influence on the frequency response", where="argument data",
                         expected="parameters that change the linearization (offsets and temperatures may not)",
                         remedy="Take it out of the parameters.")
