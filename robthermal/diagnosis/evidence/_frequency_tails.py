"""What an estimated noise does to tests: the covariance of a response has q degrees of freedom per window only.

With C = W/q, W complex Wishart, p outputs, a deviation e and a signature g, the score |gᴴC⁻¹e|²/gᴴC⁻¹g is
q |e₁ - β e₂|² / w, where w ~ Γ(q-p+1) and β, the regression of the noise along g on the other outputs, has
E|β|² = (p-1)/(q-p+1). So along any signature chosen beforehand the mean square is q/(q-p+1) times the average over all
directions, and the tails are those of Student's t with 2(q-p+1) degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..data import ResponseData
from ..fit import Refit

Array = NDArray[np.float64]


def inflation(fit: Refit, unit: Array) -> Array:
    """Mean of (unitᵀz)², relative to the whitened variance, for unit columns (m, k)."""
    out = np.ones(unit.shape[1])
    for one, rows in _windows(fit, unit):
        out += (one.alignment - 1.0) * np.sum(rows**2, axis=0)
    return out


def tail(fit: Refit, unit: Array) -> Array:
    """Degrees of freedom of Student's t with the kurtosis of unitᵀz, for unit columns (m, k); infinite for records.

    A window with the weight w has the excess kurtosis 6 w²/(ν-4).
    """
    excess = np.zeros(unit.shape[1])
    for one, rows in _windows(fit, unit):
        excess += np.sum(rows**2, axis=0) ** 2 / (one.tail - 4.0)
    return np.where(excess > 0, 4.0 + 1.0 / np.where(excess > 0, excess, 1.0), np.inf)


def relative_degrees_of_freedom(fit: Refit, U: Array) -> float:
    """Degrees of freedom of |Uᵀz|² per orthonormal column of U (m, q).

    Let the noise of window g be known up to a factor τ, var τ² = 2/(ν-4). Then the variance of |Uᵀz|² is
    2q + var τ² Σ (2 |P|² + (tr P)²) with P = U_g U_gᵀ, and χ² with 2q²/variance degrees of freedom has the same (Box
    1954).
    """
    more = sum((2.0 * float(np.sum((rows.T @ rows) ** 2)) + float(np.sum(rows**2)) ** 2) * 2.0 / (one.tail - 4.0)
               for one, rows in _windows(fit, U))
    return 1.0 / (1.0 + more / (2.0 * U.shape[1]))


def _windows(fit: Refit, U: Array) -> Iterator[tuple[ResponseData, Array]]:
    """Rows of U that share an estimate of the noise, (n, k), window by window of every response."""
    row = 0
    for path in fit.paths:
        size = path.one.readings.size
        yield from path.noise_windows(U[row:row + size])
        row += size
