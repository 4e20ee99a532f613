"""Upper bounds of the H-infinity norm, proven at every frequency."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import schur, solve_continuous_are, solve_discrete_are

from .._arrays import Array
from ..errors import InputError
from ..verification import Certificate, establish
from ._bound import GainBound
from ._levels import plant_norm
from ._stability import coordinates
from ._systems import Plant, made_by, read_plant, scaling

_LOSSES = (0.0, 0.02, 0.1)  # given up in turn where a proof fails
_LARGE = 60  # states above which the pencil of scipy takes too long
SHIFTS = (1e-4, 1e-7)  # of the strict Riccati equation, relative to the bound²


def hinf(system: Any, bound: float | None = None, *, left: Array | None = None,
         right: Array | None = None) -> GainBound:
    """Certify an upper bound of the H-infinity norm: the largest gain over all frequencies, not over a grid.

    Parameters
    ----------
    system : control.StateSpace or control.TransferFunction
        G, continuous or sampled.
    bound : float, optional
        What to prove [output unit per input unit]; by default the norm found in floats plus 0.5 %. Should that fail,
        2 % and 10 % more are tried, and the loss stands in ``made_by``.
    left, right : ndarray, shape (p, p), (m, m), optional
        Regular real scalings L, R: the bound is one of L G R⁻¹.

    Returns
    -------
    GainBound
        Proven upper bound, attained lower bound and its frequency, certificate of kind "hinf". ``holds`` is False for
        an unstable system and for a bound that is too small.

    Raises
    ------
    InputError
        Another type, numbers that are not finite, a bound that is not positive, a singular scaling.

    References
    ----------
    Boyd, El Ghaoui, Feron and Balakrishnan (1994), section 2.7.2; Rantzer (1996).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> G = control.ss(control.tf([1], [1, 0.02, 1]))
    >>> gain = rt.certify.hinf(G)
    >>> gain.holds, round(gain.lower, 3), gain.upper / gain.lower < 1.0051
    (True, 50.003, True)
    >>> rt.certify.hinf(G, 49.9).holds
    False
    """
    plant = read_plant(system)
    L, R = scaling(left, len(plant.C), "argument left"), scaling(right, plant.B.shape[1], "argument right")
    if any(matrix is not None and (matrix.ndim > 2 or np.iscomplexobj(matrix)) for matrix in (L, R)):
        raise InputError("a scaling is complex or one per interval", where="arguments left, right",
                         expected="one real matrix", remedy="Use frequency_norm for scalings that vary.")
    if bound is not None and not (isinstance(bound, (int, float, np.number)) and 0 < bound < np.inf):
        raise InputError(f"bound = {bound!r}", where="argument bound", expected="a positive number")
    scaled = _scaled(plant, L, R)
    stable = plant.stable
    norm, frequency = plant_norm(scaled) if stable else (np.inf, np.nan)
    start = bound if bound is not None else (norm * 1.005 if 0 < norm < np.inf else 1.0)
    cert = _prove(plant, scaled, norm, start, L, R, 0.0)
    for loss in _LOSSES[1:] if bound is None and stable else ():
        if cert.holds:
            break
        cert = _prove(plant, scaled, norm, start * (1 + loss), L, R, loss)
    return GainBound(float(cert.region["bound"]) if cert.holds else np.inf, norm, frequency, cert)


def _prove(plant: Plant, scaled: Plant, norm: float, bound: float, L: Array | None, R: Array | None,
           loss: float) -> Certificate:
    region: dict[str, Any] = {"bound": float(bound)}
    region |= {key: matrix for key, matrix in (("left", L), ("right", R)) if matrix is not None}
    given = f"{100 * loss:g} % given up for the proof"
    if norm < bound and len(plant.A):
        for shift in SHIFTS:
            matrix = bounded_real_matrix(scaled, norm + 0.7 * (bound - norm), bound**2 * shift)
            if matrix is None:
                continue
            cert = establish("hinf", system=plant.section, region=region, margin={},
                             evidence={"method": "bounded_real", "matrix": matrix},
                             made_by=made_by("scipy Riccati equation", f"shifted by {shift:g}; {given}"))
            if cert.holds:
                return cert
    return establish("hinf", system=plant.section, region=region, evidence={"method": "polynomial"}, margin={},
                     made_by=made_by("none", f"polynomial; {given}"))


def bounded_real_matrix(plant: Plant, level: float, shift: float) -> Array | None:
    """P of the bounded real lemma at a level below the bound, with shift I added to C'C in excited coordinates."""
    T = coordinates(plant.A, plant.B @ plant.B.T, bool(plant.dt))
    if T is None:
        return None
    A, B, C, D = np.linalg.solve(T, plant.A @ T), np.linalg.solve(T, plant.B), plant.C @ T, plant.D
    Q, S, R = C.T @ C + shift * np.eye(len(A)), C.T @ D, D.T @ D - level**2 * np.eye(B.shape[1])
    solver = solve_discrete_are if plant.dt else solve_continuous_are
    try:
        large = not plant.dt and len(A) > _LARGE
        P = _by_schur(A, B, Q, R, S) if large else solver(A, B, Q, R, s=S)
    except (np.linalg.LinAlgError, ValueError):
        return None
    inverse = np.linalg.inv(T)
    P = inverse.T @ P @ inverse
    return (P + P.T) / 2 if np.isfinite(P).all() else None


def _by_schur(A: Array, B: Array, Q: Array, R: Array, S: Array) -> Array:
    """The same solution from the Hamiltonian matrix of half the size: R is regular, below the bound."""
    n = len(A)
    gain = np.linalg.solve(R, np.hstack([S.T, B.T]))
    own = A - B @ gain[:, :n]
    H = np.block([[own, -B @ gain[:, n:]], [S @ gain[:, :n] - Q, -own.T]])
    _, U, count = schur(H, sort="lhp")
    if count != n:
        raise np.linalg.LinAlgError("eigenvalues on the axis")
    P: Array = np.linalg.solve(U[:n, :n].T, U[n:, :n].T).T
    return P


def _scaled(plant: Plant, L: Array | None, R: Array | None) -> Plant:
    C, B, D = plant.C, plant.B, plant.D
    if L is not None:
        C, D = L @ C, L @ D
    if R is not None:
        inverse = np.linalg.inv(R)
        B, D = B @ inverse, D @ inverse
    return Plant(plant.A, B, C, D, plant.dt)
