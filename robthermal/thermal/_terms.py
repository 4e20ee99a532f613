"""Heat that is not linear in temperature, and its simplest kinds: natural convection and radiation.

Every term acts between two nodes a and b (lumps or ambients) and returns the heat that flows *into* each of them. It
may be driven by one column of w (`_drives.py`): a current, a heater, a step. All functions are vectorized: temperatures
(..., n_pairs), and analytic, so that a complex step differentiates them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Indices = NDArray[np.intp]
COLDEST = 1.0  # K; an iteration that passes below has not converged, and a power of less than nothing is no number


@dataclass(frozen=True)
class Slopes:
    """Partial derivatives of the heats into a and b; each (..., n_pairs) [W/K], [W per unit of the drive]."""

    aa: Array  # d heat into a / d T_a
    ab: Array
    ba: Array
    bb: Array
    a_drive: Array
    b_drive: Array


class Term(Protocol):
    """Heat between pairs of nodes.

    `table` and `components` say which part of the system each pair belongs to, `fields` which of its parameters the
    term knows, `supply` where its energy comes from: "modules" or "inputs", by number in `supply_index`; "sources"; or
    "" for plain links, which only pass heat on.
    """

    table: ClassVar[str]
    fields: ClassVar[tuple[str, ...]]
    supply: ClassVar[str]

    @property
    def components(self) -> tuple[str, ...]:
        """Part of every pair."""

    @property
    def a(self) -> Indices:
        """First node of every pair."""

    @property
    def b(self) -> Indices:
        """Second node of every pair; the first one again where there is none."""

    @property
    def drive(self) -> Indices:
        """Column of w that drives every pair; empty for what nothing drives."""

    @property
    def supply_index(self) -> Indices:
        """Number of the module or heater whose energy meter counts the pair."""

    def heat(self, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Heat into a and into b [W]."""

    def slopes(self, Ta: Array, Tb: Array, drive: Array) -> Slopes:
        """Partial derivatives of `heat`."""

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Derivative of `heat` with respect to one named parameter of every pair."""


@dataclass(frozen=True)
class LinkTerm:
    """What the nonlinear links share: no drive, and an ambient end seen warmer by the other end's `gradient`."""

    table: ClassVar[str] = "links"
    supply: ClassVar[str] = ""

    components: tuple[str, ...]
    a: Indices
    b: Indices
    warmer_a: Array  # added to the temperature of end a where that is an ambient [K]
    warmer_b: Array

    @property
    def drive(self) -> Indices:
        """Nothing drives a link."""
        return np.zeros(0, np.intp)

    @property
    def supply_index(self) -> Indices:
        """Nobody: heat of a link is the ambients'."""
        return np.zeros(0, np.intp)


@dataclass(frozen=True)
class NaturalTerm(LinkTerm):
    """Natural convection: gain |dT|^exponent dT from the warmer to the colder node."""

    fields: ClassVar[tuple[str, ...]] = ("natural.gain", "natural.exponent")

    gain: Array
    exponent: Array

    def heat(self, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Heat into a and b [W]."""
        dT = self._difference(Ta, Tb)
        flow = self.gain * _power(dT, self.exponent) * dT
        return flow, -flow

    def _difference(self, Ta: Array, Tb: Array) -> Array:
        return Tb - Ta + (self.warmer_b - self.warmer_a)

    def slopes(self, Ta: Array, Tb: Array, drive: Array) -> Slopes:
        """Conductance gain (1 + exponent) |dT|^exponent."""
        g = self.gain * (1 + self.exponent) * _power(self._difference(Ta, Tb), self.exponent)
        zero = np.zeros_like(g)
        return Slopes(aa=-g, ab=g, ba=g, bb=-g, a_drive=zero, b_drive=zero)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Derivatives with respect to ``natural.gain`` and ``natural.exponent``."""
        dT = self._difference(Ta, Tb)
        flow = _power(dT, self.exponent) * dT
        if field == "natural.exponent":
            size = np.where(dT == 0, 1.0, _modulus(dT))  # |dT|^c dT log|dT| vanishes at dT = 0
            flow = self.gain * flow * np.log(size)
        return flow, -flow


@dataclass(frozen=True)
class RadiationTerm(LinkTerm):
    """Radiation: coefficient (T_a⁴ - T_b⁴), kelvin."""

    fields: ClassVar[tuple[str, ...]] = ("radiation",)

    coefficient: Array

    def heat(self, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Heat into a and b [W]."""
        flow = self.coefficient * ((Tb + self.warmer_b) ** 4 - (Ta + self.warmer_a) ** 4)
        return flow, -flow

    def slopes(self, Ta: Array, Tb: Array, drive: Array) -> Slopes:
        """4 coefficient T³ at each end."""
        ga = 4 * self.coefficient * (Ta + self.warmer_a) ** 3
        gb = 4 * self.coefficient * (Tb + self.warmer_b) ** 3
        zero = np.zeros_like(ga)
        return Slopes(aa=-ga, ab=gb, ba=ga, bb=-gb, a_drive=zero, b_drive=zero)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Derivative with respect to ``radiation``."""
        flow = (Tb + self.warmer_b) ** 4 - (Ta + self.warmer_a) ** 4
        return flow, -flow


@dataclass(frozen=True)
class PowerTerm(LinkTerm):
    """What a conductance gains with its temperature: conductance ((T / T_ref)^exponent - 1) (T_b - T_a).

    T is the mean of both ends.
    """

    fields: ClassVar[tuple[str, ...]] = ("conductance", "temperature_law.exponent",
                                         "temperature_law.reference_temperature")

    conductance: Array
    exponent: Array
    T_ref: Array

    def _ratio(self, Ta: Array, Tb: Array) -> Array:
        mean = 0.5 * (Ta + Tb + self.warmer_a + self.warmer_b)
        return np.where(mean.real > COLDEST, mean, COLDEST) / self.T_ref

    def _difference(self, Ta: Array, Tb: Array) -> Array:
        return Tb - Ta + (self.warmer_b - self.warmer_a)

    def heat(self, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Heat into a and b [W]."""
        flow = self.conductance * (self._ratio(Ta, Tb) ** self.exponent - 1) * self._difference(Ta, Tb)
        return flow, -flow

    def slopes(self, Ta: Array, Tb: Array, drive: Array) -> Slopes:
        """The conductance gained, and its change with the mean."""
        ratio = self._ratio(Ta, Tb)
        factor = ratio ** self.exponent
        gained = self.conductance * (factor - 1)
        bend = 0.5 * self.conductance * self.exponent * factor / (ratio * self.T_ref) * self._difference(Ta, Tb)
        zero = np.zeros_like(gained)
        return Slopes(aa=bend - gained, ab=bend + gained, ba=gained - bend, bb=-gained - bend, a_drive=zero,
                      b_drive=zero)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, drive: Array) -> tuple[Array, Array]:
        """Derivatives with respect to `fields`."""
        ratio = self._ratio(Ta, Tb)
        factor = ratio ** self.exponent
        by = {"conductance": factor - 1, "temperature_law.exponent": self.conductance * factor * np.log(ratio),
              "temperature_law.reference_temperature": -self.conductance * factor * self.exponent / self.T_ref}
        flow = by[field] * self._difference(Ta, Tb)
        return flow, -flow


def _modulus(x: Array) -> Array:
    """|x|, analytic in the sense of a complex step: sign of the real part times x."""
    return np.where(x.real < 0, -x, x)


def _power(x: Array, exponent: Array) -> Array:
    """|x|^exponent, with 0^exponent = 0 also for exponent = 0+."""
    return _modulus(x) ** exponent
