"""Which set-points can be held, with a load and within the limits of a feedback law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._celsius import ADD_ZERO, ZERO_CELSIUS
from .._drawing import axes_for
from ..errors import InputError, Outcome
from ..thermal import Equations, steady_state
from ._linearization import FeedbackLinearization
from ._modules import Array
from ._numbers import expect
from ._outcomes import DesignCode
from ._plant import cold_side
from ._regulated_points import Regulate, RegulatedPoint, regulated_points

_FINE = 1e-3  # K
_STRIDE = 2.0  # K, first step of the march
_FURTHEST = 3.0  # times the way to the set-points


@dataclass(frozen=True)
class Reachable:
    """What a system can hold in the direction of its set-points.

    Parameters
    ----------
    setpoint : dict
        Module to wanted temperature of its cold face, or of what it regulates instead [K].
    passive : dict
        The same with the modules off and the load on [K].
    limit : dict
        How far they can be brought from `passive`, together, along the line through the set-points [K].
    current : dict
        Currents that hold the set-points, or the limit if they are beyond it [A].
    binding : str
        What sets the limit: "runaway" (no stable equilibrium beyond), the "current" or "voltage" limit of the feedback
        law, or "" when the set-points are held and nothing binds up to three times as far.
    outcome : Outcome
        "reachable", or "unreachable" with the reachable range.
    faces : dict
        Module to the temperature of its cold face with these currents [K].
    temperatures : dict
        Lump to its temperature with these currents [K].
    """

    setpoint: dict[str, float]
    passive: dict[str, float]
    limit: dict[str, float]
    current: dict[str, float]
    binding: str
    outcome: Outcome
    faces: dict[str, float]
    temperatures: dict[str, float]

    @property
    def why(self) -> str:
        """What sets the limit, in words; empty where nothing does."""
        return _words(self.binding) if self.binding else ""

    def __str__(self) -> str:
        return self.outcome.text

    def require(self) -> None:
        """Refuse set-points that cannot be held.

        Raises
        ------
        InputError
            With the reachable range.
        """
        if not self.outcome:
            raise InputError("; ".join(f"{name} at {value:g} K" for name, value in self.setpoint.items()),
                             where="argument setpoint", expected=_ranges(self.passive, self.limit),
                             remedy="Choose set-points within it, lower the load, or cool the hot side better.")

    def plot(self, ax: Any = None) -> Any:
        """Plot range and set-point of every module [°C]; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        for i, name in enumerate(self.setpoint):
            ax.plot([i, i], np.array([self.passive[name], self.limit[name]]) - ZERO_CELSIUS, lw=8, alpha=0.4)
            ax.plot(i, self.setpoint[name] - ZERO_CELSIUS, "k_", ms=24)
        ax.set_xticks(range(len(self.setpoint)), list(self.setpoint))
        ax.set(ylabel="regulated temperature [°C]", title="set-point (black) and reachable range")
        return ax


def reachable(law: FeedbackLinearization, setpoint: Mapping[str, float] | float, *,
              load: Mapping[str, float] | None = None, inputs: Mapping[str, float] | None = None,
              regulate: Regulate = None) -> Reachable:
    """Can these set-points be held, in steady state, with this load and within the feedback law's current limits?

    Parameters
    ----------
    law : FeedbackLinearization
        Its system and current limits.
    setpoint : mapping of module to float, or one number for all
        Temperatures of the cold faces, or of what is regulated instead [K].
    load : mapping of lump to float, optional
        Heat into lumps [W].
    inputs : mapping, optional
        Ambients [K], heaters [unit], currents of other modules [A].
    regulate : mapping of module to str, optional
        Sensor or lump that a module regulates; default its cold face. Offset and gain of a sensor count.

    Returns
    -------
    Reachable

    Raises
    ------
    InputError
        Unknown names, Celsius; a load that has no equilibrium with the modules off.

    Examples
    --------
    >>> import robthermal as rt
    >>> law = rt.design.feedback_linearization(rt.systems.two_module())
    >>> answer = rt.design.reachable(law, 283.15, load={"x11": 5.0, "x12": 5.0})
    >>> answer.outcome.code, round(answer.limit["m1"] - 273.15, 1), answer.binding
    ('unreachable', 11.6, 'runaway')
    """
    expect(law, FeedbackLinearization, "law", "rt.design.feedback_linearization")
    target = law.modules.vector(setpoint, "setpoint", "K")
    if target.min() < 150.0:
        raise InputError(f"a set-point is {target.min():g} K", where="argument setpoint", expected="kelvin",
                         remedy=ADD_ZERO)
    search = _Search.of(law, dict(load or {}), dict(inputs or {}),
                        cold_side(law, regulate=regulate).points if regulate else regulated_points(law))
    base = search.readings(search.passive)
    share, x, at, why = search.furthest(np.array([point.temperature(value) for point, value in
                                                  zip(search.points, target, strict=True)]))
    passive, wanted, far, current, faces = (
        dict(zip(law.names, a.tolist(), strict=True))
        for a in (base, target, base + share * (target - base), at, x[law.modules.cold]))
    lumps = dict(zip(law.system.lump_names, x.tolist(), strict=True))
    if share >= 1:
        further = f" In their direction: {_ranges(passive, far)}; beyond, {_words(why)}." if why else ""
        outcome = DesignCode.REACHABLE.outcome(f"The set-points can be held.{further}")
    else:
        outcome = DesignCode.UNREACHABLE.outcome(
            f"These set-points cannot be held: {_words(why)}. Reachable is {_ranges(passive, far)}.")
    return Reachable(wanted, passive, far, current, why, outcome, faces, lumps)


def held_near(law: FeedbackLinearization, points: tuple[RegulatedPoint, ...], setpoint: Array,
              inputs: Mapping[str, float], near: tuple[Array, Array]) -> tuple[Array, Array] | None:
    """Lumps and currents that hold set-points, by Newton's method from those of a similar machine.

    Parameters
    ----------
    law : FeedbackLinearization
        Its system and current limits.
    points : tuple of RegulatedPoint
        What is regulated.
    setpoint : ndarray
        Set-points of the points [K].
    inputs : mapping
        Ambients [K] and heaters [unit].
    near : tuple of ndarray
        Lumps [K] and currents [A] to start from.

    Returns
    -------
    tuple of ndarray or None
        None where no stable steady state within the limits is found so.
    """
    eq = Equations(law.system)
    u = eq.nominal()
    for name, value in inputs.items():
        u[law.system.exogenous_names.index(name)] = value
    search = _Search(law, eq, u, np.zeros(len(near[0])), near[0], points)
    goal = np.array([float(point.temperature(value)) for point, value in zip(points, setpoint, strict=True)])
    found = search._solve(goal, *near)
    return None if found is None or search._limit(*found) else found


@dataclass(frozen=True)
class _Search:
    """Marches along a line of set-points, from the passive faces, through stable steady states only."""

    law: FeedbackLinearization
    eq: Equations
    u: Array
    heat: Array
    passive: Array
    points: tuple[RegulatedPoint, ...]

    @classmethod
    def of(cls, law: FeedbackLinearization, load: dict[str, float], inputs: dict[str, float],
           points: tuple[RegulatedPoint, ...]) -> _Search:
        """Start at the steady state with the feedback law's modules off and the load on."""
        for name in law.names:
            if name in inputs:
                raise InputError(f"{name!r} is driven by the feedback law", where="argument inputs",
                                 remedy="Leave its current out.")
        found = steady_state(law.system, inputs, heat=load)
        if not found.equilibria or not found.equilibria[0].stable:
            raise InputError("this load has no stable steady state with the modules off", where="argument load",
                             remedy=found.outcome.text)
        eq = Equations(law.system)
        u = eq.nominal()
        for name, value in inputs.items():
            u[law.system.exogenous_names.index(name)] = value
        heat = np.array([load.get(name, 0.0) for name in law.system.lumps])
        return cls(law, eq, u, heat, np.array(list(found.equilibria[0].temperatures.values())), points)

    @property
    def held(self) -> list[int]:
        """Lumps that are held."""
        return [self.law.system.lump_names.index(point.lump) for point in self.points]

    def readings(self, x: Array) -> Array:
        """What is regulated, in steady state at these lump temperatures."""
        return np.array([float(point.reading(x[i])) for point, i in zip(self.points, self.held, strict=True)])

    @property
    def columns(self) -> list[int]:
        """Columns of u with the currents of the feedback law's modules."""
        return [self.law.system.exogenous_names.index(name) for name in self.law.names]

    def furthest(self, target: Array) -> tuple[float, Array, Array, str]:
        """Largest share of the way to the target (three at most), lumps and currents there or at it, what binds."""
        base = self.passive[self.held]
        size = float(np.abs(target - base).max())
        if size < _FINE:
            return 1.0, self.passive, np.zeros(len(base)), ""
        x: Array = self.passive
        current: Array = np.zeros(len(base))
        share, why = 0.0, ""
        at_target, step = (x, current), _STRIDE / size
        while step * size > _FINE and share < _FURTHEST:
            goal = min(share + step, 1.0 if share < 1 else _FURTHEST)
            found = self._solve(base + goal * (target - base), x, current)
            why = "runaway" if found is None else self._limit(*found)
            if found is None or why:
                step /= 2
                continue
            share, (x, current), step = goal, found, min(1.5 * step, 2 * _STRIDE / size)
            at_target = (x, current) if share <= 1 else at_target
        return share, *at_target, why

    def _limit(self, x: Array, current: Array) -> str:
        """Limit of the feedback law that these currents exceed."""
        active = self.law.command(self.law.heat(current, x), x).limit
        return next((str(name) for name in active if name), "")

    def _solve(self, goal: Array, x: Array, current: Array) -> tuple[Array, Array] | None:
        """Newton for the free temperatures and the currents; None unless it ends in a stable steady state nearby."""
        x, u, held, columns = x.copy(), self.u.copy(), self.held, self.columns
        free = np.setdiff1d(np.arange(len(x)), held)
        x[held], u[columns] = goal, current
        for _ in range(20):
            Jx, every = self.eq.jacobians(x, u)
            Ju = every[:, columns]
            change = np.linalg.solve(np.hstack([Jx[:, free], Ju]), self.eq.heat(x, u) + self.heat)
            if not np.abs(change).max() < 200.0:
                return None
            x[free] -= change[:len(free)]
            u[columns] -= change[len(free):]
            if np.abs(change).max() < 1e-9:
                return (x, u[columns]) if self._stable(Jx, Ju, u[columns], x) else None
        return None

    def _stable(self, Jx: Array, Ju: Array, current: Array, x: Array) -> bool:
        """Whether the rest of the network is stable while the currents, below their optimum, hold the cold faces."""
        if not np.isfinite(self.law.gain(current, x)).all():
            return False
        faces = self.law.modules.cold
        free = np.setdiff1d(np.arange(len(x)), faces)
        feedback = -np.linalg.solve(Ju[faces], Jx[faces][:, free])
        matrix = (Jx[np.ix_(free, free)] + Ju[free] @ feedback) / self.eq.capacity[free, None]
        return bool(np.linalg.eigvals(matrix).real.max(initial=-np.inf) < 0)


def _words(binding: str) -> str:
    return "the hot side runs away" if binding == "runaway" else f"the {binding} limit is reached"


def _ranges(passive: Mapping[str, float], limit: Mapping[str, float]) -> str:
    parts = [f"{name} {min(passive[name], limit[name]):.2f} to {max(passive[name], limit[name]):.2f} K"
             for name in passive]
    return ", ".join(parts)
