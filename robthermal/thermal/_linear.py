"""Linearization to python-control, with the names of the system; time constants."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .._celsius import LOWEST_KELVIN
from .._control import control
from .._pandas import pd
from ..errors import InputError
from ._checks import by_lump
from ._equations import Equations
from ._layout import Layout
from ._steady import exogenous_point
from ._system import System, equations
from ._terms import Array
from ._voltage import voltages


def linearize(system: System, temperatures: ArrayLike | Mapping[str, float] | None = None,
              inputs: Mapping[str, float] | None = None, *, sample_time: float = 0.0) -> control.StateSpace:
    """Linearize a system to a python-control state space.

    Parameters
    ----------
    system : System
        System to linearize at an operating point.
    temperatures : array_like or mapping, optional
        Lump temperatures of the operating point [K]; default: initial temperatures. It need not be an equilibrium.
    inputs : mapping, optional
        Heaters [unit], module currents [A] and ambients [K] of the operating point; default off and nominal.
    sample_time : float
        0 for continuous time; else the exact zero-order-hold equivalent at this sample time [s].

    Returns
    -------
    control.StateSpace
        Deviations from the operating point; inputs, states and outputs carry the names of the system (a lagged sensor
        or drive adds a state "NAME_lag"; the voltage of a module has a feedthrough, its resistance; without sensors the
        outputs are all lumps). Delays are not part of a state space; a hysteresis, a periodic load and a conductance
        step are taken as in `Equations.heat`.

    Raises
    ------
    InputError
        Unknown names, Celsius, wrong lengths, negative sample time.

    Examples
    --------
    >>> import robthermal as rt
    >>> G = rt.thermal.linearize(rt.systems.two_module())
    >>> G.nstates, G.input_labels
    (18, ['m1', 'm2', 'room'])
    """
    eq = equations(system)
    x, u = _point(eq, temperatures), exogenous_point(eq, inputs or {})
    A, B = _matrices(eq, x, u)
    states = _states(eq)
    if not (np.isfinite(sample_time) and sample_time >= 0):
        raise InputError(f"sample_time = {sample_time}", where="argument sample_time",
                         expected="0 or a positive number [s]")
    if sample_time:
        both = np.zeros((A.shape[0] + B.shape[1],) * 2)
        both[:len(A)] = np.hstack([A, B]) * sample_time
        exact = scipy.linalg.expm(both)[:len(A)]
        A, B = exact[:, :len(A)], exact[:, len(A):]
    C, D, outputs = _outputs(eq, len(A), x, u)
    return control.ss(A, B, C, D, dt=sample_time, name=system.name,
                      inputs=list(system.exogenous_names), outputs=outputs, states=list(states))


def state_matrices(system: System, temperatures: ArrayLike | Mapping[str, float] | None = None,
                   inputs: Mapping[str, float] | None = None) -> tuple[Array, Array, tuple[str, ...]]:
    """A and B of `linearize` in continuous time, and the names of the states: arrays, without python-control.

    Parameters
    ----------
    system, temperatures, inputs
        As in `linearize`.

    Returns
    -------
    A : ndarray, shape (n, n)
        Deviations of the states among each other [1/s].
    B : ndarray, shape (n, n_u)
        What heaters [K/s per unit], currents [K/s per A] and ambients [K/s per K] do to them.
    states : tuple of str
        Lumps in file order, then "NAME_lag" of lagged sensors and drives.

    Examples
    --------
    >>> import robthermal as rt
    >>> A, B, states = rt.thermal.state_matrices(rt.systems.tclab_two_state())
    >>> A.shape, B.shape, states
    ((2, 2), (2, 2), ('heater', 'sensor'))
    """
    eq = equations(system)
    return *_matrices(eq, _point(eq, temperatures), exogenous_point(eq, inputs or {})), _states(eq)


def time_constants(system: System, temperatures: ArrayLike | Mapping[str, float] | None = None,
                   inputs: Mapping[str, float] | None = None) -> pd.DataFrame:
    """Time constants of the lumps' network at an operating point, slowest first.

    Parameters
    ----------
    system, temperatures, inputs
        As in `linearize`.

    Returns
    -------
    pandas.DataFrame
        Columns "time constant [s]" (negative: unstable), "lump" (where the mode is largest) and "share", its part of
        the mode's stored heat.

    Examples
    --------
    >>> import robthermal as rt
    >>> round(float(rt.thermal.time_constants(rt.systems.two_module())["time constant [s]"].max()))
    225
    """
    eq = equations(system)
    J = eq.jacobian(_point(eq, temperatures), exogenous_point(eq, inputs or {})).toarray() / eq.capacity[:, None]
    values, modes = np.linalg.eig(J)
    order = np.argsort(-values.real)
    heat = eq.capacity[:, None] * np.abs(modes[:, order]) ** 2
    largest = heat.argmax(axis=0)
    return pd.DataFrame({"time constant [s]": -1 / values.real[order],
                         "lump": [system.lump_names[i] for i in largest],
                         "share": heat.max(axis=0) / heat.sum(axis=0)})


def _point(eq: Equations, temperatures: ArrayLike | Mapping[str, float] | None) -> Array:
    if temperatures is None:
        return eq.initial()
    names = eq.system.lump_names
    if isinstance(temperatures, Mapping):
        temperatures = by_lump(temperatures, names, "temperatures")
    x = np.asarray(temperatures, float)
    if x.shape != (len(names),) or not np.isfinite(x).all() or x.min() < LOWEST_KELVIN:
        raise InputError(f"shape {x.shape}, smallest value {x.min(initial=np.inf):.6g}", where="argument temperatures",
                         expected=f"{len(names)} finite temperatures in kelvin")
    return x


def _states(eq: Equations) -> tuple[str, ...]:
    """Names of the lumps, then of the lags of sensors and drives."""
    drives = [eq.system.exogenous_names[column] for column in Layout(eq).drives]
    return (*eq.system.lump_names, *(f"{name}_lag" for name in (*Layout(eq).sensors, *drives)))


def _matrices(eq: Equations, x: Array, u: Array) -> tuple[Array, Array]:
    """A (with the lags as states) and B, [1/s] and [K/s per unit]."""
    n, layout = len(eq.capacity), Layout(eq)
    size = n + len(layout.sensors) + len(layout.drives)
    A, B = np.zeros((size, size)), np.zeros((size, u.size))
    A[:n, :n] = eq.jacobian(x, u).toarray() / eq.capacity[:, None]
    B[:n] = eq.input_jacobian(x, u).toarray() / eq.capacity[:, None]
    for name, row in layout.sensors.items():
        sensor = eq.system.sensors[name]
        A[row, row] = -1 / sensor.time_constant
        A[row, eq.index[sensor.lump]] = 1 / sensor.time_constant
    for column, row in layout.drives.items():  # the state follows u; the lumps follow the state
        A[row, row] = -1 / eq.drives.of[column].time_constant
        A[:n, row], B[:n, column], B[row, column] = B[:n, column], 0.0, -A[row, row]
    return A, B


def _outputs(eq: Equations, n_states: int, x: Array, u: Array) -> tuple[Array, Array, list[str]]:
    """C and D: a thermometer reads a state, a voltage the faces of its module and the current."""
    sensors, layout, volts, sources = eq.system.sensors, Layout(eq), voltages(eq), Layout(eq).sources
    if not sensors:
        return np.eye(len(eq.capacity), n_states), np.zeros((len(eq.capacity), u.size)), list(eq.system.lump_names)
    C, D = np.zeros((len(sensors), n_states)), np.zeros((len(sensors), u.size))
    per_column, w = eq.drives.slopes(u), eq.drives(u)
    for row, (name, sensor) in enumerate(sensors.items()):
        if name not in volts:
            C[row, sources[name]] = sensor.gain
            continue
        volt = volts[name]
        C[row, volt.hot], C[row, volt.cold], per_ampere = sensor.gain * np.array(volt.slopes(x, w[volt.column]))
        lagged = layout.drives.get(volt.column)
        at = (C, lagged) if lagged is not None else (D, volt.column)
        at[0][row, at[1]] = per_ampere * per_column[volt.column]
    return C, D, list(sensors)
