"""Boxes that a machine cannot leave, and the claim "no thermal runaway" made of two certificates.

In the box the network contracts; the box is never left; so every trajectory that starts in it forgets its start and
stays in it, whatever the currents, heaters and ambients do within their ranges.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._celsius import ZERO_CELSIUS
from .._pandas import pd
from ..errors import Outcome
from ..thermal import System
from ..verification import Certificate, not_certified
from ._contraction import Method, contraction
from ._energy import energy_rate
from ._faces import Array, Faces
from ._heaters import following, heater_sections, power_ranges, slope_of
from ._invariance import invariance
from ._jacobian import box_jacobian
from ._lyapunov import Structure
from ._outcomes import CertifyCode
from ._own_heat import driven, of_leads
from ._sections import (
    Currents,
    Interval,
    current_box,
    made_by,
    parameter_box,
    refuse_effects,
    region_section,
    system_section,
)
from ._smallest_box import COLDEST, HOTTEST, smallest_box
from ._surroundings import ambient_ranges, heat_ranges

RESERVE = 0.005  # share of every heat kept in reserve in boxes: three standard deviations of an ordinary calibration
_TIGHTER = (1.0, 0.2, 0.0)  # shares of the reserve that are tried where there is no box with all of it


@dataclass(frozen=True)
class RunawayFree:
    """The claim that a machine cannot run away thermally.

    Parameters
    ----------
    temperature : dict
        Lump to (lower, upper) [K]: the box; empty if none was found.
    invariance, contraction : Certificate
        The box is never left; in it the network contracts.
    outcome : Outcome
        "certified", or which of the two is missing and why.
    limiting_parameter : str or None
        Where it fails only because of the ranges of `parameters`: the one without whose range it would hold, or come
        closest to it.
    """

    temperature: dict[str, Interval]
    invariance: Certificate
    contraction: Certificate
    outcome: Outcome
    limiting_parameter: str | None = None

    @property
    def holds(self) -> bool:
        """Whether both certificates hold."""
        return self.invariance.holds and self.contraction.holds

    def table(self) -> pd.DataFrame:
        """The box, °C."""
        return pd.DataFrame({name: np.array(pair) - ZERO_CELSIUS for name, pair in self.temperature.items()},
                            index=["lowest [°C]", "highest [°C]"]).T

    def __str__(self) -> str:
        return self.outcome.text


def runaway_free(system: System, *, current: Currents, ambient: Mapping[str, Interval] | None = None,
                 heat: Mapping[str, Interval] | None = None, method: Method = "energy", structure: Structure = "full",
                 large: bool = False, parameters: Mapping[str, Interval] | None = None) -> RunawayFree:
    """Certify that a machine cannot run away thermally.

    The box is chosen with a reserve of 0.5 % of every single heat (a link's, Peltier, Joule, conducted), where it
    exists, so that the claim survives the errors of an ordinary calibration.

    Parameters
    ----------
    system : System
        Network with its modules.
    current : mapping
        {module: (lower, upper)} [A], every module, independently and arbitrarily in time.
    ambient : mapping, optional
        {ambient: (lower, upper)} [K]; default nominal.
    heat : mapping, optional
        {lump: (lower, upper)} [W], heaters and loads; default the declared limits of the heaters. Not in it are
        constant and periodic heats of the system, which are added, and heaters whose power follows temperature, whose
        declared limits always count.
    method : {"energy", "sum", "max", "lyapunov"}
        Norm of the contraction.
    structure, large
        As in `contraction`.
    parameters : mapping, optional
        Ranges of uncertain numbers of the system as in `contraction`; ranges of heaters' gains widen `heat` where it is
        not given.

    Returns
    -------
    RunawayFree

    Raises
    ------
    InputError
        Ranges that do not fit the system; a heater without limits when `heat` is not given; ranges of parameters that
        no checker covers.

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.certify.runaway_free(rt.systems.two_module(), current={"m1": (0.0, 1.0), "m2": (0.0, 1.0)})
    >>> found.holds
    True
    """
    around = ambient_ranges(system, ambient, parameters)
    plain = driven(system, heat_ranges(system, heat, parameters), parameters)
    system, heat, parameters = plain.system, plain.heat, plain.parameters
    heater_sections(system, following(system, parameters))  # refuses what heaters are that no claim knows
    refuse_effects(system, ("leads",), [*map(slope_of, following(system, parameters))])  # before they meet the box
    currents = current_box(system, current)
    ranges = parameter_box(system, parameters, ("leads", "inputs")) | of_leads(parameters)
    power = power_ranges(system, parameters)

    def faces(kept: Mapping[str, Any]) -> Faces:
        return Faces(system, around, heat, kept, RESERVE, power)

    box = box_with_reserve(faces(ranges), currents)
    if box is None:
        refused = no_box(system, current)
        return RunawayFree({}, refused, refused,
                           CertifyCode.NOT_CERTIFIED.outcome(f"Not certified: {refused.reason}", remedy=""),
                           _limiting(ranges, lambda kept: _size(box_with_reserve(faces(kept), currents))))
    named = named_box(system, box)
    stays = invariance(system, current=current, temperature=named, ambient=around, heat=heat or None,
                       parameters=parameters)
    shrinks = contraction(system, current=current, temperature=named, method=method, structure=structure, large=large,
                          parameters=parameters)
    limiting = None
    if not (stays.holds and shrinks.holds):
        limiting = _limiting(ranges, lambda kept: _rate(system, currents, kept, faces(kept)))
    return RunawayFree(named, stays, shrinks, _outcome(stays, shrinks, named), limiting)


def box_with_reserve(faces: Faces, current: Mapping[str, Any]) -> Array | None:
    """Smallest box that is never left, with as much of the reserve of the faces as there is; None if there is none."""
    for share in _TIGHTER:
        box = smallest_box(replace(faces, reserve=share * faces.reserve), current)
        if box is not None:
            return box
    return None


def named_box(system: System, box: Array) -> dict[str, Interval]:
    """{lump: (lower, upper)} [K] of an array (2, n)."""
    return {name: (float(low), float(high)) for name, low, high in zip(system.lumps, *box, strict=True)}


def no_box(system: System, current: Currents) -> Certificate:
    """The refusal where no box was found."""
    system, heaters = driven(system, {}, None, current_box(system, current)).system, following(system)
    region = region_section(system, current, (COLDEST, HOTTEST), knows=("inputs",))
    reason = ("no box was found that these currents and heats cannot leave: the heat balance of some lump "
              f"diverges, or its box would reach below {COLDEST:g} K or above {HOTTEST:g} K. Narrow the currents, or "
              "improve the heat sink.")
    return not_certified("invariance", system=system_section(system, heaters=heaters), region=region, evidence={},
                         reason=reason, made_by=made_by("Newton's method on the faces", "none"))


def _limiting(ranges: Mapping[str, Any], better: Any) -> str | None:
    """The parameter without whose range the claim comes out best, if that is better than with all of them."""
    if not ranges:
        return None
    scores = {name: better({key: pair for key, pair in ranges.items() if key != name}) for name in ranges}
    best = max(scores, key=lambda name: scores[name])
    return best if scores[best] > better(ranges) else None


def _size(box: Array | None) -> float:
    return -np.inf if box is None else -float(np.ptp(box))


def _rate(system: System, current: Mapping[str, Any], ranges: Mapping[str, Any], faces: Faces) -> float:
    box = box_with_reserve(faces, current)
    if box is None:
        return -np.inf
    temperature = {name: list(pair) for name, pair in named_box(system, box).items()}
    return energy_rate(box_jacobian(system, {"temperature": temperature, "current": current, "parameters": ranges,
                                             "power": faces.power}))


def _outcome(stays: Certificate, shrinks: Certificate, box: dict[str, Interval]) -> Outcome:
    low, high = min(p[0] for p in box.values()) - ZERO_CELSIUS, max(p[1] for p in box.values()) - ZERO_CELSIUS
    if stays.holds and shrinks.holds:
        return CertifyCode.CERTIFIED.outcome("Certified: no thermal runaway. Every lump stays in its range (overall "
                                             f"{low:.1f} to {high:.1f} °C), in which the network contracts.")
    missing = shrinks if stays.holds else stays
    what = "the network contracts in the box" if stays.holds else "the box is never left"
    return CertifyCode.NOT_CERTIFIED.outcome(f"Not certified: it is not shown that {what}: {missing.reason}", remedy="")
