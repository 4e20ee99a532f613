"""What to hold against a name, a sentence each."""

from __future__ import annotations

from collections.abc import Sequence

from ..thermal import System
from .effects import AMBIENT_DRIFT, Candidate
from .fit import Refit

_LIKE_THE_ROOM = ("heat_source", "ambient_gradient")  # constants that a warmer or colder room gives too


def doubts(system: System, remainder: bool) -> list[str]:
    """What to hold against a name beside a remainder, from the suite of foreign truth.

    Parameters
    ----------
    system : System
        Nominal system that was diagnosed.
    remainder : bool
        Whether a name stands beside a remainder.
    """
    if not system.modules or not remainder:
        return []
    return ["A module has no inside of its own in this test. On 18 simulated stacks with a module none of the names "
            "was wrong, which does not exclude one in five: confirm this name on the machine."]


def may_be_the_room(nominal: Refit, effects: Sequence[Candidate]) -> list[str]:
    """Which effects may be an ambient that was not recorded, or are inferred of it.

    A constant heat into a lump that is joined to it may be the ambient. That it swings or drifts is a candidate itself.

    Parameters
    ----------
    nominal : Refit
        Fit of the nominal system that was diagnosed.
    effects : sequence of Candidate
        Effects that were accepted, provisional ones included.
    """
    said = []
    for room in nominal.unrecorded:
        joined = {end for link in nominal.system.links if room in link.between for end in link.between}
        labels = [one.label for one in effects if one.effect.name in _LIKE_THE_ROOM and one.where[0] in joined]
        if labels:
            said.append(f"The temperature of {room} was not recorded: {', '.join(labels)} may be {room} itself, "
                        "warmer or colder than the system says, or drifting. Record it.")
        if any(one.effect.name == AMBIENT_DRIFT and one.where == (room,) for one in effects):
            said.append(f"That {room} drifts is read off other temperatures: record it.")
    return said
