"""Decay rate of V = eᵀEe: the largest eigenvalue of the symmetric part over the vertices of the box."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import ArpackError, eigsh

from ._jacobian import BoxJacobian

_DENSE = 300
_ENTRIES = 1_000_000  # of the matrices whose eigenvalues are computed at once
_EVERY = 4096  # joint vertices; beyond, the worst one is searched block by block


def energy_rate(box: BoxJacobian) -> float:
    """Largest rate with sym J <= -rate E at the vertices [1/s]; negative when there is none.

    Parameters
    ----------
    box : BoxJacobian
        Jacobian of the network over the box.

    Returns
    -------
    float
    """
    scale = 1 / np.sqrt(box.capacity)
    base = diags_array(scale) @ (0.5 * (box.base + box.base.T)) @ diags_array(scale)
    blocks = [_scaled(block.a, block.b, block.vertices, scale) for block in box.blocks]
    options = [_undominated(values) for _, values in blocks]
    if len(scale) > _DENSE:
        return _sparse_rate(csc_array(base), [nodes for nodes, _ in blocks], options)
    dense = base.toarray()
    if np.prod([len(o) for o in options], dtype=float) <= _EVERY:
        worst = _largest(dense, blocks, list(product(*options)))
    else:
        worst = _search(dense, blocks, options)
    return -worst


def _scaled(a: int, b: int, vertices: np.ndarray, scale: np.ndarray) -> tuple[list[int], np.ndarray]:
    """Nodes of a block and its scaled symmetric parts."""
    nodes = [a] if b < 0 else [a, b]
    symmetric = 0.5 * (vertices + vertices.transpose(0, 2, 1))
    if b < 0:
        symmetric = vertices[:, :1, :1]
    return nodes, symmetric * np.outer(scale[nodes], scale[nodes])


def _undominated(values: np.ndarray) -> list[np.ndarray]:
    """Vertices that no other vertex exceeds in every direction."""
    values = np.unique(values, axis=0)
    keep: list[np.ndarray] = []
    for i, M in enumerate(values):
        others = np.delete(values, i, axis=0)
        if not len(others) or np.linalg.eigvalsh(others - M)[:, 0].max() < 0:
            keep.append(M)
    return keep


def _largest(dense: np.ndarray, blocks: list, choices: list) -> float:
    """Largest eigenvalue of all choices of vertices, many matrices at a time."""
    worst, many = -np.inf, max(1, _ENTRIES // dense.size)
    for first in range(0, len(choices), many):
        some = choices[first:first + many]
        M = np.repeat(dense[None], len(some), axis=0)
        for k, (nodes, _) in enumerate(blocks):
            M[(slice(None), *np.ix_(nodes, nodes))] += np.array([choice[k] for choice in some])
        worst = max(worst, float(np.linalg.eigvalsh(M)[:, -1].max()))
    return worst


def _top(dense: np.ndarray, blocks: list, choice: tuple) -> float:
    M = dense.copy()
    for (nodes, _), block in zip(blocks, choice, strict=True):
        M[np.ix_(nodes, nodes)] += block
    n = len(M)
    return float(eigh(M, eigvals_only=True, subset_by_index=[n - 1, n - 1])[0])


def _search(dense: np.ndarray, blocks: list, options: list) -> float:
    """Coordinate ascent from every block's first and last vertex: a lower bound of the worst case, only to search."""
    worst = -np.inf
    for start in (0, -1):
        choice = [o[start] for o in options]
        value = _top(dense, blocks, tuple(choice))
        for _ in range(4):
            before = value
            for i, option in enumerate(options):
                trials = [_top(dense, blocks, (*choice[:i], o, *choice[i + 1:])) for o in option]
                choice[i], value = option[int(np.argmax(trials))], max(trials)
            if value <= before + 1e-15:
                break
        worst = max(worst, value)
    return worst


def _sparse_rate(base: csc_array, nodes: list[list[int]], options: list) -> float:
    """For large networks: every block at the vertex with the largest eigenvalue, then Lanczos near zero."""
    rows, cols, data = [], [], []
    for own, option in zip(nodes, options, strict=True):
        block = max(option, key=lambda M: float(np.linalg.eigvalsh(M)[-1]))
        for i, row in enumerate(own):
            for j, col in enumerate(own):
                rows.append(row)
                cols.append(col)
                data.append(block[i, j])
    M = csc_array(base + coo_array((data, (rows, cols)), shape=base.shape))
    try:
        return -float(eigsh(M, k=1, sigma=1e-9, which="LM", return_eigenvectors=False)[0])
    except (ArpackError, RuntimeError):
        return -np.inf
