"""The coupling controller (6.12) of matrices as a state space, and the matrices whose stability decides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..factors import MatrixLoop, feedback_matrix
from ..systems import apart, expect_stable, series
from ._problem import MatrixProblem


@dataclass(frozen=True, eq=False)
class MatrixRealization:
    """The coupling as state spaces.

    Parameters
    ----------
    X, Y, X_input, Y_input : StateSpace
        Z1 X_hat, Z2 Y_hat, Q1 X_hat, Q2 Y_hat.
    controller : StateSpace
        K_Delta, errors (e1, e2) to inputs (u1, u2).
    coupling_matrix : ndarray
        State matrix of the controller without the states of C1, C2.
    loop_matrix : ndarray
        State matrix of the coupled closed loop with P1, P2.
    """

    X: control.StateSpace
    Y: control.StateSpace
    X_input: control.StateSpace
    Y_input: control.StateSpace
    controller: control.StateSpace
    coupling_matrix: Array
    loop_matrix: Array


def realize_matrix(problem: MatrixProblem, X_hat: control.StateSpace, Y_hat: control.StateSpace) -> MatrixRealization:
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
    p = problem.one.P.noutputs
    well = np.block([[np.eye(p), -x.D[:p]], [-y.D[:p], np.eye(p)]])
    if np.linalg.cond(well) > 1e9:
        raise InputError("I - X(∞)Y(∞) is singular: the coupling controller is not well posed", where="X_hat, Y_hat",
                         expected="X(∞)Y(∞) without an eigenvalue 1", remedy="Let one of the filters roll off.")
    controller, coupling = _assembled(problem, x, y, np.linalg.inv(well))
    plants = apart(problem.one.P, problem.two.P)
    return MatrixRealization(_rows(x, slice(0, p)), _rows(y, slice(0, p)), _rows(x, slice(p, None)),
                             _rows(y, slice(p, None)), controller, coupling, feedback_matrix(plants, controller))


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


def _assembled(problem: MatrixProblem, x: control.StateSpace, y: control.StateSpace, well: Array
               ) -> tuple[control.StateSpace, Array]:
    """Close e+ = e + [[0, X], [Y, 0]] e+; states: filters of X, of Y, then C1, C2."""
    p, (C1, C2) = problem.one.P.noutputs, (problem.one.C, problem.two.C)
    A = block_diag(x.A, y.A, C1.A, C2.A)
    B = np.block([[np.zeros((x.nstates, p)), x.B], [y.B, np.zeros((y.nstates, p))],
                  [C1.B, np.zeros((C1.nstates, p))], [np.zeros((C2.nstates, p)), C2.B]])
    own = C1.nstates + C2.nstates
    to_e = np.hstack([block_diag(x.C[:p], y.C[:p]), np.zeros((2 * p, own))])
    to_u = np.hstack([block_diag(x.C[p:], y.C[p:]), block_diag(C1.C, C2.C)])
    direct = np.block([[C1.D, x.D[p:]], [y.D[p:], C2.D]])
    state = A + B @ well @ to_e
    controller = control.StateSpace(state, B @ well, to_u + direct @ well @ to_e, direct @ well, problem.dt,
                                    remove_useless_states=False)
    n = x.nstates + y.nstates
    return controller, state[:n, :n]
