"""Thermal modes: shapes in which a network decays, what each sensor sees of them and what the tool point feels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from .._arrays import Array
from .._pandas import pd
from ..errors import InputError
from ..thermal import System, linearize
from ._numbers import expect

_SYMMETRIC = 1e-9  # largest asymmetry of the conduction, relative
_ONE_RATE = 1e-7  # relative distance of rates that count as one
_SEEN = 1e-8  # part of a mode's size in the sensors, relative, below which they do not see it


@dataclass(frozen=True)
class ThermalModes:
    """Modes of the linearized network, slowest first: x = sum of shapes[:, i] z_i, z_i in kelvin.

    Each mode obeys ``capacities[i] dz_i/dt = -rates[i] capacities[i] z_i + shapes[:, i] @ heat``.

    Parameters
    ----------
    lumps, inputs, sensors : tuple of str
        Names of the lumps, of heaters, module currents and ambients, and of the thermometers.
    rates : ndarray, shape (n,)
        Rates of decay [1/s].
    shapes : ndarray, shape (n_lumps, n)
        Columns with a largest entry of 1 [-], orthogonal in the capacities of the lumps.
    capacities : ndarray, shape (n,)
        Heat capacities of the modes [J/K].
    heat : ndarray, shape (n_lumps, n_inputs)
        Heat into the lumps [W per unit of the input, W/K of an ambient].
    readings : ndarray, shape (n_sensors, n_lumps)
        What the thermometers read [K/K].
    expansion : ndarray, shape (n_lumps,)
        Displacement of the tool point [m/K].
    """

    lumps: tuple[str, ...]
    inputs: tuple[str, ...]
    sensors: tuple[str, ...]
    rates: Array
    shapes: Array
    capacities: Array
    heat: Array
    readings: Array
    expansion: Array

    @property
    def tool_gains(self) -> Array:
        """Displacement of the tool point per kelvin of every mode [m/K]."""
        return self.expansion @ self.shapes

    def static(self, name: str) -> Array:
        """What one unit of an input displaces the tool point by in the end, mode by mode [m/unit]; the sum is all.

        Parameters
        ----------
        name : str
            Heater, module or ambient.

        Returns
        -------
        numpy.ndarray, shape (n,)
        """
        column = place(self.inputs, [name], "argument name")[0]
        return self.tool_gains * (self.shapes.T @ self.heat[:, column]) / (self.capacities * self.rates)

    def felt(self, names: Sequence[str]) -> Array:
        """Modes by what the tool point feels of them, most first: by the size of `static`, the largest of some inputs.

        Parameters
        ----------
        names : sequence of str
            Inputs that count, one unit of each.

        Returns
        -------
        numpy.ndarray of int, shape (n,)
        """
        return np.argsort(-np.max([abs(self.static(name)) for name in names], axis=0), kind="stable")

    def observable(self, sensors: Sequence[str]) -> np.ndarray:
        """Whether some sensors determine every mode from their course in time, modes of one rate together.

        Of a symmetric network the test is exact: the readings of the shapes of one rate must be independent.

        Parameters
        ----------
        sensors : sequence of str
            Names of thermometers.

        Returns
        -------
        numpy.ndarray of bool, shape (n,)
        """
        seen = self.readings[place(self.sensors, sensors, "argument sensors")] @ self.shapes
        found = np.zeros(len(self.rates), dtype=bool)
        first = 0
        for last in range(1, len(self.rates) + 1):
            if last < len(self.rates) and self.rates[last] - self.rates[first] <= _ONE_RATE * self.rates[first]:
                continue
            found[first:last] = np.linalg.matrix_rank(seen[:, first:last], tol=_SEEN) == last - first
            first = last
        return found

    def table(self, names: Sequence[str]) -> pd.DataFrame:
        """One row per mode: time constant, lump in which it is largest, displacement per kelvin and per input.

        Parameters
        ----------
        names : sequence of str
            Inputs whose static displacements are shown.

        Returns
        -------
        pandas.DataFrame
        """
        largest = [self.lumps[i] for i in np.abs(self.shapes).argmax(axis=0)]
        return pd.DataFrame({"time constant [s]": 1 / self.rates, "largest in": largest,
                             "tool point [m/K]": self.tool_gains,
                             **{f"{name}, in the end [m/unit]": self.static(name) for name in names}})


@dataclass(frozen=True)
class ModalReconstruction:
    """Modes and tool point from the readings of one moment, by least squares.

    Parameters
    ----------
    sensors : tuple of str
        Thermometers that are read.
    modes : ndarray of int, shape (m,)
        Modes that are reconstructed.
    matrix : ndarray, shape (m, n_sensors)
        From deviations of the readings to the modes [K/K].
    spillover : ndarray, shape (m, n)
        What one kelvin of every mode adds to the error of these [K/K]; zero for the modes that are reconstructed.
    tool : ndarray, shape (n_sensors,)
        From the readings to the displacement of the tool point [m/K].
    tool_error : ndarray, shape (n,)
        Error of that displacement per kelvin of every mode [m/K]; zero for the modes that are reconstructed.
    """

    sensors: tuple[str, ...]
    modes: np.ndarray
    matrix: Array
    spillover: Array
    tool: Array
    tool_error: Array

    def noise(self, deviation: float) -> tuple[Array, float]:
        """Standard deviations that white noise of the thermometers causes.

        Parameters
        ----------
        deviation : float
            Standard deviation of every reading [K].

        Returns
        -------
        modes : numpy.ndarray, shape (m,)
            Of the modes [K].
        tool : float
            Of the tool point [m].
        """
        return deviation * np.linalg.norm(self.matrix, axis=1), float(deviation * np.linalg.norm(self.tool))


def thermal_modes(system: System, *, expansion: Mapping[str, float],
                  temperatures: ArrayLike | Mapping[str, float] | None = None,
                  inputs: Mapping[str, float] | None = None) -> ThermalModes:
    """Modes of a thermal network and what the tool point of the machine feels of them by thermal expansion.

    Parameters
    ----------
    system : System
        Network whose linearization is symmetric: links, ambients and heaters; modules without current.
    expansion : mapping
        Lump: displacement of the tool point per kelvin of that lump [m/K]. Lumps that are left out do not matter.
    temperatures, inputs
        Operating point, as in `rt.thermal.linearize`.

    Returns
    -------
    ThermalModes

    Raises
    ------
    InputError
        Unknown lumps, an expansion that is zero or not finite, a network that is not symmetric or does not decay, and
        thermometers or drives with a lag, which are no lumps.

    Examples
    --------
    >>> import robthermal as rt
    >>> stage = rt.System(ambients={"room": {"temperature": 295.0}},
    ...     lumps={"left": {"capacity": 500.0}, "right": {"capacity": 500.0}},
    ...     links=[{"between": ("left", "right"), "conductance": 2.0},
    ...            *({"between": (side, "room"), "conductance": 0.5} for side in ("left", "right"))],
    ...     inputs={"motor": {"lump": "left"}}, sensors={"T1": {"lump": "left"}, "T2": {"lump": "right"}})
    >>> modes = rt.design.thermal_modes(stage, expansion={"left": 2e-6, "right": -2e-6})  # tilt
    >>> (1 / modes.rates).round(6).tolist(), (1e6 * modes.static("motor")).round(6).tolist()
    ([1000.0, 111.111111], [0.0, 0.444444])
    """
    expect(system, System, "system", "rt.System or rt.read_system")
    G = linearize(system, temperatures, inputs)
    lumps = system.lump_names
    if G.nstates != len(lumps):
        raise InputError("thermometers or drives have lags, which are states beside the lumps", where="argument system",
                         expected="a network of lumps", remedy="Leave the lags out, or make them lumps.")
    row = _expansion(expansion, lumps)
    E = np.array([lump.capacity for lump in system.lumps.values()])
    K = -E[:, None] * np.asarray(G.A)
    if abs(K - K.T).max() > _SYMMETRIC * abs(K).max():
        raise InputError("the linearized network is not symmetric", where="argument system",
                         expected="links, ambients and heaters; modules without current",
                         remedy="Take the operating point without currents, or let the modules' heat be an input.")
    rates, shapes = eigh(0.5 * (K + K.T), np.diag(E))
    if rates[0] <= 0.0:
        raise InputError(f"a mode does not decay: rate {rates[0]:.3g} 1/s", where="argument system",
                         expected="every lump linked to an ambient, directly or through others")
    shapes = shapes / shapes[np.abs(shapes).argmax(axis=0), np.arange(len(rates))]
    thermometers = list(system.sensors) or list(lumps)
    return ThermalModes(tuple(lumps), tuple(G.input_labels), tuple(thermometers), rates, shapes,
                        np.einsum("li,l,li->i", shapes, E, shapes), E[:, None] * np.asarray(G.B), np.asarray(G.C), row)


def reconstruct(modes: ThermalModes, sensors: Sequence[str], chosen: Sequence[int]) -> ModalReconstruction:
    """Some modes and the tool point from the readings of one moment.

    What the readings cannot hold is stated: every other mode that the thermometers see spills into the result.

    Parameters
    ----------
    modes : ThermalModes
        Modes of the machine, from `thermal_modes`.
    sensors : sequence of str
        Thermometers that are read, at least as many as modes.
    chosen : sequence of int
        Modes to reconstruct, counted from 0, for example the first of ``modes.felt(["room"])``.

    Returns
    -------
    ModalReconstruction

    Raises
    ------
    InputError
        Unknown names or modes, fewer thermometers than modes, or thermometers that do not tell these modes apart.

    Examples
    --------
    >>> import robthermal as rt
    >>> stage = rt.System(ambients={"room": {"temperature": 295.0}},
    ...     lumps={"left": {"capacity": 500.0}, "right": {"capacity": 500.0}},
    ...     links=[{"between": ("left", "right"), "conductance": 2.0},
    ...            *({"between": (side, "room"), "conductance": 0.5} for side in ("left", "right"))],
    ...     sensors={"T1": {"lump": "left"}})
    >>> modes = rt.design.thermal_modes(stage, expansion={"left": 2e-6, "right": -2e-6})
    >>> seen = rt.design.reconstruct(modes, ["T1"], [1])  # the mode of the tilt, from one thermometer
    >>> seen.tool_error.round(9).tolist()  # the uniform mode is taken for tilt: 4 um/K
    [4e-06, 0.0]
    """
    expect(modes, ThermalModes, "modes", "rt.design.thermal_modes")
    which = np.asarray(list(chosen), dtype=int)
    n = len(modes.rates)
    if not which.size or len(set(which.tolist())) != which.size or which.min() < 0 or which.max() >= n:
        raise InputError(f"modes {list(chosen)}", where="argument chosen",
                         expected=f"different numbers from 0 to {n - 1}")
    seen = modes.readings[place(modes.sensors, sensors, "argument sensors")] @ modes.shapes
    own = seen[:, which]
    if len(own) < which.size or np.linalg.svd(own, compute_uv=False)[-1] <= _SEEN:
        raise InputError(f"{len(own)} thermometer(s) do not tell {which.size} modes apart", where="argument sensors",
                         expected="at least as many as modes, at places where the modes differ",
                         remedy="Reconstruct fewer modes, or use an observer (rt.design.observer), which uses time.")
    matrix = np.linalg.pinv(own)
    tool = modes.tool_gains[which] @ matrix
    spillover, error = matrix @ seen, tool @ seen - modes.tool_gains
    spillover[:, which], error[which] = 0.0, 0.0
    return ModalReconstruction(tuple(sensors), which, matrix, spillover, tool, error)


def place(names: Sequence[str], wanted: Sequence[str], where: str) -> list[int]:
    """Places of some names; unknown ones, none at all and repetitions are refused."""
    asked = [wanted] if isinstance(wanted, str) else list(wanted)
    missing = [name for name in asked if name not in names]
    if missing or not asked or len(set(asked)) != len(asked):
        raise InputError(f"{', '.join(map(repr, missing)) or 'no name, or one twice'}", where=where,
                         expected=f"among {', '.join(names)}")
    return [list(names).index(name) for name in asked]


def _expansion(given: Mapping[str, float], lumps: Sequence[str]) -> Array:
    row = np.zeros(len(lumps))
    if not isinstance(given, Mapping) or not given:
        raise InputError("no lump is named", where="argument expansion", expected="lump: displacement per kelvin [m/K]")
    for name, value in given.items():
        if name not in lumps or not isinstance(value, (int, float, np.number)) or not np.isfinite(value):
            raise InputError(f"{name!r}: {value!r}", where="argument expansion",
                             expected=f"finite numbers [m/K] of lumps, {', '.join(lumps)}")
        row[list(lumps).index(name)] = float(value)
    if not row.any():
        raise InputError("every expansion is zero", where="argument expansion", expected="a tool point that moves")
    return row
