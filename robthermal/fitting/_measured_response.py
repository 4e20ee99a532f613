"""A frequency response as data of a fit: its channels, bins, whitener and operating point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from ..errors import Diverged, InputError
from ..identify import FrequencyResponse
from ..thermal import System
from ._operating_point import OperatingPoint
from ._response_whitening import ResponseWhitener, as_real, every_bin, kept_bins, response_whitener
from ._sampled_response import sampled_response

_LEAST_SHARE = 1e-13  # of the variance of the least known input, where that of the best known still has digits


@dataclass(frozen=True, eq=False)
class MeasuredResponse:
    """One frequency response and the part of it that is fitted.

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
    readings: Floats
    white: ResponseWhitener
    operating_point: dict[str, float]
    _points: dict[tuple[str, ...], OperatingPoint] = field(default_factory=dict)  # where Newton's method was last

    @property
    def label(self) -> str:
        """Name for tables."""
        return f"response ({self.response.method})"

    @property
    def frequencies(self) -> Floats:
        """Of the bins used [Hz]."""
        return np.asarray(self.response.frequencies[self.index], np.float64)

    def model(self, system: System, inputs: tuple[str, ...] | None = None) -> Floats:
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

    def temperatures(self, system: System) -> Floats | None:
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


def measured_response(system: System, G: FrequencyResponse, where: str, operating_point: Mapping[str, float],
                      *, thinned: bool = True) -> MeasuredResponse:
    """Bins that are determined and trusted, channels that the system has, and their whitener.

    Parameters
    ----------
    system : System
        System that has the channels.
    G : FrequencyResponse
        Measured response with its covariance.
    where : str
        Name of the argument, for messages.
    operating_point : mapping
        Mean inputs, before those that the response itself carries.
    thinned : bool
        Bins far enough apart to be whitened together, without the lowest, whose windows are shifted: what a polynomial
        extrapolates there is biased long before it is suspect. False: all bins, each whitened by itself, the
        correlation between them left to the caller; of a response that does not know it, one bin per window.
    """
    outputs, inputs = _channels(system, G, where)
    spare = G.degrees_of_freedom - len(G.output_names) - 1
    centered = G.frequencies * G.n_samples * G.sample_time > G.half_width + 0.5
    trusted = ~np.isnan(G.response).any(axis=(0, 1)) & ~G.suspect & (spare > 0) & ~_confounded(G)
    good = np.flatnonzero(trusted & centered if thinned else trusted)
    if not good.size:
        raise InputError("no bin of the frequency response can be used: all are undetermined, suspect or short of "
                         "degrees of freedom, so that their covariance is not known", where=f"argument {where}",
                         remedy="Excite every input at more frequencies, estimate with a larger half_width or better "
                                "poles, or record longer.")
    o = np.array([G.output_names.index(name) for name in outputs], np.intp)
    i = np.array([G.input_names.index(name) for name in inputs], np.intp)
    index, factor = kept_bins(G, good, i) if thinned else every_bin(G, good)
    measured = G.response[np.ix_(o, i, index)].transpose(2, 1, 0).reshape(index.size, -1)
    return MeasuredResponse(G, index, outputs, inputs, as_real(measured), response_whitener(G, index, factor, o, i),
                            _point_of(system, G, operating_point))


def _confounded(G: FrequencyResponse) -> NDArray[np.bool_]:
    """Bins where some input is so weak beside the others, or so like them, that nothing is known of it."""
    if G.gram is None:
        return np.zeros(len(G), bool)
    gram = np.nan_to_num(np.moveaxis(np.asarray(G.gram), -1, 0))
    return np.asarray(np.linalg.eigvalsh(gram)[:, 0] <= _LEAST_SHARE * np.einsum("bii->b", gram).real)


def _channels(system: System, G: FrequencyResponse, where: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    known = system.sensor_names or system.lump_names
    outputs = tuple(name for name in G.output_names if name in known)
    inputs = tuple(name for name in G.input_names if name in system.exogenous_names)
    for what, found, own in (("output", outputs, known), ("input", inputs, system.exogenous_names)):
        if not found:
            raise InputError(f"the frequency response has no {what} of the system", where=f"argument {where}",
                             expected="one of " + ", ".join(own), remedy="Name the channels like the system's.")
    return outputs, inputs


def _point_of(system: System, G: FrequencyResponse, given: Mapping[str, float]) -> dict[str, float]:
    """What is given, else the means of the records, of the inputs that the system has."""
    unknown = [name for name in given if name not in system.exogenous_names]
    if unknown:
        raise InputError(f"there is no input {unknown[0]!r}", where="argument operating_point",
                         expected="some of " + ", ".join(system.exogenous_names))
    return {name: mean for name, mean in G.operating_point.items() if name in system.exogenous_names} | dict(given)
