"""The least-squares problem on a frequency response: the linearised model against it, weighted by its covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ..errors import Diverged
from ..identify import FrequencyResponse
from ..thermal import System, linearize
from ._operating_point import OperatingPoint
from ._ranges import Ranges

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
_DIFFERENCE = 1e-4  # step of the central differences, in `Ranges.spread`; their error is the square of it
_CHUNK = 1000  # bins at once
_ROUNDING = 1e-9  # of a sample: less of a delay is none


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
        vec G.
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
        Whose parameters.
    response : FrequencyResponse
        Estimated.
    bins : Bins
        What of it is fitted.
    ranges : Ranges
        Parameters to estimate.
    operating_point : OperatingPoint
        Where the model is linearised.
    """

    system: System
    response: FrequencyResponse
    bins: Bins
    ranges: Ranges
    operating_point: OperatingPoint

    def system_at(self, q: Array) -> System:
        """System at some coordinates."""
        return self.system.with_parameters(self.ranges.assigned(self.ranges.values(q)))

    def model(self, q: Array) -> Complex:
        """vec G of the model at the bins, (n_b, m)."""
        frequencies = self.response.frequencies[self.bins.index]
        G = sampled_response(self.system_at(q), frequencies, self.response.sample_time, self.operating_point,
                             self.bins.outputs, self.bins.inputs)
        return G.transpose(0, 2, 1).reshape(len(frequencies), -1)  # columns of G stacked

    def whitened(self, q: Array) -> Complex:
        """L⁻¹ (model - measured), (n_b, m)."""
        white: Complex = np.einsum("kab,kb->ka", self.bins.root, self.model(q) - self.bins.measured)
        return white

    def slopes(self, q: Array) -> Complex:
        """Derivative of `whitened` by central differences, (n_b, m, p); one-sided at a bound."""
        low, high = self.ranges.coordinates(self.ranges.lower), self.ranges.coordinates(self.ranges.upper)
        out = np.empty((*self.bins.measured.shape, q.size), np.complex128)
        for i, h in enumerate(_DIFFERENCE * self.ranges.spread):
            after, before = q.copy(), q.copy()
            after[i], before[i] = min(q[i] + h, high[i]), max(q[i] - h, low[i])
            change = self.model(after) - self.model(before)
            out[..., i] = np.einsum("kab,kb->ka", self.bins.root, change) / (after[i] - before[i])
        return out

    def vector(self, q: Array) -> Array:
        """Real residuals, whose half sum of squares is minus the log-likelihood, then the priors."""
        prior = self.ranges.prior(self.ranges.values(q))
        try:
            return np.concatenate([_real(self.whitened(q)), prior])
        except Diverged:  # no steady state: a rejected step
            return np.full(2 * self.bins.measured.size + prior.size, np.inf)

    def jacobian(self, q: Array) -> Array:
        """Derivative of `vector`."""
        known = np.isfinite(self.ranges.sigma)
        prior = np.diag(self.ranges.prior_slopes(self.ranges.values(q)))[known]
        slopes = self.slopes(q)
        data = np.column_stack([_real(slopes[..., i]) for i in range(q.size)])
        return np.concatenate([data, prior])


def _real(z: Complex) -> Array:
    """Circular complex noise of unit variance has real and imaginary parts of variance one half."""
    flat = np.sqrt(2.0) * z.ravel()
    return np.concatenate([flat.real, flat.imag])


def sampled_response(system: System, frequencies: Array, sample_time: float, operating_point: OperatingPoint,
                     outputs: tuple[str, ...], inputs: tuple[str, ...]) -> Complex:
    """Response (n_f, n_y, n_u) of the linearisation, inputs held over each sample, delays included.

    With x(k+1) = Φ x(k) + Γ u(k), a delay of d samples and f seconds reads y(k) = C x(t_(k-d) - f): the state between
    samples, Φ(h-f) x(k-d-1) + Γ(h-f) u(k-d-1). A factor e^(-iωf) would be that of an input that is not held.
    """
    plant = linearize(system, operating_point.temperatures(system), operating_point.inputs)
    rows = [plant.output_labels.index(name) for name in outputs]
    columns = [plant.input_labels.index(name) for name in inputs]
    A, B, C = np.asarray(plant.A), np.asarray(plant.B)[:, columns], np.asarray(plant.C)[rows]
    delay = _delays(system, outputs, inputs)
    whole, parts = np.divmod(delay + _ROUNDING * sample_time, sample_time)
    parts = np.where(parts > 2 * _ROUNDING * sample_time, parts, 0.0)
    held = {part: held_over(A, B, sample_time - part) for part in {0.0, *map(float, parts.ravel())}}
    step, push = held[0.0]
    out = np.empty((frequencies.size, len(rows), len(columns)), np.complex128)
    for first in range(0, frequencies.size, _CHUNK):
        z = np.exp(2j * np.pi * frequencies[first:first + _CHUNK] * sample_time)[:, None, None]
        x = np.linalg.solve(z * np.eye(len(A)) - step, push.astype(complex))
        for part, (phi, gamma) in held.items():
            own = parts == part
            y = C @ x if part == 0.0 else C @ (phi @ x + gamma) / z
            out[first:first + _CHUNK][:, own] = (y * z**-whole)[:, own]
    return out


def held_over(A: Array, B: Array, time: float) -> tuple[Array, Array]:
    """What a state and an input held over some time leave in the state at its end."""
    both = np.zeros((A.shape[0] + B.shape[1],) * 2)
    both[:len(A)] = np.hstack([A, B]) * time
    exact = expm(both)[:len(A)]
    return exact[:, :len(A)], exact[:, len(A):]


def _delays(system: System, outputs: tuple[str, ...], inputs: tuple[str, ...]) -> Array:
    """Delay from every input to every output [s], (n_y, n_u)."""
    read = np.array([system.sensors[name].delay if name in system.sensors else 0.0 for name in outputs])
    drives = {name: part.drive for table in (system.inputs, system.modules) for name, part in table.items()}
    driven = np.array([drives[name].delay if name in drives else 0.0 for name in inputs])
    return np.asarray(read[:, None] + driven)
