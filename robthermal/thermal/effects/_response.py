"""What effects see of a simulated record, and what a unit of an effect does to its readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

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
    heat : tuple of ndarray, or mapping of int to tuple of ndarray, optional
        Heat into the lumps at the start and at the end of every sample, both (n, n_lumps) [W]; or into some of them, by
        their place, both (n,). It is kept in the second form.
    reading : ndarray, optional
        Change of all sensors of the system (n, n_sensors) [K].
    """

    heat: Any = None
    reading: Array | None = None

    def __post_init__(self) -> None:
        if isinstance(self.heat, tuple):
            start, end = self.heat
            some = np.flatnonzero(start.any(axis=0) | end.any(axis=0)).tolist()
            object.__setattr__(self, "heat", {lump: (start[:, lump], end[:, lump]) for lump in some})


Signature = Callable[[RecordContext, Where, Values], Response]
