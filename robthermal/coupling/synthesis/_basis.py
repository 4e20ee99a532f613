"""Stable bases for coupling filters: FIR, Laguerre, prescribed poles. A filter is c[0] + c[1] f_1 + c[2] f_2 + ...

The functions f_k are the states of a cascade of all-pass sections, one per pole. Each section is realized
input-balanced, so the f_k are orthonormal in H2 whatever the poles; equal poles make Laguerre functions, poles at zero
the delays of an FIR filter (Heuberger, Van den Hof and Wahlberg 2005, Modelling and Identification with Rational
Orthogonal Basis Functions, chapter 2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import null_space, solve_continuous_lyapunov, solve_discrete_lyapunov

from ..._arrays import Array
from ..._control import control
from ...errors import InputError


@dataclass(frozen=True)
class Basis:
    """Orthonormal functions f_1 ... f_{n-1} = (zI - A)^-1 B, and the constant before them.

    Parameters
    ----------
    name : str
        "fir", "laguerre" or "poles".
    A, B : ndarray, shapes (n - 1, n - 1) and (n - 1, 1)
        Realization, real, stable.
    sample_time : float
        [s]; 0 for continuous time.
    """

    name: str
    A: Array
    B: Array
    sample_time: float

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return len(self.A) + 1

    def all(self) -> control.StateSpace:
        """Every function, the constant first: one input, `size` outputs."""
        n = len(self.A)
        return self._system(np.vstack([np.zeros((1, n)), np.eye(n)]), np.eye(n + 1, 1))

    def filter(self, coefficients: Array) -> control.StateSpace:
        """Filter with these coefficients, in state space."""
        constant = np.array([[coefficients[0]]])
        if not np.any(coefficients[1:]):
            return control.ss([], [], [], constant, self.sample_time)
        return self._system(coefficients[None, 1:], constant)

    def _system(self, C: Array, D: Array) -> control.StateSpace:
        return control.StateSpace(self.A, self.B, C, D, self.sample_time, remove_useless_states=False)


def make_basis(name: str, order: int, pole: complex | Sequence[complex] | None, sample_time: float) -> Basis:
    """Build a basis.

    Parameters
    ----------
    name : str
        "fir" (discrete only), "laguerre" or "poles".
    order : int
        Coefficients of each filter, the constant included; "poles" has one more than there are poles instead.
    pole : complex or sequence of complex
        Of "laguerre": the real pole. Of "poles": all of them; complex ones in conjugate pairs, or one of the pair.
        Discrete: inside the unit circle. Continuous: in the left half plane [rad/s].
    sample_time : float
        [s]; 0 for continuous time.
    """
    if name == "fir":
        if not sample_time:
            raise InputError('basis = "fir" in continuous time', where="synthesize",
                             expected="a discrete-time system", remedy='Use basis="laguerre" or "poles".')
        poles = np.zeros(order - 1, complex)
    elif name == "laguerre":
        poles = np.full(order - 1, _one_real(pole), complex)
    else:
        poles = _listed(pole)
    _require_stable(poles, sample_time)
    A, B = _cascade(poles, sample_time)
    return Basis(name, A, B, sample_time)


def _one_real(pole: complex | Sequence[complex] | None) -> float:
    value = np.atleast_1d(np.asarray(pole, complex))
    if value.size != 1 or value[0].imag != 0:
        raise InputError(f'pole = {pole!r} with basis = "laguerre"', where="synthesize", expected="one real pole",
                         remedy='Give a list of poles with basis="poles".')
    return float(value[0].real)


def _listed(pole: complex | Sequence[complex] | None) -> Array:
    """Poles given, each complex one once (positive imaginary part)."""
    values: ArrayLike = [] if pole is None else np.atleast_1d(np.asarray(pole, complex))
    poles = np.asarray(values)
    if not poles.size:
        raise InputError('basis = "poles" without poles', where="synthesize", expected="pole = [p1, p2, ...]",
                         remedy="Give the stable poles, for example those of the closed loops.")
    upper, lower = poles[poles.imag > 0], poles[poles.imag < 0].conj()
    # A pair may be given whole or by one of its members.
    alone = [p for p in lower if not np.any(np.isclose(p, upper, rtol=1e-9))]
    return np.concatenate([poles[poles.imag == 0], upper, np.array(alone, complex)])


def _require_stable(poles: Array, sample_time: float) -> None:
    good = np.abs(poles) < 1 if sample_time else poles.real < 0
    if not np.all(good & np.isfinite(poles)):
        bad = poles[~(good & np.isfinite(poles))][0]
        place = "inside the unit circle" if sample_time else "in the left half plane (negative, rad/s)"
        raise InputError(f"pole {bad:g} is not stable", where="synthesize, argument pole", expected=f"poles {place}",
                         remedy="The filters must be stable: choose other poles.")


def _cascade(poles: Array, sample_time: float) -> tuple[Array, Array]:
    """States of all-pass sections in series, the output of one the input of the next."""
    chain: tuple[Array, Array, Array, Array] = np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.eye(1)
    for p in poles:
        A, B, C, D = chain
        a, b, c, d = _section(p, sample_time)
        chain = (np.block([[A, np.zeros((len(A), len(a)))], [b @ C, a]]), np.vstack([B, b @ D]),
                 np.hstack([d @ C, c]), d @ D)
    return chain[0], chain[1]


def _section(p: complex, sample_time: float) -> tuple[Array, Array, Array, Array]:
    """All-pass function with pole p (and its conjugate), realized with controllability Gramian I."""
    if p.imag == 0:
        A, B = np.array([[p.real]]), np.ones((1, 1))
    else:
        A, B = np.array([[p.real, p.imag], [-p.imag, p.real]]), np.array([[1.0], [0.0]])
    if sample_time:
        L = np.linalg.cholesky(solve_discrete_lyapunov(A, B @ B.T))
    else:
        L = np.linalg.cholesky(solve_continuous_lyapunov(A, -B @ B.T))
    a, b = np.linalg.solve(L, A @ L), np.linalg.solve(L, B)
    if not sample_time:
        return a, b, -b.T, np.eye(1)  # A + A' + BB' = 0 makes it lossless
    rest = null_space(np.hstack([a, b])).T  # completes [A B; C D] to an orthogonal matrix
    return a, b, rest[:, :-1], rest[:, -1:]
