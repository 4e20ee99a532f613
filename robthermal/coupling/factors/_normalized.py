"""Normalized coprime factors: P = N M⁻¹ (right) or M⁻¹ N (left) with [N; M] inner, [N M] co-inner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.linalg import solve_continuous_are, solve_continuous_lyapunov, solve_discrete_are, solve_discrete_lyapunov

from ..._arrays import Array
from ..._control import control
from ...errors import InputError

_SIDES = ("right", "left")


@dataclass(frozen=True)
class NormalizedFactors:
    """Normalized coprime factors of a plant.

    Parameters
    ----------
    N, M : StateSpace
        Numerator and denominator, stable.
    side : {"right", "left"}
        P = N M⁻¹, or P = M⁻¹ N.
    margin : float
        Largest size of stable perturbations of (N, M) that some controller can bear: sqrt(1 - Hankel norm²) [-].
    """

    N: control.StateSpace
    M: control.StateSpace
    side: str
    margin: float


def normalized(P: Any, side: Literal["right", "left"] = "right") -> NormalizedFactors:
    """Normalized coprime factors of a plant, N~N + M~M = 1 on the axis or the unit circle (left: N N~ + M M~ = 1).

    Parameters
    ----------
    P : StateSpace or TransferFunction
        Plant of any size, without hidden unstable modes.
    side : {"right", "left"}
        P = N M⁻¹, or P = M⁻¹ N.

    Returns
    -------
    NormalizedFactors

    Raises
    ------
    InputError
        Not an LTI system, unknown side, a hidden mode on the boundary or unstable.

    References
    ----------
    McFarlane and Glover, *Robust Controller Design Using Normalized Coprime Factor Plant Descriptions* (1990), ch. 2.

    Examples
    --------
    >>> import control, numpy as np
    >>> import robthermal as rt
    >>> f = rt.coupling.normalized(control.tf([1], [1, -1]))  # unstable: 1/(s - 1)
    >>> bool(np.isclose(abs(f.N(2j)) ** 2 + abs(f.M(2j)) ** 2, 1.0)), round(f.margin, 4)
    (True, 0.3827)
    """
    if side not in _SIDES:
        raise InputError(f"side = {side!r}", where="argument side", expected='"right" or "left"')
    if not isinstance(P, (control.StateSpace, control.TransferFunction)):
        raise InputError(f"P is a {type(P).__name__}", where="argument P", expected="a StateSpace or TransferFunction")
    plant = control.ss(P)
    A, B, C, D = (np.asarray(part, dtype=float) for part in (plant.A, plant.B, plant.C, plant.D))
    if side == "left":
        A, B, C, D = A.T, C.T, B.T, D.T
    try:
        F, root = _gain(A, B, C, D, discrete=control.isdtime(plant, strict=True))
    except np.linalg.LinAlgError:
        raise InputError("the Riccati equation has no stabilizing solution", where="argument P",
                         expected="a plant whose unstable modes and modes on the boundary are all reached and seen",
                         remedy="Take a minimal realization (control.minreal).") from None
    rows = {"N": (C + D @ F, D @ root), "M": (F, root)}
    parts = {name: (A + B @ F, B @ root, output, through) for name, (output, through) in rows.items()}
    if side == "left":
        parts = {name: (a.T, c.T, b.T, d.T) for name, (a, b, c, d) in parts.items()}
    N, M = (control.ss(*parts[name], plant.dt) for name in ("N", "M"))
    return NormalizedFactors(N, M, side, _margin(A + B @ F, B @ root, np.vstack([C + D @ F, F]),
                                                 discrete=control.isdtime(plant, strict=True)))


def _gain(A: Array, B: Array, C: Array, D: Array, *, discrete: bool) -> tuple[Array, Array]:
    """State feedback F, and the factor R^-½ that makes the right factors inner."""
    if not len(A):
        X, R = np.zeros((0, 0)), np.eye(D.shape[1]) + D.T @ D
        F = np.zeros((D.shape[1], 0))
    elif discrete:
        X = solve_discrete_are(A, B, C.T @ C, np.eye(D.shape[1]) + D.T @ D, s=C.T @ D)
        R = np.eye(D.shape[1]) + D.T @ D + B.T @ X @ B
        F = -np.linalg.solve(R, B.T @ X @ A + D.T @ C)
    else:
        R = np.eye(D.shape[1]) + D.T @ D
        X = solve_continuous_are(A, B, C.T @ C, R, s=C.T @ D)
        F = -np.linalg.solve(R, B.T @ X + D.T @ C)
    values, vectors = np.linalg.eigh(R)
    return F, (vectors / np.sqrt(values)) @ vectors.T


def _margin(A: Array, B: Array, C: Array, *, discrete: bool) -> float:
    """sqrt(1 - Hankel norm²) of stable inner factors."""
    if not len(A):
        return 1.0
    solve = solve_discrete_lyapunov if discrete else lambda a, q: solve_continuous_lyapunov(a, -q)
    square = np.linalg.eigvals(solve(A, B @ B.T) @ solve(A.T, C.T @ C)).real.max()
    return float(np.sqrt(max(0.0, 1.0 - square)))
