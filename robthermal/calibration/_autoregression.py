"""Correlation of residuals in time: one autoregression per sensor, innovations correlated between sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .._all_pole import all_pole
from .._arrays import Floats

_LONGEST = 30


@dataclass(frozen=True)
class Correlation:
    """Residual model a_s(q) e_s = v_s, cov(v) = `innovation`.

    Parameters
    ----------
    polynomials : tuple of ndarray
        One monic polynomial per sensor.
    innovation : ndarray, shape (n_sensors, n_sensors)
        Covariance of the innovations.
    """

    polynomials: tuple[Floats, ...]
    innovation: Floats

    def meat(self, J: Floats) -> Floats:
        """Jᵀ Cov(e) J for J of shape (n, n_sensors, p), by filtering J backwards in time.

        Zeros before the first sample let the innovations before it count too: e was stationary when it began.
        """
        J = np.concatenate([np.zeros_like(J), J])
        back = np.stack([all_pole(a, J[::-1, s]) for s, a in enumerate(self.polynomials)],
                        axis=1)
        return np.einsum("ksi,st,ktj->ij", back, self.innovation, back, optimize=True)

    def share(self, psi: Floats) -> float:
        """Independent samples in the slow part of residuals (n, n_sensors), as a part of all samples [-].

        γ₀/S(0), not above 1, with γ₀ the variance and S(0) the spectral density of the autoregression at frequency
        zero; mean of the sensors.
        """
        density = np.diag(self.innovation) / np.array([a.sum() for a in self.polynomials]) ** 2
        return float(np.minimum(np.mean(psi**2, axis=0) / np.where(density > 0, density, np.inf), 1.0).mean())

    def independent(self, psi: Floats) -> float:
        """How many independent samples the slow part of residuals (n, n_sensors) amounts to.

        `share` of all readings, times S/‖R‖² for S sensors whose innovations have the correlation R (S, S).
        """
        spread = np.diag(self.innovation)
        deviation = np.sqrt(np.where(spread > 0, spread, 1.0))
        R = self.innovation / np.outer(deviation, deviation)
        return psi.size * self.share(psi) * len(R) / max(float(np.sum(R**2)), len(R))

    def bias(self, psi: Floats) -> float:
        """Factor by which the autoregression's spectral density at frequency zero is too small on average.

        Where a level is fitted too, as by start temperatures, its pole φ comes out too small by (1 + 3φ)/n
        (Kendall, 1954), hence S(0) by a part 4/n_e of itself, with n_e independent samples per sensor; nothing of white
        residuals.
        """
        share = self.share(psi)
        return 1.0 + 4.0 * (1.0 - share) / max(share * len(psi), 1.0)


def correlation_of(segments: list[Floats]) -> Correlation:
    """Fit by Burg's method, order by BIC; segments (n, n_sensors) of the same sensors are pooled.

    Parameters
    ----------
    segments : list of ndarray
        Weighted residuals (n, n_sensors) of every record.
    """
    n_sensors = segments[0].shape[1]
    polynomials = tuple(burg([e[:, s] for e in segments]) for s in range(n_sensors))
    v = np.concatenate([np.column_stack([np.convolve(a, e[:, s])[: len(e)] for s, a in enumerate(polynomials)])
                        for e in segments])
    return Correlation(polynomials, v.T @ v / len(v))


def burg(segments: list[Floats]) -> Floats:
    """Monic autoregression polynomial of several stretches of one signal, always stable; order by BIC."""
    n = sum(e.size for e in segments)
    power = sum(float(e @ e) for e in segments) / n
    best = a = np.ones(1)
    if power == 0.0:
        return best
    least = n * math.log(power)
    forward, backward = [e[1:] for e in segments], [e[:-1] for e in segments]
    for order in range(1, min(_LONGEST, min(e.size for e in segments) // 10) + 1):
        energy = sum(float(f @ f + b @ b) for f, b in zip(forward, backward, strict=True))
        if energy <= 1e-20 * n * power:
            break
        k = -2.0 * sum(float(f @ b) for f, b in zip(forward, backward, strict=True)) / energy
        a = np.append(a, 0.0) + k * np.append(a, 0.0)[::-1]
        power *= 1.0 - k * k
        if power <= 0.0:
            break
        pairs = [(f + k * b, b + k * f) for f, b in zip(forward, backward, strict=True)]
        forward, backward = [f[1:] for f, _ in pairs], [b[:-1] for _, b in pairs]
        criterion = n * math.log(power) + order * math.log(n)
        if criterion < least:
            best, least = a, criterion
    return best
