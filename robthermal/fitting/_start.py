"""Initial state of a record: fixed, measured, or unknown with a prior."""

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
WHOLE = 2.0  # half ranges: an input was anything within its range
COLDEST, HOTTEST = 151.0, 1500.0  # K: a system refuses what is below 150 K, and above this a network means nothing
REACH = 10.0  # bounds of a free initial temperature, in SIGMA: 50 K, to keep trial steps physical


@dataclass(frozen=True)
class Initial:
    """Initial state of one record.

    Parameters
    ----------
    mean : ndarray, shape (n,)
        Fixed value, or center of the prior: of all lumps and lagged thermometers [K], then what delayed and lagged
        inputs were before the record [unit of the input].
    sigma : ndarray, shape (n,)
        Standard deviation of the prior of every one; 0 if fixed.
    names : tuple of str
        What is unknown, as parameters of the system.
    """

    mean: Floats
    sigma: Floats
    names: tuple[str, ...] = ()

    def within(self, coldest: float, hottest: float, farthest: float) -> tuple[Floats, Floats]:
        """Bounds of the unknowns in standard deviations; an input was within its range about its first value.

        Parameters
        ----------
        coldest, hottest : float
            Bounds of temperatures [K].
        farthest : float
            Largest distance of a temperature from its center [standard deviations].
        """
        if not self.n_free:
            return np.zeros(0), np.zeros(0)
        of_input = np.array([name.endswith(".before") for name in self.names])
        low = np.clip((coldest - self.mean) / self.sigma, -farthest, 0.0)
        high = np.clip((hottest - self.mean) / self.sigma, 0.0, farthest)
        return np.where(of_input, -WHOLE, low), np.where(of_input, WHOLE, high)

    @property
    def at_rest(self) -> Initial:
        """The same where lags are settled and delayed inputs have their first value: of lumps alone."""
        n = sum(name.startswith("lumps.") for name in self.names)
        return self if n == self.mean.size else Initial(self.mean[:n], self.sigma[:n], self.names[:n])

    @property
    def n_free(self) -> int:
        """Number of unknowns."""
        return self.mean.size if self.sigma.any() else 0


def initial_of(system: System, one: Data, start: Start) -> Initial:
    """Initial temperatures of a record.

    The center is the nearest sensor's first reading (by thermal resistance); with "system", the file's `initial` where
    it has one. A free start has a prior of max(5 K, spread of the first readings): the lumps without a sensor are
    hardly determined by data, and without a prior the directions nobody can see would spoil the conditioning.

    A record may begin while the machine moves: a lagged thermometer then shows another temperature than its lump has,
    and what it shows first is an unknown of its own, with the first reading in its center. So is what a delayed or
    lagged input was before, with its first value in its center and half of its range as standard deviation.
    """
    mean = first_temperatures(system if start == "system" else _without_initial(system), one)
    names = tuple(f"lumps.{name}.initial" for name in system.lumps)
    if start != "free":
        return Initial(mean, np.zeros(mean.size), names)
    shown, before = _shown_first(system, one), _before(system, one)
    names = (*names, *(f"sensors.{name}.initial" for name in shown), *before)
    warm = [T for name, T in zip(one.sensors, one.readings[0], strict=True) if name in system.thermometers]
    sigma = np.full(mean.size + len(shown), max(SIGMA, float(np.ptp(warm)) if warm else 0.0))
    return Initial(np.concatenate([mean, list(shown.values()), [first for first, _ in before.values()]]),
                   np.append(sigma, [spread for _, spread in before.values()]), names)


def first_temperatures(system: System, one: Data) -> Floats:
    """Default start of the simulator [K]."""
    return trajectory(system, one.record[:2]).lumps[0]


def started(system: System) -> tuple[str, ...]:
    """Everything with a start of its own: lumps, lagged thermometers, delayed and lagged inputs.

    Parameters
    ----------
    system : System
        Model of a record.
    """
    return (*system.lumps, *(name for name, sensor in system.thermometers.items() if sensor.time_constant),
            *_remembering(system))


def _remembering(system: System) -> dict[str, str]:
    """Delayed and lagged inputs and currents, with what they were before as a parameter."""
    return {name: f"{table}.{name}.drive.before" for table, parts in (("inputs", system.inputs),
                                                                      ("modules", system.modules))
            for name, part in parts.items() if part.drive.delay or part.drive.time_constant}


def _before(system: System, one: Data) -> dict[str, tuple[float, float]]:
    """First value and half the range of every delayed or lagged input of a record that ever changes, by parameter."""
    found = {}
    for name, parameter in _remembering(system).items():
        values = one.record[name]
        if np.ptp(values) > 0:
            found[parameter] = float(values[0]), 0.5 * float(np.ptp(values))
    return found


def _shown_first(system: System, one: Data) -> dict[str, float]:
    """What lagged thermometers in the record show at its start, without their gain and offset [K]."""
    reference = next(iter(system.ambients.values())).temperature
    first = dict(zip(one.sensors, one.readings[0].tolist(), strict=True))
    return {name: reference + (first[name] - sensor.offset - reference) / sensor.gain
            for name, sensor in system.thermometers.items() if sensor.time_constant and name in first}


def start_values(start: Initial, temperatures: Floats) -> dict[str, float]:
    """Initial state as named parameters.

    Parameters
    ----------
    start : Initial
        Prior of the initial temperatures of a record.
    temperatures : ndarray, shape (n,)
        Its values, as many as `start.mean`.
    """
    return dict(zip(start.names, map(float, temperatures), strict=True))


def _without_initial(system: System) -> System:
    lumps = {name: lump.model_copy(update={"initial": None}) for name, lump in system.lumps.items()}
    sensors = {name: sensor.model_copy(update={"initial": None}) for name, sensor in system.sensors.items()}
    return system.model_copy(update={"lumps": lumps, "sensors": sensors})
