"""P Q = Z with Z inner for a plant of several inputs and outputs, by one Riccati equation."""

from __future__ import annotations

import numpy as np
from scipy.linalg import matrix_balance, solve_continuous_are, solve_discrete_are

from ..._arrays import Array
from ..._control import control
from ...errors import InputError

_FASTER = 10.0  # default cut-off over the fastest pole of the plant
_INVERSION = 1e-6  # largest relative error of Z~ Z = I (discrete) at which the Riccati solution is taken


def inner_pair(P: control.StateSpace, where: str, cutoff: float | None = None, other_corners: Array | None = None
               ) -> tuple[control.StateSpace, control.StateSpace]:
    """Stable Z and Q with P Q = Z; discrete: Z~ Z = I, continuous: Z~ Z + Q~ R Q = I with R from the cut-off.

    Parameters
    ----------
    P : StateSpace
        Plant, no more inputs than outputs in discrete time.
    where : str
        Name of the plant, for messages.
    cutoff : float, optional
        Continuous time: frequency beyond which Z rolls off [rad/s]. Default: ten times the fastest pole of P.
    other_corners : ndarray, optional
        Where the default cut-off comes from when every pole of the plant is at zero [rad/s].
    """
    A, B, C, D = (np.asarray(part, dtype=float) for part in (P.A, P.B, P.C, P.D))
    m = B.shape[1]
    if P.dt and m > C.shape[0]:
        raise InputError(f"{m} inputs and {C.shape[0]} outputs", where=where, expected="no more inputs than outputs",
                         remedy="Combine the inputs first: the coupling needs as many as there are outputs.")
    if not len(A):
        return _constant(D, where, P.dt)
    penalty = np.zeros((m, m)) if P.dt else _penalty(P, where, cutoff, other_corners)
    try:
        if P.dt:
            X = solve_discrete_are(A, B, C.T @ C, D.T @ D, s=C.T @ D)
            G, K = D.T @ D + B.T @ X @ B, B.T @ X @ A + D.T @ C
        else:
            G = D.T @ D + penalty
            X = _continuous_are(A, B, C, D, G)
            K = B.T @ X + D.T @ C
        F = -np.linalg.solve(G, K)
    except (np.linalg.LinAlgError, ValueError):  # ValueError: scipy cannot order the pencil
        raise _no_solution(where) from None
    values, vectors = np.linalg.eigh((G + G.T) / 2)
    poles = np.linalg.eigvals(A + B @ F)
    edge = np.max(np.abs(poles)) if P.dt else 1.0 + np.max(poles.real)
    if values[0] <= 1e-14 * values[-1] or not edge < 1.0:
        raise _no_solution(where)
    root = (vectors / np.sqrt(values)) @ vectors.T
    closed, driven = A + B @ F, B @ root
    Z = control.StateSpace(closed, driven, C + D @ F, D @ root, P.dt, remove_useless_states=False)
    Q = control.StateSpace(closed, driven, F, root, P.dt, remove_useless_states=False)
    _expect_inner(Z, Q, penalty, where)
    return Z, Q


def _continuous_are(A: Array, B: Array, C: Array, D: Array, G: Array) -> Array:
    """The Riccati equation in inputs that cost one each and states of even size, which scipy solves more often."""
    n, units = len(A), np.linalg.inv(np.linalg.cholesky(G)).T
    B, D = B @ units, D @ units
    whole = np.block([[A, B], [C, np.zeros((len(C), B.shape[1]))]])
    square = np.zeros((max(whole.shape),) * 2)
    square[:whole.shape[0], :whole.shape[1]] = whole
    scale = matrix_balance(square, permute=False, separate=True)[1][0][:n]
    A, B, C = A * scale / scale[:, None], B / scale[:, None], C * scale
    rate = max(float(np.linalg.norm(A, 2)), 1e-300)
    X = solve_continuous_are(A / rate, B / np.sqrt(rate), C.T @ C / rate, np.eye(B.shape[1]), s=C.T @ D / np.sqrt(rate))
    return np.asarray(X / scale / scale[:, None])


def _constant(D: Array, where: str, dt: float) -> tuple[control.StateSpace, control.StateSpace]:
    """Of a plant without states: D Q = Z with orthonormal columns."""
    values, vectors = np.linalg.eigh(D.T @ D)
    if not values[0] > 1e-14 * values[-1]:
        raise _no_solution(where)
    root = (vectors / np.sqrt(values)) @ vectors.T
    return control.ss([], [], [], D @ root, dt), control.ss([], [], [], root, dt)


def _penalty(P: control.StateSpace, where: str, cutoff: float | None, other_corners: Array | None) -> Array:
    """R = Re P*P at the cut-off: there |P u|² and u'Ru are of one size."""
    corner = cutoff
    if corner is None:
        own = float(np.max(np.abs(np.linalg.eigvals(P.A)), initial=0.0))
        corner = _FASTER * (own or float(np.max(np.abs([] if other_corners is None else other_corners), initial=0.0)))
    if not corner > 0:
        raise InputError(f"cut-off {cutoff} for {where}", where="cutoff",
                         expected="a positive frequency [rad/s], above the frequencies that matter",
                         remedy="Give cutoff: the frequency beyond which the coupling rolls off.")
    response = np.atleast_2d(P(1j * corner))
    return np.asarray((response.conj().T @ response).real)


def _expect_inner(Z: control.StateSpace, Q: control.StateSpace, penalty: Array, where: str) -> None:
    """The identity at a few frequencies: a plant with a zero on the boundary has a Riccati solution of rounding."""
    fastest = np.abs(np.linalg.eigvals(Z.A)).max()
    points = np.exp(1j * np.linspace(0.1, 3.0, 7)) if Z.dt else 1j * fastest * np.geomspace(1e-3, 10, 7)
    for point in points:
        z, q = (np.asarray(part(point)).reshape(part.noutputs, part.ninputs) for part in (Z, Q))
        error = z.conj().T @ z + q.conj().T @ penalty @ q - np.eye(Z.ninputs)
        if not np.linalg.norm(error) < _INVERSION:
            raise _no_solution(where)


def _no_solution(where: str) -> InputError:
    return InputError("no stable Q makes P Q inner: a zero on the boundary, an unstable mode that no input reaches, or "
                      "outputs that depend on each other", where=where,
                      expected="a plant of full rank with zeros off the boundary",
                      remedy="Model the delay (a zero at z = -1 comes from sampling without it), or drop inputs that "
                             "do the same.")
