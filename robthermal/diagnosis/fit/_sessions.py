"""Every record its own gain of every input: days differ, and that is no physics."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...thermal import FitRange, System
from ..data import DataSet, RecordData, warmest_rooms
from ..effects import Candidate
from ..path import LATE_MEANS

Array = NDArray[np.float64]
SessionGain = bool | Mapping[str, float]
SIGMA = 0.05  # relative
_FARTHEST = 0.9  # relative: an input never vanishes
_OTHERS = 8.0  # standard deviations
_LATE, _LATEST = 0.03, 0.1  # of a step, that means are late: of 16 samples by 0.03, of 5 by 0.1
_WARMEST = 30.0  # K: a room is never farther from what the system says


@dataclass(frozen=True)
class Sessions:
    """Nuisance gains and ambients of every record, with their priors; unknowns in units of the prior.

    Parameters
    ----------
    inputs : tuple of str
        Heaters and modules whose gain may differ from record to record, then ambients that were not
        recorded, and other numbers that scatter.
    numbers : tuple of str
        The system's number behind each.
    sigma : tuple of float
        Prior standard deviation of each gain [-], ambient [K] or other number in its unit.
    """

    inputs: tuple[str, ...] = ()
    numbers: tuple[str, ...] = ()
    sigma: tuple[float, ...] = ()

    @property
    def n_free(self) -> int:
        """Unknowns of every record."""
        return len(self.inputs)

    @property
    def reach(self) -> Array:
        """Bound of every unknown, in units of its prior."""
        return np.array([_reach(number, sigma) for number, sigma in zip(self.numbers, self.sigma, strict=True)])

    def applied(self, system: System, g: Array) -> System:
        """System as it was in one session.

        Parameters
        ----------
        system : System
            Common to all.
        g : ndarray, shape (n_free,)
            Gains in units of their priors.

        Returns
        -------
        System
        """
        if not g.size:
            return system
        values = {name: system.parameter(name) + sigma * float(value) for name, sigma, value
                  in zip(self.numbers, self.sigma, g, strict=True) if name != LATE_MEANS}
        return _in_range(system, values).with_parameters(values)

    def late(self, g: Array) -> float:
        """How many steps the means of one session are late [-].

        Parameters
        ----------
        g : ndarray, shape (n_free,)
            Gains in units of their priors.
        """
        return next((sigma * float(value) for name, sigma, value in zip(self.numbers, self.sigma, g, strict=False)
                     if name == LATE_MEANS), 0.0)

    def warmest(self, system: System, data: Sequence[DataSet]) -> Array:
        """Upper bounds of the unknowns of all sessions, in units of their priors: of ambients, others have none.

        Parameters
        ----------
        system : System
            Common to all sessions.
        data : sequence of DataSet
            Records, of which each allows no room warmer than the readings of its file.
        """
        rooms = {f"ambients.{name}.temperature": room.temperature for name, room in system.ambients.items()}
        warmest = warmest_rooms(system, data)
        return np.array([(most - rooms[number]) / sigma if number in rooms else np.inf
                         for one, most in zip(data, warmest, strict=True) if one.n_sessions
                         for number, sigma in zip(self.numbers, self.sigma, strict=True)])

    def hides(self, candidate: Candidate) -> str:
        """Why an effect cannot be distinguished from the sessions' gains; empty if it can."""
        if candidate.effect.name == "input_gain" and candidate.where[0] in self.inputs:
            return "every session has a gain of its own for this input"
        return ""


def _in_range(system: System, values: Mapping[str, float]) -> System:
    """The system with ranges of its fit table that hold these values: what scatters from day to day may leave them.

    An effect is tried by building the system with it, and a system with a number out of its range is refused.
    """
    beyond = {name: _widened(system.fit[name], value) for name, value in values.items() if name in system.fit
              and not system.fit[name].lower <= value <= system.fit[name].upper}
    return system.model_copy(update={"fit": {**system.fit, **beyond}}) if beyond else system


def _widened(bounds: FitRange, value: float) -> FitRange:
    return bounds.model_copy(update={"lower": min(bounds.lower, value), "upper": max(bounds.upper, value)})


def sessions_of(system: System, session_gain: SessionGain) -> Sessions:
    """Check the argument: which inputs, and how far their gains may be from 1.

    Parameters
    ----------
    system : System
        Nominal system of all sessions.
    session_gain : bool or mapping
        True: 5 % for every heater and module. A mapping: from input to standard deviation [-].
    """
    driven = (*system.inputs, *system.modules)
    table = dict.fromkeys(driven, SIGMA) if session_gain is True else session_gain or {}
    if not isinstance(table, Mapping):
        raise InputError(f"session_gain is {session_gain!r}", where="argument session_gain",
                         expected="True, False, or a mapping from input to standard deviation")
    for name, sigma in table.items():
        if name not in driven:
            raise InputError(f"there is no input {name!r}", where="argument session_gain",
                             expected="some of " + ", ".join(driven))
        number = not isinstance(sigma, bool) and isinstance(sigma, int | float)
        if not number or not (math.isfinite(sigma) and sigma > 0):
            raise InputError(f"the standard deviation of the gain of {name!r} is {sigma!r}",
                             where="argument session_gain", expected="a positive number, 0.05 for 5 %")
    numbers = tuple(f"{'inputs' if name in system.inputs else 'modules'}.{name}.drive.gain" for name in table)
    return Sessions(tuple(table), numbers, tuple(float(sigma) for sigma in table.values()))


def with_late_means(sessions: Sessions, records: Sequence[RecordData]) -> Sessions:
    """Sessions whose means may be late or early by half a sample of the logger, if any record is of means.

    Parameters
    ----------
    sessions : Sessions
        Gains of the records.
    records : sequence of RecordData
        Records of all sessions.
    """
    if not any(one.record.averaged for one in records):
        return sessions
    return replace(sessions, inputs=(*sessions.inputs, "steps that means are late"),
                   numbers=(*sessions.numbers, LATE_MEANS), sigma=(*sessions.sigma, _LATE))


def session_table(sessions: Sessions, labels: Sequence[str], gains: Sequence[Array]) -> list[str]:
    """Estimated gains of every record, in words."""
    return [f"session {label}: " + ", ".join(_moved(number, name, sigma * float(value)) for number, name, sigma, value
                                             in zip(sessions.numbers, sessions.inputs, sessions.sigma, g, strict=True))
            for label, g in zip(labels, gains, strict=True)] if sessions.inputs else []


def _is_ambient(number: str) -> bool:
    return number.startswith("ambients.")


def _reach(number: str, sigma: float) -> float:
    """Bound in standard deviations of an ambient, a gain, or another number of which these are a few per cent."""
    if _is_ambient(number):
        return _WARMEST / sigma
    if number == LATE_MEANS:
        return _LATEST / sigma
    return min(20.0, _FARTHEST / sigma) if _is_gain(number) else _OTHERS


def _is_gain(number: str) -> bool:
    return number.endswith(".drive.gain")


def _moved(number: str, name: str, by: float) -> str:
    """An ambient by kelvins, a gain by a factor, another number by as much as it differs."""
    if _is_gain(number):
        return f"{name} × {1.0 + by:.4g}"
    return f"{name} {by:+.4g}{' K' if _is_ambient(number) else ''}"
