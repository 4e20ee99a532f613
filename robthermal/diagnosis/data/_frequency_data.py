"""A frequency response as data of a diagnosis: its channels, bins, whitener and operating point."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...fitting import Initial, MeasuredResponse, Start, as_complex, measured_response
from ...identify import FrequencyResponse
from ...thermal import System
from ..effects import Candidate

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
NO_START = Initial(np.zeros(0), np.zeros(0))  # a frequency response has no initial temperatures


@dataclass(frozen=True, eq=False)
class ResponseData(MeasuredResponse):
    """One frequency response and the part of it that is diagnosed: a `DataSet`."""

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

    def started(self, system: System, start: Initial, temperatures: Array) -> System:
        """As `DataSet.started`: the system as it is."""
        return system

    def hides(self, system: System, candidate: Candidate) -> str:
        """As `DataSet.hides`: what is constant, or not linear and time-invariant."""
        return candidate.effect.hidden(system, candidate.where)

    def warmest_room(self, system: System) -> float:
        """As `DataSet.warmest_room`: a response has no ambient."""
        return math.inf

    def without_outliers(self, system: System, noise: Mapping[str, float]) -> ResponseData:
        """As `DataSet.without_outliers`: the estimate has averaged them."""
        return self

    def first(self, n: int) -> ResponseData:
        """As `DataSet.first`: it has no samples."""
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


def response_data(system: System, G: FrequencyResponse, where: str, operating_point: Mapping[str, float]
                  ) -> ResponseData:
    """Bins that are determined and trusted, channels that the system has, and their whitener."""
    one = measured_response(system, G, where, operating_point)
    return ResponseData(one.response, one.index, one.outputs, one.inputs, one.readings, one.white, one.operating_point)
