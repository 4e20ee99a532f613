"""Exact sampling of linear systems with held inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import expm

from ._modules import Array


def held(A: Array, B: Array, time: float) -> tuple[Array, Array]:
    """Exact A_d, B_d after a time with held inputs.

    Parameters
    ----------
    A, B : ndarray
        Continuous state space [1/s].
    time : float
        How long the inputs are held [s].
    """
    n, m = B.shape
    both = np.zeros((n + m, n + m))
    both[:n] = np.hstack([A, B]) * time
    exact = expm(both)[:n]
    return exact[:, :n], exact[:, n:]


def delayed(A: Array, B: Array, C: Array, delays: Sequence[float], h: float) -> tuple[Array, Array, Array]:
    """Exact sampled A, B, C of a continuous system with held inputs, whose outputs are delayed.

    Parameters
    ----------
    A, B, C : ndarray
        Continuous state space [1/s].
    delays : sequence of float
        Pure delay of every output [s].
    h : float
        Time between two samples [s].
    """
    A_d, B_d = held(A, B, h)
    n, m = B.shape
    whole = [int(np.ceil(delay / h - 1e-12)) for delay in delays]
    size = n + sum(whole)
    Phi, Gamma, out = np.zeros((size, size)), np.zeros((size, m)), np.zeros((len(C), size))
    Phi[:n, :n], Gamma[:n] = A_d, B_d
    first = n
    for row, (count, delay) in enumerate(zip(whole, delays, strict=True)):
        if not count:
            out[row, :n] = C[row]
            continue
        part, drive = held(A, B, count * h - delay)
        Phi[first, :n], Gamma[first] = C[row] @ part, C[row] @ drive
        for later in range(first + 1, first + count):
            Phi[later, later - 1] = 1.0
        out[row, first + count - 1] = 1.0
        first += count
    return Phi, Gamma, out
