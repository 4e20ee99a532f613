"""What one matrix P shows of the loops at all vertices, in floats: rate, H-infinity and H2 bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from .._arrays import Array
from ._vertices import Vertices

_ABOVE = 1e-7  # of the least multiple of P that the H2 norm needs


@dataclass(frozen=True)
class Reached:
    """P scaled for its bound; rate of x'Px; bound of the norm, infinity where P shows none."""

    P: Array
    rate: float
    bound: float


def reached(v: Vertices, F: Array, P: Array, objective: str) -> Reached:
    """Rate and bound that a multiple of P shows for all vertices."""
    P = (P + P.T) / 2
    try:
        L = np.linalg.cholesky(np.linalg.inv(P))
    except np.linalg.LinAlgError:
        return Reached(P, -np.inf, np.inf)
    A, C = v.loops(F)
    inverse = np.linalg.inv(L)
    A, B, C = inverse @ A @ L, inverse @ v.B1, C @ L  # coordinates in which P is the identity
    if v.dt:
        rate = 1 - float(np.linalg.norm(A, 2, axis=(1, 2)).max())
        falls = np.eye(A.shape[1]) - A.transpose(0, 2, 1) @ A
    else:
        falls = -(A + A.transpose(0, 2, 1))
        rate = float(np.linalg.eigvalsh(falls).min()) / 2
    if objective == "stability" or not np.linalg.eigvalsh(falls).min() > 0:
        return Reached(P / np.abs(P).max(), rate, np.inf)
    seen = C.transpose(0, 2, 1) @ C
    half = np.linalg.inv(np.linalg.cholesky(falls))
    least = float(np.linalg.eigvalsh(half @ seen @ half.transpose(0, 2, 1)).max())  # s falls > C'C
    if objective == "h2":
        s = least * (1 + _ABOVE) + 1e-300
        energy = s * np.trace(B.transpose(0, 2, 1) @ B, axis1=1, axis2=2)
        if v.dt:
            energy = energy + np.sum(v.D1**2, axis=(1, 2))
        return Reached(s * P, rate, float(np.sqrt(energy.max())))

    def squared(log: float) -> float:
        s = least * (1 + np.exp(log)) + 1e-300
        cross = s * (A.transpose(0, 2, 1) @ B if v.dt else B) + C.transpose(0, 2, 1) @ v.D1
        own = v.D1.transpose(0, 2, 1) @ v.D1 + (s * B.transpose(0, 2, 1) @ B if v.dt else 0.0)
        bounded = own + cross.transpose(0, 2, 1) @ np.linalg.solve(s * falls - seen, cross)
        return float(np.linalg.eigvalsh(bounded).max())

    logs = np.linspace(-12, 12, 49)
    near = float(logs[int(np.argmin([squared(one) for one in logs]))])
    best = scipy.optimize.minimize_scalar(squared, bounds=(near - 0.6, near + 0.6), method="bounded",
                                          options={"xatol": 1e-6})
    return Reached((least * (1 + np.exp(best.x)) + 1e-300) * P, rate, float(np.sqrt(max(best.fun, 0.0))))
