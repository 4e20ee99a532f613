"""One step of a predictive controller: the quadratic program of a state, and what is done where it has no solution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cholesky

from .._arrays import Array
from .._drawing import axes_for
from ..conic import Ball, least_quadratic
from ..errors import Outcome
from ..linear import Plant
from ._mpc_limits import Limits
from ._mpc_terminal import Terminal
from ._outcomes import SynthesisCode

_ROUNDS = 10  # programs with bounds of the controls by a function, taken along the last prediction
_SETTLED = 1e-6  # of the bounds, relative: then the prediction obeys them
KEPT = 1e-5  # of the limits: what the solver's result may miss
_TOLERANCES = (1e-11, 1e-8)  # of the solver, in turn


@dataclass(frozen=True)
class MpcStep:
    """What a predictive controller does at one state.

    Parameters
    ----------
    control : ndarray, shape (m,)
        Control to apply now, in deviations from the operating point [control unit].
    controls : ndarray, shape (horizon, m)
        Controls of the prediction, in turn [control unit].
    states : ndarray, shape (horizon + 1, n)
        States of the prediction, the first one as measured.
    cost : float
        Predicted cost with that of the end.
    outcome : Outcome
        Whether every limit is kept over the horizon; where not, which one is missed most and by how much.
    sample_time : float
        Time from one sample to the next [s].
    """

    control: Array
    controls: Array
    states: Array
    cost: float
    outcome: Outcome
    sample_time: float

    @property
    def holds(self) -> bool:
        """Whether the prediction keeps every limit and ends in the terminal set."""
        return self.outcome.ok

    def __str__(self) -> str:
        return f"u = {', '.join(f'{one:.6g}' for one in self.control)}; cost {self.cost:.6g}; {self.outcome.text}"

    def plot(self, ax: Any = None) -> Any:
        """Draw the predicted controls over time.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = axes_for(ax)
        times = self.sample_time * np.arange(len(self.controls))
        for k, values in enumerate(self.controls.T):
            ax.step(times, values, where="post", label=f"control {k}")
        ax.set(xlabel="time [s]", ylabel="control [unit of the control]")
        ax.legend(loc="best")
        return ax


@dataclass(frozen=True)
class Prediction:
    """x_k = free[k] x + driven[k] c and u_k = K x_k + c_k over a horizon, c the unknowns: the loop keeps it small."""

    free: Array
    driven: Array
    law: Array
    moved: Array

    @classmethod
    def of(cls, plant: Plant, K: Array, horizon: int) -> Prediction:
        """Build the matrices, with u = K x + c."""
        n, m = plant.B.shape
        loop = plant.A + plant.B @ K
        free, driven = np.zeros((horizon + 1, n, n)), np.zeros((horizon + 1, n, horizon * m))
        free[0] = np.eye(n)
        for k in range(horizon):
            free[k + 1] = loop @ free[k]
            driven[k + 1] = loop @ driven[k]
            driven[k + 1][:, k * m:(k + 1) * m] += plant.B
        moved = K @ driven[:-1]
        for k in range(horizon):
            moved[k][:, k * m:(k + 1) * m] += np.eye(m)
        return cls(free, driven, K @ free[:-1], moved)

    def paths(self, x: Array, c: Array) -> tuple[Array, Array]:
        """States and controls."""
        return self.free @ x + self.driven @ c, self.law @ x + self.moved @ c


@dataclass(frozen=True)
class Program:
    """The quadratic program of every state."""

    prediction: Prediction
    Q: Array
    R: Array
    limits: Limits
    terminal: Terminal
    dt: float

    def step(self, x: Array) -> MpcStep:
        """Solve for one state."""
        horizon = len(self.prediction.law)
        path = np.repeat(x[None], horizon, axis=0)
        settled = False
        for _ in range(_ROUNDS):
            c, short, worst = self._solved(x, *self._rows(x, path))
            states, controls = self.prediction.paths(x, c)
            if self.limits.function is None:
                settled = True
                break
            before, path = np.array([self.limits.bounds(one) for one in path]), states[:-1]
            after = np.array([self.limits.bounds(one) for one in path])
            if np.abs(after - before).max() <= _SETTLED * np.abs(after).max():
                settled = True
                break
        P = self.terminal.P
        cost = float(np.einsum("ki,ij,kj->", states[:-1], self.Q, states[:-1])
                     + np.einsum("ki,ij,kj->", controls, self.R, controls) + states[-1] @ P @ states[-1])
        already, missed = self._already(x)
        if short > KEPT:
            outcome = SynthesisCode.NO_STEP.outcome(
                f"No controls keep every limit over the horizon from this state: at best {worst} is missed by "
                f"{100 * short:.3g} % of its size. The control returned misses least.")
        elif already > 0:
            outcome = SynthesisCode.NO_STEP.outcome(
                f"The measured state misses {missed} by {100 * already:.3g} % of its size, which no control changes. "
                "The control returned keeps every other limit over the horizon.")
        elif not settled:
            outcome = SynthesisCode.NO_STEP.outcome(
                f"The bounds of the controls along the prediction did not settle in {_ROUNDS} programs; the control "
                "returned keeps those at the measured state.")
        else:
            outcome = SynthesisCode.STEP.outcome("Every limit is kept over the horizon, which ends in the terminal "
                                                 "set, as far as the solver tells.")
        return MpcStep(controls[0], controls, states, cost, outcome, self.dt)

    def missed(self, x: Array) -> float:
        """Largest relative miss of what a control can change, by the plan that misses least; constant bounds only."""
        return float(self._solved(x, *self._rows(x, np.repeat(x[None], len(self.prediction.law), axis=0)))[1])

    def _already(self, x: Array) -> tuple[float, str]:
        """The largest miss of a limit of the states alone by the measured state, relative, and which one."""
        limits = self.limits
        alone = np.flatnonzero(~limits.H.any(axis=1))
        short = limits.G[alone] @ x / limits.g[alone] - 1.0
        if not (short > KEPT).any():
            return 0.0, ""
        worst = int(np.argmax(short))
        return float(short[worst]), f"{limits.words[alone[worst]]} at sample 0"

    def _rows(self, x: Array, path: Array) -> tuple[Array, Array, Array, list[str]]:
        """Rows over c of every limit at every sample, divided by its size; which of them the controls alone decide.

        Of the measured state only limits with a control: no control changes the others.
        """
        p, limits = self.prediction, self.limits
        rows, bounds, words, own = [], [], [], []
        for k in range(len(path)):
            now = limits if limits.function is None else limits.with_controls(*limits.bounds(path[k]))
            kept = np.flatnonzero(now.H.any(axis=1)) if k == 0 else np.arange(len(now.g))
            G, H, g = now.G[kept], now.H[kept], now.g[kept]
            size = np.where(g != 0, np.abs(g), 1.0)
            rows.append((G @ p.driven[k] + H @ p.moved[k]) / size[:, None])
            bounds.append((g - G @ p.free[k] @ x - H @ p.law[k] @ x) / size)
            words += [f"{now.words[j]} at sample {k}" for j in kept]
            own.append(H.any(axis=1) if k == 0 else ~G.any(axis=1))
        return np.vstack(rows), np.concatenate(bounds), np.concatenate(own), words

    def _solved(self, x: Array, rows: Array, bounds: Array, own: Array, words: list[str]) -> tuple[Array, float, str]:
        """Unknowns, the largest relative miss of a limit (zero: none), and which one."""
        p, P = self.prediction, self.terminal.P
        root = cholesky(P) / np.sqrt(self.terminal.level)  # the end: |root x_N| <= 1
        end = Ball(root @ p.driven[-1], root @ p.free[-1] @ x, 1.0)
        quadratic, linear = self._cost(x)
        for tolerance in _TOLERANCES:
            found = least_quadratic(quadratic, linear, rows, bounds, ball=end, tolerance=tolerance)
            missed = _missed(found.x, rows, bounds, end, words) if found.solved else (np.inf, "")
            if missed[0] <= KEPT:
                return found.x, *missed
        for hard in (own, np.zeros(len(own), bool)):  # what the controls alone decide is kept where that is possible
            least = _least_miss(rows, bounds, hard, end)
            if least is not None:
                return least, *_missed(least, rows, bounds, end, words)
        return np.zeros(rows.shape[1]), np.inf, "every limit: the solver found nothing, and one"

    def _cost(self, x: Array) -> tuple[Array, Array]:
        """Quadratic and linear part of the cost of c, divided by its size."""
        p, P = self.prediction, self.terminal.P
        quadratic = np.einsum("kia,ij,kjb->ab", p.driven[:-1], self.Q, p.driven[:-1])
        quadratic += np.einsum("kia,ij,kjb->ab", p.moved, self.R, p.moved) + p.driven[-1].T @ P @ p.driven[-1]
        linear = (np.einsum("kia,ij,kj->a", p.driven[:-1], self.Q, p.free[:-1] @ x)
                  + np.einsum("kia,ij,kj->a", p.moved, self.R, p.law @ x) + p.driven[-1].T @ P @ p.free[-1] @ x)
        scale = np.abs(quadratic).max()
        return quadratic / scale, linear / scale


def _least_miss(rows: Array, bounds: Array, hard: Array, end: Ball) -> Array | None:
    """Unknowns that miss the limits least, those that are hard not at all; None where there are none."""
    n = rows.shape[1]
    column = np.where(hard, 0.0, -1.0)[:, None]
    most = np.vstack([np.hstack([rows, column]), -np.eye(n + 1)[n]])
    ball = Ball(np.hstack([end.rows, np.zeros((len(end.rows), 1))]), end.center, 1.0, n)
    found = least_quadratic(1e-9 * np.eye(n + 1), np.eye(n + 1)[n], most, np.append(bounds, 0.0), ball=ball)
    return found.x[:n] if found.solved else None


def _missed(c: Array, rows: Array, bounds: Array, end: Ball, words: list[str]) -> tuple[float, str]:
    """The largest miss of a limit, relative to its size, and which one."""
    short = np.append(rows @ c - bounds, np.linalg.norm(end.rows @ c + end.center) - 1.0)
    worst = int(np.argmax(short))
    return max(float(short[worst]), 0.0), [*words, "the terminal set"][worst]
