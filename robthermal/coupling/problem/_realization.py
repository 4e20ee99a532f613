"""The coupling controller (6.12) as a state space, and the matrices whose stability decides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..factors import feedback_matrix
from ..systems import apart, expect_stable, realize, series
from ._problem import Problem, Subsystem

_SINGULAR = 1e-9  # smallest singular value of I - X(∞)Y(∞) below which the controller is not well posed


@dataclass(frozen=True, eq=False)
class Realization:
    """The coupling as state spaces.

    Parameters
    ----------
    X, Y, X_input, Y_input : StateSpace
        Z1 X_hat, Z2 Y_hat, Q1 X_hat, Q2 Y_hat; for one channel Q X_hat = P⁻¹X.
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


@dataclass(frozen=True, eq=False)
class RunningLoops:
    """Both loops as state spaces that run sample by sample.

    Parameters
    ----------
    plants : StateSpace
        P1 and P2 apart.
    shaping : StateSpace
        W1 and W2 apart: white noise to v1, v2.
    alone, coupled, cut : StateSpace
        e to (u, e+): C1 and C2 alone; with the coupling; with the inputs of its filters cut, the same states.
    samples : int
        In the exposure window; 0 without one.
    """

    plants: control.StateSpace
    shaping: control.StateSpace
    alone: control.StateSpace
    coupled: control.StateSpace
    cut: control.StateSpace
    samples: int

    @classmethod
    def of(cls, plants: Sequence[control.StateSpace], own: Sequence[control.StateSpace],
           shaping: Sequence[control.StateSpace], both: Sequence[control.StateSpace], samples: int) -> RunningLoops:
        """Loops of two subsystems.

        Parameters
        ----------
        plants, own, shaping : pair of StateSpace
            P1, P2; C1, C2; W1, W2.
        both : pair of StateSpace
            As for `assembled`.
        samples : int
            Samples in the exposure window.

        Returns
        -------
        RunningLoops
        """
        C, dt = apart(*own), own[0].dt
        alone = control.StateSpace(C.A, C.B, np.vstack([C.C, np.zeros((C.ninputs, C.nstates))]),
                                   np.vstack([C.D, np.eye(C.ninputs)]), dt, remove_useless_states=False)
        return cls(apart(*plants), apart(*shaping), alone, assembled(both, own, dt)[0],
                   assembled(both, own, dt, connected=0.0)[0], samples)


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
    own = [realize(problem.one.C), realize(problem.two.C)]
    driver, coupling = assembled(both, own, problem.dt)
    controller = coupling_controller(driver, 2)
    plants = apart(realize(problem.one.P), realize(problem.two.P))
    return Realization(X=_output(both[0], 0), Y=_output(both[1], 0), X_input=_output(both[0], 1),
                       Y_input=_output(both[1], 1), controller=controller, coupling_matrix=coupling,
                       loop_matrix=feedback_matrix(plants, controller))


def running_loops(problem: Problem, X_hat: control.StateSpace, Y_hat: control.StateSpace) -> RunningLoops:
    """What runs sample by sample: plants, disturbances, and the controllers with coupling, with it cut, and without.

    Parameters
    ----------
    problem : Problem
        The two controlled subsystems.
    X_hat, Y_hat : StateSpace
        Stable, one input and one output.
    """
    both = [_two_outputs(problem.one, X_hat), _two_outputs(problem.two, Y_hat)]
    one, two = problem.one, problem.two
    return RunningLoops.of((realize(one.P), realize(two.P)), (realize(one.C), realize(two.C)),
                           (realize(one.W), realize(two.W)), both, problem.samples)


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


def assembled(both: Sequence[control.StateSpace], own: Sequence[control.StateSpace], dt: float, connected: float = 1.0
              ) -> tuple[control.StateSpace, Array]:
    """Close e+ = e + [[0, X], [Y, 0]] e+ round the filters: the controller, e to (u, e+), and the filters' matrix.

    States: those of X, of Y, then of C1, C2.

    Parameters
    ----------
    both : pair of StateSpace
        e2+ to (X, u1) and e1+ to (Y, u2), p inputs and p + m outputs each.
    own : pair of StateSpace
        C1 and C2.
    dt : float
        Sample time [s]; 0 in continuous time.
    connected : float
        Factor on the inputs of the filters: 0 cuts them.

    Raises
    ------
    InputError
        If I - X(∞)Y(∞) is singular, of one channel 1 - X(∞)Y(∞) = 0.
    """
    (x, y), (C1, C2), p = both, own, both[0].ninputs
    A = block_diag(x.A, y.A, C1.A, C2.A)
    B = np.block([[np.zeros((x.nstates, p)), connected * x.B], [connected * y.B, np.zeros((y.nstates, p))],
                  [C1.B, np.zeros((C1.nstates, p))], [np.zeros((C2.nstates, p)), C2.B]])
    C_e = np.hstack([block_diag(x.C[:p], y.C[:p]), np.zeros((2 * p, C1.nstates + C2.nstates))])
    C_u = np.hstack([block_diag(x.C[p:], y.C[p:]), block_diag(C1.C, C2.C)])
    D_u = np.block([[C1.D, connected * x.D[p:]], [connected * y.D[p:], C2.D]])
    direct = np.eye(p) - connected**2 * x.D[:p] @ y.D[:p]
    if np.linalg.svd(direct, compute_uv=False)[-1] < _SINGULAR:
        fault = "1 - X(∞)Y(∞) = 0" if p == 1 else "I - X(∞)Y(∞) is singular"
        raise InputError(f"{fault}: the coupling controller is not well posed", where="X_hat, Y_hat",
                         expected="X(∞)Y(∞) without an eigenvalue 1", remedy="Let one of the filters roll off.")
    well = np.linalg.inv(np.block([[np.eye(p), -connected * x.D[:p]], [-connected * y.D[:p], np.eye(p)]]))
    A_k, n = A + B @ well @ C_e, x.nstates + y.nstates
    whole = control.StateSpace(A_k, B @ well, np.vstack([C_u + D_u @ well @ C_e, well @ C_e]),
                               np.vstack([D_u @ well, well]), dt, remove_useless_states=False)
    return whole, A_k[:n, :n]


def coupling_controller(driver: control.StateSpace, inputs: int) -> control.StateSpace:
    """K_Delta, errors to inputs, of what `assembled` returns.

    Parameters
    ----------
    driver : StateSpace
        e to (u, e+).
    inputs : int
        Number of plant inputs u.
    """
    return control.StateSpace(driver.A, driver.B, driver.C[:inputs], driver.D[:inputs], driver.dt,
                              remove_useless_states=False)
