"""Positive observers: a linear programme for a gain under which errors that start nonnegative stay so, and decay."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy

from .._checks import positive_number
from ..errors import Outcome
from ._error_box import Block
from ._modules import Array
from ._observer_model import ObserverModel
from ._outcomes import DesignCode


@dataclass(frozen=True)
class PositiveGain:
    """A gain, and the weights that show its decay.

    Parameters
    ----------
    gain : ndarray, shape (n, n_sensors)
        Observer gain L from sensors to lumps.
    weights : ndarray, shape (n,)
        c: Σ c_i |e_i| shrinks by `rate` every sample, as computed here in floating point.
    rate : float
        Factor per sample.
    outcome : Outcome
        "designed" or "not_contracting".
    """

    gain: Array
    weights: Array
    rate: float
    outcome: Outcome


def positive_gain(model: ObserverModel, found: list[Block], time_constant: float | None) -> PositiveGain:
    """Smallest gain that contracts in a weighted sum over the box, its measured columns nonnegative at every corner.

    With Z = diag(c) L all conditions are linear in c and Z. For every column j and corner of the box, M = A_d + Γ∂f/∂x:
    c_i M_ij - (Z C)_ij >= 0 where a sensor reads lump j, and Σ_i |c_i M_ij - (Z C)_ij| <= ρ c_j. The modulus is needed
    in columns without a sensor only, where no gain can act.
    """
    columns = list(_columns(model, found))
    fastest = _fastest(model, columns)
    if fastest >= 1:
        gain = _largest_gain(model, columns)
        return PositiveGain(gain, np.ones(len(gain)), fastest, DesignCode.NOT_CONTRACTING.outcome(
            "No gain on these sensors makes the weighted sum of the errors decay over this box (at best it changes by "
            f"{fastest:.5f} per sample):", remedy="lower the current, or add sensors at the modules."))
    h = model.sample_time
    best = -h / np.log(fastest) if fastest > 0 else 0.0
    tau = 1.2 * best if time_constant is None else positive_number(time_constant, "time_constant", "s")
    rate = float(np.exp(-h / tau)) if tau > 0 else 0.0
    solved = _solve(model, columns, max(rate, fastest + 1e-9))
    if tau < best or solved is None:
        outcome = DesignCode.NOT_CONTRACTING.outcome(
            f"A time constant of {tau:.4g} s is not possible over this box; the fastest is {best:.4g} s.", remedy="")
        return PositiveGain(_largest_gain(model, columns), np.ones(len(model.A_d)), fastest, outcome)
    c, L = solved
    return PositiveGain(L, c, rate, DesignCode.DESIGNED.outcome(
        "Errors that start nonnegative in the measured columns stay so; the weighted sum of the errors decays with "
        f"{tau:.4g} s or faster over the box, as computed here. rt.certify.observer proves what it can."))


def _columns(model: ObserverModel, found: list[Block]) -> Iterator[Array]:
    """Column j of A_d + Γ∂f/∂x at every corner of what touches lump j, (n, n_corners)."""
    for j in range(len(model.A_d)):
        touching = [(block, 0 if block.a == j else 1) for block in found if j in (block.a, block.b)]
        options = []
        for choice in product(*(range(len(block.hull)) for block, _ in touching)):
            heat = np.zeros(len(model.A_d))
            for (block, side), k in zip(touching, choice, strict=True):
                heat[[block.a, block.b]] += block.hull[k][:, side]
            options.append(model.A_d[:, j] + model.Gamma @ heat)
        yield np.unique(np.array(options), axis=0).T


def _largest_gain(model: ObserverModel, columns: list[Array]) -> Array:
    """Largest gain that keeps the measured columns nonnegative: the fastest decay, the most noise."""
    return np.column_stack([columns[j].min(axis=1) for j in model.indices()])


def _fastest(model: ObserverModel, columns: list[Array]) -> float:
    """Smallest factor per sample, by bisection on the linear programme with the largest gain."""
    L = _largest_gain(model, columns)
    left = {int(j): columns[j] - L[:, [s]] for s, j in enumerate(model.indices())}
    low, high = 0.0, 1.0
    if not _weights(columns, left, high):
        return float("inf") if not _weights(columns, left, 10.0) else _bisect(columns, left, 1.0, 10.0)
    return _bisect(columns, left, low, high)


def _bisect(columns: list[Array], left: dict[int, Array], low: float, high: float) -> float:
    while high - low > 1e-7:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _weights(columns, left, middle) else (middle, high)
    return high


def _weights(columns: list[Array], left: dict[int, Array], rate: float) -> bool:
    """Whether weights c >= 1 with cᵀ|M| <= ρ cᵀ exist."""
    n, rows = len(columns), []
    for j, column in enumerate(columns):
        for corner in np.abs(left.get(j, column)).T:
            row = corner.copy()
            row[j] -= rate
            rows.append(row)
    solved = scipy.optimize.linprog(np.ones(n), A_ub=np.array(rows), b_ub=np.zeros(len(rows)), bounds=(1, None),
                                    method="highs")
    return bool(solved.status == 0)


def _solve(model: ObserverModel, columns: list[Array], rate: float) -> tuple[Array, Array] | None:
    """Weights and the gain of the least weighted sum at a rate, 0 <= Z <= c min M."""
    n, p = model.C.shape[1], model.C.shape[0]
    measured = {int(j): s for s, j in enumerate(model.indices())}
    rows, size = [], n + n * p
    for j, column in enumerate(columns):
        for corner in column.T:
            row = np.zeros(size)
            row[:n] = corner if j in measured else np.abs(corner)
            row[j] -= rate
            if j in measured:
                row[n + measured[j] * n: n + (measured[j] + 1) * n] = -1.0
                for i in range(n):
                    keep = np.zeros(size)  # (Z C)_ij <= c_i M_ij
                    keep[n + measured[j] * n + i], keep[i] = 1.0, -corner[i]
                    rows.append(keep)
            rows.append(row)
    cost = np.concatenate([np.zeros(n), np.ones(n * p)])
    free = _largest_gain(model, columns).T.ravel() < 0  # elsewhere no entry of L need be negative
    bounds = [(1, 1e6)] * n + [(None if below else 0.0, None) for below in free]
    solved = scipy.optimize.linprog(cost, A_ub=np.array(rows), b_ub=np.zeros(len(rows)), bounds=bounds, method="highs")
    if solved.status != 0:
        return None
    c = solved.x[:n]
    return c, solved.x[n:].reshape(p, n).T / c[:, None]
