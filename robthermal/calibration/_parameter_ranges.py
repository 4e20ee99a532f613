"""Simultaneous ranges of calibrated parameters: the box around their confidence ellipsoid."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.stats import f as f_distribution
from scipy.stats import t as t_distribution

from .._arrays import Floats
from ..errors import InputError
from ._outcomes import CalibrationCode

if TYPE_CHECKING:
    from ._estimates import Estimates

Set = Literal["ellipsoid", "box"]
SETS = ("ellipsoid", "box")


def ranges_of(fit: Estimates, confidence: float, shape: str) -> tuple[Floats, Floats]:
    """Lower and upper ends (p,) of the ranges, in the unit of each parameter.

    In the coordinates q of the optimizer (logarithms of positive parameters) the ends are q̂ ± c s, s the standard
    deviation, which leaves positive parameters positive; then cut at the bounds. Parameters that neither data nor prior
    determine have their bounds.
    """
    _check(fit, confidence, shape)
    values = np.array(list(fit.parameters.values()))
    slopes = np.where(fit.logarithmic, values, 1.0)
    reach = factor(shape, int(np.sum(~fit.bounded)), fit.degrees_of_freedom, confidence) * np.sqrt(
        np.diag(fit.covariance) * fit.covariance_scale) / slopes
    with np.errstate(over="ignore"):  # beyond every bound, at which it is cut
        low, high = (np.where(fit.logarithmic, values * np.exp(np.where(fit.logarithmic, side, 0.0)), values + side)
                     for side in (-reach, reach))
    low, high = np.clip(low, fit.lower, fit.upper), np.clip(high, fit.lower, fit.upper)
    return np.where(fit.bounded, fit.lower, low), np.where(fit.bounded, fit.upper, high)


def factor(shape: str, count: int, degrees_of_freedom: float, confidence: float) -> float:
    """Half-width of a range in standard deviations.

    Parameters
    ----------
    shape : {"ellipsoid", "box"}
        Box around the ellipsoid, √(p F_{p,ν}); or simultaneous intervals by Bonferroni's inequality, t_ν(1 - α/2p).
    count : int
        Number p of parameters that are estimated.
    degrees_of_freedom : float
        Degrees of freedom ν of the estimated noise; infinite if it is known.
    confidence : float
        Probability 1 - α that all ranges hold at once.
    """
    if not count:
        return 0.0
    if shape == "box":
        return float(t_distribution.ppf(1.0 - (1.0 - confidence) / (2 * count), degrees_of_freedom))
    return math.sqrt(count * float(f_distribution.ppf(confidence, count, degrees_of_freedom)))


def _check(fit: Estimates, confidence: float, shape: str) -> None:
    number = not isinstance(confidence, bool) and isinstance(confidence, int | float)
    if not number or not 0.0 < confidence < 1.0:
        raise InputError(f"confidence is {confidence!r}", where="argument confidence",
                         expected="a probability between 0 and 1, for example 0.95")
    if shape not in SETS:
        raise InputError(f"set is {shape!r}", where="argument set", expected="one of " + ", ".join(SETS))
    if fit.outcome.code == CalibrationCode.NOT_CONVERGED.code:
        raise InputError("the calibration did not converge: its covariance is that of no estimate", where="fit.ranges",
                         remedy=f"{fit.outcome.text} Or give the certificate parameters= yourself.")
    if not np.isfinite(fit.covariance).all():
        raise InputError("the calibration has no covariance", where="fit.ranges",
                         remedy="Calibrate with data, or give parameters=.")
