"""Heat that is not linear in temperature: thermoelectric modules, natural convection, radiation.

Every term acts between two nodes a and b (lumps or ambients) and returns the heat that flows *into* each of them.
All functions are vectorised: temperatures (..., n_terms), and analytic, so that a complex step differentiates them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Slopes:
    """Partial derivatives of the heats into a and b; each (..., n_terms) [W/K], [W/A]."""

    aa: Array  # d heat into a / d T_a
    ab: Array
    ba: Array
    bb: Array
    a_current: Array
    b_current: Array


class Term(Protocol):
    """Heat between pairs of nodes."""

    @property
    def a(self) -> Indices:
        """First node of every pair."""

    @property
    def b(self) -> Indices:
        """Second node of every pair."""

    def heat(self, Ta: Array, Tb: Array, current: Array) -> tuple[Array, Array]:
        """Heat into a and into b [W]."""

    def slopes(self, Ta: Array, Tb: Array, current: Array) -> Slopes:
        """Partial derivatives of `heat`."""

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, current: Array) -> tuple[Array, Array]:
        """Derivative of `heat` with respect to one named parameter of every term."""


@dataclass(frozen=True)
class ModuleTerm:
    """Thermoelectric modules (a hot, b cold) without the constant part K_ref (T_b - T_a), which is a linear link.

    Heat into hot: S T_h I + ½ R I² + (K - K_ref)(T_c - T_h); into cold: -S T_c I + ½ R I² + (K - K_ref)(T_h - T_c),
    S, R, K at T_avg = (T_h + T_c)/2: Evers (5.4)-(5.5), (5.13), corrected.
    """

    a: Indices
    b: Indices
    S: Array
    S_slope: Array
    R: Array
    R_slope: Array
    K_slope: Array
    T_ref: Array

    def heat(self, Ta: Array, Tb: Array, current: Array) -> tuple[Array, Array]:
        """Heat into the hot and the cold face [W]."""
        total = Ta + Tb
        pump = (self._S_rest + self._S_half * total) * current  # few operations: this is the innermost loop
        joule = (self._R_rest + self._R_half * total) * (0.5 * current * current)
        if not self._leaks:
            return pump * Ta + joule, joule - pump * Tb
        leak = self.K_slope * (0.5 * total - self.T_ref) * (Ta - Tb)
        return pump * Ta + joule - leak, joule - pump * Tb + leak

    @cached_property
    def _S_half(self) -> Array:
        return 0.5 * self.S_slope

    @cached_property
    def _S_rest(self) -> Array:
        return self.S - self.S_slope * self.T_ref

    @cached_property
    def _R_half(self) -> Array:
        return 0.5 * self.R_slope

    @cached_property
    def _R_rest(self) -> Array:
        return self.R - self.R_slope * self.T_ref

    @cached_property
    def _leaks(self) -> bool:
        return bool(np.any(self.K_slope != 0))

    def slopes(self, Ta: Array, Tb: Array, current: Array) -> Slopes:
        """Entries hh, hc, ch, cc of the errata, with S′, R′ and K′."""
        dT = 0.5 * (Ta + Tb) - self.T_ref
        S = self.S + self.S_slope * dT
        R = self.R + self.R_slope * dT
        half_pump = 0.5 * self.S_slope * current
        joule = 0.25 * self.R_slope * current * current
        leak = self.K_slope * dT
        bend = 0.5 * self.K_slope * (Ta - Tb)
        return Slopes(aa=S * current + half_pump * Ta + joule - leak - bend, ab=half_pump * Ta + joule + leak - bend,
                      ba=-half_pump * Tb + joule + leak + bend, bb=-S * current - half_pump * Tb + joule - leak + bend,
                      a_current=S * Ta + R * current, b_current=-S * Tb + R * current)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, current: Array) -> tuple[Array, Array]:
        """Derivatives with respect to ``seebeck.value`` and so on; `conductance.value` includes its linear link."""
        dT = 0.5 * (Ta + Tb) - self.T_ref
        half_square = 0.5 * current * current
        if field == "seebeck.value":
            return current * Ta, -current * Tb
        if field == "seebeck.slope":
            return dT * current * Ta, -dT * current * Tb
        if field == "resistance.value":
            return half_square, half_square
        if field == "resistance.slope":
            return dT * half_square, dT * half_square
        if field == "conductance.slope":
            return dT * (Tb - Ta), dT * (Ta - Tb)
        # reference_temperature: every property loses slope x change
        pump, joule, leak = self.S_slope * current, self.R_slope * half_square, self.K_slope * (Ta - Tb)
        return -pump * Ta - joule + leak, pump * Tb - joule - leak


@dataclass(frozen=True)
class NaturalTerm:
    """Natural convection: gain |dT|^exponent dT from the warmer to the colder node."""

    a: Indices
    b: Indices
    gain: Array
    exponent: Array

    def heat(self, Ta: Array, Tb: Array, current: Array) -> tuple[Array, Array]:
        """Heat into a and b [W]."""
        flow = self.gain * _power(Tb - Ta, self.exponent) * (Tb - Ta)
        return flow, -flow

    def slopes(self, Ta: Array, Tb: Array, current: Array) -> Slopes:
        """Conductance gain (1 + exponent) |dT|^exponent."""
        g = self.gain * (1 + self.exponent) * _power(Tb - Ta, self.exponent)
        zero = np.zeros_like(g)
        return Slopes(aa=-g, ab=g, ba=g, bb=-g, a_current=zero, b_current=zero)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, current: Array) -> tuple[Array, Array]:
        """Derivatives with respect to ``natural.gain`` and ``natural.exponent``."""
        dT = Tb - Ta
        flow = _power(dT, self.exponent) * dT
        if field == "natural.exponent":
            size = np.where(dT == 0, 1.0, _modulus(dT))  # |dT|^c dT log|dT| vanishes at dT = 0
            flow = self.gain * flow * np.log(size)
        return flow, -flow


@dataclass(frozen=True)
class RadiationTerm:
    """Radiation: coefficient (T_a⁴ - T_b⁴), kelvin."""

    a: Indices
    b: Indices
    coefficient: Array

    def heat(self, Ta: Array, Tb: Array, current: Array) -> tuple[Array, Array]:
        """Heat into a and b [W]."""
        flow = self.coefficient * (Tb**4 - Ta**4)
        return flow, -flow

    def slopes(self, Ta: Array, Tb: Array, current: Array) -> Slopes:
        """4 coefficient T³ at each end."""
        ga, gb = 4 * self.coefficient * Ta**3, 4 * self.coefficient * Tb**3
        zero = np.zeros_like(ga)
        return Slopes(aa=-ga, ab=gb, ba=ga, bb=-gb, a_current=zero, b_current=zero)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, current: Array) -> tuple[Array, Array]:
        """Derivative with respect to ``radiation``."""
        flow = Tb**4 - Ta**4
        return flow, -flow


def _modulus(x: Array) -> Array:
    """|x|, analytic in the sense of a complex step: sign of the real part times x."""
    return np.where(x.real < 0, -x, x)


def _power(x: Array, exponent: Array) -> Array:
    """|x|^exponent, with 0^exponent = 0 also for exponent = 0+."""
    return _modulus(x) ** exponent
