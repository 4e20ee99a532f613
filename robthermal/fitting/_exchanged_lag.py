"""Lags and the time constants of their lumps exchanged: another optimum, which no step from the first one reaches.

A lump with the time constant τ = C/G behind or before a first-order lag t answers its own inputs by
gain / ((τ s + 1)(t s + 1)), in which τ and t may change places. What tells them apart is what passes one of the two
only: heat that the lump hands on to another one, another thermometer on it, a capacity or a gain that is known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from .._arrays import Floats
from ..thermal import System, state_matrices
from ._ranges import Ranges

_ALIKE = 1.25  # factor between two times below which exchanging them is no other optimum
_OF_LINK = ("conductance", "radiation", "natural.gain")


def lagged_parts(system: System) -> dict[str, str]:
    """The lump behind every thermometer and heater, by the name of the parameter that its lag is.

    Parameters
    ----------
    system : System
        Network with its sensors and inputs.
    """
    sensors = {f"sensors.{name}.time_constant": sensor.lump for name, sensor in system.thermometers.items()}
    heaters = {f"inputs.{name}.drive.time_constant": heater.lump for name, heater in system.inputs.items()}
    return {name: lump for name, lump in (sensors | heaters).items() if lump is not None}


def choices_of(lags: Mapping[str, str]) -> list[dict[str, str]]:
    """What is exchanged at once: every lag by itself, then those of all thermometers together.

    Parameters
    ----------
    lags : mapping of str to str
        Lumps by the names of the lags, as in `lagged_parts`.
    """
    thermometers = {name: lump for name, lump in lags.items() if name.startswith("sensors.")}
    return [*({name: lump} for name, lump in lags.items()), *([thermometers] if len(thermometers) > 1 else [])]


def is_elsewhere(before: float, asked: float, ended: float) -> bool:
    """Whether a lag has ended nearer to where it was put than to where it was: else it is the same optimum again.

    Parameters
    ----------
    before, asked, ended : float
        The lag at the first optimum, where it was put, and where the fit from there ended [s].
    """
    return abs(math.log(ended / before)) > 0.5 * abs(math.log(asked / before))


def own_times(system: System) -> dict[str, float]:
    """Time constant of every lump between neighbors that hold still [s]; infinite for one that would run away.

    Parameters
    ----------
    system : System
        Network, at its nominal operating point.
    """
    A, _, states = state_matrices(system)
    return {lump: 1.0 / -float(A[i, i]) if A[i, i] < 0.0 else math.inf
            for i, lump in enumerate(states) if lump in system.lumps}


def exchanged_lags(system: System, ranges: Ranges, values: Floats, lags: Mapping[str, float]
                   ) -> tuple[Floats, dict[str, float]] | None:
    """Parameters with which lumps have the time constants of their lags, and those that they had, for the lags.

    The capacity of a lump changes; where it is not estimated, its heats do: conductances to ambients, to other lumps of
    these, gains of heaters, a constant heat. None where nothing of these is estimated, or all times are about the same.

    Parameters
    ----------
    system : System
        Network with the estimated parameters.
    ranges : Ranges
        What is estimated.
    values : ndarray, shape (p,)
        Estimates, in the unit of each.
    lags : mapping of str to float
        Lumps, each with the time constant of the lag of its thermometer or heater [s].
    """
    own = own_times(system)
    if any(not math.isfinite(own[lump]) or lag <= 0.0 for lump, lag in lags.items()):
        return None
    factors = {lump: own[lump] / lag for lump, lag in lags.items()}
    if all(1.0 / _ALIKE < factor < _ALIKE for factor in factors.values()):
        return None
    scales = _scales(system, set(ranges.flat), factors)
    if not scales:
        return None
    changed = [values[i] * next((scales[name] for name in group if name in scales), 1.0)
               for i, group in enumerate(ranges.members)]
    return np.clip(changed, ranges.lower, ranges.upper), {lump: own[lump] for lump in lags}


def _scales(system: System, estimated: set[str], factors: Mapping[str, float]) -> dict[str, float]:
    """Factors on parameters that make each lump as many times faster."""
    capacities = {f"lumps.{lump}.capacity": 1.0 / factor for lump, factor in factors.items()}
    known = {lump: factor for lump, factor in factors.items() if f"lumps.{lump}.capacity" not in estimated}
    heats = {f"lumps.{lump}.heat": factor for lump, factor in known.items()}
    heats |= {f"inputs.{name}.gain": known[heater.lump] for name, heater in system.inputs.items()
              if heater.lump in known}
    for link in system.links:
        inside = [lump for lump in link.between if lump in system.lumps]
        if inside and all(lump in known for lump in inside):
            factor = math.prod(known[lump] for lump in inside) ** (1.0 / len(inside))
            heats |= {f"links.{link.name}.{what}": factor for what in _OF_LINK}
    return {name: factor for name, factor in (capacities | heats).items() if name in estimated}
