"""Heaters whose power is linear in the temperature of their lump: q (1 + s (x - w)), q the power at w, s its slope.

The heat is affine in x, in q and in s, so that of both bounds the corners of (q, s) suffice, constant in time or not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from flint import fmpq

from robthermal.errors import InputError

from ._fields import Interval, get, intervals, mapping, text
from ._numbers import decimal, exact, name_of
from ._system import Link, ThermalSystem, say_interval
from ._uncertain import Parameters, must_contain

_FIELD = "power_slope"
_SOMEWHERE = ""  # the other end of what a slope conducts: no ambient has an empty name


@dataclass(frozen=True)
class Heater:
    """One heater: its lump, slope [1/K], temperature w at which its power is stated [K], and that power [W]."""

    name: str
    lump: int
    slope: Interval
    reference: fmpq
    power: Interval = (fmpq(0), fmpq(0))

    @property
    def rise(self) -> Interval:
        """Bounds of the heat per kelvin of its lump [W/K]."""
        found = [q * s for q, s in product(self.power, self.slope)]
        return min(found), max(found)

    def heat(self, temperature: fmpq) -> Interval:
        """Bounds of its heat at a temperature of its lump [W]."""
        found = [q * (1 + s * (temperature - self.reference)) for q, s in product(self.power, self.slope)]
        return min(found), max(found)


def heaters_of(section: Mapping[str, Any], lumps: Sequence[str]) -> tuple[Heater, ...]:
    """Return the heaters of a section that follow temperature, at their own slopes and without powers."""
    inputs = mapping(section.get("inputs", {}), "system.inputs")
    return tuple(_heater(name, inputs[name], lumps) for name in inputs if _FIELD in inputs[name])


def read_heaters(section: Mapping[str, Any], region: Mapping[str, Any], lumps: Sequence[str], parameters: Parameters
                 ) -> tuple[tuple[Heater, ...], Parameters]:
    """Return the heaters of a certificate with their ranges, and the uncertain numbers that are not theirs."""
    found = heaters_of(section, lumps)
    powers = intervals(region.get("power", {}), [heater.name for heater in found], "region.power")
    ranges, slopes = dict(parameters), {f"inputs.{heater.name}.{_FIELD}": heater for heater in found}
    for name in [name for name in ranges if name in slopes]:
        must_contain(ranges[name], slopes[name].slope[0], f"region.parameters[{name_of(name)}]")
    own = tuple(replace(heater, power=power, slope=ranges.get(f"inputs.{heater.name}.{_FIELD}", heater.slope))
                for heater, power in zip(found, powers, strict=True))
    return own, tuple(pair for pair in parameters if pair[0] not in slopes)


def with_rises(system: ThermalSystem, heaters: Sequence[Heater]) -> ThermalSystem:
    """Return the network whose Jacobian is that with the heaters: a rise is a conductance below zero to somewhere."""
    zero = fmpq(0)
    links = [Link((heater.lump, _SOMEWHERE), -heater.rise[1], zero, zero, zero, heater.rise[1] - heater.rise[0])
             for heater in heaters]
    return replace(system, links=(*system.links, *links))


def say_heaters(heaters: Sequence[Heater]) -> str:
    """Return the powers of a claim in words; empty where there are none."""
    powers = ", ".join(f"{name_of(heater.name)} in {say_interval(heater.power)} W at {decimal(heater.reference)} K"
                       for heater in heaters)
    return f", heater powers {powers}, linear in the temperatures of their lumps" if powers else ""


def _heater(name: str, value: Any, lumps: Sequence[str]) -> Heater:
    where = f"system.inputs[{name_of(name)}]"
    table = mapping(value, where)
    lump = text(get(table, "lump", where), f"{where}.lump")
    if lump not in lumps:
        raise InputError(f"{name_of(lump)} is not a lump", where=f"{where}.lump")
    if "reference_temperature" not in table:
        raise InputError("'reference_temperature' is missing", where=where,
                         expected=f"beside {_FIELD!r} the temperature at which the power is stated [K]")
    slope, reference = exact(table[_FIELD], f"{where}.{_FIELD}"), exact(table["reference_temperature"], where)
    return Heater(name, list(lumps).index(lump), (slope, slope), reference)
