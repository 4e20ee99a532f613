"""Where the nodes of a network stand in a drawing: distances on paper like distances along the links."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from .._arrays import Array

_APART = 1.35  # distance of two linked nodes [inch]
_ROUNDS = 150
_GAP = 0.16  # between two boxes [inch]


def positions(sizes: Array, edges: Sequence[tuple[int, int]]) -> Array:
    """Centers of boxes that do not overlap, the long side of the drawing lying.

    Classical scaling gives the start, stress majorization the shape (Gansner, Koren and North 2005), and boxes that
    overlap are pushed apart.

    Parameters
    ----------
    sizes : ndarray, shape (n, 2)
        Width and height of every box [inch].
    edges : sequence of (int, int)
        Pairs of linked boxes.

    Returns
    -------
    ndarray, shape (n, 2)
        [inch]; the same for the same network.
    """
    n = len(sizes)
    if n == 1:
        return np.zeros((1, 2))
    first, second = np.array(edges, dtype=int).reshape(-1, 2).T
    graph = scipy.sparse.csr_array((np.ones(len(first)), (first, second)), shape=(n, n))
    steps = scipy.sparse.csgraph.shortest_path(graph, directed=False, unweighted=True, method="D")
    known = np.isfinite(steps)
    steps[~known] = steps[known].max() + 1.0
    return _separated(_relaxed(_scaled(steps), steps) * _APART, sizes)


def _scaled(steps: Array) -> Array:
    """Classical scaling: the plane that keeps the distances best; a little noise parts what it puts on one point."""
    n = len(steps)
    center = np.eye(n) - 1.0 / n
    values, vectors = np.linalg.eigh(-0.5 * center @ steps**2 @ center)
    plane = vectors[:, -2:][:, ::-1] * np.sqrt(np.maximum(values[-2:][::-1], 0.0))
    plane = plane * np.where(plane[np.abs(plane).argmax(axis=0), [0, 1]] < 0, -1.0, 1.0)  # the sign of vectors is free
    return np.asarray(plane + 0.05 * np.random.default_rng(0).standard_normal((n, 2)))


def _relaxed(start: Array, steps: Array) -> Array:
    """Smallest sum of ((distance - steps)/steps)², by majorization."""
    weights = np.zeros_like(steps)
    off = ~np.eye(len(steps), dtype=bool)
    weights[off] = steps[off] ** -2.0
    laplacian = np.diag(weights.sum(axis=1)) - weights
    inverse = np.linalg.pinv(laplacian)
    plane = start
    for _ in range(_ROUNDS):
        distance = np.linalg.norm(plane[:, None] - plane[None], axis=2)
        ratio = np.zeros_like(steps)
        ratio[off] = weights[off] * steps[off] / np.maximum(distance[off], 1e-9)
        plane = inverse @ ((np.diag(ratio.sum(axis=1)) - ratio) @ plane)
    turn = np.linalg.svd(plane - plane.mean(axis=0), full_matrices=False)[2]
    return np.asarray(plane @ turn.T)


def _separated(plane: Array, sizes: Array) -> Array:
    """Boxes moved until none overlaps: two that do go apart along the side on which they overlap less."""
    placed = plane.copy()
    room = (sizes[:, None] + sizes[None]) / 2 + _GAP
    for _ in range(_ROUNDS):
        missing = room - np.abs(placed[:, None] - placed[None])
        pairs = [(i, j) for i, j in np.argwhere(np.all(missing > 1e-9, axis=2)) if i < j]
        if not pairs:
            break
        for i, j in pairs:
            lack = room[i, j] - np.abs(placed[i] - placed[j])
            if np.all(lack > 0):
                side = int(lack.argmin())
                step = (0.5 * lack[side] + 1e-6) * (1.0 if placed[i, side] >= placed[j, side] else -1.0)
                placed[i, side] += step
                placed[j, side] -= step
    return placed
