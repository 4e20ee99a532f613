"""A module between two temperatures, or on a heat sink: current, voltage, heats, and the sink that it needs.

Cold face: q = S T_c I - ½ R I² - K (T_h - T_c), the load that it absorbs. Hot face: W = q + V I, V as in `_voltage.py`.
On a sink of thermal resistance r to an ambient T_a, T_h = T_a + r W. At a wanted T_c and q, every current has its T_h,
hence its r = (T_h - T_a)/W: the largest r is that of the fold, beyond which no steady state holds load and temperature
(errata of Evers, chapter 5: dq/dI = 0 there), and the module runs away thermally.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from .._checks import finite_number, positive_number
from ..errors import InputError, Outcome
from ._checks import kelvin, non_negative
from ._outcomes import ThermalCode
from ._rating import Properties

_GRID = 400  # currents at which the sink is tried before the best is refined
_HOTTEST = 200.0  # K above the cold face


@dataclass(frozen=True)
class ModulePoint:
    """Steady operating point of a module.

    Parameters
    ----------
    hot, cold : float
        Temperatures of the faces [K].
    current, voltage : float
        At the terminals of the module [A], [V].
    load : float
        Heat absorbed at the cold face [W].
    rejected : float
        Heat rejected at the hot face [W].
    outcome : Outcome
        Code "held", or "not_held": then the point is the nearest one, of the largest load.
    """

    hot: float
    cold: float
    current: float
    voltage: float
    load: float
    rejected: float
    outcome: Outcome

    @property
    def power(self) -> float:
        """Electrical power V I [W]."""
        return self.voltage * self.current

    @property
    def cop(self) -> float:
        """Coefficient of performance, load over electrical power [-]; NaN without current."""
        return self.load / self.power if self.power else float("nan")


def module_point(properties: Properties, *, hot: float, cold: float, load: float | None = None,
                 current: float | None = None) -> ModulePoint:
    """Operating point between two temperatures, at a load or at a current.

    Parameters
    ----------
    properties : Properties
        S, R and K of the module.
    hot, cold : float
        Temperatures of the faces [K].
    load : float, optional
        Heat to absorb at the cold face [W]; the smaller of the two currents that do it is taken.
    current : float, optional
        Current of the module instead of a load [A].

    Returns
    -------
    ModulePoint

    Raises
    ------
    InputError
        Celsius, load and current both given, or neither.

    Examples
    --------
    >>> import robthermal as rt
    >>> sheet = rt.thermal.Rating(t_hot=300.15, v_max=15.5, i_max=3.9, dt_max=70.0)
    >>> module = rt.thermal.invert_datasheet([sheet]).voltage.properties
    >>> point = rt.thermal.module_point(module, hot=310.0, cold=290.0, load=10.0)
    >>> round(point.current, 3), round(point.voltage, 2), round(point.cop, 2)
    (1.275, 4.92, 1.59)
    """
    hot, cold = kelvin(hot, "argument hot"), kelvin(cold, "argument cold")
    if load is not None and current is not None:
        raise InputError("both are given", where="arguments load and current", expected="one of them")
    if load is None:
        return _point(properties, hot, cold, finite_number(current, "current", "A"), ThermalCode.HELD.outcome())
    wanted = finite_number(load, "load", "W")
    S, R, K = properties.at(0.5 * (hot + cold))
    pumped, square = wanted + K * (hot - cold), (S * cold) ** 2
    if square < 2 * R * pumped:
        most = _point(properties, hot, cold, S * cold / R, ThermalCode.HELD.outcome())
        return _point(properties, hot, cold, S * cold / R, ThermalCode.NOT_HELD.outcome(
            f"Between {cold:.2f} K and {hot:.2f} K the module absorbs at most {most.load:.4g} W, at {most.current:.4g} "
            f"A; {wanted:.4g} W are wanted:"))
    amperes = 2 * pumped / (S * cold + np.sqrt(square - 2 * R * pumped))  # the smaller root, without cancellation
    return _point(properties, hot, cold, float(amperes), ThermalCode.HELD.outcome())


@dataclass(frozen=True)
class SinkSize:
    """The heat sink that a module needs to hold a load at a temperature.

    Parameters
    ----------
    properties : Properties
        S, R and K of the module.
    ambient : float
        Temperature of the surroundings of the sink [K].
    load : float
        Heat to absorb [W].
    resistance : float
        Largest thermal resistance from the hot face to the ambient with which load and temperature are held [K/W];
        0 where none is small enough.
    limit : ModulePoint
        Operating point with that resistance: at the fold, without any margin.
    outcome : Outcome
        Code "held", or "not_held" where no sink suffices.
    """

    properties: Properties
    ambient: float
    load: float
    resistance: float
    limit: ModulePoint
    outcome: Outcome

    def point(self, resistance: float) -> ModulePoint:
        """Operating point on a sink, the one of smaller current.

        Parameters
        ----------
        resistance : float
            Thermal resistance from the hot face to the ambient [K/W].

        Returns
        -------
        ModulePoint
            With "not_held", the point of the largest resistance, where this one is larger.
        """
        wanted = positive_number(resistance, "resistance", "K/W")
        if not self.outcome or wanted > self.resistance:
            most = self.limit
            why = ThermalCode.NOT_HELD.outcome(f"The sink has {wanted:.4g} K/W, at most {self.resistance:.4g} K/W hold "
                                               f"{self.load:.4g} W at {most.cold:.2f} K:")
            return ModulePoint(most.hot, most.cold, most.current, most.voltage, most.load, most.rejected, why)
        best = module_point(self.properties, hot=self.ambient, cold=self.limit.cold, load=self.load)  # of resistance 0

        def excess(current: float) -> float:
            return _resistance(self.properties, self.limit.cold, self.ambient, self.load, current) - wanted

        low = best.current if excess(best.current) < 0 else 0.0
        current = float(scipy.optimize.brentq(excess, low, self.limit.current, xtol=1e-12))
        hot = _hot_face(self.properties, self.limit.cold, self.load, current)
        return _point(self.properties, hot, self.limit.cold, current, ThermalCode.HELD.outcome())


def size_sink(properties: Properties, *, cold: float, ambient: float, load: float) -> SinkSize:
    """Largest thermal resistance of a heat sink with which a module holds a load at a temperature.

    Parameters
    ----------
    properties : Properties
        S, R and K of the module.
    cold : float
        Temperature to hold at the cold face, below the ambient [K].
    ambient : float
        Temperature of the surroundings of the sink [K].
    load : float
        Heat to absorb at the cold face [W].

    Returns
    -------
    SinkSize

    Raises
    ------
    InputError
        Celsius, a negative load, a cold face that is not below the ambient.

    Examples
    --------
    >>> import robthermal as rt
    >>> sheet = rt.thermal.Rating(t_hot=300.15, v_max=15.5, i_max=3.9, dt_max=70.0)
    >>> module = rt.thermal.invert_datasheet([sheet]).voltage.properties
    >>> sink = rt.thermal.size_sink(module, cold=283.15, ambient=298.15, load=8.0)
    >>> round(sink.resistance, 3), round(sink.limit.current, 2)
    (1.253, 2.22)
    >>> on_half = sink.point(0.5 * sink.resistance)
    >>> round(on_half.current, 2), round(on_half.hot - 273.15, 1)
    (1.25, 34.0)
    """
    cold, ambient = kelvin(cold, "argument cold"), kelvin(ambient, "argument ambient")
    load = non_negative(load, "argument load", "W")
    if cold >= ambient:
        raise InputError(f"the cold face at {cold:g} K is not below the ambient of {ambient:g} K",
                         where="argument cold", expected="a temperature below the ambient",
                         remedy="Above it no module is needed to cool.")
    perfect = module_point(properties, hot=ambient, cold=cold, load=load)
    if not perfect.outcome:
        return SinkSize(properties, ambient, load, 0.0, perfect, ThermalCode.NOT_HELD.outcome(
            f"Even with its hot face at the ambient of {ambient:.2f} K the module absorbs at most {perfect.load:.4g} W "
            f"at {cold:.2f} K; {load:.4g} W are wanted:"))
    S, R, _ = properties.at(cold)
    currents = np.linspace(perfect.current, S * cold / R, _GRID)
    found = np.array([_resistance(properties, cold, ambient, load, current) for current in currents])
    k = int(found.argmax())
    around = (currents[max(k - 1, 0)], currents[min(k + 1, _GRID - 1)])
    best = scipy.optimize.minimize_scalar(
        lambda current: -_resistance(properties, cold, ambient, load, current), bounds=around, method="bounded",
        options={"xatol": 1e-10})
    current = float(best.x)
    hot = _hot_face(properties, cold, load, current)
    limit = _point(properties, hot, cold, current, ThermalCode.HELD.outcome())
    return SinkSize(properties, ambient, load, -float(best.fun), limit, ThermalCode.HELD.outcome())


def _resistance(properties: Properties, cold: float, ambient: float, load: float, current: float) -> float:
    """Thermal resistance of the sink on which a current holds load and cold face [K/W]."""
    hot = _hot_face(properties, cold, load, current)
    point = _point(properties, hot, cold, current, ThermalCode.HELD.outcome())
    return (hot - ambient) / point.rejected if point.rejected > 0 else 0.0


def _hot_face(properties: Properties, cold: float, load: float, current: float) -> float:
    """Temperature of the hot face [K] at which a current absorbs the load."""
    def surplus(hot: float) -> float:
        S, R, K = properties.at(0.5 * (hot + cold))
        return S * cold * current - 0.5 * R * current**2 - K * (hot - cold) - load

    S, R, K = properties.at(cold)
    low = cold - max(load + 0.5 * R * current**2, 0.0) / K - 1.0
    high = cold + _HOTTEST
    if surplus(high) > 0:
        raise InputError(f"the hot face would be more than {_HOTTEST:g} K above the cold one", where="the module",
                         expected="a module whose sheet allows for such a load", remedy="Is its conductance right?")
    return float(scipy.optimize.brentq(surplus, low, high, xtol=1e-10))


def _point(properties: Properties, hot: float, cold: float, current: float, outcome: Outcome) -> ModulePoint:
    S, R, K = properties.at(0.5 * (hot + cold))
    voltage = S * (hot - cold) + R * current
    load = S * cold * current - 0.5 * R * current**2 - K * (hot - cold)
    return ModulePoint(hot, cold, current, voltage, load, load + voltage * current, outcome)
