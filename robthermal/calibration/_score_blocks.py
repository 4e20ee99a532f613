"""Do the residuals pull the estimates more than their autoregression accounts for? Tested over blocks of records."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from .._arrays import Floats
from ._autoregression import Correlation

BLOCKS = 10  # of all records together: long against the correlation of residuals, yet enough to estimate a variance
_LEVEL = 0.01  # chance of a scale above 1 if the autoregression is right
_ZERO = 1e-9  # relative eigenvalue that is rounding


def blocks_of(lengths: Sequence[int]) -> list[list[slice]]:
    """Consecutive blocks of every record, about `BLOCKS` together, at least one each."""
    total = sum(lengths)
    out = []
    for n in lengths:
        edges = np.linspace(0, n, max(1, round(BLOCKS * n / total)) + 1).astype(int).tolist()
        out.append([slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True)])
    return out


def block_scores(psi: Floats, J: Floats, correlation: Correlation, blocks: Sequence[slice]) -> tuple[Floats, Floats]:
    """Sum over blocks of s sᵀ, s = Jᵀψ of the block, and of what the autoregression expects of it, both (p, p).

    Parameters
    ----------
    psi : ndarray, shape (n, n_sensors)
        Weighted residuals of one record (their score under a robust loss).
    J : ndarray, shape (n, n_sensors, p)
        Derivative of the weighted residuals, initial temperatures answered.
    correlation : Correlation
        Autoregression of the residuals.
    blocks : sequence of slice
        Samples of each block.
    """
    scores = np.array([np.einsum("ks,ksi->i", psi[part], J[part]) for part in blocks])
    expected = sum((correlation.meat(J[part]) for part in blocks), np.zeros((J.shape[2], J.shape[2])))
    return scores.T @ scores, expected


def covariance_scale(found: Floats, expected: Floats, count: int) -> float:
    """Mean ratio of found to expected variance of the scores if it is beyond chance, else 1.

    The fit makes the sum of all block scores vanish, which takes one of the `count` degrees of freedom of each
    direction; the directions count alike, whatever their units.
    """
    if count < 2:
        return 1.0
    values, vectors = np.linalg.eigh(expected)
    kept = values > _ZERO * max(values[-1], 0.0)
    if not kept.any():
        return 1.0
    root = vectors[:, kept] / np.sqrt(values[kept])
    ratio = float(np.trace(root.T @ found @ root)) / int(kept.sum()) * count / (count - 1)
    return ratio if ratio > scipy.special.chdtri(count - 1, _LEVEL) / (count - 1) else 1.0
