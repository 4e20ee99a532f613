"""Stability of x' = A x or x+ = A x, proven."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import cholesky, solve_continuous_lyapunov, solve_discrete_lyapunov

from .._arrays import Array
from ..errors import InputError
from ..verification import Certificate, establish
from ._systems import Plant, made_by, read_plant

_FLOOR = 1e-9  # relative: directions driven less than this are taken as driven this much, for the sake of rounding


def stability(system: Any, *, rate: float = 0.0) -> Certificate:
    """Certify that every mode of a linear system decays.

    Tried first is a Lyapunov matrix; where rounding spoils it, the characteristic polynomial is computed exactly.

    Parameters
    ----------
    system : control.StateSpace or control.TransferFunction
        Every eigenvalue of A counts, also those that no output sees.
    rate : float
        Decay to spare: real parts below -rate [1/s], or absolute values below 1 - rate [-] of a sampled system.

    Returns
    -------
    Certificate
        Kind "stability"; ``holds`` False, with the reason, where it is not proven.

    Raises
    ------
    InputError
        Another type, numbers that are not finite, a negative rate.

    Examples
    --------
    >>> import control, robthermal as rt
    >>> loop = control.ss([[0, 1], [-1, -1e-6]], [[0], [1]], [[1, 0]], 0)
    >>> rt.certify.stability(loop).holds, rt.certify.stability(loop, rate=1e-6).holds
    (True, False)
    """
    plant = read_plant(system)
    _check_rate(plant, rate)
    region = {"rate": float(rate)}
    matrix = lyapunov_matrix(plant, rate)
    if matrix is not None:
        cert = establish("stability", system=plant.section, region=region, margin={},
                         evidence={"method": "lyapunov", "matrix": matrix},
                         made_by=made_by("scipy Lyapunov equation", "solved"))
        if cert.holds:
            return cert
    return establish("stability", system=plant.section, region=region, evidence={"method": "polynomial"}, margin={},
                     made_by=made_by("none", "characteristic polynomial"))


def _check_rate(plant: Plant, rate: float) -> None:
    good = isinstance(rate, (int, float, np.number)) and not isinstance(rate, bool)
    if not (good and 0 <= rate < (1 if plant.dt else np.inf)):
        raise InputError(f"rate = {rate!r}", where="argument rate",
                         expected="zero or above [1/s]; below 1 for a sampled system")


def lyapunov_matrix(plant: Plant, rate: float) -> Array | None:
    """P that decays with the rate, solved in coordinates whose modes are driven alike; None where floats see none."""
    n = len(plant.A)
    if n == 0:
        return None
    A = plant.A / (1 - rate) if plant.dt else plant.A + rate * np.eye(n)
    T = coordinates(A, np.eye(n), bool(plant.dt))
    if T is None:
        return None
    P = solve(np.linalg.solve(T, A @ T).T, np.eye(n), bool(plant.dt))
    if P is None:
        return None
    inverse = np.linalg.inv(T)
    P = inverse.T @ P @ inverse
    return (P + P.T) / 2


def coordinates(A: Array, driven: Array, discrete: bool, floor: float = _FLOOR) -> Array | None:
    """T with x = T x̂ in which the states that noise of covariance ``driven`` excites are of size one and unrelated."""
    size = np.sqrt(np.maximum(np.diag(driven), 1e-300))
    W = solve(A, driven + 1e-12 * np.diag(size**2), discrete)
    if W is None or np.diag(W).min() < 0:  # a badly scaled A: floats found nothing
        return None
    try:
        root = np.sqrt(np.maximum(np.diag(W), 1e-300))
        lower: Array = cholesky(W / np.outer(root, root) + floor * np.eye(len(A)), lower=True)
    except np.linalg.LinAlgError:
        return None
    return root[:, None] * lower


def solve(A: Array, Q: Array, discrete: bool) -> Array | None:
    """X with A X + X Aᵀ + Q = 0, or A X Aᵀ - X + Q = 0; None where there is none that is positive."""
    values = np.linalg.eigvals(A)
    if (abs(values).max() >= 1) if discrete else (values.real.max() >= 0):
        return None
    try:
        X: Array = solve_discrete_lyapunov(A, Q) if discrete else solve_continuous_lyapunov(A, -Q)
    except (np.linalg.LinAlgError, ValueError):
        return None
    return (X + X.T) / 2 if np.isfinite(X).all() else None
