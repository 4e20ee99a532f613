"""Which blocks of Delta can act on each other in a cycle: only those parts of M count for mu.

Draw an arrow from block j to block i where M_ij is not zero. det(I − M Delta) is the product of the determinants of the
strongly connected parts, so entries of M between two parts never matter. Master-slave coupling is of this form.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ._blocks import Complex, Structure


def cyclic_part(M: Complex, structure: Structure) -> Complex:
    """Drop what lies in no cycle of blocks, matrix by matrix.

    Parameters
    ----------
    M : ndarray, shape (n_f, p, m)
        Matrices; only entries that are exactly zero count as zero.
    structure : Structure
        Blocks of Delta.

    Returns
    -------
    ndarray, shape (n_f, p, m)
        The same mu.
    """
    blocks = structure.blocks
    used = M != 0
    arrows = np.array([[used[:, i.columns, j.rows].any((1, 2)) for j in blocks] for i in blocks])
    patterns, which = np.unique(np.moveaxis(arrows, 2, 0), axis=0, return_inverse=True)
    kept = np.array([_split(pattern, structure)[0] for pattern in patterns])
    return np.where(kept[which.ravel()], M, 0.0)


def cycles(M: Complex, structure: Structure) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Find the entries that lie in a cycle of blocks at some frequency.

    Parameters
    ----------
    M : ndarray, shape (n_f, p, m)
        Matrices of all frequencies.
    structure : Structure
        Blocks of Delta.

    Returns
    -------
    kept : ndarray of bool, shape (p, m)
        False between different parts: M with zeros there has the same mu.
    level : ndarray of int, shape (number of blocks,)
        How far downstream the part of a block lies: M_ij that is not zero is dropped only where level[i] > level[j].
    """
    used, blocks = (M != 0).any(0), structure.blocks
    return _split(np.array([[used[i.columns, j.rows].any() for j in blocks] for i in blocks]), structure)


def _split(arrows: NDArray[np.bool_], structure: Structure) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    part = connected_components(csr_array(arrows), connection="strong")[1]
    between = arrows & (part[:, None] != part[None, :])
    level = np.zeros(len(part), int)
    for _ in part:  # longest way down; between parts there are no cycles, so it ends
        below = np.where(between, level[None, :] + 1, 0).max(1)
        level = np.array([max(level[k].max(), below[k].max()) for k in (part == number for number in part)])
    m, p = structure.shape
    kept = np.ones((p, m), bool)
    for i, j in zip(*np.nonzero(between), strict=True):
        kept[structure.blocks[i].columns, structure.blocks[j].rows] = False
    return kept, level
