"""Residual = measured − modelled: the one definition of its sign."""

from __future__ import annotations

from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]


@overload
def residual(measured: NDArray[np.floating[Any]], modelled: NDArray[np.floating[Any]]) -> Floats: ...


@overload
def residual(measured: Complex, modelled: Complex) -> Complex: ...


def residual(measured: NDArray[Any], modelled: NDArray[Any]) -> NDArray[Any]:
    """Measured minus modelled readings: a machine 1 K warmer than its model has residual +1 K.

    Parameters
    ----------
    measured : ndarray
        Readings of the sensors [K], or a measured frequency response.
    modelled : ndarray
        The model's answer at the same times or frequencies, in the same unit.
    """
    return measured - modelled
