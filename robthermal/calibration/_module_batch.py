"""Average and spread of a batch of modules, their uncertainty by calibration kept apart. Evers, figures 5.8 and 5.9."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from .._arrays import Floats
from .._celsius import ADD_ZERO, ZERO_CELSIUS
from .._distributions import chi2_isf, t_isf
from .._drawing import line_of
from .._pandas import pd
from ..errors import InputError
from ..thermal import System
from ._module_properties import PROPERTIES, ModuleProperties

_UNITS = dict(zip(PROPERTIES, ("V/K", "V/K²", "Ω", "Ω/K", "W/K"), strict=True))
_CONFIDENCE = 0.95  # of the ranges of the spread in the table


@dataclass(frozen=True, eq=False)
class ModuleBatch:
    """What calibrations of several modules of one type say about the type.

    Parameters
    ----------
    modules : tuple of ModuleProperties
        Calibrated modules of one type, all at one reference temperature.
    table : pandas.DataFrame
        Per property: "mean" of the type, its standard deviation "std", the standard deviation between modules "spread"
        with its 95 % range "spread_low" to "spread_high", and the mean deviation by "calibration" alone.
    """

    modules: tuple[ModuleProperties, ...]
    table: pd.DataFrame

    @property
    def reference_temperature(self) -> float:
        """Temperature about which S and R are linear [K]."""
        return self.modules[0].reference_temperature

    def at(self, temperature: float) -> pd.DataFrame:
        """Average and spread of S and R at a temperature.

        Parameters
        ----------
        temperature : float
            Mean temperature of both faces [K].

        Returns
        -------
        pandas.DataFrame
            Rows "seebeck" [V/K] and "resistance" [Ω]; columns of `table`.
        """
        x = np.array([1.0, _kelvin(temperature) - self.reference_temperature])
        rows = []
        for first in (0, 2):
            part = slice(first, first + 2)
            values = np.array([x @ _values(one)[part] for one in self.modules])
            rows.append(_row(values, np.array([x @ one.covariance[part, part] @ x for one in self.modules])))
        return pd.DataFrame(rows, index=["seebeck", "resistance"])

    def next_module(self, confidence: float = 0.95) -> dict[str, tuple[float, float]]:
        """Ranges that hold all five properties of another module of the type at once.

        Parameters
        ----------
        confidence : float
            Probability that all five ranges hold, for example 0.95.

        Returns
        -------
        dict
            {property: (lower, upper)}, for example "seebeck.value" [V/K].

        Raises
        ------
        InputError
            An impossible confidence; so few modules that a range of S, R or K reaches zero.
        """
        return self._ranges(confidence, 1)

    def ranges(self, *names: str, confidence: float = 0.95) -> dict[str, tuple[float, float]]:
        """Ranges of the parameters of a system whose modules are others of this type, all valid at once.

        Parameters
        ----------
        *names : str
            Modules of the system.
        confidence : float
            Probability that all ranges of all these modules hold.

        Returns
        -------
        dict
            {parameter: (lower, upper)}, as `parameters=` of the certify functions takes them; for a system that is
            `applied` already, so that the reference temperature is the same.

        Raises
        ------
        InputError
            As for `next_module`; no name.
        """
        if not names:
            raise InputError("no module is named", where="argument names", expected="modules of the system",
                             remedy="For example batch.ranges('m1', 'm2').")
        found = self._ranges(confidence, len(names))
        return {f"modules.{name}.{_key(key)}": ends for name in names for key, ends in found.items()}

    def applied(self, system: System, *names: str) -> System:
        """A system whose modules have the mean properties of the type.

        Parameters
        ----------
        system : System
            Any system with modules.
        *names : str
            Modules to change; default all.

        Returns
        -------
        System

        Raises
        ------
        InputError
            A name that is no module of the system.
        """
        common = {_key(str(name)): float(mean) for name, mean in self.table["mean"].items()}
        common |= {"conductance.slope": 0.0, "reference_temperature": self.reference_temperature}
        return system.with_parameters({f"modules.{name}.{key}": value for name in names or system.module_names
                                       for key, value in common.items()})

    def _ranges(self, confidence: float, machines: int) -> dict[str, tuple[float, float]]:
        if not 0.0 < confidence < 1.0:
            raise InputError(f"confidence = {confidence!r}", where="argument confidence",
                             expected="a number between 0 and 1")
        n = len(self.modules)
        many = len(PROPERTIES) * machines
        factor = float(t_isf((1.0 - confidence) / (2 * many), n - 1)) * math.sqrt(n + 1)
        found = {}
        for name, row in self.table.iterrows():
            ends = (float(row["mean"] - factor * row["std"]), float(row["mean"] + factor * row["std"]))
            if not str(name).endswith("slope") and ends[0] <= 0:
                raise InputError(f"the range of {name} reaches zero: from {ends[0]:.3g} {_UNITS[str(name)]}",
                                 where="argument confidence", expected="enough modules for this confidence",
                                 remedy=f"Calibrate more than {n} modules, or ask for less.")
            found[str(name)] = ends
        return found

    def __str__(self) -> str:
        lines = [f"{len(self.modules)} modules, reference {self.reference_temperature - ZERO_CELSIUS:.4g} °C"]
        for name, row in self.table.iterrows():
            mean, std, spread, low, high, error = row
            lines.append(f"{name:17} {mean:.4g} ± {std:.2g} {_UNITS[str(name)]}, spread {spread:.2g} "
                         f"({low:.2g} to {high:.2g}), calibration {error:.2g}")
        return "\n".join(lines)

    def plot(self) -> NDArray[Any]:
        """R and S over temperature, like Evers figures 5.8 and 5.9; returns the matplotlib axes.

        Points and line of every module, the mean of the type, and the band of 95 % for one more module.
        """
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, axes = plt.subplots(1, 2, layout="constrained", figsize=(11, 4.5))
        for ax, kind, unit, points in ((axes[0], "resistance", "Ω", "steps"), (axes[1], "seebeck", "V/K", "steady")):
            tables = [getattr(one, points) for one in self.modules]
            every = np.concatenate([table["temperature"] for table in tables])
            grid = np.linspace(every.min(), every.max(), 30)
            rows = pd.DataFrame([self.at(T).loc[kind] for T in grid])
            wide = float(t_isf(0.025, len(tables) - 1)) * np.sqrt(len(tables) + 1) * rows["std"]
            for i, (one, table) in enumerate(zip(self.modules, tables, strict=True)):
                law, style = getattr(one, kind), line_of(i)
                ax.plot(table["temperature"] - ZERO_CELSIUS, table[kind], ".", color=style["color"])
                ax.plot(grid - ZERO_CELSIUS, law.value + law.slope * (grid - self.reference_temperature),
                        linewidth=0.8, **style, label=f"module {i + 1}")
            ax.plot(grid - ZERO_CELSIUS, rows["mean"], "k--", label="mean")
            ax.fill_between(grid - ZERO_CELSIUS, rows["mean"] - wide, rows["mean"] + wide, color="k", alpha=0.1,
                            label="another module, 95 %")
            ax.set(xlabel="mean temperature [°C]", ylabel=f"{kind} [{unit}]")
            ax.legend()
        found: NDArray[Any] = axes
        return found


def module_batch(modules: Sequence[ModuleProperties]) -> ModuleBatch:
    """Average and spread of the properties of modules of one type.

    Calibrated values differ because the modules do and because calibrations err. The model of random effects keeps them
    apart: value = mean + (spread between modules) + (error of the calibration, of known deviation). Each property by
    itself; the spread by Mandel and Paule, the mean weighted by it, ranges by Student's t with one degree of freedom
    less than there are modules.

    Parameters
    ----------
    modules : sequence of ModuleProperties
        Two or more, at one reference temperature; best in the middle of the temperatures that were measured.

    Returns
    -------
    ModuleBatch

    Raises
    ------
    InputError
        Fewer than two modules, other objects, different reference temperatures, a covariance that is not finite.

    References
    ----------
    Evers (2021), sec. 5.4.3. Paule and Mandel, J. Res. Nat. Bur. Stand. 87, 1982; Hartung and Knapp, Statistics in
    Medicine 20, 2001; range of the spread: Viechtbauer, Statistics in Medicine 26, 2007.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> def measured(seebeck, resistance):          # of three modules; a staircase of current, faces at rest
    ...     I = np.repeat([0.0, 0.3, 0.6, 0.9, -0.3, -0.6], 50)
    ...     T = np.column_stack([298.0 + 2.0 * I, 298.0 - 30.0 * I])
    ...     T = np.vstack([np.full((5, 2), 298.0), T[:-5]])        # they move only later
    ...     V = seebeck * (T[:, 0] - T[:, 1]) + resistance * I + 1e-3 * np.random.default_rng(1).standard_normal(300)
    ...     record = rt.Record(sample_time=1.0, inputs=I, outputs=np.column_stack([T, V]), input_names=["m"],
    ...                        output_names=["Th", "Tc", "V"])
    ...     return rt.calibration.module_properties(record, current="m", voltage="V", hot="Th", cold="Tc")
    >>> batch = rt.calibration.module_batch([measured(0.050, 4.0), measured(0.051, 4.1), measured(0.052, 3.9)])
    >>> [float(round(batch.table.loc["seebeck.value", key], 4)) for key in ("mean", "spread")]
    [0.051, 0.001]
    >>> system = batch.applied(rt.systems.two_module())
    >>> round(system.modules["m1"].seebeck.value, 4)
    0.051
    """
    if not isinstance(modules, Sequence) or len(modules) < 2:
        raise InputError("fewer than two modules", where="argument modules",
                         expected="a list of what rt.calibration.module_properties found", remedy="Calibrate another.")
    for k, one in enumerate(modules):
        where = f"argument modules[{k}]"
        if not isinstance(one, ModuleProperties):
            raise InputError(f"an object of type {type(one).__name__}", where=where, expected="ModuleProperties")
        if one.reference_temperature != modules[0].reference_temperature:
            raise InputError(f"its reference temperature is {one.reference_temperature} K", where=where,
                             expected=f"{modules[0].reference_temperature} K, as of the first",
                             remedy="Give module_properties the same reference_temperature for all.")
        if not np.isfinite(one.covariance).all():
            raise InputError("its covariance is not finite", where=where, expected="a calibrated module",
                             remedy="Measure it at more currents.")
    values = np.array([_values(one) for one in modules])
    variances = np.array([np.diag(one.covariance) for one in modules])
    table = pd.DataFrame([_row(x, v) for x, v in zip(values.T, variances.T, strict=True)],
                         index=pd.Index(PROPERTIES, name="property"))
    return ModuleBatch(modules=tuple(modules), table=table)


def _values(one: ModuleProperties) -> Floats:
    return np.array([*one.values.values()], np.float64)


def _key(name: str) -> str:
    """How a system names a property."""
    return name if "." in name else f"{name}.value"


def _kelvin(temperature: float) -> float:
    if not 150.0 <= temperature <= 1500.0:
        raise InputError(f"temperature is {temperature!r}", where="argument temperature", expected="kelvin",
                         remedy=ADD_ZERO)
    return float(temperature)


def _row(x: Floats, v: Floats) -> dict[str, float]:
    """Mean and spread of values x (n,) with variances v (n,) by calibration."""
    v = np.maximum(v, (1e-12 * np.abs(x).max()) ** 2)  # records without noise
    n = len(x)
    between = _between(x, v, n - 1.0)
    weights = 1.0 / (v + between)
    lower, upper = (_between(x, v, float(chi2_isf(tail, n - 1)))
                    for tail in ((1 - _CONFIDENCE) / 2, (1 + _CONFIDENCE) / 2))
    return {"mean": float(weights @ x / weights.sum()), "std": float(weights.sum() ** -0.5),
            "spread": math.sqrt(between), "spread_low": math.sqrt(lower), "spread_high": math.sqrt(upper),
            "calibration": math.sqrt(float(v.mean()))}


def _between(x: Floats, v: Floats, wanted: float) -> float:
    """Variance t between modules at which the weighted sum of squares is as wanted; it falls with t, 0 if none is."""
    def excess(t: float) -> float:
        weights = 1.0 / (v + t)
        return float(weights @ (x - weights @ x / weights.sum()) ** 2) - wanted

    if excess(0.0) <= 0:
        return 0.0
    largest = float(np.sum((x - x.mean()) ** 2)) / wanted * 1.001
    return float(scipy.optimize.brentq(excess, 0.0, largest, xtol=1e-14 * largest, rtol=1e-10))

