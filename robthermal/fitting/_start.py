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
    mean : ndarray, shape (n,)
        Fixed value, or center of the prior [K]: of all lumps, then of lagged thermometers.
    sigma : float
        Standard deviation of the prior of every one [K]; 0 if fixed.
    names : tuple of str
        What is unknown, as parameters of the system.
    """

    mean: Floats
    sigma: float
    names: tuple[str, ...] = ()

    @property
    def n_free(self) -> int:
        """Number of unknowns."""
        return self.mean.size if self.sigma else 0


def initial_of(system: System, one: Data, start: Start) -> Initial:
    """Initial temperatures of a record.

    The center is the nearest sensor's first reading (by thermal resistance); with "system", the file's `initial` where
    it has one. A free start has a prior of max(5 K, spread of the first readings): the lumps without a sensor are
    hardly determined by data, and without a prior the directions nobody can see would spoil the conditioning.

    A record may begin while the machine moves: a lagged thermometer then shows another temperature than its lump has,
    and what it shows first is an unknown of its own, with the first reading in its center.
    """
    mean = first_temperatures(system if start == "system" else _without_initial(system), one)
    names = tuple(f"lumps.{name}.initial" for name in system.lumps)
    if start != "free":
        return Initial(mean, 0.0, names)
    shown = _shown_first(system, one)
    mean, names = np.append(mean, list(shown.values())), (*names, *(f"sensors.{name}.initial" for name in shown))
    warm = [T for name, T in zip(one.sensors, one.readings[0], strict=True) if name in system.thermometers]
    return Initial(mean, max(SIGMA, float(np.ptp(warm)) if warm else 0.0), names)


def first_temperatures(system: System, one: Data) -> Floats:
    """Default start of the simulator [K]."""
    return trajectory(system, one.record[:2]).lumps[0]


def started(system: System) -> tuple[str, ...]:
    """Everything with an initial temperature of its own: lumps and lagged thermometers.

    Parameters
    ----------
    system : System
        Model of a record.
    """
    return (*system.lumps, *(name for name, sensor in system.thermometers.items() if sensor.time_constant))


def _shown_first(system: System, one: Data) -> dict[str, float]:
    """What lagged thermometers in the record show at its start, without their gain and offset [K]."""
    reference = next(iter(system.ambients.values())).temperature
    first = dict(zip(one.sensors, one.readings[0].tolist(), strict=True))
    return {name: reference + (first[name] - sensor.offset - reference) / sensor.gain
            for name, sensor in system.thermometers.items() if sensor.time_constant and name in first}


def start_values(start: Initial, temperatures: Floats) -> dict[str, float]:
    """Initial temperatures as named parameters.

    Parameters
    ----------
    start : Initial
        Prior of the initial temperatures of a record.
    temperatures : ndarray, shape (n,)
        Their values [K], as many as `start.mean`.
    """
    return dict(zip(start.names, map(float, temperatures), strict=True))


def _without_initial(system: System) -> System:
    lumps = {name: lump.model_copy(update={"initial": None}) for name, lump in system.lumps.items()}
    sensors = {name: sensor.model_copy(update={"initial": None}) for name, sensor in system.sensors.items()}
    return system.model_copy(update={"lumps": lumps, "sensors": sensors})
