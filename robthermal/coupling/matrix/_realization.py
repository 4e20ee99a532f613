"""The coupling controller (6.12) of matrices as a state space, and the matrices whose stability decides."""

from __future__ import annotations

import numpy as np

from ..._control import control
from ..factors import MatrixLoop, feedback_matrix
from ..problem import Realization, RunningLoops, assembled, coupling_controller
from ..systems import apart, expect_stable, series
from ._problem import MatrixProblem


def realize_matrix(problem: MatrixProblem, X_hat: control.StateSpace, Y_hat: control.StateSpace) -> Realization:
    """Build K_Delta = [[C1, Q1 X_hat], [Q2 Y_hat, C2]] [[I, -X], [-Y, I]]⁻¹.

    Parameters
    ----------
    problem : MatrixProblem
        The two controlled subsystems.
    X_hat, Y_hat : StateSpace
        Stable filters, (m1, p) and (m2, p).
    """
    for name, filter in (("X_hat", X_hat), ("Y_hat", Y_hat)):
        expect_stable(np.linalg.eigvals(filter.A), name, problem.dt, remedy="Only stable filters keep the loop stable.")
    x, y = _stacked(problem.one, X_hat), _stacked(problem.two, Y_hat)  # e2+ to (X, u1), e1+ to (Y, u2)
    p, plants = problem.one.P.noutputs, apart(problem.one.P, problem.two.P)
    driver, coupling = assembled((x, y), (problem.one.C, problem.two.C), problem.dt)
    controller = coupling_controller(driver, plants.ninputs)
    return Realization(_rows(x, slice(0, p)), _rows(y, slice(0, p)), _rows(x, slice(p, None)),
                       _rows(y, slice(p, None)), controller, coupling, feedback_matrix(plants, controller))


def running_matrix_loops(problem: MatrixProblem, X_hat: control.StateSpace, Y_hat: control.StateSpace) -> RunningLoops:
    """What runs sample by sample: plants, disturbances, and the controllers with coupling, with it cut, and without.

    Parameters
    ----------
    problem : MatrixProblem
        The two controlled subsystems.
    X_hat, Y_hat : StateSpace
        Stable filters, (m1, p) and (m2, p).
    """
    one, two = problem.one, problem.two
    return RunningLoops.of((one.P, two.P), (one.C, two.C), problem.disturbances,
                           (_stacked(one, X_hat), _stacked(two, Y_hat)), problem.samples)


def youla_matrix(problem: MatrixProblem, X_hat: control.StateSpace, Y_hat: control.StateSpace) -> control.StateSpace:
    """Delta_k = [[0, X_hat Dk2], [Y_hat Dk1, 0]], (m1 + m2, 2p).

    Parameters
    ----------
    problem : MatrixProblem
        The two controlled subsystems.
    X_hat, Y_hat : StateSpace
        Stable filters of the right sizes.
    """
    both = apart(series(X_hat, problem.two.Dk), series(Y_hat, problem.one.Dk))
    p = problem.one.P.noutputs
    swapped = np.r_[p:2 * p, 0:p]  # e1 drives the second filter, e2 the first
    return control.StateSpace(both.A, both.B[:, swapped], both.C, both.D[:, swapped], problem.dt,
                              remove_useless_states=False)


def _stacked(loop: MatrixLoop, filter: control.StateSpace) -> control.StateSpace:
    """[Z; Q] times the filter. Z and Q have one state matrix, so their states stand once."""
    Z, Q = loop.Z, loop.Q
    if not np.any(filter.D) and not (np.any(filter.B) and np.any(filter.C)):
        rows = Z.noutputs + Q.noutputs
        return control.ss([], [], [], np.zeros((rows, filter.ninputs)), loop.P.dt)
    both = control.StateSpace(Z.A, Z.B, np.vstack([Z.C, Q.C]), np.vstack([Z.D, Q.D]), Z.dt,
                              remove_useless_states=False)
    return series(both, filter)


def _rows(system: control.StateSpace, rows: slice) -> control.StateSpace:
    return control.StateSpace(system.A, system.B, system.C[rows], system.D[rows], system.dt,
                              remove_useless_states=False)
