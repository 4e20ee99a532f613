"""Frequency responses of state spaces, many frequencies at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import schur

from ..._arrays import Array
from ..._control import control
from ._zpk import from_origin


class Response:
    """Frequency response of a state space, prepared once: Schur form, then back substitution for all frequencies.

    A complex Schur form also serves repeated poles (Laguerre filters), where a modal form does not exist.

    Parameters
    ----------
    system : StateSpace
        Any number of inputs and outputs.
    """

    def __init__(self, system: control.StateSpace):
        self.dt, self.D = float(system.dt), np.asarray(system.D, dtype=float)
        A = np.asarray(system.A, dtype=float)
        empty = A.astype(complex)
        pair: tuple[Array, Array] = schur(A, output="complex") if len(A) else (empty, empty)
        self.T, U = pair
        self.B, self.C = U.conj().T @ system.B, system.C @ U

    def __call__(self, omega: ArrayLike) -> Array:
        """Response at frequencies [rad/s].

        Parameters
        ----------
        omega : array_like, shape (n_f,)
            Frequencies of the responses [rad/s].

        Returns
        -------
        ndarray, shape (p, m, n_f)
        """
        shift, origin = from_origin(np.asarray(omega, dtype=float), self.dt)
        n, m = self.B.shape
        result = np.repeat(self.D[:, :, None].astype(complex), len(shift), axis=2)
        for column in range(m):
            states = np.empty((n, len(shift)), dtype=complex)
            for k in range(n - 1, -1, -1):
                inflow = self.B[k, column] + self.T[k, k + 1 :] @ states[k + 1 :]
                states[k] = inflow / (shift + (origin - self.T[k, k]))
            result[:, column] += self.C @ states
        return result


def siso(system: control.StateSpace, omega: ArrayLike) -> Array:
    """Response of one channel, shape (n_f,).

    Parameters
    ----------
    system : StateSpace
        One input, one output.
    omega : array_like
        Frequencies of the responses [rad/s].
    """
    return Response(system)(np.atleast_1d(np.asarray(omega, dtype=float)))[0, 0]


def series(*systems: control.StateSpace) -> control.StateSpace:
    """Product of systems, the last one first in the signal path; block triangular, nothing removed.

    Parameters
    ----------
    *systems : StateSpace
        Factors as written in a formula: ``series(Z, X)`` is Z X.
    """
    result = systems[-1]
    for system in reversed(systems[:-1]):
        A = np.block([[result.A, np.zeros((result.nstates, system.nstates))], [system.B @ result.C, system.A]])
        result = control.StateSpace(A, np.vstack([result.B, system.B @ result.D]),
                                    np.hstack([system.D @ result.C, system.C]), system.D @ result.D, result.dt,
                                    remove_useless_states=False)
    return result


def plus_one(system: control.StateSpace) -> control.StateSpace:
    """1 + system.

    Parameters
    ----------
    system : StateSpace
        One input, one output.
    """
    return control.StateSpace(system.A, system.B, system.C, system.D + 1.0, system.dt, remove_useless_states=False)


def negative(system: control.StateSpace) -> control.StateSpace:
    """-system.

    Parameters
    ----------
    system : StateSpace
        System of any size.
    """
    return control.StateSpace(system.A, system.B, -system.C, -system.D, system.dt, remove_useless_states=False)
