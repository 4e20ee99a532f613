"""Steady states: all of them along the way from rest, with their stability, or the honest "none"."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .._celsius import LOWEST_KELVIN, ZERO_CELSIUS
from .._drawing import axes_for
from .._pandas import pd
from ..errors import InputError, Outcome
from ._continuation import Curve, follow
from ._equations import Equations
from ._outcomes import ThermalCode
from ._regulated import check_setpoint, slowest_regulated
from ._system import System, equations
from ._terms import Array, Indices

_COLDEST, _HOTTEST = 100.0, 1500.0  # K: beyond, the model means nothing


@dataclass(frozen=True)
class Equilibrium:
    """One steady state.

    Parameters
    ----------
    temperatures : dict
        Lump to temperature [K].
    currents : dict
        Module to current [A].
    stable : bool
        Whether small deviations die out (with the cold faces regulated, if set-points were given).
    slowest : float
        Largest real part of the eigenvalues [1/s].
    """

    temperatures: dict[str, float]
    currents: dict[str, float]
    stable: bool
    slowest: float


@dataclass(frozen=True)
class SteadyState:
    """All steady states that were found; the first is the one reached from rest.

    Parameters
    ----------
    system : System
        System whose steady states these are.
    equilibria : tuple of Equilibrium
        In order along the curve from rest.
    reached : float
        Largest share of what was asked that has an equilibrium; at least 1 when there is one.
    outcome : Outcome
        "found", or "none" and why.
    """

    system: System
    equilibria: tuple[Equilibrium, ...]
    reached: float
    outcome: Outcome

    def to_frame(self) -> pd.DataFrame:
        """Temperatures [K] and currents [A], a column per equilibrium."""
        rows = [{**{f"{k} [K]": v for k, v in e.temperatures.items()}, **{f"{k} [A]": v for k, v in e.currents.items()},
                 "stable": e.stable} for e in self.equilibria]
        return pd.DataFrame(rows).T

    def __str__(self) -> str:
        return f"{self.outcome.text}\n{self.to_frame().to_string()}" if self.equilibria else self.outcome.text

    def plot(self, ax: Any = None) -> Any:
        """Bar chart of the lump temperatures [°C] of every equilibrium; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        width = 0.8 / max(len(self.equilibria), 1)
        for i, e in enumerate(self.equilibria):
            where = np.arange(len(e.temperatures)) + i * width
            ax.bar(where, np.array(list(e.temperatures.values())) - ZERO_CELSIUS, width,
                   label=f"equilibrium {i + 1}, {'stable' if e.stable else 'unstable'}")
        ax.set_xticks(range(len(self.system.lumps)), self.system.lump_names, rotation=90)
        ax.set(ylabel="temperature [°C]", title=f"steady states of {self.system.name}")
        ax.legend()
        return ax


def steady_state(system: System, inputs: Mapping[str, float] | None = None, *,
                 setpoint: Mapping[str, float] | None = None, heat: Mapping[str, float] | None = None) -> SteadyState:
    """Find the steady states of a system.

    Parameters
    ----------
    system : System
        System whose steady states are wanted.
    inputs : mapping, optional
        Heaters [unit], module currents [A] and ambients [K] by name; default off and nominal.
    setpoint : mapping, optional
        Module to temperature at which its cold face is regulated [K]; its current is then an unknown.
    heat : mapping, optional
        Extra heat into lumps [W], a load.

    Returns
    -------
    SteadyState
        All equilibria on the curve that leads from rest to what is asked, around folds; none when the load is above
        what the modules can take, or the currents drive a thermal runaway.

    Raises
    ------
    InputError
        Unknown names, Celsius, a current and a set-point for one module.

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.systems.two_module()
    >>> cold = {"m1": 283.15, "m2": 283.15}
    >>> possible = rt.thermal.steady_state(system, setpoint=cold, heat={"x11": 2.0, "x12": 2.0})
    >>> [e.stable for e in possible.equilibria]
    [True, False]
    >>> bool(rt.thermal.steady_state(system, setpoint=cold, heat={"x11": 5.0, "x12": 5.0}).outcome)
    False
    """
    eq = equations(system)
    problem = _Problem(eq, exogenous_point(eq, inputs or {}), *_regulated(eq, setpoint or {}, inputs or {}),
                       _vector(heat or {}, system.lump_names, "heat", "lump"))
    rest = _rest(eq, problem)
    curve = follow(problem.residual(rest), problem.jacobian(rest), problem.pack(rest, np.zeros(len(system.modules))),
                   problem.scale(), problem.inside)
    found = tuple(problem.equilibrium(y) for y in curve.crossings if problem.inside(y))
    return SteadyState(system, found, curve.reached, _outcome(found, curve, problem))


def _outcome(found: tuple[Equilibrium, ...], curve: Curve, problem: _Problem) -> Outcome:
    if found:
        stable = sum(e.stable for e in found)
        return ThermalCode.FOUND.outcome(f"{len(found)} steady state{'s' * (len(found) > 1)}, {stable} of them stable.")
    if problem.held.size:
        return ThermalCode.NONE.outcome(
            "None: the load is above q*, what the modules can take at these set-points. The largest share of set-point "
            f"change and load that has an equilibrium is {curve.reached:.3f}.",
            remedy="Raise the set-point, lower the load, or cool the hot side better.")
    return ThermalCode.NONE.outcome(
        "None: these currents drive a thermal runaway; the largest share of them that has an equilibrium is "
        f"{curve.reached:.3f}.", remedy="Lower the currents or cool the hot side better.")


@dataclass(frozen=True)
class _Problem:
    """Unknowns y: temperatures of the lumps that are not regulated, then the currents of the regulating modules."""

    eq: Equations
    u: Array
    held: Indices  # regulated lumps
    modules: Indices  # their modules
    target: Array  # their set-points [K]
    heat: Array

    @cached_property  # asked for at every step along the curve
    def free(self) -> Indices:
        """Lumps that are not regulated."""
        return np.setdiff1d(np.arange(len(self.eq.capacity)), self.held)

    @cached_property
    def columns(self) -> Indices:
        """Columns of u that hold the currents of the regulating modules."""
        return len(self.eq.system.inputs) + self.modules

    @cached_property
    def start(self) -> Array:
        """Exogenous values at rest."""
        return self.eq.nominal()

    def pack(self, x: Array, currents: Array) -> Array:
        return np.concatenate([x[self.free], currents[self.modules]])

    def state(self, y: Array, share: float, rest: Array) -> tuple[Array, Array]:
        """Temperatures and exogenous values at a share of the way."""
        x, free = np.empty(len(self.eq.capacity)), self.free
        x[free] = y[:free.size]
        x[self.held] = rest[self.held] + share * (self.target - rest[self.held])
        u = self.start + share * (self.u - self.start)
        u[self.columns] = y[free.size:]
        return x, u

    def residual(self, rest: Array) -> Any:
        return lambda y, share: self.eq.heat(*self.state(y, share, rest)) + share * self.heat

    def jacobian(self, rest: Array) -> Any:
        def J(y: Array, share: float) -> Array:
            x, u = self.state(y, share, rest)
            Jx, Ju = self.eq.jacobians(x, u)
            du = self.u - self.start
            du[self.columns] = 0.0
            along = Ju @ du + Jx[:, self.held] @ (self.target - rest[self.held]) + self.heat
            return np.column_stack([Jx[:, self.free], Ju[:, self.columns], along])
        return J

    def scale(self) -> Array:
        return np.concatenate([np.full(self.free.size, 50.0), np.full(self.modules.size, 2.0)])

    def inside(self, y: Array) -> bool:
        x = y[:self.free.size]
        return bool(x.min(initial=_HOTTEST) > _COLDEST and x.max(initial=_COLDEST) < _HOTTEST)

    def equilibrium(self, y: Array) -> Equilibrium:
        x, u = self.state(y, 1.0, np.zeros(len(self.eq.capacity)))
        if self.held.size:
            slowest = slowest_regulated(self.eq, x, u, self.held, self.columns)
        else:
            slowest = float(np.linalg.eigvals(self.eq.jacobians(x, u)[0] / self.eq.capacity[:, None]).real.max())
        first = len(self.eq.system.inputs)
        return Equilibrium(dict(zip(self.eq.system.lump_names, x.tolist(), strict=True)),
                           dict(zip(self.eq.system.module_names, u[first:].tolist(), strict=False)),
                           slowest < 0, slowest)


def _rest(eq: Equations, problem: _Problem) -> Array:
    """Equilibrium with heaters and currents off and nominal ambients, by Newton (monotone: conduction only)."""
    x, u = eq.initial(), eq.nominal()
    for _ in range(50):
        change = np.linalg.solve(eq.jacobians(x, u)[0], eq.heat(x, u))
        x = x - change
        if np.abs(change).max() < 1e-11:
            break
    return x


def exogenous_point(eq: Equations, inputs: Mapping[str, float]) -> Array:
    u, names = eq.nominal(), eq.system.exogenous_names
    for name, value in inputs.items():
        if name not in names:
            raise InputError(f"{name!r} is not a heater, module or ambient", where="argument inputs",
                             expected="one of " + ", ".join(names))
        if not _finite(value) or (name in eq.system.ambients and value < LOWEST_KELVIN):
            raise InputError(f"{name} = {value!r}", where="argument inputs",
                             expected="a finite number, kelvin for ambients")
        u[names.index(name)] = value
    return u


def _regulated(eq: Equations, setpoint: Mapping[str, float],
               inputs: Mapping[str, float]) -> tuple[Indices, Indices, Array]:
    modules = eq.system.modules
    check_setpoint(eq.system, setpoint)
    for name in setpoint:
        if name in inputs:
            raise InputError(f"module {name!r} has a current and a set-point", where="argument inputs",
                             remedy="Give one of them: its current follows from the set-point.")
    cold = [eq.system.lump_names.index(modules[name].cold) for name in setpoint]
    if len(set(cold)) < len(cold):
        raise InputError("two set-points regulate one lump", where="argument setpoint", remedy="Give one of them.")
    return (np.array(cold, np.intp), np.array([list(modules).index(name) for name in setpoint], np.intp),
            np.array(list(setpoint.values()), float))


def _vector(values: Mapping[str, float], names: tuple[str, ...], argument: str, kind: str) -> Array:
    out = np.zeros(len(names))
    for name, value in values.items():
        if name not in names or not _finite(value):
            raise InputError(f"{name} = {value!r}", where=f"argument {argument}",
                             expected=f"a {kind} and a finite number")
        out[names.index(name)] = value
    return out


def _finite(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and bool(np.isfinite(value))
