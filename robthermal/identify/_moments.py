"""Sums over a sliding window of a sequence times fixed functions, by one matrix product."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import as_strided

from .._arrays import Array

BLOCK = 16  # bins that share one product with the banded matrix


class Moments:
    """Sums over windows of a sequence times fixed functions.

    Parameters
    ----------
    functions : ndarray, shape (p, m)
        Functions of the offset within a window [-].
    """

    def __init__(self, functions: Array):
        self.count, m = functions.shape
        banded = np.zeros((self.count, BLOCK, BLOCK + m - 1))
        for j in range(BLOCK):
            banded[:, j, j : j + m] = functions
        self._banded = banded.reshape(-1, BLOCK + m - 1)

    def __call__(self, blocks: Array, out: Array) -> Array:
        """Sums (p, B), in the order that `ordered` undoes.

        Parameters
        ----------
        blocks : ndarray
            Of the sequence, as `in_blocks` leaves it.
        out : ndarray, shape (p, B)
            Contiguous, of the same type.
        """
        np.matmul(self._banded, blocks.view(float), out=out.view(float).reshape(len(self._banded), -1))
        return out


def in_blocks(sequence: Array, out: Array) -> Array:
    """Neighborhoods of blocks of bins, as columns that overlap.

    Parameters
    ----------
    sequence : ndarray, shape (B + m - 1,)
        Contiguous, B a multiple of `BLOCK`.
    out : ndarray, shape (BLOCK + m - 1, B/BLOCK)
        Of the same type.
    """
    strides = (sequence.itemsize, BLOCK * sequence.itemsize)
    np.copyto(out, as_strided(sequence, out.shape, strides, writeable=False))
    return out


def ordered(values: Array, count: int) -> Array:
    """Bins in their order; `Moments` leaves bin j of block k at place j (B/BLOCK) + k.

    Parameters
    ----------
    values : ndarray, shape (..., B)
        What was computed from moments.
    count : int
        Bins to keep.
    """
    shape = values.shape[:-1]
    return np.ascontiguousarray(values.reshape(*shape, BLOCK, -1).swapaxes(-1, -2)).reshape(*shape, -1)[..., :count]
