r"""How far a model is from a record, beyond the noise of the sensors, and whether chance explains it.

With residuals e = measured − modelled, the excess is √(max(rms² − noise², 0)). Under the hypothesis that e is noise of
the stated size, n_eff rms² / noise² is nearly χ² with n_eff degrees of freedom, where n_eff = n / (1 + 2 Σ ρ_k²) and
ρ_k are the autocorrelations of e without its mean, up to the first that is not significant: correlated residuals count
as fewer (Satterthwaite's approximation of a sum of correlated squares).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..._distributions import chi2_sf

Array = NDArray[np.float64]
SIGNIFICANT = 1e-3  # p below it: noise does not explain the residual
_LEAST_NOISE = 1e-4  # K: the simulation's own truncation; nothing is known better


@dataclass(frozen=True)
class Misfit:
    """Residual of one sensor in one record, measured − modelled.

    Parameters
    ----------
    kind : str
        "train" or "validation".
    record, sensor : str
        Which reading it is about.
    mean, rms : float
        Of the residual [K].
    noise : float
        Standard deviation of the sensor [K].
    excess : float
        Root mean square beyond the noise [K].
    tolerance : float
        Largest excess that is accepted [K].
    p_value : float
        Chance of a residual as large, if it were noise.
    unit : str
        Unit of the residual: "K", or "V" of the voltage of a module.
    """

    kind: str
    record: str
    sensor: str
    mean: float
    rms: float
    noise: float
    excess: float
    tolerance: float
    p_value: float
    unit: str = "K"

    @property
    def significant(self) -> bool:
        """Whether noise does not explain the residual."""
        return self.p_value < SIGNIFICANT and self.excess > 0.0

    @property
    def beyond(self) -> bool:
        """Whether the residual exceeds both the noise and the tolerance."""
        return self.significant and self.excess > self.tolerance


def misfit(kind: str, record: str, sensor: str, residual: Array, noise: float, tolerance: float,
           unit: str = "K") -> Misfit:
    """Compare a residual with the noise.

    Parameters
    ----------
    kind, record, sensor : str
        What it is about.
    residual : ndarray, shape (n,)
        Measured − modelled [K]; samples that are not finite are left out.
    noise, tolerance : float
        As in `Misfit` [K or V].
    unit : str
        Unit of all of them.
    """
    e = residual[np.isfinite(residual)]
    power = float(np.mean(e**2)) if e.size else 0.0
    count = effective_count(e)
    p = float(chi2_sf(count * power / noise**2, count)) if e.size else 1.0
    return Misfit(kind, record, sensor, float(e.mean()) if e.size else 0.0, power**0.5, noise,
                  max(power - noise**2, 0.0) ** 0.5, tolerance, p, unit)


def effective_count(e: Array) -> float:
    """Independent samples that tell as much about the mean square as these do, at least 1."""
    n, centered = e.size, e - e.mean() if e.size else e
    power = float(centered @ centered)
    if n < 3 or not power:
        return max(float(n), 1.0)
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(centered, size)) ** 2
    rho = np.fft.irfft(spectrum, size)[1:n // 2 + 1] / power
    small = np.flatnonzero(np.abs(rho) < 2.0 / np.sqrt(n))
    significant = rho[:small[0]] if small.size else rho
    return max(n / (1.0 + 2.0 * float(significant @ significant)), 1.0)


def noise_of_readings(readings: Array) -> float:
    """Noise of a sensor that states none [K]: from second differences, in which slow temperatures cancel.

    Parameters
    ----------
    readings : ndarray, shape (n,)
        Measured readings of one sensor [K].
    """
    steps = np.diff(readings[np.isfinite(readings)], n=2)
    robust = 1.4826 * float(np.median(np.abs(steps))) if steps.size else 0.0
    spread = robust or (float(np.sqrt(np.mean(steps**2))) if steps.size else 0.0)
    return max(float(spread / np.sqrt(6.0)), _LEAST_NOISE)
