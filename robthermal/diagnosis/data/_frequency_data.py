"""A frequency response as data of a diagnosis: its channels, bins, whitener and operating point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...errors import Diverged, InputError
from ...fitting import Initial, OperatingPoint, Start, sampled_response
from ...identify import FrequencyResponse
from ...thermal import System
from ..effects import Candidate
from ._frequency_whitening import ResponseWhitener, as_complex, as_real, kept_bins, response_whitener

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
NO_START = Initial(np.zeros(0), 0.0)  # a frequency response has no initial temperatures


@dataclass(frozen=True, eq=False)
class ResponseData:
    """One frequency response and the part of it that is diagnosed.

    Parameters
    ----------
    response : FrequencyResponse
        Estimated frequency response with its covariance.
    index : ndarray of int, shape (n_b,)
        Positions of the bins used.
    outputs, inputs : tuple of str
        Channels that the system has.
    readings : ndarray, shape (2 n_b, m)
        vec G (columns stacked), real parts above imaginary parts [output unit / input unit].
    white : ResponseWhitener
        Of its errors.
    operating_point : dict
        Mean inputs of the experiment.
    """

    response: FrequencyResponse
    index: NDArray[np.intp]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    readings: Array
    white: ResponseWhitener
    operating_point: dict[str, float]
    _points: dict[tuple[str, ...], OperatingPoint] = field(default_factory=dict)  # where Newton's method was last

    @property
    def label(self) -> str:
        """Name for tables."""
        return f"response ({self.response.method})"

    @property
    def missing(self) -> None:
        """No reading is missing: bins that cannot be used are left out."""
        return None

    @property
    def n_sessions(self) -> int:
        """A response has no input gains of its own."""
        return 0

    def initial(self, system: System, start: Start) -> Initial:
        """As `DataSet.initial`: none."""
        return NO_START

    def started(self, system: System, temperatures: Array) -> System:
        """As `DataSet.started`: the system as it is."""
        return system

    def hides(self, system: System, candidate: Candidate) -> str:
        """As `DataSet.hides`: what is constant, or not linear and time-invariant."""
        return candidate.effect.hidden(system, candidate.where)

    def without_outliers(self, system: System, noise: Mapping[str, float]) -> ResponseData:
        """As `DataSet.without_outliers`: the estimate has averaged them."""
        return self

    @property
    def sensors(self) -> tuple[str, ...]:
        """Elements, as "output/input", in the order of the columns of `readings`."""
        return tuple(f"{o}/{i}" for i in self.inputs for o in self.outputs)

    @property
    def columns(self) -> NDArray[np.intp]:
        """All of them."""
        return np.arange(self.readings.shape[1])

    @property
    def frequencies(self) -> Array:
        """Of the bins used [Hz]."""
        return np.asarray(self.response.frequencies[self.index], np.float64)

    @property
    def noise(self) -> Array:
        """Median standard deviation of every element (m,), as a part of its median magnitude [-]."""
        inverse = np.linalg.inv(self.white.roots)
        sigma = np.sqrt(np.sum(np.abs(inverse) ** 2, axis=2))
        if self.white.factor.size:
            s = np.diag(self.white.factor @ self.white.factor.conj().T).real.reshape(len(self.index), -1)
            sigma = sigma * np.repeat(np.sqrt(s), self.white.n_outputs, axis=1)
        return np.asarray(np.median(sigma, axis=0) / np.median(np.abs(as_complex(self.readings)), axis=0), np.float64)

    @property
    def tail(self) -> float:
        """Degrees of freedom of one window's noise: whitened deviations have the tails of t with as many."""
        return float(2 * (self.response.degrees_of_freedom[self.index].min() - len(self.outputs) + 1))

    @property
    def alignment(self) -> float:
        """Mean square of a whitened deviation along a signature, relative to that in any direction: q/(q - p + 1)."""
        q = self.tail / 2.0
        return float((q + len(self.outputs) - 1.0) / q)

    @property
    def certainty(self) -> float:
        """Degrees of freedom of the sum of squares, per reading: below 1, because the noise is an estimate.

        Of K deviations that share a noise estimate the mean square is F(2K, 2q): its variance is (q+K-1)/(q-2) times
        that of χ².
        """
        q = self.tail / 2.0
        shared = self.index.size * len(self.inputs) / len(self.windows)
        return float((q - 2.0) / (q + shared - 1.0))

    @cached_property
    def windows(self) -> list[NDArray[np.intp]]:
        """Places of the bins that share an estimate of the noise, window by window."""
        window = self.index // (2 * self.response.half_width + 1)
        return [np.flatnonzero(window == number) for number in np.unique(window)]

    def model(self, system: System, inputs: tuple[str, ...] | None = None) -> Array:
        """Response of a system at its steady state, in the form of `readings`.

        Parameters
        ----------
        system : System
            System with any lumps.
        inputs : tuple of str, optional
            Inputs of the system instead of those of the response.

        Returns
        -------
        ndarray, shape (2 n_b, m)
        """
        self.temperatures(system)
        G = sampled_response(system, self.frequencies, self.response.sample_time, self._point(system), self.outputs,
                             self.inputs if inputs is None else inputs)
        return as_real(G.transpose(0, 2, 1).reshape(len(G), -1))

    def temperatures(self, system: System) -> Array | None:
        """Steady state [K]; None for a linear network, whose response is the same everywhere."""
        point = self._point(system)
        try:
            found = point.temperatures(system)
        except Diverged:
            point.last = None  # search all branches
            found = point.temperatures(system)
        if found is None and point.last is None:  # where Newton's method starts once an effect is not linear
            point.last = np.full(len(system.lumps), next(iter(system.ambients.values())).temperature)
        return found

    def _point(self, system: System) -> OperatingPoint:
        """Operating point that knows where the steady state was; a new lump starts at the first ambient."""
        names = system.lump_names
        if names not in self._points:
            known = {name: T for lumps, point in self._points.items() if point.last is not None
                     for name, T in zip(lumps, point.last, strict=True)}
            room = next(iter(system.ambients.values())).temperature
            last = np.array([known.get(name, room) for name in names]) if self._points else None
            self._points[names] = OperatingPoint(self.operating_point, last)
        return self._points[names]


def response_data(system: System, G: FrequencyResponse, where: str, operating_point: Mapping[str, float]
                  ) -> ResponseData:
    """Bins that are determined and trusted, channels that the system has, and their whitener."""
    known = system.sensor_names or system.lump_names
    outputs = tuple(name for name in G.output_names if name in known)
    inputs = tuple(name for name in G.input_names if name in system.exogenous_names)
    for what, found, own in (("output", outputs, known), ("input", inputs, system.exogenous_names)):
        if not found:
            raise InputError(f"the frequency response has no {what} of the system", where=f"argument {where}",
                             expected="one of " + ", ".join(own), remedy="Name the channels like the system's.")
    unknown = [name for name in operating_point if name not in system.exogenous_names]
    if unknown:
        raise InputError(f"there is no input {unknown[0]!r}", where="argument operating_point",
                         expected="some of " + ", ".join(system.exogenous_names))
    spare = G.degrees_of_freedom - len(G.output_names) - 1
    # the lowest windows are shifted: what the local model extrapolates there is biased long before it is suspect
    centered = G.frequencies * G.n_samples * G.sample_time > G.half_width + 0.5
    good = np.flatnonzero(~np.isnan(G.response).any(axis=(0, 1)) & ~G.suspect & (spare > 0) & centered)
    if not good.size:
        raise InputError("no bin of the frequency response can be used: all are undetermined, suspect or short of "
                         "degrees of freedom, so that their covariance is not known", where=f"argument {where}",
                         remedy="Estimate it with rt.identify.lpm or lrmp, a larger half_width, better poles, or a "
                                "longer record.")
    o = np.array([G.output_names.index(name) for name in outputs], np.intp)
    i = np.array([G.input_names.index(name) for name in inputs], np.intp)
    index, factor = kept_bins(G, good, i)
    measured = G.response[np.ix_(o, i, index)].transpose(2, 1, 0).reshape(index.size, -1)
    return ResponseData(G, index, outputs, inputs, as_real(measured), response_whitener(G, index, factor, o, i),
                        dict(operating_point))
