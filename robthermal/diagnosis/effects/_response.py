"""What a unit of an effect does to a record, and what trial values of an effect may depend on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...thermal import System

Array = NDArray[np.float64]


class Seen(Protocol):
    """What trial values of an effect may depend on: `Along`, or its counterpart for a frequency response."""

    @property
    def system(self) -> System:
        """Simulated."""

    @property
    def x(self) -> Array:
        """Lump temperatures (n, n_lumps) [K]."""

    @property
    def h(self) -> float:
        """Sample time [s]."""

    @property
    def span(self) -> float:
        """Longest time seen [s]."""


@dataclass(frozen=True)
class Response:
    """What a unit of an effect does: extra heat or a changed reading; what is None is zero.

    Parameters
    ----------
    heat : tuple of ndarray, optional
        Heat into the lumps at the start and at the end of every sample, both (n, n_lumps) [W].
    reading : ndarray, optional
        Change of all sensors of the system (n, n_sensors) [K].
    """

    heat: tuple[Array, Array] | None = None
    reading: Array | None = None
