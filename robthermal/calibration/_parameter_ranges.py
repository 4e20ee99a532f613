"""Simultaneous ranges of parameters: how many standard deviations wide, for all of them at once."""

from __future__ import annotations

import math
from typing import Literal

import scipy

from ..errors import InputError

Set = Literal["ellipsoid", "box"]
SETS = ("ellipsoid", "box")


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

    Examples
    --------
    >>> round(factor("ellipsoid", 3, math.inf, 0.95) ** 2, 3), round(factor("box", 1, math.inf, 0.95), 3)
    (7.815, 1.96)
    """
    if not count:
        return 0.0
    if shape == "box":
        return float(scipy.special.stdtrit(degrees_of_freedom, 1.0 - (1.0 - confidence) / (2 * count)))
    if math.isinf(degrees_of_freedom):  # p F_{p,∞} is χ²_p
        return math.sqrt(float(scipy.special.chdtri(count, 1.0 - confidence)))
    return math.sqrt(count * float(scipy.special.fdtri(count, degrees_of_freedom, confidence)))


def check_request(confidence: float, shape: str) -> None:
    """Refuse an impossible confidence and an unknown set."""
    number = not isinstance(confidence, bool) and isinstance(confidence, int | float)
    if not number or not 0.0 < confidence < 1.0:
        raise InputError(f"confidence is {confidence!r}", where="argument confidence",
                         expected="a probability between 0 and 1, for example 0.95")
    if shape not in SETS:
        raise InputError(f"set is {shape!r}", where="argument set", expected="one of " + ", ".join(SETS))
