"""Refitted candidates that no machine shows: a room faster than rooms are, a heat "periodic" within less than a period.

A lag longer than the record is a sensor that is stuck. Water condenses from air that is as warm as its dew point. A
memory of the polarity shows where the polarity changes.

Bounds of single quantities cannot say this. Such a candidate is an approximation of something else, and as flexible as
it is it often beats the effect that is really there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..._celsius import ZERO_CELSIUS
from ..data import moves
from ..effects import AMBIENT_DRIFT, Candidate
from ..evidence import Twin
from ..fit import Refit

_LAGS = ("sensor_lag", "input_lag")
_HALF, _MARGIN = 0.5, 1.0  # of the heat of condensation, and K by which all must be colder than its dew point
_BY_ITSELF = 0.25  # relative: by so much radiation and natural convection change a conductance over tens of kelvins
_SWINGS = 0.3  # of what a column moves beside a ramp
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
    if candidate.effect.name == "hysteresis" and not any(
            np.ptp(np.sign(path.one.record[candidate.where[0]])) for path in fit.records):
        return (f"the current of {candidate.where[0]} is on, or off, throughout every record, so that none shows a "
                "memory of its polarity: something else settles from the start of a record on")
    if candidate.effect.name == "condensation":
        return _from_no_air(candidate.where[0], fit, values["dew_point"])
    return _slow_or_fast(candidate, span, values, twins, fit) if candidate.effect.paired else ""


def _slow_or_fast(candidate: Candidate, span: float, values: Mapping[str, float], twins: Sequence[Twin], fit: Refit
                  ) -> str:
    """Why something does not come and go like this."""
    if candidate.effect.name == AMBIENT_DRIFT:
        rate = 2.0 * math.pi * abs(values["difference"]) / values["period"]
        return "" if rate <= FASTEST else f"{candidate.where[0]} would change by {60.0 * rate:.2g} K per minute"
    if any(twin.candidate.effect.name == AMBIENT_DRIFT for twin in twins):
        return ""
    if values["period"] > span:
        return f"its period of {values['period']:.3g} s is longer than the record, of {span:.3g} s"
    column = _swinging(fit, values["period"])
    return column and (f"its period of {values['period']:.3g} s is that in which {column} swings, which is recorded: "
                       "the machine answers to that otherwise than the model")


def _swinging(fit: Refit, period: float) -> str:
    """A recorded ambient of which a sine of this period is a good part, beside a ramp; "" if there is none.

    Inputs do not count: under feedback they follow a periodic heat.
    """
    for path in fit.records:
        record = path.one.record
        t = record.time - record.time[0]
        ramp = np.column_stack([np.ones_like(t), t / max(float(t[-1]), 1e-9)])
        sine = np.column_stack([ramp, np.cos(2.0 * np.pi * t / period), np.sin(2.0 * np.pi * t / period)])
        for name in (one for one in record.input_names if one in fit.system.ambients):
            column = record[name] - record[name].mean()
            plain, left = (column - A @ np.linalg.lstsq(A, column, rcond=None)[0] for A in (ramp, sine))
            if float(left @ left) < (1.0 - _SWINGS) * float(plain @ plain):
                return name
    return ""


def _from_no_air(lump: str, fit: Refit, dew_point: float) -> str:
    """Why water does not condense like this: most of it while lumps and ambients are all colder than the dew point."""
    heat, none = 0.0, 0.0
    for path in fit.records:
        record, at = path.one.record, path.system.lump_names.index(lump)
        rooms = [record[name].max() if name in record.input_names else room.temperature
                 for name, room in path.system.ambients.items()]
        cold = np.maximum(dew_point - path.x[:, at], 0.0)
        heat += float(cold.sum())
        none += float(cold[np.maximum(path.x.max(axis=1), max(rooms)) < dew_point - _MARGIN].sum())
    return "" if none <= _HALF * heat else (
        f"most of its heat comes while nothing beside {lump} is as warm as its dew point of "
        f"{dew_point - ZERO_CELSIUS:.3g} °C: no air holds that much water")


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
