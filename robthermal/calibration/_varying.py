"""Local models at several temperatures joined to one that varies with temperature."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from .._celsius import ADD_ZERO
from .._control import control
from .._distributions import chi2_sf
from .._pandas import pd
from ..errors import InputError
from ..thermal import System, linearize, parameter_label
from ._estimates import Estimates


@dataclass(frozen=True, eq=False, kw_only=True)
class VaryingModel:
    """Parameters that vary with the temperature of the operating point.

    Parameters
    ----------
    system : System
        System whose parameters vary.
    names : tuple of str
        Parameters that vary with temperature.
    temperatures : ndarray, shape (n,)
        Operating points of the local models [K], increasing.
    values, std : ndarray, shape (n, p)
        Local estimates and their standard deviations.
    """

    system: System
    names: tuple[str, ...]
    temperatures: Floats
    values: Floats
    std: Floats

    def parameters(self, temperature: float) -> dict[str, float]:
        """Parameters at a temperature, linear between the local models.

        Parameters
        ----------
        temperature : float
            Within the range of the local models [K].

        Returns
        -------
        dict

        Raises
        ------
        InputError
            Outside that range: nothing was measured there.
        """
        low, high = self.temperatures[0], self.temperatures[-1]
        if not low <= temperature <= high:
            raise InputError(f"temperature is {temperature} K", where="argument temperature",
                             expected=f"{low:g} to {high:g} K, the range of the local models",
                             remedy="Identify a local model there too; this one does not extrapolate.")
        return {name: float(np.interp(temperature, self.temperatures, column))
                for name, column in zip(self.names, self.values.T, strict=True)}

    def at(self, temperature: float) -> System:
        """System with its parameters at a temperature.

        Parameters
        ----------
        temperature : float
            As in `parameters` [K].

        Returns
        -------
        System
        """
        shared = self.parameters(temperature)
        return self.system.with_parameters({own: value for name, value in shared.items() for own in name.split(" = ")})

    def linearize(self, temperature: float, *, sample_time: float = 0.0) -> control.StateSpace:
        """Local linear model with every lump at a temperature.

        Parameters
        ----------
        temperature : float
            As in `parameters` [K].
        sample_time : float
            As in `rt.thermal.linearize` [s].

        Returns
        -------
        control.StateSpace
        """
        system = self.at(temperature)
        return linearize(system, np.full(len(system.lumps), float(temperature)), sample_time=sample_time)

    def trend(self) -> pd.DataFrame:
        """Straight line through the local estimates, weighted by their covariance.

        Returns
        -------
        pandas.DataFrame
            Index: parameter. Columns: value (at the mean temperature), slope [per K], std (of the slope), p_value
            (of the scatter about the line; nan for two temperatures).
        """
        middle = float(self.temperatures.mean())
        A = np.column_stack([np.ones_like(self.temperatures), self.temperatures - middle])
        rows = [_line(A, value, std) for value, std in zip(self.values.T, self.std.T, strict=True)]
        return pd.DataFrame(rows, index=pd.Index(self.names, name="parameter"),
                            columns=["value", "slope", "std", "p_value"])

    def plot(self) -> NDArray[Any]:
        """Plot every parameter against temperature with two standard deviations; returns the matplotlib axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, axes = plt.subplots(len(self.names), 1, sharex=True, squeeze=False, layout="constrained")
        for ax, name, value, std in zip(axes[:, 0], self.names, self.values.T, self.std.T, strict=True):
            ax.errorbar(self.temperatures, value, 2 * std, fmt="o-")
            ax.set(ylabel=parameter_label(name))
        axes[-1, 0].set(xlabel="temperature [K]")
        return axes[:, 0]


def join_models(local: Mapping[float, Estimates]) -> VaryingModel:
    """Join local calibrations at several temperatures to a parameter-varying model.

    Parameters
    ----------
    local : mapping
        Temperature of the operating point [K] to what `rt.calibrate` found there, all with the same parameters.

    Returns
    -------
    VaryingModel

    Raises
    ------
    InputError
        Fewer than two temperatures, Celsius, calibrations with different parameters.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> def fit(g):
    ...     bar = rt.System(ambients={"room": {"temperature": 300.0}}, lumps={"bar": {"capacity": 20.0}},
    ...                     links=[{"between": ("bar", "room"), "conductance": g}], inputs={"q": {"lump": "bar"}},
    ...                     sensors={"T": {"lump": "bar", "noise": 0.01}})
    ...     drive = rt.Record(sample_time=1.0, inputs=np.tile([0.0] * 40 + [5.0] * 40, 3), outputs=np.zeros((240, 0)),
    ...                       input_names=["q"], output_names=[])
    ...     return rt.calibrate(bar, rt.thermal.simulate(bar, drive),
    ...                         parameters={"links.bar-room.conductance": (0.1, 10.0)}, initial="measured")
    >>> model = rt.calibration.join_models({290.0: fit(1.0), 310.0: fit(1.4)})
    >>> round(model.parameters(300.0)["links.bar-room.conductance"], 3)
    1.2
    """
    if not isinstance(local, Mapping) or len(local) < 2:
        raise InputError("fewer than two local models", where="argument local", expected="{kelvin: calibration}",
                         remedy="Calibrate at two temperatures or more.")
    temperatures = np.array(sorted(local), float)
    if not np.isfinite(temperatures).all() or temperatures[0] < 150.0:
        raise InputError(f"temperature {temperatures[0]} K", where="argument local", expected="kelvin",
                         remedy=ADD_ZERO)
    fits = [local[key] for key in sorted(local)]
    names = tuple(fits[0].parameters)
    for temperature, fit in zip(temperatures, fits, strict=True):
        if tuple(fit.parameters) != names:
            raise InputError(f"the calibration at {temperature:g} K has other parameters than the first",
                             where="argument local", remedy="Calibrate the same parameters everywhere.")
    values = np.array([list(fit.parameters.values()) for fit in fits])
    std = np.array([list(fit.std.values()) for fit in fits])
    return VaryingModel(system=fits[0].system, names=names, temperatures=temperatures, values=values, std=std)


def _line(A: Floats, value: Floats, std: Floats) -> tuple[float, float, float, float]:
    """Weighted line: value, slope, its standard deviation, and the p-value of the scatter."""
    weighted = A / std[:, None]
    covariance = np.linalg.inv(weighted.T @ weighted)
    estimate = covariance @ weighted.T @ (value / std)
    freedom = len(value) - 2
    scatter = float(np.sum(((value - A @ estimate) / std) ** 2))
    p_value = float(chi2_sf(scatter, freedom)) if freedom else float("nan")
    return float(estimate[0]), float(estimate[1]), float(np.sqrt(covariance[1, 1])), p_value
