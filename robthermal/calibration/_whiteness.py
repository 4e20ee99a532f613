"""Are the residuals white? Ljung and Box's portmanteau test."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from .._arrays import Floats


@dataclass(frozen=True)
class Whiteness:
    """Ljung-Box test of one sensor's residuals, all records together.

    Parameters
    ----------
    statistic : float
        Q, the weighted sum of squared autocorrelations.
    degrees_of_freedom : int
        Lags tested, summed over the records.
    p_value : float
        Chance of a larger Q if the residuals were white; small means that the model misses something.
    """

    statistic: float
    degrees_of_freedom: int
    p_value: float


def whiteness_of(segments: list[Floats]) -> Whiteness:
    """Test stretches of one sensor's weighted residuals, about zero: a constant residual is not white either."""
    Q, total = 0.0, 0
    for e in segments:
        n, lags = e.size, min(20, e.size // 5)
        power = float(e @ e)
        if not power or not lags:
            continue
        rho = np.array([float(e[lag:] @ e[:-lag]) for lag in range(1, lags + 1)]) / power
        Q += n * (n + 2) * float(np.sum(rho**2 / (n - np.arange(1, lags + 1))))
        total += lags
    return Whiteness(Q, total, float(scipy.special.chdtrc(total, Q)) if total else 1.0)
