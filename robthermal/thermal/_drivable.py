"""What the electronics can drive: current range of a module on its supply and bridge, with the reason."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from .._celsius import ZERO_CELSIUS
from ._parts import Module
from ._supply import Supply

Interval = tuple[float, float]
_HALVINGS = 60  # of the searched range of currents


@dataclass(frozen=True)
class DrivableRange:
    """Currents that a module may have by its rating and can have from its supply.

    Parameters
    ----------
    low, high : float
        Ends of the range [A]; infinite where nothing limits them.
    why_low, why_high : str
        What limits each end, in a sentence; empty where nothing does.

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.thermal.drivable_range(rt.systems.surrogate_module("sink", "stage"))
    >>> found.high, found.why_high
    (3.3, 'current_limits')
    """

    low: float
    high: float
    why_low: str
    why_high: str

    def __str__(self) -> str:
        return f"{self.low:.4g} A ({self.why_low or 'no limit'}) to {self.high:.4g} A ({self.why_high or 'no limit'})"


def drivable_range(module: Module, temperature: Interval | None = None) -> DrivableRange:
    """Current range of a module: declared, of its bridge, and what its supply voltage drives at all temperatures.

    The supply drives a current I at all temperatures of the faces if
    abs((S - thomson)(T_hot - T_cold) + (R + r) I) is at
    most duty times voltage for the worst of them; r is the resistance in series. The largest such I is exact for S and
    R linear in the mean temperature, rounded down.

    Parameters
    ----------
    module : Module
        With `current_limits` and `supply`, each optional.
    temperature : tuple of float, optional
        Coldest and hottest temperature of both faces [K]; without it the supply voltage limits nothing.

    Returns
    -------
    DrivableRange

    Examples
    --------
    A module for 6.4 A on a bridge for 4 A, and one for 15 V on 12 V of which the bridge passes 90 %:

    >>> import robthermal as rt
    >>> part = {"hot": "sink", "cold": "stage", "seebeck": 0.05, "resistance": 2.0, "conductance": 0.5}
    >>> bridge = rt.thermal.Module(**part, current_limits=(-6.4, 6.4), supply={"current": 4.0})
    >>> print(rt.thermal.drivable_range(bridge))
    -4 A (bridge or supply, 4 A) to 4 A (bridge or supply, 4 A)
    >>> volts = rt.thermal.Module(**part, current_limits=(-6.4, 6.4), supply={"voltage": 12.0, "duty": 0.9})
    >>> rt.thermal.drivable_range(volts, (278.15, 338.15)).why_high
    '12 V at a duty of 0.9, faces anywhere between 5 and 65 °C'
    >>> round(rt.thermal.drivable_range(volts, (278.15, 338.15)).high, 6)  # (0.9*12 - 0.05*60)/2
    3.9
    """
    low, high = module.current_limits or (-inf, inf)
    why = dict.fromkeys(("low", "high"), "current_limits" if module.current_limits else "")
    supply = module.supply
    if supply is None:
        return DrivableRange(low, high, why["low"], why["high"])
    if not supply.reversible and low < 0.0:
        low, why["low"] = 0.0, "the bridge cannot reverse the current"
    ends: list[tuple[float, float, str]] = []
    if supply.current is not None:
        ends.append((supply.current, supply.current, f"bridge or supply, {supply.current:g} A"))
    if supply.voltage is not None and temperature is not None:
        cooling, heating = (_largest(module, supply, temperature, sign) for sign in (1.0, -1.0))
        at = " and ".join(f"{end - ZERO_CELSIUS:g}" for end in temperature)
        ends.append((cooling, heating, f"{supply.voltage:g} V at a duty of {supply.duty:g}, faces anywhere between "
                     f"{at} °C"))
    for cooling, heating, reason in ends:
        if cooling < high:
            high, why["high"] = cooling, reason
        if -heating > low:
            low, why["low"] = -heating, reason
    return DrivableRange(low, high, why["low"], why["high"])


def _largest(module: Module, supply: Supply, temperature: Interval, sign: float) -> float:
    """Largest size of a current of this sign that the supply drives at all temperatures [A]; from below."""
    assert supply.voltage is not None
    available = supply.duty * supply.voltage

    def short(size: float) -> bool:
        return _needed(module, supply.resistance, sign * size, temperature, sign) > available

    if short(0.0):
        return 0.0
    low, high = 0.0, 1.0
    while not short(high):
        low, high = high, 2.0 * high
        if high > 1e6:  # resistance that falls to nothing at the cold end: no current is too large for the voltage
            return inf
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if short(middle) else (middle, high)
    return low


def _needed(module: Module, series: float, current: float, temperature: Interval, sign: float) -> float:
    """Most voltage, in the direction of the current, over all temperatures of the faces [V].

    With the mean temperature T_m = (T_h + T_c)/2 the voltage is a sum of one quadratic in T_h and one in T_c.
    """
    S, R, at = module.seebeck, module.resistance, module.reference_temperature
    level, bend = S.value - module.thomson - S.slope * at, 0.5 * S.slope
    rise = 0.5 * R.slope * current
    hot = _most(lambda t: sign * (level * t + bend * t * t + rise * t), temperature, sign * bend, sign * (level + rise))
    cold = _most(lambda t: sign * (-level * t - bend * t * t + rise * t), temperature, -sign * bend,
                 sign * (rise - level))
    return hot + cold + sign * (R.value - R.slope * at + series) * current


def _most(f: Callable[[float], float], interval: Interval, square: float, linear: float) -> float:
    """Largest value of square·t² + linear·t on an interval: at an end, or at the vertex."""
    ends = [f(t) for t in interval]
    if square < 0.0 and interval[0] < -linear / (2.0 * square) < interval[1]:
        ends.append(f(-linear / (2.0 * square)))
    return max(ends)
