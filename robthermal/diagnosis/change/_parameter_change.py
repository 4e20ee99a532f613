"""Candidate changes of parameters: each of the fit table by a factor, from one day to another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial

from ...fitting import Ranges
from ...thermal import System
from ..effects import Candidate, Effect, Quantity

NAME = "parameter_change"
GAIN = "input_gain"  # the same for a heater or module whose gain is no parameter of the fit
SIZE = "log_ratio"  # the coordinate in which a factor is linear; said to the user as a relative change
_FARTHEST = 3.5  # a factor of 33: what has broken off altogether
_ROOM = 2.0  # factor about a changed number that its range in the fit table leaves


def parameter_changes(system: System, ranges: Ranges) -> list[Candidate]:
    """One candidate per parameter of the fit that may change; tied parameters change together.

    Where air takes heat beside a conductance, another law between the same parts, the whole path may change as well:
    dust and a cover reduce both.

    Parameters
    ----------
    system : System
        Nominal system of all records.
    ranges : Ranges
        Parameters that were fitted.
    """
    groups = [members for members in ranges.members if all(system.parameter(name) for name in members)]
    paths = [(*members, *beside) for members in groups if (beside := _beside(system, members))]
    return [Candidate(_effect(members), members) for members in [*groups, *paths]]


def place_of(where: tuple[str, ...], ranges: Ranges) -> int:
    """Place of the parameter of the fit that a `parameter_change` changes, alone or with others.

    Parameters
    ----------
    where : tuple of str
        Of the change.
    ranges : Ranges
        Parameters that were fitted.
    """
    return next(i for i, members in enumerate(ranges.members) if set(members) <= set(where))


def _beside(system: System, members: tuple[str, ...]) -> tuple[str, ...]:
    """Gains of natural convection between the parts that the link of a conductance joins."""
    joined = {frozenset(link.between) for link in system.links if f"links.{link.name}.conductance" in members}
    if len(joined) != 1:
        return ()
    beside = [f"links.{link.name}.natural.gain" for link in system.links
              if frozenset(link.between) in joined and link.natural and link.natural.gain > 0]
    return tuple(name for name in beside if name not in members)


def _add(system: System, where: tuple[str, ...], values: Mapping[str, float]) -> System:
    return changed_by(system, where, values[SIZE])


def changed_by(system: System, where: tuple[str, ...], logarithm: float) -> System:
    """System with some numbers times a factor.

    Parameters
    ----------
    system : System
        System of the reference records.
    where : tuple of str
        Names of the numbers.
    logarithm : float
        Of the factor.
    """
    changed = {name: system.parameter(name) * math.exp(logarithm) for name in where}
    return _with_wider_fit(system.with_parameters(changed), changed)


def _with_wider_fit(system: System, changed: Mapping[str, float]) -> System:
    """With a fit table that holds the changed numbers: its ranges are those of the healthy machine."""
    wider = {name: system.fit[name].model_copy(update={"lower": min(system.fit[name].lower, value / _ROOM),
                                                       "upper": max(system.fit[name].upper, value * _ROOM)})
             for name, value in changed.items() if name in system.fit
             and not system.fit[name].lower <= value <= system.fit[name].upper}
    return system.model_copy(update={"fit": {**system.fit, **wider}}) if wider else system


def _places(members: tuple[str, ...], system: System) -> list[tuple[str, ...]]:
    return [members]


def _effect(members: tuple[str, ...]) -> Effect:
    return Effect(name=NAME, meaning="A parameter has another value than on the reference records, by a factor.",
                  places=partial(_places, members),
                  quantities=(Quantity(SIZE, "", -_FARTHEST, _FARTHEST),), add=_add)


def relative(values: Mapping[str, tuple[float, float, str]]) -> dict[str, tuple[float, float, str]]:
    """The relative change with its standard deviation, from the coordinate of the search.

    Parameters
    ----------
    values : mapping
        Quantities of a `parameter_change` with standard deviation and unit.
    """
    value, std, unit = values[SIZE]
    others = {name: one for name, one in values.items() if name != SIZE}
    return {"relative": (math.expm1(value), std * math.exp(value), unit), **others}


def says_again(candidate: Candidate, system: System, ranges: Ranges) -> bool:
    """Whether an effect of the catalog only changes numbers that one parameter of the fit changes.

    Parameters
    ----------
    candidate : Candidate
        Effect at a place.
    system : System
        Nominal system of all records.
    ranges : Ranges
        Parameters that were fitted.
    """
    shaped = {q.name: next(iter(q.grid), 1.0) for q in candidate.effect.quantities if not callable(q.grid)}
    if len(shaped) < len(candidate.effect.quantities):  # its trial values depend on the record: more than a number
        return False
    size = candidate.effect.size
    before, after = system.parameters, candidate.effect.add(system, candidate.where,
                                                            {**shaped, size.name: size.typical}).parameters
    moved = {name for name, value in after.items() if before.get(name) != value}
    return any(moved <= set(members) for members in ranges.members)
