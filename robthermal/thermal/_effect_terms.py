"""Heats of single effects: heater power that follows temperature, leads, condensation, a link that changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ._terms import Array, Indices, Slopes


@dataclass(frozen=True)
class HeaterTerm:
    """What a heater's power gains with its lump's temperature: gain slope (T_a - T_ref) v, a share of it into b."""

    table: ClassVar[str] = "inputs"
    supply: ClassVar[str] = "inputs"
    fields: ClassVar[tuple[str, ...]] = ("gain", "power_slope", "feedthrough.share")

    components: tuple[str, ...]
    a: Indices
    b: Indices
    drive: Indices
    supply_index: Indices
    gain: Array
    slope: Array
    share: Array
    T_ref: float

    def heat(self, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Heat into the heater's lump and into the one it feeds through to [W]."""
        power = self.gain * self.slope * (Ta - self.T_ref) * drive
        return (1 - self.share) * power, self.share * power

    def slopes(self, Ta: Array, Tb: Array, drive: Array) -> Slopes:
        """The power follows T_a only."""
        g, by_drive = self.gain * self.slope * drive, self.gain * self.slope * (Ta - self.T_ref)
        zero, own = np.zeros_like(g), 1 - self.share
        return Slopes(aa=own * g, ab=zero, ba=self.share * g, bb=zero, a_drive=own * by_drive,
                      b_drive=self.share * by_drive)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Derivatives with respect to `fields`, and to the reference temperature."""
        warmer = (Ta - self.T_ref) * drive
        if field == "feedthrough.share":
            moved = self.gain * self.slope * warmer
            return -moved, moved
        power = {"gain": self.slope * warmer, "power_slope": self.gain * warmer,
                 "reference": -self.gain * self.slope * drive}[field]
        return (1 - self.share) * power, self.share * power


@dataclass(frozen=True)
class LeadTerm:
    """Lead and contact heating: resistance I² into a lump."""

    table: ClassVar[str] = "leads"
    supply: ClassVar[str] = "modules"
    fields: ClassVar[tuple[str, ...]] = ("resistance",)

    components: tuple[str, ...]
    a: Indices
    drive: Indices
    supply_index: Indices
    resistance: Array

    @property
    def b(self) -> Indices:
        """No second node."""
        return self.a

    def heat(self, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Heat into the lump [W]."""
        power = self.resistance * drive * drive + 0 * Ta
        return power, 0 * power

    def slopes(self, Ta: Array, Tb: Array, drive: Array) -> Slopes:
        """Of the current only."""
        zero = 0 * Ta * drive
        return Slopes(zero, zero, zero, zero, a_drive=2 * self.resistance * drive + zero, b_drive=zero)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Derivative with respect to ``resistance``."""
        square = drive * drive
        return square, 0 * square


@dataclass(frozen=True)
class CondensationTerm:
    """Condensation: conductance max(0, dew_point - T) into a lump."""

    table: ClassVar[str] = "lumps"
    supply: ClassVar[str] = "sources"
    fields: ClassVar[tuple[str, ...]] = ("condensation.conductance", "condensation.dew_point")

    components: tuple[str, ...]
    a: Indices
    conductance: Array
    dew_point: Array

    @property
    def b(self) -> Indices:
        """No second node."""
        return self.a

    @property
    def drive(self) -> Indices:
        """Nothing drives it."""
        return np.zeros(0, np.intp)

    @property
    def supply_index(self) -> Indices:
        """The moist air."""
        return np.zeros(0, np.intp)

    def _below(self, Ta: Array) -> Array:
        return np.where(Ta.real < self.dew_point, self.dew_point - Ta, 0 * Ta)

    def heat(self, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Heat into the lump [W]."""
        flow = self.conductance * self._below(Ta)
        return flow, 0 * flow

    def slopes(self, Ta: Array, Tb: Array, drive: Array) -> Slopes:
        """-conductance below the dew point, 0 above."""
        g = self.conductance * (Ta.real < self.dew_point)
        zero = 0 * g
        return Slopes(aa=-g, ab=zero, ba=zero, bb=zero, a_drive=zero, b_drive=zero)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Derivatives with respect to ``condensation.conductance`` and ``condensation.dew_point``."""
        flow = self._below(Ta) if field.endswith("conductance") else self.conductance * (Ta.real < self.dew_point)
        return flow, 0 * flow


@dataclass(frozen=True)
class StepTerm:
    """A link that changes: conductance relative (T_b - T_a), driven by 0 before and 1 after its time."""

    table: ClassVar[str] = "links"
    supply: ClassVar[str] = ""
    fields: ClassVar[tuple[str, ...]] = ("conductance", "step.relative")

    components: tuple[str, ...]
    a: Indices
    b: Indices
    drive: Indices
    conductance: Array
    relative: Array
    warmer: Array  # by how much the gradient makes end b warmer than end a [K]

    @property
    def supply_index(self) -> Indices:
        """Nobody: heat of a link is the ambients'."""
        return np.zeros(0, np.intp)

    def heat(self, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Heat into a and b [W]."""
        flow = self.conductance * self.relative * drive * (Tb - Ta + self.warmer)
        return flow, -flow

    def slopes(self, Ta: Array, Tb: Array, drive: Array) -> Slopes:
        """The added conductance."""
        added = self.conductance * self.relative
        g, by_drive = added * drive, added * (Tb - Ta + self.warmer)
        return Slopes(aa=-g, ab=g, ba=g, bb=-g, a_drive=by_drive, b_drive=-by_drive)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Derivatives with respect to ``conductance`` and ``step.relative``."""
        flow = (self.relative if field == "conductance" else self.conductance) * drive * (Tb - Ta + self.warmer)
        return flow, -flow


@dataclass(frozen=True)
class FollowTerm:
    """A link that follows a column: conductance relative |v| (T_b - T_a), v what the column's drive makes of it."""

    table: ClassVar[str] = "links"
    supply: ClassVar[str] = ""
    fields: ClassVar[tuple[str, ...]] = ("conductance", "follow.relative")

    components: tuple[str, ...]
    a: Indices
    b: Indices
    drive: Indices
    conductance: Array
    relative: Array
    warmer: Array  # by how much the gradient makes end b warmer than end a [K]

    @property
    def supply_index(self) -> Indices:
        """Nobody: heat of a link is the ambients'."""
        return np.zeros(0, np.intp)

    def heat(self, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Heat into a and b [W]."""
        flow = self.conductance * self.relative * _modulus(drive) * (Tb - Ta + self.warmer)
        return flow, -flow

    def slopes(self, Ta: Array, Tb: Array, drive: Array) -> Slopes:
        """The added conductance; at v = 0, where |v| has no slope, that of the mean of both sides, 0."""
        added = self.conductance * self.relative
        g, by_drive = added * _modulus(drive), added * np.sign(drive.real) * (Tb - Ta + self.warmer)
        return Slopes(aa=-g, ab=g, ba=g, bb=-g, a_drive=by_drive, b_drive=-by_drive)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Derivatives with respect to ``conductance`` and ``follow.relative``."""
        factor = self.relative if field == "conductance" else self.conductance
        flow = factor * _modulus(drive) * (Tb - Ta + self.warmer)
        return flow, -flow


def _modulus(value: Array) -> Array:
    """|value|, analytic but at 0: a complex step goes through it."""
    return np.where(value.real < 0, -value, value)
