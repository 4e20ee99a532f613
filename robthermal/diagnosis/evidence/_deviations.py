"""Standard deviations of sizes where the model is not exact."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..fit import Refit, Whitened
from ._blocks import alone, block_sums

Array = NDArray[np.float64]
_ALONG = 2e-3  # of the power of a remainder, along any one unknown, where a finer network takes up most of it
_ALONG_PLAIN = 0.25  # where it does not
_CHANCE = 2.0  # standard deviations of the power of white noise, which are no remainder


def deviations(fit: Refit, network: Refit | None, columns: Sequence[int]) -> Array:
    """Standard deviations of unknowns in the optimizer's coordinates that include the remainder.

    Scatter is the larger of the model's and that of the scores of blocks, which a remainder makes larger than noise
    would (White 1980; blocks as clusters). Neither knows of a remainder that follows the inputs as the effect does:
    a fit leaves nothing along its unknowns, and a longer record repeats it. Of its power a fixed part is taken to lie
    along each unknown, however long the record.

    Parameters
    ----------
    fit : Refit
        Fit with the unknowns.
    network : Refit, optional
        The same with the network taken to be right: what it leaves is the remainder. None where a remainder was there
        on the days of reference too, and moves no change between days.
    columns : sequence of int
        Places of the unknowns.

    Returns
    -------
    ndarray, shape (len(columns),)
    """
    along = 0.0 if network is None else _power_of_remainder(fit, network) * (
        _ALONG if fit.structure.coarse else _ALONG_PLAIN)
    return np.array([math.hypot(_scatter(fit, column, own := alone(fit, column)), _shift(own, along))
                     for column in columns])


def _scatter(fit: Refit, column: int, own: Array) -> float:
    """Of noise and of what differs between blocks of the records."""
    power = float(own @ own)
    scores = block_sums(fit, own * fit.z)
    free = scores.size / max(scores.size - 1, 1)
    model = math.sqrt(max(float(fit.covariance[column, column]), 0.0))
    return max(model, math.sqrt(free * float(np.sum(scores**2))) / power if power > 0 else 0.0)


def _shift(own: Array, along: float) -> float:
    """Of this power of a remainder along an unknown, the same in all blocks."""
    power = float(own @ own)
    return math.sqrt(along / power) if power > 0 else 0.0


def _power_of_remainder(fit: Refit, network: Refit) -> float:
    """Sum of squares beyond declared noise that the network as it is leaves, under the filters of the fit."""
    n = fit.n_readings
    left = Whitened(network.structure, fit.whiteners).residual(network.v)[:n]
    raised = sum(len(path.one.readings) * (1.0 - max(fit.levels.noise.get(name, 1.0), 1.0) ** -2)
                 for path in fit.records for name in path.one.sensors)  # levels grow with what they cannot explain
    return max(float(left @ left) - (n - raised) - _CHANCE * math.sqrt(2.0 * n), 0.0)
