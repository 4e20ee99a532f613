"""Initial temperatures: fixed, measured, or unknown with a prior."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .._arrays import Floats
from ..thermal import System, trajectory
from ._data import Data

Start = Literal["free", "measured", "system"]
STARTS = ("free", "measured", "system")
SIGMA = 5.0  # K: how far a lump may be from its nearest sensor when nobody says anything
REACH = 10.0  # bounds of a free initial temperature, in SIGMA: 50 K, to keep trial steps physical


@dataclass(frozen=True)
class Initial:
    """Initial temperatures of one record.

    Parameters
    ----------
    mean : ndarray, shape (n_lumps,)
        Fixed value, or center of the prior [K].
    sigma : float
        Standard deviation of the prior of every lump [K]; 0 if fixed.
    """

    mean: Floats
    sigma: float

    @property
    def n_free(self) -> int:
        """Number of unknowns."""
        return self.mean.size if self.sigma else 0


def initial_of(system: System, one: Data, start: Start) -> Initial:
    """Initial temperatures of a record.

    The center is the nearest sensor's first reading (by thermal resistance); with "system", the file's `initial` where
    it has one. A free start has a prior of max(5 K, spread of the first readings): the lumps without a sensor are
    hardly determined by data, and without a prior the directions nobody can see would spoil the conditioning.
    """
    mean = first_temperatures(system if start == "system" else _without_initial(system), one)
    if start != "free":
        return Initial(mean, 0.0)
    warm = [T for name, T in zip(one.sensors, one.readings[0], strict=True) if name in system.thermometers]
    return Initial(mean, max(SIGMA, float(np.ptp(warm)) if warm else 0.0))


def first_temperatures(system: System, one: Data) -> Floats:
    """Default start of the simulator [K]."""
    return trajectory(system, one.record[:2]).lumps[0]


def start_values(system: System, temperatures: Floats) -> dict[str, float]:
    """Initial temperatures as named parameters."""
    return {f"lumps.{name}.initial": float(T) for name, T in zip(system.lump_names, temperatures, strict=True)}


def _without_initial(system: System) -> System:
    lumps = {name: lump.model_copy(update={"initial": None}) for name, lump in system.lumps.items()}
    return system.model_copy(update={"lumps": lumps})
