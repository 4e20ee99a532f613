"""One quadratic norm for all matrices base + Σ B_j D_j S_j at once, without looking at joint vertices.

D_j, small, lies in the hull of its own vertices. With a multiplier Π_j for each that makes [1; D]ᵀ Π_j [1; D] >= 0
there, Φ = diag(Q, 0) - Σ [S_j 0; 0 1]ᵀ Π_j [S_j 0; 0 1] and M = [base, B]: Φ - MᵀQM > 0 makes eᵀQe shrink under every
one of the matrices (docs/explanations/observers.md). There are as many inequalities as vertices of each D_j, not as
their products, and all but three are tiny. What is found is rounded and proven elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..conic import Inequality, inside

Array = NDArray[np.floating[Any]]
Channel = tuple[Array, Array, Array]


def multiplier_form(base: Array, channels: Sequence[Channel]) -> Array:
    """Q with Q <= I and Q - MᵀQM large at all vertices; a candidate, not even a positive one where none was found.

    Parameters
    ----------
    base : ndarray, shape (n, n)
        Part of M that all vertices share.
    channels : sequence of (B, S, vertices)
        (n, k), (k, n) and (n_vertices, k, k) of every D_j.
    """
    n = len(base)
    base, B, S, corners = base.copy(), [], [], []
    for inputs, outputs, vertices in channels:
        middle = 0.5 * (vertices.max(axis=0) + vertices.min(axis=0))
        size = np.abs(vertices - middle).max() or 1.0
        base += inputs @ middle @ outputs
        B.append(inputs * size)
        S.append(outputs)
        corners.append(np.unique((vertices - middle) / size, axis=0))
    width = sum(len(part) for part in S)
    M, form, slices, first = np.hstack([base, *B]), _symmetric(n), [], 0
    grown = np.zeros((len(form), n + width, n + width))
    grown[:, :n, :n] = form
    storage = [grown]
    for part in S:
        k = len(part)
        place = np.zeros((2 * k, n + width))
        place[:k, :n], place[k:, n + first:n + first + k] = part, np.eye(k)
        start = sum(len(block) for block in storage)
        storage.append(-(place.T @ _symmetric(2 * k) @ place))
        slices.append(slice(start, start + len(storage[-1])))
        first += k
    Phi = np.concatenate(storage)
    left = Phi.copy()
    left[:len(form)] -= M.T @ form @ M
    total = len(Phi)
    inequalities = [Inequality(np.zeros((n + width,) * 2), left, 1.0),
                    Inequality(np.zeros((n, n)), _filled(form, slice(0, len(form)), total), 1e-3),
                    Inequality(np.eye(n), _filled(-form, slice(0, len(form)), total))]
    for own, vertices in zip(slices, corners, strict=True):
        k = vertices.shape[1]
        for D in vertices:
            both = np.vstack([np.eye(k), D])
            inequalities.append(Inequality(np.zeros((k, k)), _filled(both.T @ _symmetric(2 * k) @ both, own, total)))
    return np.tensordot(inside(inequalities).x[:len(form)], form, 1)


def _filled(slopes: Array, own: slice, total: int) -> Array:
    out = np.zeros((total, *slopes.shape[1:]))
    out[own] = slopes
    return out


def _symmetric(n: int) -> Array:
    """Unit matrices of the symmetric ones, (n (n + 1)/2, n, n)."""
    i, j = np.triu_indices(n)
    units = np.zeros((len(i), n, n))
    units[np.arange(len(i)), i, j] = units[np.arange(len(i)), j, i] = 1.0
    return units
