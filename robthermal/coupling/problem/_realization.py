"""The coupling controller (6.12) as a state space, and the matrices whose stability decides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..factors import feedback_matrix
from ..systems import apart, expect_stable, realize, series
from ._problem import Problem, Subsystem


@dataclass(frozen=True, eq=False)
class Realization:
    """The coupling as state spaces.

    Parameters
    ----------
    X, Y, X_input, Y_input : StateSpace
        Z1 X_hat, Z2 Y_hat, P1⁻¹X, P2⁻¹Y.
    controller : StateSpace
        K_Delta, errors to inputs.
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


def realization(problem: Problem, X_hat: control.StateSpace, Y_hat: control.StateSpace) -> Realization:
    """Build K_Delta = [[C1, P1⁻¹X], [P2⁻¹Y, C2]] [[1, -X], [-Y, 1]]⁻¹, Evers (6.12).

    Parameters
    ----------
    problem : Problem
        The two controlled subsystems.
    X_hat, Y_hat : StateSpace
        Stable, one input and one output.
    """
    for name, filter in (("X_hat", X_hat), ("Y_hat", Y_hat)):
        expect_stable(np.linalg.eigvals(filter.A), name, problem.dt, remedy="Only stable filters keep the loop stable.")
    both = [_two_outputs(problem.one, X_hat), _two_outputs(problem.two, Y_hat)]  # e2+ -> X, u1;  e1+ -> Y, u2
    direct = float(both[0].D[0, 0] * both[1].D[0, 0])
    if abs(1.0 - direct) < 1e-9:
        raise InputError("1 - X(∞)Y(∞) = 0: the coupling controller is not well posed", where="X_hat, Y_hat",
                         expected="X(∞)Y(∞) other than 1", remedy="Let one of the filters roll off.")
    own = [realize(problem.one.C), realize(problem.two.C)]
    driver, coupling = _assembled(both, own, problem.dt)
    controller = control.StateSpace(driver.A, driver.B, driver.C[:2], driver.D[:2], problem.dt,
                                    remove_useless_states=False)
    plants = apart(realize(problem.one.P), realize(problem.two.P))
    return Realization(X=_output(both[0], 0), Y=_output(both[1], 0), X_input=_output(both[0], 1),
                       Y_input=_output(both[1], 1), controller=controller, coupling_matrix=coupling,
                       loop_matrix=feedback_matrix(plants, controller))


def drivers(problem: Problem, X_hat: control.StateSpace, Y_hat: control.StateSpace
            ) -> tuple[control.StateSpace, control.StateSpace]:
    """The controller with the inputs of the coupling filters connected, and cut: e to (u, e+), the same states.

    Parameters
    ----------
    problem : Problem
        The two controlled subsystems.
    X_hat, Y_hat : StateSpace
        Stable, one input and one output.
    """
    both = [_two_outputs(problem.one, X_hat), _two_outputs(problem.two, Y_hat)]
    own = [realize(problem.one.C), realize(problem.two.C)]
    return _assembled(both, own, problem.dt)[0], _assembled(both, own, problem.dt, connected=0.0)[0]


def youla_parameter(problem: Problem, X_hat: control.StateSpace, Y_hat: control.StateSpace) -> control.StateSpace:
    """Delta_k = [[0, X_hat Dk2], [Y_hat Dk1, 0]].

    Parameters
    ----------
    problem : Problem
        The two controlled subsystems.
    X_hat, Y_hat : StateSpace
        Stable, one input and one output.
    """
    upper = _trimmed(X_hat, series(X_hat, realize(problem.two.Dk)))
    lower = _trimmed(Y_hat, series(Y_hat, realize(problem.one.Dk)))
    zero = np.zeros((1, 1))
    return control.StateSpace(
        block_diag(upper.A, lower.A),
        np.block([[np.zeros((upper.nstates, 1)), upper.B], [lower.B, np.zeros((lower.nstates, 1))]]),
        np.block([[upper.C, np.zeros((1, lower.nstates))], [np.zeros((1, upper.nstates)), lower.C]]),
        np.block([[zero, upper.D], [lower.D, zero]]), problem.dt, remove_useless_states=False)


def is_zero(filter: control.StateSpace) -> bool:
    """Whether a filter is the number zero.

    Parameters
    ----------
    filter : StateSpace
        One input and one output.
    """
    return not filter.nstates and not np.any(filter.D)


def _trimmed(filter: control.StateSpace, product: control.StateSpace) -> control.StateSpace:
    return filter if is_zero(filter) else product


def _two_outputs(half: Subsystem, filter: control.StateSpace) -> control.StateSpace:
    """[Z; Q] times the filter: the coupling signal and the plant input that makes it, sharing the filter's states."""
    if is_zero(filter):
        return control.StateSpace(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((2, 0)), np.zeros((2, 1)), half.P.dt)
    Z, Q = realize(half.Z), realize(half.Q)
    A = np.block([[filter.A, np.zeros((filter.nstates, Z.nstates + Q.nstates))],
                  [Z.B @ filter.C, Z.A, np.zeros((Z.nstates, Q.nstates))],
                  [Q.B @ filter.C, np.zeros((Q.nstates, Z.nstates)), Q.A]])
    B = np.vstack([filter.B, Z.B @ filter.D, Q.B @ filter.D])
    C = np.block([[Z.D @ filter.C, Z.C, np.zeros((1, Q.nstates))], [Q.D @ filter.C, np.zeros((1, Z.nstates)), Q.C]])
    return control.StateSpace(A, B, C, np.vstack([Z.D @ filter.D, Q.D @ filter.D]), half.P.dt,
                              remove_useless_states=False)


def _output(both: control.StateSpace, row: int) -> control.StateSpace:
    """One output, without the states of the other factor."""
    A, C = both.A, both.C[[row]]
    used = np.any(C != 0, axis=0)
    for _ in range(len(A)):
        used = used | np.any(A[used] != 0, axis=0)
    return control.StateSpace(A[np.ix_(used, used)], both.B[used], C[:, used], both.D[[row]], both.dt,
                              remove_useless_states=False)


def _assembled(both: list[control.StateSpace], own: list[control.StateSpace], dt: float, connected: float = 1.0
               ) -> tuple[control.StateSpace, Array]:
    """Close e+ = e + [[0, X], [Y, 0]] e+ round the filters; states: X, Y, C1, C2; outputs: u, e+."""
    x, y = both
    A = block_diag(x.A, y.A, own[0].A, own[1].A)
    B = np.block([[np.zeros((x.nstates, 1)), connected * x.B], [connected * y.B, np.zeros((y.nstates, 1))],
                  [own[0].B, np.zeros((own[0].nstates, 1))], [np.zeros((own[1].nstates, 1)), own[1].B]])
    rest = own[0].nstates + own[1].nstates
    C_e = np.hstack([block_diag(x.C[[0]], y.C[[0]]), np.zeros((2, rest))])
    D_e = connected * np.array([[0.0, x.D[0, 0]], [y.D[0, 0], 0.0]])
    C_u = np.hstack([block_diag(x.C[[1]], y.C[[1]]), block_diag(own[0].C, own[1].C)])
    D_u = np.array([[own[0].D[0, 0], connected * x.D[1, 0]], [connected * y.D[1, 0], own[1].D[0, 0]]])
    well = np.linalg.inv(np.eye(2) - D_e)
    A_k = A + B @ well @ C_e
    n = x.nstates + y.nstates
    whole = control.StateSpace(A_k, B @ well, np.vstack([C_u + D_u @ well @ C_e, well @ C_e]),
                               np.vstack([D_u @ well, well]), dt, remove_useless_states=False)
    return whole, A_k[:n, :n]
