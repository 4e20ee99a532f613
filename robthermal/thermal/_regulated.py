"""Modules that hold their cold face at a set-point: the load curve q(I), its fold I*, q*: thermal runaway.

The hot side is stable while more current takes more heat; at the fold dq/dI = 0 and beyond it no equilibrium takes the
load (errata, "Thermal runaway: what the thesis lacks").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._celsius import ADD_ZERO, LOWEST_KELVIN
from .._drawing import axes_for
from ..errors import InputError
from ._equations import Equations
from ._module_term import ModuleTerm
from ._system import System, equations
from ._terms import Array, Indices


@dataclass(frozen=True)
class LoadCurve:
    """Equilibria of modules that hold their cold faces, along a path of currents.

    Parameters
    ----------
    system : System
        System whose equilibria these are.
    setpoint : dict
        Module to temperature of its cold face [K].
    current : ndarray, shape (n, n_modules)
        Current of every module named [A].
    load : ndarray, shape (n, n_modules)
        Heat every module takes from its cold face [W].
    temperatures : ndarray, shape (n, n_lumps)
        Steady temperatures of all lumps [K].
    slowest : ndarray, shape (n,)
        Largest eigenvalue of the regulated machine [1/s]; negative: stable.
    """

    system: System
    setpoint: dict[str, float]
    current: Array
    load: Array
    temperatures: Array
    slowest: Array

    def plot(self, ax: Any = None) -> Any:
        """Plot load against current, stable part solid; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        stable = self.slowest < 0
        for name, current, load in zip(self.setpoint, self.current.T, self.load.T, strict=True):
            line = ax.plot(current, np.where(stable, load, np.nan), label=f"{name}, stable")[0]
            if not stable[:-1].all():  # up to its last point, the fold, a curve may be stable
                ax.plot(current, np.where(stable, np.nan, load), "--", color=line.get_color(),
                        label=f"{name}, runs away")
        ax.set(xlabel="current [A]", ylabel="load taken at the set-point [W]", title="load curve")
        ax.legend()
        return ax


def load_curve(system: System, setpoint: Mapping[str, float], current: Array, *,
               ambient: Mapping[str, float] | None = None) -> LoadCurve:
    """Equilibria with the cold faces held, along a path of currents.

    Parameters
    ----------
    system : System
        Whose; modules not named are off.
    setpoint : mapping
        Module to temperature of its cold face [K].
    current : ndarray, shape (n,) or (n, n_modules)
        Increasing, the same for all modules or one column each [A]; the curve ends where temperatures become senseless.
    ambient : mapping, optional
        Ambient temperatures [K]; default nominal.

    Returns
    -------
    LoadCurve

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> curve = rt.thermal.load_curve(rt.systems.two_module(), {"m1": 278.15, "m2": 278.15}, np.linspace(0, 2, 21))
    >>> bool(curve.slowest[0] < 0 < curve.slowest[-1])  # stable at rest, runs away at 2 A
    True
    """
    eq = equations(system)
    held, columns, target = cold_faces(eq, setpoint)
    u, rows = surroundings(eq, ambient), []
    x: Array = eq.initial()
    x[held] = target
    path = np.asarray(current, float)
    for values in path[:, None] * np.ones(len(columns)) if path.ndim == 1 else path:
        u[columns] = values
        solved = hot_side(eq, x, u, held)
        if solved is None:
            break
        x = solved
        slowest = slowest_regulated(eq, x, u, held, columns)
        rows.append((values.copy(), loads(eq, x, u, columns), x, slowest))
    found = zip(*rows, strict=True) if rows else (np.zeros((0, 0)),) * 4
    values, load, temperatures, rate = (np.array(column) for column in found)
    return LoadCurve(system, dict(setpoint), values, load, temperatures, rate)


def surroundings(eq: Equations, ambient: Mapping[str, float] | None) -> Array:
    """Exogenous values with currents and heaters off and ambients as given, else nominal."""
    u = eq.nominal()
    for name, value in (ambient or {}).items():
        if name not in eq.system.ambients or not np.isfinite(value) or value < LOWEST_KELVIN:
            raise InputError(f"ambient {name} = {value}", where="argument ambient",
                             expected=f"kelvin for one of {', '.join(eq.system.ambients)}")
        u[eq.system.exogenous_names.index(name)] = value
    return u


def hot_side(eq: Equations, x: Array, u: Array, held: Indices) -> Array | None:
    """Temperatures of all lumps but the held ones in steady state, by Newton from x; None if there are none nearby."""
    free = np.setdiff1d(np.arange(len(x)), held)
    x = x.copy()
    for _ in range(40):
        change = np.linalg.solve(eq.jacobians(x, u)[0][np.ix_(free, free)], eq.heat(x, u)[free])
        x[free] -= change
        if not np.abs(change).max(initial=0.0) < 1e4:
            return None
        if np.abs(change).max(initial=0.0) < 1e-10:
            return x if x.min() > 0 else None
    return None


def regulated_feedback(eq: Equations, x: Array, u: Array, held: Indices, columns: Indices) -> Array:
    """System matrix [1/s] of the other lumps while the currents keep the held lumps' heat balance."""
    Jx, Ju = eq.jacobians(x, u)
    Ju = Ju[:, columns]
    free = np.setdiff1d(np.arange(len(x)), held)
    law = -np.linalg.solve(Ju[held], Jx[np.ix_(held, free)])  # dI/dx that holds the cold faces
    return (Jx[np.ix_(free, free)] + Ju[free] @ law) / eq.capacity[free, None]


def slowest_regulated(eq: Equations, x: Array, u: Array, held: Indices, columns: Indices) -> float:
    """Largest real part of the regulated machine's eigenvalues [1/s]; infinite where more current no longer cools."""
    cooling_slope = eq.jacobians(x, u)[1][held, columns]
    if not (cooling_slope < 0).all():  # beyond S x_c = R I the controller's sign is wrong
        return np.inf
    matrix = regulated_feedback(eq, x, u, held, columns)
    return float(np.linalg.eigvals(matrix).real.max(initial=-np.inf))


def loads(eq: Equations, x: Array, u: Array, columns: Indices) -> Array:
    """Heat the modules take from their cold lumps, S x_c I - ½ R I² - K (x_h - x_c) [W]."""
    term = next(t for t in eq.terms if isinstance(t, ModuleTerm))
    hot, cold, current = eq.ends(term, x, u)
    _, into_cold = term.heat(hot, cold, current)
    K = np.array([m.conductance.value for m in eq.system.modules.values()])
    return -(into_cold + K * (hot - cold))[columns - len(eq.system.inputs)]


def cold_faces(eq: Equations, setpoint: Mapping[str, float]) -> tuple[Indices, Indices, Array]:
    """Held lumps, columns of u with the currents of their modules, and set-points [K]."""
    if not setpoint:
        raise InputError("no module is named", where="argument setpoint", remedy='For example {"m1": 278.15}.')
    check_setpoint(eq.system, setpoint)
    held = np.array([eq.system.lump_names.index(eq.system.modules[name].cold) for name in setpoint], np.intp)
    columns = len(eq.system.inputs) + np.array([eq.system.module_names.index(name) for name in setpoint], np.intp)
    return held, columns, np.array(list(setpoint.values()), float)


def check_setpoint(system: System, setpoint: Mapping[str, float]) -> None:
    """Refuse set-points of what is no module, and Celsius."""
    for name, value in setpoint.items():
        if name not in system.modules:
            raise InputError(f"{name!r} is not a module", where="argument setpoint",
                             expected="one of " + ", ".join(system.modules))
        if not np.isfinite(value) or value < LOWEST_KELVIN:
            raise InputError(f"set-point of {name} is {value} K", where="argument setpoint", expected="kelvin",
                             remedy=ADD_ZERO)
