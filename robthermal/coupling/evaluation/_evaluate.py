"""The verdict on given coupling filters: everything computed again from the filters alone, and proven."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from ..._control import control
from ...errors import Outcome
from .._outcomes import CouplingCode
from ..factors import intervals_of
from ..problem import NORMS, Problem, Proofs, Realization, coupled, h2, prepare, realization, variances, youla_parameter
from ..systems import LTI, beside, negative, plus_one, realize, series, state_space_of
from ._filters import Filters


def evaluate(P1: LTI, P2: LTI, C1: LTI, C2: LTI, *, X_hat: LTI = 0, Y_hat: LTI = 0, Z1: LTI | None = None,
             Z2: LTI | None = None, uncertainty: Any = None, disturbances: Any = (1, 1), weight: LTI = 1,
             window: float | None = None, cutoff: float | None = None) -> Filters:
    """Verdict on coupling filters designed by hand, Evers Algorithm 2.

    Parameters
    ----------
    P1, P2, C1, C2 : StateSpace or TransferFunction
        Plants and stabilizing controllers, one input and one output each, one sample time.
    X_hat, Y_hat : LTI or float
        Stable filters; X = Z1 X_hat acts from subsystem 2 on 1, Y = Z2 Y_hat from 1 on 2.
    Z1, Z2 : LTI or float, optional
        Factors with P⁻¹Z stable and proper; None: constructed, as :func:`inner_factor`.
    uncertainty : Uncertainty, 2x2 frequency response, or list of them, optional
        Measured plants, for the robust number.
    disturbances : pair of LTI or float
        Shaping filters of v1, v2: white noise of variance 1 per sample (continuous: PSD 1) to output [m].
    weight : LTI or float
        Performance filter on e12; not together with a window.
    window : float, optional
        Exposure [s] of moving average and moving standard deviation; discrete time only.
    cutoff : float, optional
        Continuous time: corner of the low-pass in Z [rad/s].

    Returns
    -------
    Filters
        Filters, controller, norms, performance, certificates and verdict.

    Raises
    ------
    InputError
        For an unstable nominal loop, unstable or improper filters, different sample times, zeros of a plant on the
        boundary, a Z that does not fit, 1 - X(∞)Y(∞) = 0, or measured plants that the controllers do not stabilize.

    Examples
    --------
    Master-slave: subsystem 1 follows the error of subsystem 2.

    >>> import control
    >>> import robthermal as rt
    >>> P, C = control.tf([0.01], [1, -0.99], 0.01), control.tf([20.0], [1], 0.01)
    >>> filters = rt.coupling.evaluate(P, P, C, C, X_hat=-0.9)
    >>> filters.nominally_stable, round(filters.norms["X"], 2), filters.norms["XY"]
    (True, 0.9, 0.0)
    """
    problem = prepare(P1, P2, C1, C2, Z1=Z1, Z2=Z2, uncertainty=uncertainty, disturbances=disturbances, weight=weight,
                      window=window, cutoff=cutoff)
    return finish(problem, state_space_of(X_hat, "X_hat", problem.dt), state_space_of(Y_hat, "Y_hat", problem.dt))


def finish(problem: Problem, X_hat: control.StateSpace, Y_hat: control.StateSpace, *, basis: str = "manual",
           order: int = 0, solve_time: float = 0.0, requested: Mapping[str, float] | None = None,
           asked: Mapping[str, float] | None = None, prove: bool = True) -> Filters:
    """Result of a design: everything computed from the filters, and proven.

    Parameters
    ----------
    problem : Problem
        What was designed for.
    X_hat, Y_hat : StateSpace
        The free stable filters.
    basis : str
        Where they come from.
    order : int
        Order of the basis.
    solve_time : float
        Time of the solver [s].
    requested : mapping, optional
        The solver's own values.
    asked : mapping, optional
        Upper bounds on norms, or on "msd" (after over before), that the design had to keep.
    prove : bool
        False: numbers only; the result does not hold.
    """
    parts = realization(problem, X_hat, Y_hat)
    proofs = Proofs(prove)
    norms = _norms(problem, parts, proofs)
    robust, where = _robust_numbers(problem, X_hat, Y_hat, proofs)
    norms |= robust
    performance = variances(problem, parts.X, parts.Y)
    nominal = proofs.stable(parts.loop_matrix, problem.dt, "internal stability") and prove
    steady = Proofs(prove)  # apart: an unstable controller is no failure unless it was asked for
    controller_stable = steady.stable(parts.coupling_matrix, problem.dt, "stability of the controller") and prove
    proofs.certificates |= steady.certificates
    robustly = nominal and norms["robust"] < 1.0
    outcome = verdict(problem.uncertainty is not None, nominal, robustly, asked or {},
                      {**norms, "msd": performance.msd_growth}, proofs)
    row = coupled(problem, parts.X, parts.Y, "S")
    return Filters(
        X=parts.X, Y=parts.Y, X_hat=X_hat, Y_hat=Y_hat, Z1=realize(problem.one.Z), Z2=realize(problem.two.Z),
        X_input=parts.X_input, Y_input=parts.Y_input, controller=parts.controller,
        improvement_1=plus_one(parts.Y), improvement_2=plus_one(parts.X), e12=beside(negative(row[0]), row[1]),
        norms=norms, performance=performance, nominally_stable=nominal, robustly_stable=robustly,
        controller_stable=controller_stable, holds=outcome.ok, worst_frequency=where,
        requested=dict(requested or {}), proofs=dict(proofs.certificates), outcome=outcome, basis=basis,
        order=order, solve_time=solve_time, problem=problem, asked=dict(asked or {}),
        again=partial(finish, problem))


def refused(problem: Problem, outcome: Outcome, *, basis: str, order: int, solve_time: float,
            requested: Mapping[str, float] | None = None) -> Filters:
    """X = Y = 0 with the reason: an infeasible design is a result.

    Parameters
    ----------
    problem : Problem
        What was designed for.
    outcome : Outcome
        Why there is no filter.
    basis : str
        Basis that was tried.
    order : int
        Order of the basis.
    solve_time : float
        Time of the solver [s].
    requested : mapping, optional
        The solver's own values.
    """
    nothing = state_space_of(0, "X_hat", problem.dt)
    result = finish(problem, nothing, nothing, basis=basis, order=order, solve_time=solve_time, requested=requested)
    return result.with_outcome(outcome)


def _norms(problem: Problem, parts: Realization, proofs: Proofs) -> dict[str, float]:
    signals = coupled(problem, parts.X, parts.Y)
    alone = realize(problem.one.signal), realize(problem.two.signal)
    systems = {"X": parts.X, "Y": parts.Y, "XY": series(parts.X, parts.Y), "improvement_1": plus_one(parts.Y),
               "improvement_2": plus_one(parts.X), "hinf": beside(*signals), "hinf_uncoupled": beside(*alone)}
    proven = {key: proofs.norm(system, NORMS[key].proof) for key, system in systems.items()}
    return proven | {"h2": h2(signals), "h2_uncoupled": h2(alone)}


def _robust_numbers(problem: Problem, X_hat: control.StateSpace, Y_hat: control.StateSpace, proofs: Proofs
                    ) -> tuple[dict[str, float], float]:
    if problem.uncertainty is None:
        return {"robust": 0.0, "robust_without_circles": 0.0, "small_gain": 0.0}, 0.0
    intervals = intervals_of(problem.uncertainty, problem.dt)
    delta = youla_parameter(problem, X_hat, Y_hat)
    robust, where = proofs.radius(delta, intervals)
    bare, without = problem.uncertainty.without_confidence(), robust
    if not np.allclose(bare.envelope, problem.uncertainty.envelope, rtol=1e-9, atol=0.0):
        without = Proofs(False).radius(delta, intervals_of(bare, problem.dt))[0]
    return {"robust": robust, "robust_without_circles": without,
            "small_gain": proofs.small_gain(delta, intervals, intervals.weights())}, where


def _broken(asked: Mapping[str, float], reached: Mapping[str, float]) -> list[str]:
    return [f"{name} = {reached[name]:.4g} (asked for at most {bound:.4g})" for name, bound in asked.items()
            if not reached[name] <= bound]


def verdict(measured: bool, nominal: bool, robustly: bool, asked: Mapping[str, float], reached: Mapping[str, float],
            proofs: Proofs) -> Outcome:
    """What holds of a coupling, or why not.

    Parameters
    ----------
    measured : bool
        Whether there is an uncertainty.
    nominal, robustly : bool
        Whether stability is proven for the model, and for every plant under the envelope.
    asked, reached : mapping
        Upper bounds that were asked for, and what was proven.
    proofs : Proofs
        With what could not be proven.
    """
    broken = _broken(asked, reached)
    if not proofs.prove:
        return CouplingCode.NOT_PROVEN.outcome("Numbers only: nothing was proven.", remedy="")
    if not nominal:
        return CouplingCode.NOT_STABLE.outcome(f"Internal stability is not proven: {'; '.join(proofs.failed)}.")
    if measured and not robustly:
        return CouplingCode.NOT_ROBUST.outcome()
    if broken:
        return CouplingCode.LIMIT.outcome(f"Proven stable, but not within what was asked: {'; '.join(broken)}.",
                                          remedy="")
    code = CouplingCode.ROBUST if measured else CouplingCode.NOMINAL
    return code.outcome(remedy=f"Not proven: {'; '.join(proofs.failed)}." if proofs.failed else None)
