"""Shorter filters: balanced truncation, weighted by what the filters multiply, and verified again."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from scipy.linalg import cholesky, solve_continuous_lyapunov, solve_discrete_lyapunov, svd

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from .._outcomes import CouplingCode
from ..systems import series
from ._result import CouplingResult

Result = TypeVar("Result", bound=CouplingResult)


def reduce(filters: Result, order: int | None = None, tolerance: float = 0.01) -> Result:
    """Shorter X_hat and Y_hat with nearly the same objective, verified again.

    Parameters
    ----------
    filters : Filters or MatrixFilters
        Design to be shortened.
    order : int, optional
        Order of each filter; None: the smallest that keeps everything within the tolerance.
    tolerance : float
        Allowed relative loss of the objective [-].
    """
    if order is not None and (not isinstance(order, int) or order < 0):
        raise InputError(f"{order!r}", where="order", expected="a non-negative whole number of states")
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise InputError(f"{tolerance!r}", where="tolerance", expected="a non-negative number")
    longest = max(filters.X_hat.nstates, filters.Y_hat.nstates)
    if order is not None:
        return _shortened(filters, min(order, longest), tolerance, prove=True)
    low, high = 0, longest
    while low < high:  # bisection: longer filters lose less
        middle = (low + high) // 2
        if _keeps(_shortened(filters, middle, tolerance, prove=False), filters, tolerance):
            high = middle
        else:
            low = middle + 1
    for size in range(low, longest):
        candidate = _shortened(filters, size, tolerance, prove=True)
        if candidate.holds == filters.holds and _keeps(candidate, filters, tolerance):
            return candidate
    return filters.with_outcome(CouplingCode.NOT_REDUCED.outcome(
        f"No shorter filters lose less than {100 * tolerance:g} % and keep what was asked: {filters.outcome.text}",
        remedy="", ok=filters.holds))


def _shortened(filters: Result, order: int, tolerance: float, prove: bool) -> Result:
    first, second = filters.problem.signals
    hats = [_truncated(hat, signal, order) for hat, signal in ((filters.X_hat, second), (filters.Y_hat, first))]
    asked = {name: bound if name == "XY" else bound * (1 + tolerance)
             for name, bound in filters.asked.items() if name != "robust"}
    made: Result = filters.again(*hats, basis=filters.basis, order=order, solve_time=filters.solve_time,
                                 requested=filters.requested, asked=asked, prove=prove)
    return made


def _keeps(short: CouplingResult, long: CouplingResult, tolerance: float) -> bool:
    for name, bound in short.asked.items():
        reached = short.performance.msd_growth if name == "msd" else short.norms[name]
        if not reached <= bound:
            return False
    robust = 1.0 if long.norms["robust"] < 1.0 else (1 + tolerance) * long.norms["robust"]
    return short.norms["robust"] < robust and objective(short) <= (1 + tolerance) * objective(long)


def objective(filters: CouplingResult) -> float:
    """What a design minimizes: moving average with a window, else h2 where it is finite, else hinf.

    Parameters
    ----------
    filters : Filters or MatrixFilters
        Design to be shortened.
    """
    if filters.problem.samples:
        return filters.performance.ma_after
    return filters.norms["h2"] if np.isfinite(filters.norms["h2"]) else filters.norms["hinf"]


def _truncated(hat: control.StateSpace, signal: control.StateSpace, order: int) -> control.StateSpace:
    """Balanced truncation, the input weighted by the signal; one-sided, so that the result stays stable (Enns 1984)."""
    n = hat.nstates
    if order >= n:
        return hat
    weighted = series(hat, signal) if np.any(signal.D) or (np.any(signal.B) and np.any(signal.C)) else hat
    first = weighted.nstates - n
    own, shaped = _gramian(hat.A, hat.B, hat.dt), _gramian(weighted.A, weighted.B, hat.dt)[first:, first:]
    inputs = shaped / max(np.trace(shaped), 1e-300) + 1e-6 * own / np.trace(own)
    outputs = _gramian(hat.A.T, hat.C.T, hat.dt)
    left, right = _root(inputs), _root(outputs)
    U, s, Vt = svd(right.T @ left)
    kept = np.sqrt(s[:order])
    T = left @ Vt[:order].T / kept
    inverse = (right @ U[:, :order] / kept).T
    return control.StateSpace(inverse @ hat.A @ T, inverse @ hat.B, hat.C @ T, hat.D, hat.dt,
                              remove_useless_states=False)


def _gramian(A: Array, B: Array, dt: float) -> Array:
    return solve_discrete_lyapunov(A, B @ B.T) if dt else solve_continuous_lyapunov(A, -B @ B.T)


def _root(W: Array) -> Array:
    size = np.trace(W) / len(W)
    return cholesky(W + 1e-14 * size * np.eye(len(W)), lower=True)
