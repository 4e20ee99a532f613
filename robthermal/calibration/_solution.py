"""Minimization of a joint problem: weights that depend on the fit are renewed, and the fit repeated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from .._arrays import Floats
from ..errors import Diverged, InputError
from ..fitting import Loss, Problem, Weigh, estimated_noise, scaled, scipy_loss, smallest_noise
from ._innovations import whitener
from ._joint import JointProblem
from ._refusals import refuse_idle

_CLEAR = 10.0  # of BIC
_ROUNDS = 8  # of noise estimation
_SETTLED = 0.01  # relative change of the noise levels
_STILL = 1e-3  # change of the parameters between two filters, in `Ranges.unit`


@dataclass(frozen=True)
class Solution:
    """Where the optimizer ended.

    Parameters
    ----------
    problem : JointProblem
        As weighed last.
    v : ndarray
        Coordinates of the parameters, then of the starts of the records.
    noise : dict
        Noise of every sensor [K or V].
    converged : bool
        Whether steps, cost and noise levels stand still.
    iterations : int
        Model evaluations that were tried.
    """

    problem: JointProblem
    v: Floats
    noise: dict[str, float]
    converged: bool
    iterations: int


def from_rest(problem: JointProblem, solved: Callable[[JointProblem], Solution]) -> Solution:
    """With settled lags at the start of the records, unless these ask for more beyond doubt (by BIC).

    Parameters
    ----------
    problem : JointProblem
        With lags that may be in motion at the start.
    solved : callable
        Solves a problem.
    """
    starts = [start.at_rest for start in problem.records.starts]
    settled = solved(replace(problem, records=replace(problem.records, starts=starts)))
    more = problem.records.v0.size - settled.v.size
    if not more:
        return settled
    free = solved(problem)
    records = replace(settled.problem.records, weigh=free.problem.records.weigh)  # the same weights for both
    costs = [float(np.sum(one.vector(v) ** 2)) for one, v in ((replace(settled.problem, records=records), settled.v),
                                                              (free.problem, free.v))]
    return free if costs[0] - costs[1] > more * (np.log(problem.n_numbers) + _CLEAR) else settled


def solve(problem: JointProblem, declared: dict[str, float], loss: Loss, max_iterations: int, filtered: bool,
          start: Floats | None = None) -> Solution:
    """Minimize; weights that depend on the fit (an undeclared noise, a filter) are renewed and the fit repeated.

    Parameters
    ----------
    problem : JointProblem
        Records and responses, and what is estimated.
    declared : dict
        Noise of every sensor [K or V]; 0 where it is estimated.
    loss : {"linear", "soft_l1", "huber"}
        Of the weighted residuals.
    max_iterations : int
        Limit of the optimizer's steps.
    filtered : bool
        Whether residuals are weighed by a Kalman filter.
    start : ndarray, optional
        Unknowns to start from; default the starting values of the parameters.
    """
    unknown, records = [name for name, level in declared.items() if not level], problem.records
    v = records.v0 if start is None else start
    noise = dict(declared) | _levels(records, v, unknown, loss)
    refuse_idle(problem, v)
    # of the cost: a small part of its own scatter; differences of a response are cheap and exact enough for more
    left, enough = max_iterations, 1e-9 if problem.responses else min(1e-6, 0.01 / problem.n_numbers)
    p, several = len(problem.ranges.names), problem.several
    for number in range(_ROUNDS):
        records.weigh = _weights(records, v, noise, filtered)
        if several:  # by size first, from wherever the start is; then by combinations, which need to be near
            problem = problem.weighed(v, combined=number > 0)
        run = scipy.optimize.least_squares(problem.vector, v, problem.jacobian, bounds=records.bounds, x_scale="jac",
                                           loss=scipy_loss(loss, records.n_readings), max_nfev=left, ftol=enough,
                                           xtol=1e-9, gtol=1e-9)
        moved = np.abs(run.x - v)[:p] / problem.ranges.unit
        v, left = run.x, left - run.nfev
        new = _levels(records, v, unknown, loss)
        settled = all(abs(new[name] / noise[name] - 1.0) < _SETTLED for name in unknown)
        settled = settled and not ((filtered or several) and moved.max() > _STILL)
        if settled and (number or not several) or left < 1 or run.status == 0:
            break
        noise |= new
    return Solution(problem, v, noise, bool(run.status > 0 and settled), max_iterations - left)


def _weights(problem: Problem, v: Floats, noise: dict[str, float], filtered: bool) -> list[Weigh]:
    levels = [np.array([noise[name] for name in one.sensors]) for one in problem.data]
    if not filtered:
        return [scaled(level) for level in levels]
    systems = problem.systems(v)
    return [whitener(system, one, level) for system, one, level in zip(systems, problem.data, levels, strict=True)]


def _levels(problem: Problem, v: Floats, unknown: list[str], loss: Loss) -> dict[str, float]:
    try:
        residuals = problem.residuals(v)
    except Diverged as error:
        raise InputError(f"the model runs away at the starting values: {error}", where="argument system",
                         remedy="Start closer to the truth: system.with_parameters({...}).") from None
    return {name: estimated_noise(problem.data, residuals, name, loss, smallest_noise(problem.system, name))
            for name in unknown}


def cost_of(problem: JointProblem, v: Floats, loss: Loss) -> float:
    """Loss of all weighted residuals and priors, as they are weighed in the problem.

    Parameters
    ----------
    problem : JointProblem
        Records and responses with the weights to use.
    v : ndarray
        Coordinates of the parameters, then of the starts of the records.
    loss : {"linear", "soft_l1", "huber"}
        Of the weighted residuals.
    """
    squares = problem.vector(v) ** 2
    rho = scipy_loss(loss, problem.records.n_readings)
    return float(np.sum(squares if isinstance(rho, str) else rho(squares)[0]))
