"""Modules that hold their cold face at a set-point: the load curve q(I), its fold I*, q*: thermal runaway.

The hot side is stable while more current takes more heat; at the fold dq/dI = 0 and beyond it no equilibrium takes the
load (errata, "Thermal runaway: what the thesis lacks").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components

from ..errors import InputError
from ._equations import Equations
from ._module_term import ModuleTerm
from ._system import System, equations
from ._terms import Array, Indices
from ._units import LOWEST_KELVIN

_POINTS = 60  # of a load curve


@dataclass(frozen=True)
class LoadCurve:
    """Equilibria of modules that hold their cold faces, along a path of currents.

    Parameters
    ----------
    system : System
        Whose.
    setpoint : dict
        Module to temperature of its cold face [K].
    current : ndarray, shape (n, n_modules)
        Current of every module named [A].
    load : ndarray, shape (n, n_modules)
        Heat every module takes from its cold face [W].
    temperatures : ndarray, shape (n, n_lumps)
        [K].
    slowest : ndarray, shape (n,)
        Largest eigenvalue of the regulated machine [1/s]; negative: stable.
    """

    system: System
    setpoint: dict[str, float]
    current: Array
    load: Array
    temperatures: Array
    slowest: Array

    def plot(self) -> Any:
        """Plot load against current, stable part solid; returns the matplotlib axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, ax = plt.subplots(layout="constrained")
        stable = self.slowest < 0
        for name, current, load in zip(self.setpoint, self.current.T, self.load.T, strict=True):
            line = ax.plot(current, np.where(stable, load, np.nan), label=f"{name}, stable")[0]
            ax.plot(current, np.where(stable, np.nan, load), "--", color=line.get_color(), label=f"{name}, runs away")
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
    held, columns, target = _faces(eq, setpoint)
    u, rows = _surroundings(eq, ambient), []
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


def fold(system: System, setpoint: Mapping[str, float], *, ambient: Mapping[str, float] | None = None) -> LoadCurve:
    """Largest loads the modules can take at their set-points, and the way there.

    Modules that share a heat sink are loaded in proportion to their size (S x_c)²/2R, equal modules equally, until no
    equilibrium takes more: dq/dI = 0 along that way. Modules on sinks of their own have limits of their own.

    Parameters
    ----------
    system, setpoint, ambient
        As in `load_curve`.

    Returns
    -------
    LoadCurve
        Along the way, ending just inside the stable side of the fold: the last row is I*, q*.

    Raises
    ------
    InputError
        Unknown modules; a machine that is unstable without any current.

    Examples
    --------
    >>> import robthermal as rt
    >>> end = rt.thermal.fold(rt.systems.two_module(), {"m1": 278.15, "m2": 278.15})
    >>> end.load[-1].round(2).tolist()  # W, where the thesis's bound allows 3.3 A
    [3.75, 3.75]
    """
    eq = equations(system)
    held, columns, target = _faces(eq, setpoint)
    names = list(setpoint)
    path = np.zeros((_POINTS, len(names)))
    for group in _groups(eq, held, columns):
        own = {names[i]: setpoint[names[i]] for i in group}
        path[:, group] = _load_path(system, own, ambient)
    curve = load_curve(system, setpoint, path, ambient=ambient)
    if len(curve.current) < _POINTS or curve.slowest.max() >= 0:
        raise InputError("no stable path to the fold was found", where="argument system",
                         remedy="Check the signs of the module parameters and the heat path of the hot side.")
    return curve


def _groups(eq: Equations, held: Indices, columns: Indices) -> list[list[int]]:
    """Modules (positions among those named) that share a heat sink once the cold faces are held."""
    free = np.setdiff1d(np.arange(len(eq.capacity)), held)
    J = eq.jacobian(eq.initial(), eq.nominal())[free][:, free]
    _, label = connected_components(J, directed=False)
    modules = list(eq.system.modules.values())
    groups: dict[int, list[int]] = {}
    for position, column in enumerate(columns):
        hot = eq.system.lump_names.index(modules[column - len(eq.system.inputs)].hot)
        where = label[np.searchsorted(free, hot)] if hot not in held else -1 - position
        groups.setdefault(int(where), []).append(position)
    return list(groups.values())


def _load_path(system: System, setpoint: Mapping[str, float], ambient: Mapping[str, float] | None) -> Array:
    """Currents (n, n_modules) along loads in proportion to the modules' size, up to just before the fold."""
    eq = equations(system)
    held, columns, target = _faces(eq, setpoint)
    term = next(t for t in eq.terms if isinstance(t, ModuleTerm))
    own = columns - len(system.inputs)
    dT = target - term.T_ref[own]
    S, R = term.S[own] + term.S_slope[own] * dT, term.R[own] + term.R_slope[own] * dT
    size = (S * target) ** 2 / (2 * R)
    solve = _LoadSolver(eq, held, columns, target, _surroundings(eq, ambient), size)
    at_rest = solve.loads_at(np.zeros(len(columns)))
    if at_rest is None:
        raise InputError("the machine is unstable without any current", where="argument system",
                         remedy="Check the signs of its parameters.")
    first = float(np.max(at_rest / size))
    low, high = first, first + 1.01  # a module on a perfect sink takes its size more than at rest
    current = solve.currents(low, np.zeros(len(columns)))
    if current is None:
        raise InputError("the modules do not take heat with a small current", where="argument system",
                         remedy="Check polarity and parameters.")
    while high - low > 1e-12:
        middle = 0.5 * (low + high)
        new = solve.currents(middle, current)
        if new is None:
            high = middle
        else:
            low, current = middle, new
    path: list[Array] = []
    at: Array = np.zeros(len(columns))
    for share in first + (low - first) * (1 - np.linspace(1, 0, _POINTS) ** 2):  # dense towards the fold
        new = solve.currents(share, at)
        at = current if new is None else new
        path.append(at)
    return np.array(path)


@dataclass(frozen=True)
class _LoadSolver:
    """Finds the currents at which every module takes its share of the load, on the stable side."""

    eq: Equations
    held: Indices
    columns: Indices
    target: Array
    u: Array
    size: Array

    def at(self, current: Array) -> tuple[Array, Array] | None:
        """Equilibrium temperatures and exogenous values at given currents, if it is stable."""
        u, x = self.u.copy(), self.eq.initial()
        u[self.columns] = current
        x[self.held] = self.target
        solved = hot_side(self.eq, x, u, self.held)
        if solved is None or slowest_regulated(self.eq, solved, u, self.held, self.columns) >= 0:
            return None
        return solved, u

    def loads_at(self, current: Array) -> Array | None:
        """Loads at given currents."""
        point = self.at(current)
        return None if point is None else loads(self.eq, *point, self.columns)

    def currents(self, share: float, start: Array) -> Array | None:
        """Newton with step halving from a stable start; None where there is no stable equilibrium."""
        current = start
        point = self.at(current)
        for _ in range(60):
            if point is None:
                return None
            missing = share * self.size - loads(self.eq, *point, self.columns)
            if np.abs(missing).max() < 1e-11 * self.size.max():
                return current
            change = np.linalg.solve(_load_slopes(self.eq, *point, self.held, self.columns), missing)
            for halving in range(12):
                trial = self.at(current + change / 2**halving)
                if trial is not None:
                    break
            current, point = current + change / 2**halving, trial
        return None


def _load_slopes(eq: Equations, x: Array, u: Array, held: Indices, columns: Indices) -> Array:
    """∂q/∂I with the rest of the network in steady state [W/A]."""
    Jx, Ju = eq.jacobian(x, u).toarray(), eq.input_jacobian(x, u).toarray()[:, columns]
    free = np.setdiff1d(np.arange(len(x)), held)
    dx = -np.linalg.solve(Jx[np.ix_(free, free)], Ju[free])
    linear = eq.A.toarray()
    K = np.zeros_like(linear)  # the modules' own conductance belongs to the load, the other links do not
    for module in eq.system.modules.values():
        h, c = eq.system.lump_names.index(module.hot), eq.system.lump_names.index(module.cold)
        K[c, h] += module.conductance.value
        K[c, c] -= module.conductance.value
    own = Jx[held] - linear[held] + K[held]
    return -(Ju[held] + own[:, free] @ dx)


def _surroundings(eq: Equations, ambient: Mapping[str, float] | None) -> Array:
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
        change = np.linalg.solve(eq.jacobian(x, u).toarray()[np.ix_(free, free)], eq.heat(x, u)[free])
        x[free] -= change
        if not np.abs(change).max(initial=0.0) < 1e4:
            return None
        if np.abs(change).max(initial=0.0) < 1e-10:
            return x if x.min() > 0 else None
    return None


def regulated_feedback(eq: Equations, x: Array, u: Array, held: Indices, columns: Indices) -> Array:
    """System matrix [1/s] of the other lumps while the currents keep the held lumps' heat balance."""
    Jx, Ju = eq.jacobian(x, u).toarray(), eq.input_jacobian(x, u).toarray()[:, columns]
    free = np.setdiff1d(np.arange(len(x)), held)
    law = -np.linalg.solve(Ju[held], Jx[np.ix_(held, free)])  # dI/dx that holds the cold faces
    return (Jx[np.ix_(free, free)] + Ju[free] @ law) / eq.capacity[free, None]


def slowest_regulated(eq: Equations, x: Array, u: Array, held: Indices, columns: Indices) -> float:
    """Largest real part of the regulated machine's eigenvalues [1/s]; infinite where more current no longer cools."""
    grip = eq.input_jacobian(x, u).toarray()[held, columns]
    if not (grip < 0).all():  # beyond S x_c = R I the controller's sign is wrong
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


def _faces(eq: Equations, setpoint: Mapping[str, float]) -> tuple[Indices, Indices, Array]:
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
                             remedy="Add 273.15 to degrees Celsius.")
