"""Voltage of thermoelectric modules, V = (S - μ)(T_h - T_c) + (R + R_lead) I, and its derivatives.

It follows from the energy balance of `ModuleTerm`: what the two faces reject together is V I. S and R are taken at
T_avg = (T_h + T_c)/2 as there; the Thomson heat μ I (T_h - T_c) is taken from the faces, hence the voltage is less.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._terms import Array

if TYPE_CHECKING:
    from ._equations import Equations
    from ._parts import Module, Sensor


@dataclass(frozen=True)
class Voltage:
    """Voltage that one sensor reads, before its gain and offset.

    Parameters
    ----------
    name : str
        Name of the sensor.
    module_name : str
        Name of its module.
    module : Module
        Properties of the module.
    hot, cold : int
        Places of the two faces among the lumps.
    column : int
        Place of the current among the drives.
    lead_resistance : float
        Resistance of the wires to the terminals [Ω].
    """

    name: str
    module_name: str
    module: Module
    hot: int
    cold: int
    column: int
    lead_resistance: float

    @classmethod
    def of(cls, eq: Equations, name: str, sensor: Sensor) -> Voltage:
        """The voltage that a sensor of a system reads."""
        module = eq.system.modules[sensor.module]
        return cls(name, sensor.module, module, eq.index[module.hot], eq.index[module.cold],
                   eq.drives.column[sensor.module], sensor.lead_resistance or 0.0)

    def value(self, x: Array, current: Array) -> Array:
        """Voltage (...) [V] at lump temperatures x (..., n) [K] and currents (...) [A]."""
        S, R, dT = self._properties(x)
        return np.asarray((S - self.module.thomson) * dT + (R + self.lead_resistance) * current)

    def slopes(self, x: Array, current: Array) -> tuple[Array, Array, Array]:
        """Derivatives by the temperature of the hot and of the cold face [V/K], and by the current [Ω]."""
        S, R, dT = self._properties(x)
        pumped = S - self.module.thomson
        bend = 0.5 * (self.module.seebeck.slope * dT + self.module.resistance.slope * current)
        return pumped + bend, bend - pumped, R + self.lead_resistance

    def along(self, x: Array, current: Array, dx: Array, by_current: Array) -> Array:
        """Derivative (..., m) of the voltage when the temperatures move by dx (..., n, m), the current by (..., m)."""
        hot, cold, per_ampere = self.slopes(x, current)
        return np.asarray(hot[..., None] * dx[..., self.hot, :] + cold[..., None] * dx[..., self.cold, :]
                          + per_ampere[..., None] * by_current)

    def parameter(self, name: str, x: Array, current: Array) -> Array | float:
        """Derivative by a named parameter at fixed temperatures and current; 0 where it has no part."""
        table, _, rest = name.partition(".")
        if name == f"sensors.{self.name}.lead_resistance":
            return current
        if table != "modules" or not rest.startswith(self.module_name + "."):
            return 0.0
        hot, cold = x[..., self.hot], x[..., self.cold]
        dT, above, p = hot - cold, 0.5 * (hot + cold) - self.module.reference_temperature, self.module
        known: Mapping[str, Array] = {
            "seebeck.value": dT, "seebeck.slope": above * dT, "resistance.value": current,
            "resistance.slope": above * current, "thomson": -dT,
            "reference_temperature": -p.seebeck.slope * dT - p.resistance.slope * current}
        return known.get(rest.removeprefix(self.module_name + "."), 0.0)

    def _properties(self, x: Array) -> tuple[Array, Array, Array]:
        """S [V/K] and R [Ω] at the mean temperature, and the difference of the faces [K]."""
        hot, cold = x[..., self.hot], x[..., self.cold]
        above = 0.5 * (hot + cold) - self.module.reference_temperature
        return (self.module.seebeck.value + self.module.seebeck.slope * above,
                self.module.resistance.value + self.module.resistance.slope * above, hot - cold)


def voltages(eq: Equations) -> dict[str, Voltage]:
    """Voltage of every sensor that reads one, by the name of the sensor."""
    return {name: Voltage.of(eq, name, sensor) for name, sensor in eq.system.sensors.items() if sensor.module}


def voltage_slopes(eq: Equations, name: str, temperatures: ArrayLike, inputs: ArrayLike) -> NDArray[np.float64]:
    """Derivative of a voltage sensor's reading by the lump temperatures, at the currents given.

    Parameters
    ----------
    eq : Equations
        Equations of the system.
    name : str
        Name of a sensor that reads the voltage of a module.
    temperatures : array_like, shape (..., n)
        Temperatures of all lumps [K].
    inputs : array_like, shape (..., n_u)
        Exogenous values, as in a record [unit, A, K].

    Returns
    -------
    ndarray, shape (..., n)
        [V/K].

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> two = rt.systems.two_module()
    >>> system = rt.System(**{**dict(two), "sensors": {"V": {"module": "m1"}}})
    >>> eq = rt.thermal.Equations(system)
    >>> slopes = rt.thermal.voltage_slopes(eq, "V", eq.initial(), eq.nominal())
    >>> bool(np.isclose(slopes.max(), system.modules["m1"].seebeck.value, rtol=0.02))
    True
    """
    x, w = np.asarray(temperatures, float), eq.drives(np.asarray(inputs, float))
    volt, gain = voltages(eq)[name], eq.system.sensors[name].gain
    out = np.zeros(x.shape)
    hot, cold, _ = volt.slopes(x, w[..., volt.column])
    out[..., volt.hot], out[..., volt.cold] = gain * hot, gain * cold
    return out
