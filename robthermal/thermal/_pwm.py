"""Pulse-width modulation of a module's current: what its ripple costs against a smooth current of the same mean."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, expm1, inf, isfinite, sqrt
from sys import float_info

from ..errors import InputError
from ._parts import Module

_ABOVE_ZERO = float_info.min  # smallest number that is not zero


@dataclass(frozen=True)
class PwmRipple:
    """A module on a bridge that switches between the supply and zero volts.

    Parameters
    ----------
    mean : float
        Mean current [A]: the Peltier heat is that of this current.
    rms : float
        Root mean square of the current [A]: the Joule heat is that of this current.
    duty : float
        Share of the period at the supply [-].
    extra_heat : float
        Joule heat in the module beyond that of a smooth current [W].
    lost_cooling : float
        What of it arrives at the cold face: the module pumps so much less [W].

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.thermal.PwmRipple(mean=1.0, rms=1.1, duty=0.5, extra_heat=0.42, lost_cooling=0.21)
    >>> found.rms
    1.1
    """

    mean: float
    rms: float
    duty: float
    extra_heat: float
    lost_cooling: float

    def __str__(self) -> str:
        return (f"{self.mean:.4g} A mean at a duty of {self.duty:.3g}, {self.rms:.4g} A rms: {self.extra_heat:.3g} W "
                f"more Joule heat than a smooth current, {self.lost_cooling:.3g} W less heat pumped")


def pwm_ripple(module: Module, current: float, *, t_hot: float, t_cold: float, voltage: float, frequency: float,
               inductance: float = 0.0, resistance: float = 0.0) -> PwmRipple:
    """Ripple of the current of a module that a bridge drives by pulse-width modulation, in steady state.

    Temperatures stand still within a period. The current flows on through the bridge while it is off (synchronous
    rectification), so that the circuit is linear: resistance, inductance, and the Seebeck voltage.

    Parameters
    ----------
    module : Module
        Module that is driven.
    current : float
        Mean current wanted; its sign gives the direction [A].
    t_hot, t_cold : float
        Temperatures of its faces [K].
    voltage : float
        Voltage of the supply [V].
    frequency : float
        Switching frequency of the bridge [Hz].
    inductance : float, optional
        In series with the module [H]; 0: no filter.
    resistance : float, optional
        Bridge, filter and cable in series [Ω].

    Returns
    -------
    PwmRipple

    Raises
    ------
    InputError
        The supply cannot drive this mean current; numbers that are not finite, or negative.

    Examples
    --------
    >>> import robthermal as rt
    >>> module = rt.thermal.Module(hot="sink", cold="stage", seebeck=0.05, resistance=2.0, conductance=0.5)
    >>> at = {"t_hot": 298.15, "t_cold": 298.15, "voltage": 12.0, "frequency": 20e3}
    >>> print(rt.thermal.pwm_ripple(module, 1.5, **at))
    1.5 A mean at a duty of 0.25, 3 A rms: 13.5 W more Joule heat than a smooth current, 6.75 W less heat pumped
    >>> rt.thermal.pwm_ripple(module, 1.5, inductance=100e-6, **at).extra_heat < 0.3
    True
    """
    given = {"current": current, "t_hot": t_hot, "t_cold": t_cold, "voltage": voltage, "frequency": frequency,
             "inductance": inductance, "resistance": resistance}
    for name, value in given.items():
        least = {"current": -inf, "inductance": 0.0, "resistance": 0.0}.get(name, _ABOVE_ZERO)
        if not isfinite(value) or value < least:
            raise InputError(f"{name} = {value!r}", where=f"argument {name}", expected="a finite number"
                             + {-inf: "", 0.0: ", not negative"}.get(least, " above zero"))
    away = 0.5 * (t_hot + t_cold) - module.reference_temperature
    R = module.resistance.value + module.resistance.slope * away
    seebeck = module.seebeck.value + module.seebeck.slope * away - module.thomson
    total = R + resistance
    duty = (total * abs(current) + (1.0 if current >= 0.0 else -1.0) * seebeck * (t_hot - t_cold)) / voltage
    if not 0.0 <= duty <= 1.0:
        raise InputError(f"a mean of {current:g} A needs {duty * voltage:.4g} V", where="argument current",
                         expected=f"0 to {voltage:g} V", remedy="Another supply, another current, or colder faces: "
                         "rt.thermal.drivable_range tells what a supply can drive.")
    variance = (voltage / total) ** 2 * _spread(duty, frequency * inductance / total)
    extra = R * variance
    return PwmRipple(float(current), sqrt(current * current + variance), duty, extra,
                     (0.5 + module.joule_split) * extra)


def _spread(duty: float, constant: float) -> float:
    """Variance of a square wave of height 1 behind a lag of `constant` periods: D(1 - D) without lag."""
    if constant == 0.0:
        return duty * (1.0 - duty)
    if constant > 1e3:  # a triangle; the exact expression would be a difference of nearly equal numbers
        return (duty * (1.0 - duty) / constant) ** 2 / 12.0
    on, off = -expm1(-duty / constant), -expm1(-(1.0 - duty) / constant)
    return max(0.0, duty * (1.0 - duty) - constant * on * off / (1.0 - exp(-1.0 / constant)))
