"""Heaters whose power is linear in the temperature of their lump: q (1 + s (x - w)), q the power at w, s its slope."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

from ._document import get, intervals, mapping, text
from ._exact import Interval, Malformed, exact, short


@dataclass(frozen=True)
class Heater:
    """One heater: the index of its lump, and the ranges of its slope [1/K] and of its power [W] at `reference` [K]."""

    name: str
    lump: int
    reference: Fraction
    slope: Interval
    power: Interval

    @property
    def rise(self) -> Interval:
        """Bounds of the slope of the heat [W/K]: it is bilinear, so that the corners suffice."""
        corners = [q * s for q, s in product(self.power, self.slope)]
        return min(corners), max(corners)

    def heat(self, temperature: Fraction) -> Interval:
        """Bounds of the heat at one temperature [W]."""
        corners = [q * (1 + s * (temperature - self.reference)) for q, s in product(self.power, self.slope)]
        return min(corners), max(corners)


def _follows(item: Any) -> bool:
    """Whether an input of a system has a power that follows temperature."""
    return isinstance(item, Mapping) and "power_slope" in item


def read_heaters(system: Mapping[str, Any], region: Mapping[str, Any], lumps: tuple[str, ...]) -> tuple[Heater, ...]:
    """Return the heaters of a certificate, at the slopes of its system."""
    inputs = mapping(system.get("inputs", {}), "system.inputs")
    own = [name for name in inputs if _follows(inputs[name])]
    powers = intervals(region.get("power", {}), own, "region.power")
    found = []
    for name in own:
        where, item = f"input {short(name)}", inputs[name]
        lump = text(get(item, "lump", where), f"{where}.lump")
        if lump not in lumps:
            raise Malformed(f"{where}: {short(lump)} is not a lump")
        slope = exact(item["power_slope"], f"{where}.power_slope")
        reference = exact(get(item, "reference_temperature", where), f"{where}.reference_temperature")
        found.append(Heater(name, lumps.index(lump), reference, (slope, slope), powers[name]))
    return tuple(found)
