"""Whether set-points are held at the ends of ambients and heats, and what current they need there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ...certify import heater_heat
from ...design import FeedbackLinearization, Reachable, reachable
from ...errors import InputError
from ...thermal import System
from ._limits import ambient_ends
from ._request import DesignRequest, celsius

Heats = tuple[dict[str, float], dict[str, float]]
_NONE: Heats = ({}, {})


@dataclass(frozen=True)
class Corner:
    """Set-points at one end of the ranges of ambients and heats.

    Parameters
    ----------
    ambient : dict
        Ambient to its temperature [K]; the others are nominal.
    heat : dict
        Lump to the heat into it [W]; empty while nothing heats.
    heaters : dict
        Heater whose power follows temperature to the value of its column [unit].
    reach : Reachable or None
        How far the set-points are held, and with which currents; None where there is no steady state to start from.
    why : str
        What stands against that.
    """

    ambient: dict[str, float]
    heat: dict[str, float]
    heaters: dict[str, float]
    reach: Reachable | None
    why: str = ""

    @property
    def heated(self) -> bool:
        """Whether anything heats."""
        return bool(self.heat or self.heaters)

    @property
    def held(self) -> bool:
        """Whether the set-points are held."""
        return self.reach is not None and bool(self.reach.outcome)

    def __str__(self) -> str:
        parts = [f"{name} at {celsius(value)}" for name, value in self.ambient.items()]
        parts += [f"{value:.4g} W into {name}" for name, value in self.heat.items()]
        parts += [f"{name} at {value:.4g}" for name, value in self.heaters.items()]
        return ", ".join(parts)


def corners(law: FeedbackLinearization, request: DesignRequest) -> tuple[Corner, ...]:
    """Set-points at the ends of the ambients' ranges, without heat and with the least and the most that may flow.

    Parameters
    ----------
    law : FeedbackLinearization
        Its system and current limits.
    request : DesignRequest
        Set-points, ranges of ambients and heats.
    """
    return tuple(_each(law, request, heat_ends(law.system, request)))


def first_missed(law: FeedbackLinearization, request: DesignRequest) -> Corner | None:
    """The first end at which set-points must be held, and are not: with heat only where the request states it.

    Parameters
    ----------
    law : FeedbackLinearization
        Its system and current limits.
    request : DesignRequest
        Set-points, ranges of ambients and heats.
    """
    heats = heat_ends(law.system, request) if request.heat else []
    return next((one for one in _each(law, request, heats) if not one.held), None)


def heat_ends(system: System, request: DesignRequest) -> list[Heats]:
    """The least and the most heat into all lumps at once [W], and heaters whose power follows temperature [unit].

    Parameters
    ----------
    system : System
        With its heaters and their limits.
    request : DesignRequest
        With the heats that are stated.
    """
    ranges = heater_heat(system, stated=request.heat)
    others = {name: heater.limits if heater.gain > 0.0 else heater.limits[::-1]
              for name, heater in system.inputs.items() if heater.power_slope and heater.limits is not None}
    ends = [({lump: pair[end] for lump, pair in ranges.items() if pair[end]},
             {name: pair[end] for name, pair in others.items() if pair[end]}) for end in (0, 1)]
    return [one for one in ends if any(one)]


def _each(law: FeedbackLinearization, request: DesignRequest, heats: Sequence[Heats]) -> Iterator[Corner]:
    """All ends of the ambients' ranges, first without heat."""
    return (_corner(law, request, at, *heat) for heat in (_NONE, *heats) for at in ambient_ends(request))


def _corner(law: FeedbackLinearization, request: DesignRequest, ambient: dict[str, float], heat: dict[str, float],
            heaters: dict[str, float]) -> Corner:
    try:
        return Corner(ambient, heat, heaters, reachable(law, request.setpoint, inputs=ambient | heaters,
                                                        load=heat or None, regulate=request.regulate))
    except InputError as refusal:
        if not (heat or heaters):  # what is wrong without heat is wrong with the request
            raise
        return Corner(ambient, heat, heaters, None, refusal.what)
