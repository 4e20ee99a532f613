"""Refitted candidates that no machine shows: a room faster than rooms are, a heat "periodic" within less than a period.

A lag longer than the record is a sensor that is stuck.

Bounds of single quantities cannot say this. Such a candidate is an approximation of something else, and as flexible as
it is it often beats the effect that is really there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from ..data import moves
from ..effects import AMBIENT_DRIFT, Candidate
from ..evidence import Twin
from ..fit import Refit

_LAGS = ("sensor_lag", "input_lag")
_BY_ITSELF = 0.25  # relative: by so much radiation and natural convection change a conductance over tens of kelvins
FASTEST = 3.0 / 60.0  # K/s: air that is cooled or heated by cycling equipment changes by 1 to 2 K per minute


def implausible(candidate: Candidate, fit: Refit, values: Mapping[str, float], twins: Sequence[Twin]) -> str:
    """Why a refitted candidate is not what it is called; empty if it may be.

    Parameters
    ----------
    candidate : Candidate
        What was added last.
    fit : Refit
        Fit with it.
    values : mapping
        Quantities of the candidate by name.
    twins : sequence of Twin
        Effects with the same change of every reading.
    """
    if not fit.records:
        return ""
    span = max(path.span for path in fit.records)
    if candidate.effect.name in _LAGS and values["time_constant"] > span:
        return (f"its lag of {values['time_constant']:.3g} s is longer than the record, of {span:.3g} s: stuck, or not "
                "attached")
    if abs(values.get("relative", _BY_ITSELF)) < _BY_ITSELF and "time" in values and not any(
            moves(fit.structure.base, path.one.record) for path in fit.records):
        return ("no input changes in the records, and while everything only settles a conductance that depends on "
                "temperature looks like one that changes at some time")
    if not candidate.effect.paired:
        return ""
    if candidate.effect.name == AMBIENT_DRIFT:
        rate = 2.0 * math.pi * abs(values["difference"]) / values["period"]
        return "" if rate <= FASTEST else f"{candidate.where[0]} would change by {60.0 * rate:.2g} K per minute"
    if values["period"] <= span or any(twin.candidate.effect.name == AMBIENT_DRIFT for twin in twins):
        return ""
    return f"its period of {values['period']:.3g} s is longer than the record, of {span:.3g} s"


def implausible_names(fit: Refit, twins: Mapping[tuple[str, tuple[str, ...]], Sequence[Twin]]) -> Iterator[str]:
    """Why accepted effects are not what they are called, a sentence each: the last fit may have moved them there.

    Parameters
    ----------
    fit : Refit
        Fit with all of them.
    twins : mapping
        Effects with the same change of every reading, by the key of the accepted one.
    """
    for candidate, values in zip(fit.structure.effects, fit.structure.quantities(fit.v), strict=True):
        why = implausible(candidate, fit, values, twins.get(candidate.key, ()))
        if why:
            yield f"{candidate.label} is no name: {why}."
