"""What heaters give within their limits; those whose power is linear in the temperature of their lump, as sections.

The heat q (1 + s (x - w)) is known by the range of q, the power at w: what the declared limits of the heater give. The
temperature w is the first ambient's nominal one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

from ..errors import InputError
from ..thermal import System

Interval = tuple[float, float]
LATE = ("drive.delay", "drive.time_constant")  # of inputs: they keep the heat within its limits
OWN = (("lumps", "heat"), ("lumps", "periodic.heat"), ("sensors", "self_heating"))  # heats of no heater
MORE = ("drive.gain", "drive.offset", "drive.gain_slope", "drive.cubic", "drive.clip", "feedthrough.share")


def is_own_heat(name: str) -> bool:
    """Whether a parameter is of a constant or periodic heat of the system's own."""
    table = name.partition(".")[0]
    return any(table == own and name.endswith(f".{field}") for own, field in OWN) or (
        table == "lumps" and name.endswith((".periodic.period", ".periodic.phase")))


def is_of_lead(name: str) -> bool:
    """Whether a parameter is the resistance of a lead: its heat is the current's."""
    return name.startswith("leads.") and name.endswith(".resistance")


def following(system: System, parameters: Mapping[str, Interval] | None = None) -> tuple[str, ...]:
    """Names of the heaters whose power follows temperature, or may in these ranges of parameters."""
    return tuple(name for name, heater in system.inputs.items() if heater.power_slope is not None
                 and (heater.power_slope != 0.0 or slope_of(name) in (parameters or {})))


def slope_of(heater: str) -> str:
    """Parameter name of the slope of a heater's power."""
    return f"inputs.{heater}.power_slope"


def heater_sections(system: System, names: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """Every number of these heaters that a claim depends on.

    Raises
    ------
    InputError
        A heater that is more than linear in temperature.
    """
    for name in names:
        _refuse_more(system, name)
    return {name: {"lump": system.inputs[name].lump, "power_slope": system.inputs[name].power_slope,
                   "reference_temperature": reference(system)} for name in names}


def power_ranges(system: System, parameters: Mapping[str, Interval] | None) -> dict[str, list[float]]:
    """Powers of the heaters that follow temperature, at the reference temperature [W]: limits times gain.

    Raises
    ------
    InputError
        A heater without limits; an uncertain reference temperature.
    """
    names, ranges = following(system, parameters), parameters or {}
    if not names:
        return {}
    where = f"ambients.{next(iter(system.ambients))}.temperature"
    if where in ranges and ranges[where][0] != ranges[where][1]:
        raise InputError(f"a range of {where} cannot be covered: the powers of {', '.join(map(repr, names))} are "
                         "stated at this temperature", where=f"argument parameters[{where!r}]",
                         remedy="Leave it out of `parameters`, and give the ambient its range in `ambient`.")
    return {name: _power(system, name, ranges) for name in names}


def reference(system: System) -> float:
    """Temperature at which powers are stated [K]."""
    return next(iter(system.ambients.values())).temperature


def heater_range(system: System, name: str, parameters: Mapping[str, Interval] | None = None) -> Interval:
    """Heat of a heater [W], whatever its column is within the declared limits, in the ranges of its numbers."""
    heater, ranges = system.inputs[name], parameters or {}
    if heater.limits is None:
        raise InputError(f"heater {name!r} has no limits", where=f"[inputs.{name}] limits",
                         remedy="Give limits = [lower, upper], or pass heat={lump: (lower, upper)}.")

    drive = heater.drive

    def ends(field: str, value: float) -> Interval:
        return ranges.get(f"inputs.{name}.{field}", (value, value))

    linear = [(1.0 + gain) * v + offset for gain, v, offset in product(
        ends("drive.gain", drive.gain), heater.limits, ends("drive.offset", drive.offset))]
    shaped = list(_shaped(min(linear), max(linear), ends("drive.gain_slope", drive.gain_slope),
                          ends("drive.cubic", drive.cubic)))
    clips = ends("drive.clip", drive.clip) if drive.clip is not None else (math.inf,)
    values = [min(max(value, -clip), clip) for value, clip in product((min(shaped), max(shaped)), clips)]
    heats = [gain * value for gain, value in product(ends("gain", heater.gain), values)]
    return min(heats), max(heats)


def _power(system: System, name: str, ranges: Mapping[str, Interval]) -> list[float]:
    if system.inputs[name].limits is None:
        raise InputError(f"heater {name!r} has no limits, and its power follows temperature",
                         where=f"[inputs.{name}] limits", remedy="Give limits = [lower, upper].")
    return list(heater_range(system, name, ranges))


def _shaped(low: float, high: float, slopes: Interval, cubics: Interval) -> Iterator[float]:
    """Values of (1 + k |l|) l - c l³ at the ends of l and where it turns within, for the ends of k and c."""
    for k, c, sign in product(slopes, cubics, (-1.0, 1.0)):
        places = [low, high]
        if c:  # 1 + 2 k |l| - 3 c l² = 0
            inside = k * k + 3.0 * c
            places += [sign * (k + way * math.sqrt(inside)) / (3.0 * c) for way in (-1.0, 1.0)] if inside >= 0 else []
        elif k:
            places.append(-sign / (2.0 * k))
        yield from ((1.0 + k * abs(v)) * v - c * v**3 for v in places if low <= v <= high)


def _refuse_more(system: System, name: str) -> None:
    found = [effect for effect in system.effects if effect in {f"inputs.{name}.{field}" for field in MORE}]
    if found:
        raise InputError(f"{found[0]} = {system.parameter(found[0]):g} and {slope_of(name)} together are an effect "
                         "that no certificate covers yet", where="argument system",
                         expected="a heater whose power is its column times its gain, linear in temperature",
                         remedy="Certify the system without one of them (set it to 0).")
