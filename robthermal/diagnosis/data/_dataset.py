"""What a diagnosis asks of a data set: one protocol, implemented by records and by frequency responses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from ...fitting import Initial, Start
from ...thermal import System
from ..effects import Candidate

Array = NDArray[np.float64]


class DataSet(Protocol):
    """One measured data set: a record, or a frequency response."""

    @property
    def label(self) -> str:
        """Name for tables."""

    @property
    def sensors(self) -> tuple[str, ...]:
        """Columns of the readings: sensors, or "output/input" elements."""

    @property
    def columns(self) -> NDArray[np.intp]:
        """Places of these columns among all that a model gives."""

    @property
    def readings(self) -> Array:
        """Measured values, (n, m): [K], or real parts above imaginary parts of a response."""

    @property
    def missing(self) -> NDArray[np.bool_] | None:
        """Readings that count for nothing, (n, m)."""

    @property
    def certainty(self) -> float:
        """Degrees of freedom of the sum of squares, per reading: below 1 where the noise is itself an estimate."""

    @property
    def n_sessions(self) -> int:
        """1 if the data set may have input gains of its own, else 0."""

    def model(self, system: System) -> Array:
        """Readings (n, m) as a system would have them.

        Parameters
        ----------
        system : System
            Model with its initial temperatures.
        """

    def initial(self, system: System, start: Start) -> Initial:
        """Prior of the initial temperatures; empty if the data set has none.

        Parameters
        ----------
        system : System
            Model with any lumps.
        start : {"free", "measured", "system"}
            Where the initial temperatures come from, as in `rt.calibrate`.
        """

    def started(self, system: System, start: Initial, temperatures: Array) -> System:
        """The system with the initial temperatures of this data set.

        Parameters
        ----------
        system : System
            Model common to all data sets.
        start : Initial
            Prior of the initial temperatures, which says what they belong to.
        temperatures : ndarray, shape (n,)
            Initial temperatures [K]; empty if the data set has none.
        """

    def hides(self, system: System, candidate: Candidate) -> str:
        """Why such data can never show an effect; empty if they may.

        Parameters
        ----------
        system : System
            Nominal model of the data.
        candidate : Candidate
            Effect at a place.
        """

    def warmest_room(self, system: System) -> float:
        """Upper bound of the ambient's temperature [K] beside a machine that is only heated; infinite if unknown.

        Parameters
        ----------
        system : System
            Nominal model of the data.
        """

    def without_outliers(self, system: System, noise: Mapping[str, float]) -> Self:
        """The data set with isolated outliers marked as missing.

        Parameters
        ----------
        system : System
            Nominal model; its simulation is subtracted before outliers are looked for.
        noise : mapping
            Standard deviation of every sensor [K].
        """

    def first(self, n: int) -> Self:
        """The first samples of a record; what is no longer, and a response, as it is.

        Parameters
        ----------
        n : int
            Number of samples.
        """
