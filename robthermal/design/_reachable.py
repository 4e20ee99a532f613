"""Which set-points can be held, with a load and within the limits of a feedback law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._celsius import ADD_ZERO, ZERO_CELSIUS
from ..errors import InputError, Outcome
from ..thermal import Equations, steady_state
from ._linearization import FeedbackLinearization
from ._modules import Array
from ._numbers import expect
from ._outcomes import DesignCode

_FINE = 1e-3  # K
_STRIDE = 2.0  # K, first step of the march
_FURTHEST = 3.0  # times the way to the set-points


@dataclass(frozen=True)
class Reachable:
    """What a system can hold in the direction of its set-points.

    Parameters
    ----------
    setpoint : dict
        Module to wanted temperature of its cold face [K].
    passive : dict
        The same faces with the modules off and the load on [K].
    limit : dict
        How far the faces can be brought from `passive`, together, along the line through the set-points [K].
    current : dict
        Currents that hold the set-points, or the limit if they are beyond it [A].
    binding : str
        What sets the limit: "runaway" (no stable equilibrium beyond), the law's "current" or "voltage" limit, or ""
        when the set-points are held and nothing binds up to three times as far.
    outcome : Outcome
        "reachable", or "unreachable" with the reachable range.
    """

    setpoint: dict[str, float]
    passive: dict[str, float]
    limit: dict[str, float]
    current: dict[str, float]
    binding: str
    outcome: Outcome

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

    def plot(self) -> Any:
        """Plot range and set-point of every module [°C]; returns the matplotlib axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, ax = plt.subplots(layout="constrained")
        for i, name in enumerate(self.setpoint):
            ax.plot([i, i], np.array([self.passive[name], self.limit[name]]) - ZERO_CELSIUS, lw=8, alpha=0.4)
            ax.plot(i, self.setpoint[name] - ZERO_CELSIUS, "k_", ms=24)
        ax.set_xticks(range(len(self.setpoint)), list(self.setpoint))
        ax.set(ylabel="cold face [°C]", title="set-point (black) and reachable range")
        return ax


def reachable(law: FeedbackLinearization, setpoint: Mapping[str, float] | float, *,
              load: Mapping[str, float] | None = None, inputs: Mapping[str, float] | None = None) -> Reachable:
    """Can these set-points be held, in steady state, with this load and within the feedback law's current limits?

    Parameters
    ----------
    law : FeedbackLinearization
        Its system and current limits.
    setpoint : mapping of module to float, or one number for all
        Temperatures of the cold faces [K].
    load : mapping of lump to float, optional
        Heat into lumps [W].
    inputs : mapping, optional
        Ambients [K], heaters [unit], currents of other modules [A].

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
    search = _Search.of(law, dict(load or {}), dict(inputs or {}))
    base = search.passive[search.held]
    share, at, why = search.furthest(target)
    passive, wanted, far = (dict(zip(law.names, a.tolist(), strict=True))
                            for a in (base, target, base + share * (target - base)))
    current = dict(zip(law.names, at.tolist(), strict=True))
    if share >= 1:
        further = f" In their direction: {_ranges(passive, far)}; beyond, {_words(why)}." if why else ""
        return Reachable(wanted, passive, far, current, why,
                         DesignCode.REACHABLE.outcome(f"The set-points can be held.{further}"))
    return Reachable(wanted, passive, far, current, why, DesignCode.UNREACHABLE.outcome(
        f"These set-points cannot be held: {_words(why)}. Reachable is {_ranges(passive, far)}."))


@dataclass(frozen=True)
class _Search:
    """Marches along a line of set-points, from the passive faces, through stable steady states only."""

    law: FeedbackLinearization
    eq: Equations
    u: Array
    heat: Array
    passive: Array

    @classmethod
    def of(cls, law: FeedbackLinearization, load: dict[str, float], inputs: dict[str, float]) -> _Search:
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
        return cls(law, eq, u, heat, np.array(list(found.equilibria[0].temperatures.values())))

    @property
    def held(self) -> list[int]:
        """Lumps that are held."""
        return self.law.modules.cold

    @property
    def columns(self) -> list[int]:
        """Columns of u with the currents of the feedback law's modules."""
        return [self.law.system.exogenous_names.index(name) for name in self.law.names]

    def furthest(self, target: Array) -> tuple[float, Array, str]:
        """Largest share of the way to the target (three at most), currents there or at the target, what binds."""
        base = self.passive[self.held]
        size = float(np.abs(target - base).max())
        if size < _FINE:
            return 1.0, np.zeros(len(base)), ""
        x: Array = self.passive
        current: Array = np.zeros(len(base))
        share, why = 0.0, ""
        at_target, step = current, _STRIDE / size
        while step * size > _FINE and share < _FURTHEST:
            goal = min(share + step, 1.0 if share < 1 else _FURTHEST)
            found = self._solve(base + goal * (target - base), x, current)
            why = "runaway" if found is None else self._limit(*found)
            if found is None or why:
                step /= 2
                continue
            share, (x, current), step = goal, found, min(1.5 * step, 2 * _STRIDE / size)
            at_target = current if share <= 1 else at_target
        return share, at_target, why

    def _limit(self, x: Array, current: Array) -> str:
        """Limit of the feedback law that these currents exceed."""
        active = self.law.command(self.law.heat(current, x), x).limit
        return next((str(name) for name in active if name), "")

    def _solve(self, faces: Array, x: Array, current: Array) -> tuple[Array, Array] | None:
        """Newton for the free temperatures and the currents; None unless it ends in a stable steady state nearby."""
        x, u, held, columns = x.copy(), self.u.copy(), self.held, self.columns
        free = np.setdiff1d(np.arange(len(x)), held)
        x[held], u[columns] = faces, current
        for _ in range(20):
            Jx, Ju = self.eq.jacobian(x, u).toarray(), self.eq.input_jacobian(x, u).toarray()[:, columns]
            change = np.linalg.solve(np.hstack([Jx[:, free], Ju]), self.eq.heat(x, u) + self.heat)
            if not np.abs(change).max() < 200.0:
                return None
            x[free] -= change[:len(free)]
            u[columns] -= change[len(free):]
            if np.abs(change).max() < 1e-9:
                return (x, u[columns]) if self._stable(Jx, Ju, free, u[columns], x) else None
        return None

    def _stable(self, Jx: NDArray[np.float64], Ju: NDArray[np.float64], free: NDArray[np.intp],
                current: Array, x: Array) -> bool:
        """Whether the rest of the network is stable while the currents, below their optimum, hold the faces."""
        if not np.isfinite(self.law.gain(current, x)).all():
            return False
        feedback = -np.linalg.solve(Ju[self.held], Jx[self.held][:, free])
        matrix = (Jx[np.ix_(free, free)] + Ju[free] @ feedback) / self.eq.capacity[free, None]
        return bool(np.linalg.eigvals(matrix).real.max(initial=-np.inf) < 0)


def _words(binding: str) -> str:
    return "the hot side runs away" if binding == "runaway" else f"the {binding} limit is reached"


def _ranges(passive: Mapping[str, float], limit: Mapping[str, float]) -> str:
    parts = [f"{name} {min(passive[name], limit[name]):.2f} to {max(passive[name], limit[name]):.2f} K"
             for name in passive]
    return ", ".join(parts)
