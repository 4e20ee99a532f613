"""The verdict on given coupling filters of several channels: everything computed from the numbers alone, and proven."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import block_diag, solve_continuous_lyapunov, solve_discrete_lyapunov

from ..._control import control
from ...errors import Outcome
from ..evaluation import verdict
from ..factors import intervals_of
from ..problem import NORMS, Proofs, Realization
from ..systems import series
from ._filters import MatrixFilters
from ._problem import MatrixProblem, prepare_matrix, sized
from ._realization import realize_matrix, youla_matrix


def evaluate_matrix(P1: Any, P2: Any, C1: Any, C2: Any, *, X_hat: Any = 0, Y_hat: Any = 0, uncertainty: Any = None,
                    disturbances: Any = (1, 1), weight: Any = 1, cutoff: float | None = None) -> MatrixFilters:
    """Verdict on coupling filters between subsystems of several inputs and outputs.

    Parameters
    ----------
    P1, P2, C1, C2 : StateSpace
        Plants (p outputs each, m1 and m2 inputs) and stabilizing controllers, negative feedback, one sample time.
    X_hat, Y_hat : StateSpace, array_like or float
        Stable filters (m1, p) and (m2, p); X = Z1 X_hat acts from subsystem 2 on 1, Y = Z2 Y_hat from 1 on 2. A number
        is that multiple of the identity.
    uncertainty : Uncertainty, frequency response, or list of them, optional
        Measured plants (2p outputs, m1 + m2 inputs), for the robust number.
    disturbances : pair of StateSpace, array_like or float
        Shaping filters of v1, v2: white noise of variance 1 per sample (continuous: PSD 1) to outputs [m].
    weight : StateSpace, array_like or float
        Performance filter on e12.
    cutoff : float, optional
        Continuous time: frequency beyond which Z rolls off [rad/s].

    Returns
    -------
    MatrixFilters
        Filters, controller, norms, certificates and verdict.

    Raises
    ------
    InputError
        For an unstable nominal loop, unstable filters, wrong sizes, different sample times, zeros of a plant on the
        boundary, I - X(∞)Y(∞) singular, or measured plants that the controllers do not stabilize.

    Examples
    --------
    >>> import control, numpy as np
    >>> import robthermal as rt
    >>> P = control.ss([[0.9, 0.1], [0.0, 0.8]], np.eye(2), np.eye(2), np.zeros((2, 2)), 0.01)
    >>> C = control.ss([], [], [], 0.3 * np.eye(2), 0.01)
    >>> filters = rt.coupling.evaluate_matrix(P, P, C, C, X_hat=[[-0.5, 0.1], [0.0, -0.4]], Y_hat=-0.2)
    >>> filters.nominally_stable, filters.controller.ninputs, filters.outcome.code
    (True, 4, 'nominal')
    """
    problem = prepare_matrix(P1, P2, C1, C2, uncertainty=uncertainty, disturbances=disturbances, weight=weight,
                             cutoff=cutoff)
    X, Y = (sized(np.asarray(given, dtype=float) if isinstance(given, (list, tuple)) else given, name, problem.dt,
                  (loop.P.ninputs, loop.P.noutputs))
            for given, name, loop in ((X_hat, "X_hat", problem.one), (Y_hat, "Y_hat", problem.two)))
    return finish_matrix(problem, X, Y)


def finish_matrix(problem: MatrixProblem, X_hat: control.StateSpace, Y_hat: control.StateSpace, *,
                  basis: str = "manual", order: int = 0, solve_time: float = 0.0,
                  requested: Mapping[str, float] | None = None, asked: Mapping[str, float] | None = None,
                  prove: bool = True) -> MatrixFilters:
    """Result of a design: everything computed from the filters, and proven.

    Parameters
    ----------
    problem : MatrixProblem
        What was designed for.
    X_hat, Y_hat : StateSpace
        The free stable filters.
    basis : str
        Where they come from.
    order : int
        Order of the basis.
    solve_time : float
        Time of the search [s].
    requested : mapping, optional
        Values of the search.
    asked : mapping, optional
        Upper bounds on norms that the design had to keep.
    prove : bool
        False: numbers only; the result does not hold.
    """
    parts, proofs = realize_matrix(problem, X_hat, Y_hat), Proofs(prove)
    norms = _norms(problem, parts, proofs)
    where = 0.0
    norms["robust"] = norms["robust_without_circles"] = 0.0
    if problem.uncertainty is not None:
        delta, bare = youla_matrix(problem, X_hat, Y_hat), problem.uncertainty.without_confidence()
        norms["robust"], where = proofs.radius(delta, intervals_of(problem.uncertainty, problem.dt))
        norms["robust_without_circles"] = Proofs(False).radius(delta, intervals_of(bare, problem.dt))[0]
    nominal = proofs.stable(parts.loop_matrix, problem.dt, "internal stability") and prove
    steady = Proofs(prove)  # apart: an unstable controller is no failure unless it was asked for
    controller_stable = steady.stable(parts.coupling_matrix, problem.dt, "stability of the controller") and prove
    proofs.certificates |= steady.certificates
    robustly = nominal and norms["robust"] < 1.0
    outcome = verdict(problem.uncertainty is not None, nominal, robustly, asked or {}, norms, proofs)
    return MatrixFilters(
        X=parts.X, Y=parts.Y, X_hat=X_hat, Y_hat=Y_hat, Z1=problem.one.Z, Z2=problem.two.Z, X_input=parts.X_input,
        Y_input=parts.Y_input, controller=parts.controller, norms=norms, nominally_stable=nominal,
        robustly_stable=robustly, controller_stable=controller_stable, holds=outcome.ok, worst_frequency=where,
        proofs=dict(proofs.certificates), outcome=outcome, basis=basis, order=order, solve_time=solve_time,
        problem=problem, asked=dict(asked or {}), requested=dict(requested or {}),
        again=partial(finish_matrix, problem))


def refused_matrix(problem: MatrixProblem, outcome: Outcome, *, basis: str, order: int) -> MatrixFilters:
    """X = Y = 0 with the reason.

    Parameters
    ----------
    problem : MatrixProblem
        What was designed for.
    outcome : Outcome
        Why there is no filter.
    basis : str
        Basis that was tried.
    order : int
        Order of the basis.
    """
    nothing = [control.ss([], [], [], np.zeros((loop.P.ninputs, loop.P.noutputs)), problem.dt)
               for loop in problem.factors.loops]
    return finish_matrix(problem, *nothing, basis=basis, order=order).with_outcome(outcome)


def _norms(problem: MatrixProblem, parts: Realization, proofs: Proofs) -> dict[str, float]:
    first, second = (series(problem.weight, noise) for noise in problem.disturbed)
    with_Y, with_X = (series(problem.weight, _plus_identity(part), noise)
                      for part, noise in zip((parts.Y, parts.X), problem.disturbed, strict=True))
    systems = {"X": parts.X, "Y": parts.Y, "XY": series(parts.X, parts.Y), "improvement_1": _plus_identity(parts.Y),
               "improvement_2": _plus_identity(parts.X), "hinf_uncoupled": _row(first, second),
               "hinf": _row(with_Y, with_X)}
    proven = {key: proofs.norm(system, NORMS[key].proof) for key, system in systems.items()}
    return proven | {"h2_uncoupled": _h2(first, second), "h2": _h2(with_Y, with_X)}


def _plus_identity(system: control.StateSpace) -> control.StateSpace:
    return control.StateSpace(system.A, system.B, system.C, system.D + np.eye(system.noutputs), system.dt,
                              remove_useless_states=False)


def _row(first: control.StateSpace, second: control.StateSpace) -> control.StateSpace:
    """[first, second]: one set of outputs, the inputs of both."""
    return control.StateSpace(block_diag(first.A, second.A), block_diag(first.B, second.B),
                              np.hstack([first.C, second.C]), np.hstack([first.D, second.D]), first.dt,
                              remove_useless_states=False)


def _h2(*systems: control.StateSpace) -> float:
    """Root of the summed squared H2 norms; infinite in continuous time with a feedthrough."""
    total = 0.0
    for system in systems:
        total += float(np.sum(system.D**2)) if system.dt or not np.any(system.D) else float("inf")
        if system.nstates and np.isfinite(total):
            W = system.B @ system.B.T
            gram = solve_discrete_lyapunov(system.A, W) if system.dt else solve_continuous_lyapunov(system.A, -W)
            total += float(np.trace(system.C @ gram @ system.C.T))
    return float(np.sqrt(total))
