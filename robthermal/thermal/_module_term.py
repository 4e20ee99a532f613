"""Heat of the thermoelectric modules that depends on their current or is not linear in temperature."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ._terms import Array, Indices, Slopes


@dataclass(frozen=True)
class ModuleTerm:
    """Thermoelectric modules (a hot, b cold) without the constant part K_ref (T_b - T_a), which is a linear link.

    Heat into hot: S T_h I + ½ R I² + (K - K_ref)(T_c - T_h); into cold: -S T_c I + ½ R I² + (K - K_ref)(T_h - T_c),
    S, R, K at T_avg = (T_h + T_c)/2: Evers (5.4)-(5.5), (5.13), corrected. Thomson heat takes ½ μ I (T_h - T_c) from
    both faces; an unequal split moves d R I² of the Joule heat from the hot to the cold face.
    """

    table: ClassVar[str] = "modules"
    supply: ClassVar[str] = "modules"
    fields: ClassVar[tuple[str, ...]] = ("seebeck.value", "seebeck.slope", "resistance.value", "resistance.slope",
                                         "conductance.slope", "reference_temperature", "thomson", "joule_split")

    components: tuple[str, ...]
    a: Indices
    b: Indices
    drive: Indices
    supply_index: Indices  # every module pays for itself
    S: Array
    S_slope: Array
    R: Array
    R_slope: Array
    K_slope: Array
    T_ref: Array
    thomson: Array
    split: Array

    def heat(self, Ta: Array, Tb: Array, current: Array) -> tuple[Array, Array]:
        """Heat into the hot and the cold face [W]."""
        total = Ta + Tb
        pump = (self._S_rest + self._S_half * total) * current  # few operations: this is the innermost loop
        joule = (self._R_rest + self._R_half * total) * (0.5 * current * current)
        if not self._uneven:
            return pump * Ta + joule, joule - pump * Tb
        leak = self.K_slope * (0.5 * total - self.T_ref) * (Ta - Tb) + 2 * self.split * joule
        joule = joule - 0.5 * self.thomson * current * (Ta - Tb)
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
    def _uneven(self) -> bool:
        return any(np.any(value != 0) for value in (self.K_slope, self.thomson, self.split))

    def slopes(self, Ta: Array, Tb: Array, current: Array) -> Slopes:
        """Entries hh, hc, ch, cc of the errata, with S′, R′ and K′, Thomson heat and unequal Joule heat."""
        dT = 0.5 * (Ta + Tb) - self.T_ref
        S = self.S + self.S_slope * dT
        R = self.R + self.R_slope * dT
        half_pump = 0.5 * self.S_slope * current
        joule = 0.25 * self.R_slope * current * current
        hot, cold = (1 - 2 * self.split) * joule, (1 + 2 * self.split) * joule
        leak = self.K_slope * dT
        bend = 0.5 * self.K_slope * (Ta - Tb)
        own = 0.5 * self.thomson * current
        along = 0.5 * self.thomson * (Ta - Tb)
        return Slopes(aa=S * current + half_pump * Ta + hot - leak - bend - own,
                      ab=half_pump * Ta + hot + leak - bend + own, ba=-half_pump * Tb + cold + leak + bend - own,
                      bb=-S * current - half_pump * Tb + cold - leak + bend + own,
                      a_drive=S * Ta + (1 - 2 * self.split) * R * current - along,
                      b_drive=-S * Tb + (1 + 2 * self.split) * R * current - along)

    def parameter_slopes(self, field: str, Ta: Array, Tb: Array, current: Array) -> tuple[Array, Array]:
        """Derivatives with respect to ``seebeck.value`` and so on; `conductance.value` is a linear link."""
        dT = 0.5 * (Ta + Tb) - self.T_ref
        half_square = 0.5 * current * current
        hot, cold = (1 - 2 * self.split) * half_square, (1 + 2 * self.split) * half_square
        if field == "seebeck.value":
            return current * Ta, -current * Tb
        if field == "seebeck.slope":
            return dT * current * Ta, -dT * current * Tb
        if field == "resistance.value":
            return hot, cold
        if field == "resistance.slope":
            return dT * hot, dT * cold
        if field == "conductance.slope":
            return dT * (Tb - Ta), dT * (Ta - Tb)
        if field == "thomson":
            taken = 0.5 * current * (Tb - Ta)
            return taken, taken
        if field == "joule_split":
            moved = 2 * (self.R + self.R_slope * dT) * half_square
            return -moved, moved
        # reference_temperature: every property loses slope x change
        pump, leak = self.S_slope * current, self.K_slope * (Ta - Tb)
        return -pump * Ta - self.R_slope * hot + leak, pump * Tb - self.R_slope * cold - leak


@dataclass(frozen=True)
class RippleTerm(ModuleTerm):
    """Joule heat of modules by what their currents are off their means over a sample: the drive is its rms.

    The mean of I² over a sample is the square of its mean and the square of this; all other heat goes by the mean.
    """

    fields: ClassVar[tuple[str, ...]] = ("resistance.value", "resistance.slope", "reference_temperature", "joule_split")
