"""Rated values of a thermoelectric module: what a datasheet says at one hot-side temperature, and what a module gives.

With S, R, K at T_avg = (T_h + T_c)/2 and no load, the heat balance of the cold face is
S T_c I - ½ R I² = K (T_h - T_c). Along it dT_c/dI = 0 where S T_c = R I: the current of the largest difference,
whatever the slopes of S, R, K. Hence
½ S² T_c²/R = K (T_h - T_c) there, and the voltage is S T_h.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from .._checks import positive_number
from ..errors import InputError
from ._checks import kelvin
from ._parts import Linear, Module

_HIGHEST_DT = 90.0  # single-stage modules reach about 80 K
_HIGHEST_I = 200.0
_HIGHEST_FIGURE = 0.005  # 1/K: the best modules reach 0.0033
_CONSISTENT = 2.0  # Qmax of a consistent sheet lies within this factor of the one that follows from Vmax
_COLDEST = 50.0  # K: below, no module of these cools


@dataclass(frozen=True)
class Rating:
    """One hot-side column of a datasheet.

    Parameters
    ----------
    t_hot : float
        Hot-side temperature at which the column holds [K]; vendors use 25, 27 or 50 °C.
    v_max : float
        Voltage at the current of largest temperature difference [V].
    i_max : float
        Current of the largest temperature difference [A].
    dt_max : float
        Largest temperature difference between the faces [K], without heat load.
    q_max : float, optional
        Heat pumped at `i_max` without temperature difference [W]; without it nothing checks the sheet.

    Raises
    ------
    InputError
        A number that is missing, not positive, or by its size in another unit; numbers that contradict each other.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.Rating(t_hot=300.15, v_max=15.5, i_max=3.9, dt_max=70.0, q_max=32.0).t_cold
    230.15
    """

    t_hot: float
    v_max: float
    i_max: float
    dt_max: float
    q_max: float | None = None

    def __post_init__(self) -> None:
        values = {"v_max": positive_number(self.v_max, "v_max", "V"),
                  "i_max": positive_number(self.i_max, "i_max", "A"), "t_hot": kelvin(self.t_hot, "argument t_hot")}
        values["dt_max"] = _difference(self.dt_max, values["t_hot"])
        if values["i_max"] > _HIGHEST_I:
            raise InputError(f"{values['i_max']:g} A is more than any single module takes: it looks like milliampere",
                             where="argument i_max", expected="ampere", remedy="Divide by 1000.")
        missing = self.q_max is None or self.q_max != self.q_max  # a missing entry of a table of datasheets is NaN
        for name, value in values.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "q_max", None if missing else positive_number(self.q_max, "q_max", "W"))
        _refuse_contradiction(self)

    @property
    def t_cold(self) -> float:
        """Cold face without load at the largest difference [K]."""
        return self.t_hot - self.dt_max

    @property
    def t_mean(self) -> float:
        """Mean temperature of the faces at the largest difference [K]: where the properties hold."""
        return self.t_hot - 0.5 * self.dt_max


def _difference(value: float, t_hot: float) -> float:
    dt_max = positive_number(value, "dt_max", "K")
    if dt_max > _HIGHEST_DT:
        hint = f"; {dt_max - 273.15:.4g} °C would be a temperature" if dt_max > 273.15 else ""
        raise InputError(f"{dt_max:g} K: single-stage modules do not exceed about 80 K{hint}", where="argument dt_max",
                         expected="a temperature difference in kelvin",
                         remedy="A difference in Fahrenheit is divided by 1.8; one that a shop converted like a "
                         f"temperature was {(dt_max - 32) / 1.8:.1f} K. Multi-stage modules need another model.")
    figure = 2 * dt_max / (t_hot - dt_max) ** 2
    if figure > _HIGHEST_FIGURE:
        raise InputError(f"{dt_max:g} K at a hot side of {t_hot:g} K means a figure of merit of {figure:.2g} 1/K",
                         where="argument dt_max",
                         expected=f"below {_HIGHEST_FIGURE:g} 1/K; the best modules reach 0.0033",
                         remedy="Is the hot side in another unit, or is it a multi-stage module?")
    return dt_max


def _refuse_contradiction(one: Rating) -> None:
    """Qmax from Vmax is ½ Vmax Imax (1 + dTmax/Th); published sheets miss it by up to 17 %, a slip of units by 1000."""
    if one.q_max is None:
        return
    expected = 0.5 * one.v_max * one.i_max * (1 + one.dt_max / one.t_hot)
    if not 1 / _CONSISTENT < one.q_max / expected < _CONSISTENT:
        raise InputError(f"Qmax = {one.q_max:g} W, but Vmax · Imax = {one.v_max * one.i_max:.4g} W means about "
                         f"{expected:.4g} W", where="argument q_max",
                         expected=f"½ Vmax Imax (1 + dTmax/Th), within a factor of {_CONSISTENT:g}",
                         remedy="Check the units (mA, mV, mW) and that all four numbers are of one column.")


@dataclass(frozen=True)
class Properties:
    """S, R and K of a module, linear in the mean temperature of its faces.

    Parameters
    ----------
    seebeck, resistance, conductance : Linear
        Values [V/K], [Ω], [W/K] at the reference temperature, and their slopes per kelvin.
    reference_temperature : float
        Mean temperature of the faces at which the values hold [K].

    Examples
    --------
    >>> import robthermal as rt
    >>> p = rt.thermal.Properties(*(rt.thermal.Linear(value=value) for value in (0.05, 2.0, 0.5)), 300.0)
    >>> rated = p.rated(300.0)
    >>> round(rated.v_max, 3), round(rated.dt_max, 2)
    (15.0, 67.54)
    """

    seebeck: Linear
    resistance: Linear
    conductance: Linear
    reference_temperature: float

    @classmethod
    def of(cls, module: Module) -> Properties:
        """Those of a module of a system.

        Parameters
        ----------
        module : Module
            Module with its three properties; Thomson heat and other effects do not count here.
        """
        return cls(module.seebeck, module.resistance, module.conductance, module.reference_temperature)

    def at(self, t_mean: float) -> tuple[float, float, float]:
        """S [V/K], R [Ω], K [W/K] at a mean temperature.

        Parameters
        ----------
        t_mean : float
            Mean temperature of the faces [K].
        """
        above = t_mean - self.reference_temperature
        S, R, K = (p.value + p.slope * above for p in (self.seebeck, self.resistance, self.conductance))
        if min(S, R, K) <= 0:
            raise InputError(f"S, R, K are {S:.3g} V/K, {R:.3g} Ω, {K:.3g} W/K at {t_mean:.4g} K", where="the module",
                             expected="positive properties", remedy="The slopes do not hold that far: stay nearer to "
                             f"{self.reference_temperature:.4g} K, or take one column of the sheet.")
        return S, R, K

    def rated(self, t_hot: float, i_max: float | None = None) -> Rating:
        """Rated values that a datasheet of this module would say.

        Parameters
        ----------
        t_hot : float
            Hot-side temperature of the column [K].
        i_max : float, optional
            Current at which Qmax is meant [A]; default the current of the largest difference of these properties.
        """
        def surplus(t_cold: float) -> float:
            S, R, K = self.at(0.5 * (t_hot + t_cold))
            return 0.5 * S**2 * t_cold**2 / R - K * (t_hot - t_cold)

        low = self._coldest(t_hot)
        if not surplus(low) < 0:
            raise InputError(f"no largest temperature difference at a hot side of {t_hot:.4g} K", where="the module",
                             expected="properties that hold down to the coldest face",
                             remedy="The slopes do not hold that far: take one column of the sheet.")
        t_cold = float(scipy.optimize.brentq(surplus, low, t_hot, xtol=1e-10))
        S, R, _ = self.at(0.5 * (t_hot + t_cold))
        current = S * t_cold / R
        S_hot, R_hot, _ = self.at(t_hot)
        at = current if i_max is None else i_max
        found = Rating.__new__(Rating)  # what follows from properties is not checked like what a person typed
        for name, value in (("t_hot", t_hot), ("v_max", S * t_hot), ("i_max", current), ("dt_max", t_hot - t_cold),
                            ("q_max", S_hot * t_hot * at - 0.5 * R_hot * at**2)):
            object.__setattr__(found, name, float(value))
        return found

    def _coldest(self, t_hot: float) -> float:
        """Lowest cold face at which all properties are still positive."""
        low = _COLDEST
        for p in (self.seebeck, self.resistance, self.conductance):
            if p.slope > 0:
                low = max(low, 2 * (self.reference_temperature - 0.999 * p.value / p.slope) - t_hot)
        return low


def misfit(found: Rating, sheet: Rating) -> dict[str, float]:
    """Relative difference of every number, found / sheet - 1 [-]; NaN where the sheet has none."""
    return {name: np.nan if getattr(sheet, name) is None else getattr(found, name) / getattr(sheet, name) - 1.0
            for name in ("v_max", "i_max", "dt_max", "q_max")}
