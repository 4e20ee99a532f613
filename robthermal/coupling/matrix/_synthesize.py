"""Coupling filters between subsystems of several channels: least squares, reweighted until the robust number fits."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..._arrays import Array
from ...errors import InputError
from .._outcomes import CouplingCode
from ..problem import NORMS
from ..synthesis import make_basis, read_couple
from ._evaluate import finish_matrix, refused_matrix
from ._filters import MatrixFilters
from ._least_squares import Halves
from ._problem import MatrixProblem, prepare_matrix
from ._spectra import at, gain

_FASTER = 3.0  # default Laguerre pole over the bandwidth, as for one channel
_ROUNDS = 25
_STEEP = 2.0  # power with which a multiplier follows (robust number)/(limit)
_START = 1e-3  # share of the curvature of the variance that the penalty starts with
_SMALL = 1e-6  # of the largest entry: what a magnitude in a denominator is at least
_BACK_OFF = (1.0, 0.995, 0.98)


def synthesize_matrix(P1: Any, P2: Any, C1: Any, C2: Any, *, uncertainty: Any = None, disturbances: Any = (1, 1),
                      weight: Any = 1, margin: float = 0.1, basis: str = "laguerre", order: int = 12,
                      pole: complex | Sequence[complex] | None = None, couple: Sequence[str] = ("X", "Y"),
                      cutoff: float | None = None) -> MatrixFilters:
    """Coupling filters of small variance of e12 between subsystems of several inputs and outputs, proven.

    Parameters
    ----------
    P1, P2, C1, C2 : StateSpace
        Plants (p outputs each, m1 and m2 inputs) and stabilizing controllers, negative feedback, one sample time.
    uncertainty : Uncertainty, frequency response, or list of them, optional
        Measured plants (2p outputs, m1 + m2 inputs) that the filters must tolerate.
    disturbances : pair of StateSpace, array_like or float
        Shaping filters of v1, v2: white noise of variance 1 per sample (continuous: PSD 1) to outputs [m].
    weight : StateSpace, array_like or float
        Performance filter on e12.
    margin : float
        The robust number stays below 1 - margin [-].
    basis : {"laguerre", "fir", "poles"}
        Family of basis functions of every entry; "fir" in discrete time only.
    order : int
        Coefficients of each entry; ignored by "poles".
    pole : float or sequence of complex, optional
        Laguerre pole (default: from the bandwidth), or the list of "poles".
    couple : sequence of str
        Filters that may be nonzero: ("X",) and ("Y",) are master-slave.
    cutoff : float, optional
        Continuous time: frequency beyond which Z rolls off [rad/s].

    Returns
    -------
    MatrixFilters
        Without filters that are proven to keep the margin: X = Y = 0 and an outcome that says why.

    Raises
    ------
    InputError
        For loops, sizes, sample times, frequency responses or options that make no sense.

    Examples
    --------
    >>> import control, numpy as np
    >>> import robthermal as rt
    >>> P = control.ss([[0.9, 0.1], [0.0, 0.8]], np.eye(2), [[1.0, 0.5], [0.0, 1.0]], np.zeros((2, 2)), 0.01)
    >>> C = control.ss([], [], [], 0.3 * np.eye(2), 0.01)
    >>> filters = rt.coupling.synthesize_matrix(P, P, C, C, order=4)
    >>> filters.holds, bool(filters.norms["h2"] < 0.95 * filters.norms["h2_uncoupled"])
    (True, True)
    """
    started = time.perf_counter()
    problem = prepare_matrix(P1, P2, C1, C2, uncertainty=uncertainty, disturbances=disturbances, weight=weight,
                             cutoff=cutoff)
    if isinstance(margin, bool) or not isinstance(margin, int | float) or not 0 <= margin < 1:
        raise InputError(f"margin = {margin!r}", where="synthesize_matrix",
                         expected="a number from 0 up to, not including, 1")
    if isinstance(order, bool) or not isinstance(order, int | np.integer) or order < 1:
        raise InputError(f"order = {order!r}", where="synthesize_matrix", expected="a positive number of coefficients")
    if basis not in ("laguerre", "fir", "poles"):
        raise InputError(f"basis = {basis!r}", where="synthesize_matrix", expected='"laguerre", "fir" or "poles"')
    free = read_couple(couple)
    rate = _default_pole(problem) if basis == "laguerre" and pole is None else pole
    halves = Halves(problem, make_basis(basis, int(order), rate, problem.dt))
    if not problem.dt and any(np.any(noise.D) for noise in problem.disturbed) and np.any(problem.weight.D):
        raise InputError("the variance of e12 is infinite: disturbance and weight do not roll off",
                         where="disturbances", expected="strictly proper shaping filters",
                         remedy="Add a low-pass to the disturbance or to the weight.")
    limit = 1.0 - float(margin)
    found = _search(halves, free, limit)
    return _proven(halves, found, limit, started)


def _proven(halves: Halves, coefficients: list[Array], limit: float, started: float) -> MatrixFilters:
    """The filters found, scaled down a little where the proof between the frequencies asks for it."""
    problem, asked = halves.problem, {}
    if problem.uncertainty is not None:
        asked = {"robust": limit}
        spare = NORMS["robust"].proof_margin
        coefficients = [part / spare for part in coefficients]
    for factor in _BACK_OFF:
        hats = [halves.filter(factor * part) for part in coefficients]
        variance = sum(halves.variance(half, factor * part) for half, part in enumerate(coefficients))
        filters = finish_matrix(problem, hats[0], hats[1], basis=halves.basis.name, order=halves.basis.size,
                                solve_time=time.perf_counter() - started, asked=asked,
                                requested={"h2": float(np.sqrt(variance))})
        if filters.holds:
            return filters
    outcome = CouplingCode.NOT_PROVEN.outcome(f"Filters were found, but not proven: {filters.outcome.text}",
                                              remedy="Ask for more margin, or reduce the order. Both filters are zero.")
    return refused_matrix(problem, outcome, basis=halves.basis.name, order=halves.basis.size)


def _search(halves: Halves, free: tuple[bool, bool], limit: float) -> list[Array]:
    """Least variance first; where the robust number is too large, penalties that grow at the frequencies it is."""
    coefficients = _solved(halves, free, None)
    if halves.problem.uncertainty is None:
        return coefficients
    R = np.moveaxis(halves.problem.uncertainty.at(halves.omega), -1, 0)
    rho, x, y, magnitudes = _perron(halves, coefficients, R)
    best, least = None, np.inf
    scale = _START * sum(halves.variance(half, 0 * part) for half, part in enumerate(coefficients))
    multiplier = np.full(len(rho), scale)
    for _ in range(_ROUNDS):
        shrunk = min(1.0, limit / max(float(rho.max()), 1e-300))
        scaled = [shrunk * part for part in coefficients]
        value = sum(halves.variance(half, part) for half, part in enumerate(scaled))
        if value < least:
            best, least = scaled, value
        if shrunk == 1.0 and not np.any(multiplier > scale):
            break
        multiplier = multiplier * np.clip(rho / limit, 0.3, 3.0) ** _STEEP
        sensitivity = x[:, :, None] * np.einsum("fij,fj->fi", R, y)[:, None, :]  # of rho in |Delta_k|
        floor = _SMALL * max(float(magnitudes.max()), 1e-300)
        coefficients = _solved(halves, free, multiplier[:, None, None] * sensitivity / np.maximum(magnitudes, floor))
        rho, x, y, magnitudes = _perron(halves, coefficients, R)
    assert best is not None  # the first round sets it
    return best


def _solved(halves: Halves, free: tuple[bool, bool], penalty: Array | None) -> list[Array]:
    """Coefficients of X_hat and Y_hat; zero where that filter may not act."""
    loops = halves.problem.factors.loops
    p, m1 = loops[0].P.noutputs, loops[0].P.ninputs
    blocks: list[Array | None] = [None, None]
    if penalty is not None:
        blocks = [penalty[:, :m1, p:], penalty[:, m1:, :p]]
    return [halves.solve(half, blocks[half]) if free[half]
            else np.zeros((halves.basis.size, loops[half].P.ninputs, p)) for half in (0, 1)]


def _perron(halves: Halves, coefficients: list[Array], R: Array) -> tuple[Array, Array, Array, Array]:
    """rho(|Delta_k| R), its left and right vectors with x'y = 1, and |Delta_k|, at every frequency."""
    upper, lower = (np.abs(halves.response(part) @ D)
                    for part, D in zip(coefficients, halves.denominators, strict=True))
    count, (m1, p) = len(halves.omega), upper.shape[1:]
    size = np.zeros((count, m1 + lower.shape[1], 2 * p))
    size[:, :m1, p:], size[:, m1:, :p] = upper, lower
    product = size @ R
    # an all-positive neighbor: its vectors are positive and unique
    product = product + 1e-9 * (1e-300 + np.max(product, axis=(1, 2), keepdims=True))
    values, right = np.linalg.eig(product)
    values_left, left = np.linalg.eig(product.transpose(0, 2, 1))
    y = np.abs(np.take_along_axis(right, np.argmax(values.real, axis=1)[:, None, None], 2)[:, :, 0])
    x = np.abs(np.take_along_axis(left, np.argmax(values_left.real, axis=1)[:, None, None], 2)[:, :, 0])
    return values.real.max(axis=1), x / np.sum(x * y, axis=1, keepdims=True), y, size


def _default_pole(problem: MatrixProblem) -> float:
    """Laguerre pole: three times the frequency above which the feedback of the faster loop stops helping."""
    omega = problem.grid(1000)
    edges = []
    for loop in problem.factors.loops:
        helped = np.flatnonzero(gain(at(loop.S, omega)) < 1)
        if helped.size and helped[-1] + 1 < len(omega):
            edges.append(float(omega[helped[np.flatnonzero(np.append(np.diff(helped), 2) > 1)[0]]]))
    if not edges:
        rates = [np.abs(np.linalg.eigvals(loop.S.A)) for loop in problem.factors.loops]
        slow = np.concatenate([-np.log(rate[rate > 0]) / problem.dt if problem.dt else rate for rate in rates])
        edges = [float(slow.min())] if slow.size else [1.0 / (problem.dt or 1.0)]
    rate = _FASTER * max(edges)
    return float(np.exp(-rate * problem.dt)) if problem.dt else -float(rate)
