"""The fold of the load curve: the largest loads that modules can take at their set-points, I* and q*.

Modules on one heat sink are loaded in proportion to their size. The path of their currents is followed by the mean
current, relative to that of the largest Peltier effect; the share of the load grows along it up to the fold.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from ..errors import InputError
from ._equations import Equations
from ._module_term import ModuleTerm
from ._regulated import LoadCurve, cold_faces, hot_side, load_curve, loads, slowest_regulated, surroundings
from ._system import System, equations
from ._terms import Array, Indices

_STEPS = 24  # of the march along which the fold is bracketed
_CLOSE = 1e-11  # width of the bracket of the fold, in mean relative current
_NEWTON = 30
Conditions = Callable[[Array, Array, Array], tuple[Array, Array]]  # current, shares, slopes to residual and its matrix


def fold(system: System, setpoint: Mapping[str, float], *, ambient: Mapping[str, float] | None = None,
         points: int = 60) -> LoadCurve:
    """Largest loads the modules can take at their set-points, and the way there.

    Modules that share a heat sink are loaded in proportion to their size (S x_c)²/2R, equal modules equally, until no
    equilibrium takes more: dq/dI = 0 along that way. Modules on sinks of their own have limits of their own.

    Parameters
    ----------
    system, setpoint, ambient
        As in `load_curve`.
    points : int
        Number of points on the way to the fold, the fold itself among them.

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
    held, columns, _ = cold_faces(eq, setpoint)
    names = list(setpoint)
    path = np.zeros((points, len(names)))
    for group in _groups(eq, held, columns):
        own = {names[i]: setpoint[names[i]] for i in group}
        path[:, group] = _load_path(eq, own, ambient, points)
    curve = load_curve(system, setpoint, path, ambient=ambient)
    if len(curve.current) < points or curve.slowest.max() >= 0:
        raise InputError("no stable path to the fold was found", where="argument system",
                         remedy="Check the signs of the module parameters and the heat path of the hot side.")
    return curve


def _groups(eq: Equations, held: Indices, columns: Indices) -> list[list[int]]:
    """Modules (positions among those named) that share a heat sink once the cold faces are held."""
    free = np.setdiff1d(np.arange(len(eq.capacity)), held)
    J = eq.jacobian(eq.initial(), eq.nominal())[free][:, free]
    _, label = scipy.sparse.csgraph.connected_components(J, directed=False)
    modules = list(eq.system.modules.values())
    groups: dict[int, list[int]] = {}
    for position, column in enumerate(columns):
        hot = eq.system.lump_names.index(modules[column - len(eq.system.inputs)].hot)
        where = label[np.searchsorted(free, hot)] if hot not in held else -1 - position
        groups.setdefault(int(where), []).append(position)
    return list(groups.values())


@dataclass(frozen=True)
class _Point:
    """One point of the path."""

    mean: float  # mean of the currents, each relative to that of its largest Peltier effect
    current: Array
    temperatures: Array
    direction: Array  # of the currents with the mean
    growth: float  # of the load's share with the mean: zero at the fold


def _load_path(eq: Equations, setpoint: Mapping[str, float], ambient: Mapping[str, float] | None,
               points: int) -> Array:
    """Currents (n, n_modules) along loads in proportion to the modules' size, up to just before the fold."""
    held, columns, target = cold_faces(eq, setpoint)
    term = next(t for t in eq.terms if isinstance(t, ModuleTerm))
    own = columns - len(eq.system.inputs)
    dT = target - term.T_ref[own]
    S, R = term.S[own] + term.S_slope[own] * dT, term.R[own] + term.R_slope[own] * dT
    path = _Path(eq, held, columns, surroundings(eq, ambient), (S * target) ** 2 / (2 * R), S * target / R)
    x = eq.initial()
    x[held] = target
    first = path.first(x)
    end = _last(path, first)
    rows, point = [], first
    for mean in first.mean + (end.mean - first.mean) * np.linspace(0, 1, points)[:-1]:
        point = path.at(mean, point) or point
        rows.append(point.current)
    return np.array([*rows, end.current])


def _last(path: _Path, first: _Point) -> _Point:
    """Point just before the fold."""
    inside, beyond = first, first.mean
    for _ in range(_STEPS):
        beyond += 1.1 / _STEPS
        point = path.at(beyond, inside)
        if point is None or point.growth <= 0:
            break
        inside = point

    def growth(mean: float) -> float:
        point = path.at(mean, inside)
        return -1.0 if point is None else point.growth

    root = scipy.optimize.brentq(growth, inside.mean, beyond, xtol=_CLOSE) if inside.growth > 0 else inside.mean
    for back_off in (10 * _CLOSE, 1e-8, 1e-6, 1e-4):
        point = path.at(root - back_off, inside)
        if point is not None and point.growth > 0:
            return point
    raise InputError("the modules do not take heat with a small current", where="argument system",
                     remedy="Check polarity and parameters, and the heat path of the hot side.")


@dataclass(frozen=True)
class _Path:
    """Currents at which modules are loaded in proportion to their size, on the stable side."""

    eq: Equations
    held: Indices
    columns: Indices
    u: Array
    size: Array
    scale: Array  # currents of the largest Peltier effect

    def first(self, x: Array) -> _Point:
        """The smallest load at which no current is negative."""
        none = np.zeros(len(self.columns))
        rest = self._settled(none, x)
        if rest is None:
            raise InputError("the machine is unstable without any current", where="argument system",
                             remedy="Check the signs of its parameters.")
        share = float(np.max(loads(self.eq, *rest, self.columns) / self.size))
        point = self._solve(none, rest[0], lambda current, shares, slopes: (shares - share, slopes))
        if point is None:
            raise InputError("the modules do not take heat with a small current", where="argument system",
                             remedy="Check polarity and parameters.")
        return point

    def at(self, mean: float, start: _Point) -> _Point | None:
        """The point with a mean current, from one nearby; None where there is no stable one."""
        def conditions(current: Array, shares: Array, slopes: Array) -> tuple[Array, Array]:
            return np.append(shares[1:] - shares[0], np.mean(current / self.scale) - mean), self._matrix(slopes)

        return self._solve(start.current + (mean - start.mean) * start.direction, start.temperatures, conditions)

    def _matrix(self, slopes: Array) -> Array:
        """Of equal shares and a given mean."""
        return np.concatenate([slopes[1:] - slopes[0], (1 / self.scale / len(self.scale))[None]])

    def _solve(self, current: Array, x: Array, conditions: Conditions) -> _Point | None:
        """Newton on the currents with step halving; None where there is no stable equilibrium."""
        point = self._settled(current, x)
        for _ in range(_NEWTON):
            if point is None:
                return None
            slopes = _load_slopes(self.eq, *point, self.held, self.columns) / self.size[:, None]
            missing, matrix = conditions(current, loads(self.eq, *point, self.columns) / self.size, slopes)
            if np.abs(missing).max() < 1e-12:
                direction = np.linalg.solve(self._matrix(slopes), np.append(np.zeros(len(current) - 1), 1.0))
                return _Point(float(np.mean(current / self.scale)), current, point[0], direction,
                              float(slopes[0] @ direction))
            change = -np.linalg.solve(matrix, missing)
            for halving in range(12):
                trial = self._settled(current + change / 2**halving, point[0])
                if trial is not None:
                    break
            current, point = current + change / 2**halving, trial
        return None

    def _settled(self, current: Array, x: Array) -> tuple[Array, Array] | None:
        """Temperatures and exogenous values in equilibrium at given currents, if it is stable."""
        u = self.u.copy()
        u[self.columns] = current
        solved = hot_side(self.eq, x, u, self.held)
        if solved is None or slowest_regulated(self.eq, solved, u, self.held, self.columns) >= 0:
            return None
        return solved, u


def _load_slopes(eq: Equations, x: Array, u: Array, held: Indices, columns: Indices) -> Array:
    """∂q/∂I with the rest of the network in steady state [W/A]."""
    Jx, Ju = eq.jacobians(x, u)
    Ju = Ju[:, columns]
    free = np.setdiff1d(np.arange(len(x)), held)
    dx = -np.linalg.solve(Jx[np.ix_(free, free)], Ju[free])
    linear = eq.A[held].toarray()
    K = np.zeros(eq.A.shape)  # the modules' own conductance belongs to the load, the other links do not
    for module in eq.system.modules.values():
        h, c = eq.system.lump_names.index(module.hot), eq.system.lump_names.index(module.cold)
        K[c, h] += module.conductance.value
        K[c, c] -= module.conductance.value
    own = Jx[held] - linear + K[held]
    return -(Ju[held] + own[:, free] @ dx)
