"""The least-squares problem on a frequency response: the linearized model against it, weighted by its covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._arrays import Complex, Floats
from ..errors import Diverged
from ..fitting import OperatingPoint, Ranges, residual, sampled_response
from ..identify import FrequencyResponse
from ..thermal import System

_DIFFERENCE = 1e-4  # step of the central differences, in `Ranges.spread`; their error is the square of it


@dataclass(frozen=True)
class Bins:
    """The part of a frequency response that is fitted.

    Parameters
    ----------
    index : ndarray of int, shape (n_b,)
        Positions in the response's frequencies.
    channels : ndarray of int, shape (m,)
        Entries of vec G, columns stacked, that the model has.
    outputs, inputs : tuple of str
        Names of what they are.
    measured : ndarray, shape (n_b, m)
        Measured vec G at the bins.
    root : ndarray, shape (n_b, m, m)
        L⁻¹ with covariance = L Lᴴ.
    """

    index: NDArray[np.intp]
    channels: NDArray[np.intp]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    measured: Complex
    root: Complex


@dataclass
class ResponseProblem:
    """Weighted misfit (2.12) of the model, in the coordinates of the parameters.

    Parameters
    ----------
    system : System
        System whose parameters are estimated.
    response : FrequencyResponse
        Measured frequency response.
    bins : Bins
        What of it is fitted.
    ranges : Ranges
        Parameters to estimate.
    operating_point : OperatingPoint
        Where the model is linearized.
    """

    system: System
    response: FrequencyResponse
    bins: Bins
    ranges: Ranges
    operating_point: OperatingPoint

    def system_at(self, q: Floats) -> System:
        """System at some coordinates."""
        return self.system.with_parameters(self.ranges.assigned(self.ranges.values(q)))

    def model(self, q: Floats) -> Complex:
        """vec G of the model at the bins, (n_b, m)."""
        frequencies = self.response.frequencies[self.bins.index]
        G = sampled_response(self.system_at(q), frequencies, self.response.sample_time, self.operating_point,
                             self.bins.outputs, self.bins.inputs)
        return G.transpose(0, 2, 1).reshape(len(frequencies), -1)  # columns of G stacked

    def whitened(self, q: Floats) -> Complex:
        """L⁻¹ (measured − modelled), (n_b, m)."""
        white: Complex = np.einsum("kab,kb->ka", self.bins.root, residual(self.bins.measured, self.model(q)))
        return white

    def slopes(self, q: Floats) -> Complex:
        """Derivative of `whitened` by central differences, (n_b, m, p); one-sided at a bound."""
        low, high = self.ranges.coordinates(self.ranges.lower), self.ranges.coordinates(self.ranges.upper)
        out = np.empty((*self.bins.measured.shape, q.size), np.complex128)
        for i, h in enumerate(_DIFFERENCE * self.ranges.spread):
            after, before = q.copy(), q.copy()
            after[i], before[i] = min(q[i] + h, high[i]), max(q[i] - h, low[i])
            change = self.model(before) - self.model(after)  # of minus the model
            out[..., i] = np.einsum("kab,kb->ka", self.bins.root, change) / (after[i] - before[i])
        return out

    def vector(self, q: Floats) -> Floats:
        """Real residuals, whose half sum of squares is minus the log-likelihood, then the priors."""
        prior = self.ranges.prior(self.ranges.values(q))
        try:
            return np.concatenate([_real(self.whitened(q)), prior])
        except Diverged:  # no steady state: a rejected step
            return np.full(2 * self.bins.measured.size + prior.size, np.inf)

    def jacobian(self, q: Floats) -> Floats:
        """Derivative of `vector`."""
        known = np.isfinite(self.ranges.sigma)
        prior = np.diag(self.ranges.prior_slopes(self.ranges.values(q)))[known]
        slopes = self.slopes(q)
        data = np.column_stack([_real(slopes[..., i]) for i in range(q.size)])
        return np.concatenate([data, prior])


def _real(z: Complex) -> Floats:
    """Circular complex noise of unit variance has real and imaginary parts of variance one half."""
    flat = np.sqrt(2.0) * z.ravel()
    return np.concatenate([flat.real, flat.imag])
