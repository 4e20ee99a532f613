"""What effects see of a simulated record, and what a unit of an effect does to its readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .._equations import Equations
from .._system import System

Array = NDArray[np.float64]
Where = tuple[str, ...]
Values = Mapping[str, float]


class TrialContext(Protocol):
    """What trial values of an effect may depend on: a simulated record, or a frequency response at its steady state."""

    @property
    def system(self) -> System:
        """Simulated system."""

    @property
    def x(self) -> Array:
        """Lump temperatures (n, n_lumps) [K]."""

    @property
    def h(self) -> float:
        """Sample time [s]."""

    @property
    def span(self) -> float:
        """Longest time resolved [s]."""


class RecordContext(TrialContext, Protocol):
    """What the signature of an effect may depend on: a simulated record, sample by sample."""

    @property
    def time(self) -> Array:
        """Time of every sample (n,) [s]."""

    @property
    def end(self) -> Array:
        """Lump temperatures at the end of every sample (n, n_lumps) [K]."""

    @property
    def u(self) -> Array:
        """Held inputs (n, n_u), in the order of `System.exogenous_names`."""

    @property
    def readings(self) -> Array:
        """Simulated readings (n, n_sensors) [K]."""

    @property
    def reference(self) -> float:
        """Temperature about which sensor gains act [K]."""

    @property
    def equations(self) -> Equations:
        """Equations of the system."""

    @property
    def own_heat(self) -> tuple[Array, Array]:
        """Heat of the system as it is at the start and at the end of every sample (n, n_lumps) [W]."""

    def heat_of(self, system: System) -> tuple[Array, Array]:
        """Extra heat of a changed system at the start and at the end of every sample (n, n_lumps) [W].

        Parameters
        ----------
        system : System
            System with the same lumps.
        """


@dataclass(frozen=True)
class Response:
    """What a unit of an effect does: extra heat or a changed reading; what is None is zero.

    Parameters
    ----------
    heat : mapping of int to tuple of ndarray, optional
        Heat into lumps, by their place, at the start and at the end of every sample, both (n,) [W]; 0 into the others.
    reading : ndarray, optional
        Change of all sensors of the system (n, n_sensors) [K].
    """

    heat: Mapping[int, tuple[Array, Array]] | None = None
    reading: Array | None = None


Signature = Callable[[RecordContext, Where, Values], Response]
