"""Exact steps of a linear system over a sample: of its states, and of their means over it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]


def exact_steps(Z: Array, means: Sequence[int]) -> tuple[Array, Array, Array]:
    """e^Z, φ₁(Z) and φ₂(Z); below them the rows of the means of some states, each sample's from 0.

    The mean over a sample has the next φ: that of e^{Zt} is φ₁, of t φ₁(Zt) is φ₂, of t² φ₂(Zt) is φ₃.

    Parameters
    ----------
    Z : ndarray, shape (k, n, n)
        Rates of the states times the sample time [-].
    means : sequence of int
        States whose means are states of their own; none, or m.

    Returns
    -------
    A : ndarray, shape (k, n + m, n + m)
        Transition over a sample.
    phi1, phi2 : ndarray, shape (k, n + m, n)
        What rates that are constant over the sample, and that grow linearly from 0, leave at its end.
    """
    one, phi = np.eye(Z.shape[1]), [expm(Z)]
    for factor in (1.0, 1.0, 0.5)[:3 if means else 2]:
        phi.append(np.linalg.solve(Z, phi[-1] - factor * one))
    if not means:
        return phi[0], phi[1], phi[2]
    A, phi1, phi2 = (np.concatenate([of_state, of_mean[:, means]], axis=1)
                     for of_state, of_mean in zip(phi[:3], phi[1:], strict=True))
    return np.concatenate([A, np.zeros((*A.shape[:2], len(means)))], axis=2), phi1, phi2


def over_steps(sampled: Array) -> Array:
    """Means over the sample before of what is linear between samples, (n, ...); of the first, itself.

    Parameters
    ----------
    sampled : ndarray, shape (n, ...)
        Values at the samples.
    """
    return np.concatenate([sampled[:1], 0.5 * (sampled[1:] + sampled[:-1])])
