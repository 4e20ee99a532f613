"""From a problem and the wishes of `synthesize` to the arrays of the convex program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..._arrays import Array
from ..problem import Problem, radius
from ..systems import Response, Zpk, natural, realize
from ._basis import Basis
from ._moments import moments, square_root
from ._program import Demands, Responses

_GRID_POINTS = 2500
_WHOLE = 1e-6  # share of the whole variance beside the moving average: what the average does not see stays bounded
_FASTER = 3.0  # default pole over the bandwidth


@dataclass(frozen=True)
class Limits:
    """Upper bounds asked for; None: not asked.

    Parameters
    ----------
    msd : float or None
        Of the moving standard deviation, relative to the uncoupled one [-].
    hinf : float or None
        Of || weight [(1+Y)S1W1, (1+X)S2W2] ||_inf.
    improvement : float or None
        Of ||1+X||_inf and ||1+Y||_inf [-].
    robust : float or None
        Of rho(|Delta_k| R) [-].
    product : float or None
        Of ||XY||_inf [-].
    """

    msd: float | None = None
    hinf: float | None = None
    improvement: float | None = None
    robust: float | None = None
    product: float | None = None


@dataclass(frozen=True)
class Design:
    """One synthesis: the problem, the basis, what is minimized and which filters may act.

    Parameters
    ----------
    problem : Problem
        Plants, controllers, disturbances, uncertainty; checked.
    basis : Basis
        Of each of X̂, Ŷ.
    objective : str
        "h2" or "hinf" ("mixed" is "h2" with a limit).
    free : tuple of bool
        Whether X, Y may differ from zero.
    """

    problem: Problem
    basis: Basis
    objective: str
    free: tuple[bool, bool]

    @cached_property
    def omega(self) -> Array:
        """Frequencies the program may use [rad/s]."""
        return np.union1d(0.0, self.problem.grid(_GRID_POINTS))

    @cached_property
    def colored(self) -> tuple[Zpk, Zpk]:
        """weight S2 W2, which 1 + X multiplies, and weight S1 W1, which 1 + Y multiplies."""
        return self.problem.two.signal, self.problem.one.signal

    @cached_property
    def size(self) -> float:
        """Largest uncoupled gain [m]: the unit in which the program counts."""
        return float(np.abs(np.array([signal.at(self.omega) for signal in self.colored])).max()) or 1.0

    @cached_property
    def responses(self) -> Responses:
        """Frequency responses the program needs."""
        return self.responses_at(self.omega)

    def responses_at(self, omega: Array) -> Responses:
        """The same on another grid [rad/s]."""
        problem = self.problem
        return Responses(
            basis=Response(self.basis.all())(omega)[:, 0],
            factor=np.array([problem.one.Z.at(omega), problem.two.Z.at(omega)]),
            signal=np.array([signal.at(omega) for signal in self.colored]) / self.size,
            block=np.abs([problem.two.Dk.at(omega), problem.one.Dk.at(omega)]),
            envelope=problem.envelope(omega))

    @cached_property
    def grams(self) -> list[tuple[Array, Array]]:
        """Whole and averaged second moments of both regressors, in units of `size`²."""
        samples = max(self.problem.samples, 1)
        scaled = (Zpk(s.zeros, s.poles, s.gain / self.size, s.dt) for s in self.colored)
        factors = (self.problem.one.Z, self.problem.two.Z)
        return [moments(realize(signal), realize(Z), self.basis, samples)
                for signal, Z in zip(scaled, factors, strict=True)]

    def demands(self, limits: Limits) -> Demands:
        """The program for these limits."""
        demands = Demands(objective=self.objective, improvement=limits.improvement, radius=limits.robust,
                          product=limits.product, free=self.free,
                          hinf=None if limits.hinf is None else limits.hinf / self.size)
        if self.objective == "h2":
            demands = replace(demands, quadratic=self._quadratic())
        if limits.msd is not None:
            demands = replace(demands, limited=self._spread(limits.msd))
        return demands

    def least(self, what: str, limits: Limits) -> Demands:
        """The program that finds the smallest `what` ("msd", "hinf" or "improvement") under the stability limits."""
        demands = Demands(objective=what, radius=limits.robust, product=limits.product, free=self.free)
        if what == "msd":
            demands = replace(demands, objective="h2", quadratic=self._spread(1.0))
        return demands

    def values(self, coefficients: Array) -> dict[str, float]:
        """What the coefficients reach, from the quadratic forms and on the grid."""
        hats, filters = self.responses.filters(coefficients)
        maps = np.linalg.norm((1 + filters) * self.responses.signal, axis=0)
        reached = {"hinf": float(maps.max() * self.size), "improvement_1": float(np.abs(1 + filters[1]).max()),
                   "improvement_2": float(np.abs(1 + filters[0]).max()), "XY": float(np.abs(np.prod(filters, 0)).max()),
                   "robust": float(radius(self.responses.envelope, *(np.abs(hats) * self.responses.block)).max())}
        if self.objective == "h2":
            whole, average = (self._variance(coefficients, k) for k in (0, 1))
            reached["h2"] = float(np.sqrt(whole)) * self.size
            if self.problem.samples:
                reached["ma"] = 3 * float(np.sqrt(average)) * self.size
                reached["msd"] = 3 * float(np.sqrt(max(whole - average, 0.0))) * self.size
        return reached

    def relative_spread(self, coefficients: Array) -> dict[str, float]:
        """Moving standard deviation over the uncoupled one, as "msd"; nothing without a window."""
        if not self.problem.samples:
            return {}
        now, before = (self._variance(c, 0) - self._variance(c, 1) for c in (coefficients, 0 * coefficients))
        return {"msd": float(np.sqrt(max(now, 0.0) / before))}

    def _variance(self, coefficients: Array, which: int) -> float:
        regressors = np.hstack([np.ones((2, 1)), coefficients])
        return float(sum(c @ gram[which] @ c for c, gram in zip(regressors, self.grams, strict=True)))

    def _quadratic(self) -> tuple[Array, Array]:
        uncoupled = sum(average[0, 0] for _, average in self.grams) or 1.0
        first, second = (square_root((average + _WHOLE * whole) / uncoupled) for whole, average in self.grams)
        return first, second

    def _spread(self, limit: float) -> tuple[Array, Array]:
        uncoupled = sum(whole[0, 0] - average[0, 0] for whole, average in self.grams)
        first, second = (square_root((whole - average) / (uncoupled * limit**2)) for whole, average in self.grams)
        return first, second


def default_pole(problem: Problem) -> float:
    """Laguerre pole: three times the frequency above which the feedback of the faster loop stops helping.

    Parameters
    ----------
    problem : Problem
        |S| of its two loops crosses one there.
    """
    omega = problem.grid(_GRID_POINTS)
    edges = []
    for loop in (problem.one, problem.two):
        helped = np.flatnonzero(np.abs(loop.S.at(omega)) < 1)
        first_above = helped[np.flatnonzero(np.diff(helped) > 1)][:1] if helped.size else helped
        if first_above.size:
            edges.append(omega[first_above[0]])
    if not edges:  # loops without a bandwidth: their own slowest mode
        modes = np.abs(np.concatenate([natural(loop.S.poles, problem.dt) for loop in (problem.one, problem.two)]))
        edges = [float(modes[np.isfinite(modes)].min(initial=np.inf))]
        edges = edges if np.isfinite(edges[0]) else [1.0 / problem.dt if problem.dt else 1.0]
    rate = _FASTER * max(edges)
    return float(np.exp(-rate * problem.dt)) if problem.dt else -float(rate)
