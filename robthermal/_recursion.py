"""x(k+1) = A(k) x(k) + b(k) for many columns at once, without a loop over the samples.

The samples are cut into blocks. All blocks go through their samples together, from 0; then the states at their ends
are passed on from block to block, and what they add within each is one product.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]


def recursion(A: Array, b: Array, start: Array | None = None) -> Array:
    """States of a linear time-varying recursion.

    Parameters
    ----------
    A : ndarray, shape (n, n_z, n_z)
        Transition of every step.
    b : ndarray, shape (n, n_z, m)
        What every step adds.
    start : ndarray, shape (n_z, m), optional
        State before the first step; default 0.

    Returns
    -------
    ndarray, shape (n + 1, n_z, m)
        Before every step, and after the last.

    Examples
    --------
    >>> import numpy as np
    >>> recursion(np.full((3, 1, 1), 0.5), np.ones((3, 1, 1)))[:, 0, 0].tolist()
    [0.0, 1.0, 1.5, 1.75]
    """
    n, n_z, m = b.shape
    x = np.zeros((n + 1, n_z, m))
    if start is not None:
        x[0] = start
    if n == 0:
        return x
    length = max(1, int(np.sqrt(n / 2)))
    blocks = n // length
    whole = blocks * length
    each = A[:whole].reshape(blocks, length, n_z, n_z)
    within = x[1:whole + 1].reshape(blocks, length, n_z, m)  # a view: the states after every step
    within[:] = b[:whole].reshape(within.shape)
    passed = np.empty((blocks, length, n_z, n_z))
    passed[:, 0] = each[:, 0]
    for j in range(1, length):
        within[:, j] += each[:, j] @ within[:, j - 1]
        np.matmul(each[:, j], passed[:, j - 1], out=passed[:, j])
    before = np.empty((blocks, n_z, m))
    before[0] = x[0]
    for k in range(1, blocks):
        before[k] = within[k - 1, -1] + passed[k - 1, -1] @ before[k - 1]
    within += (passed.reshape(blocks, length * n_z, n_z) @ before).reshape(within.shape)
    for k in range(whole, n):
        x[k + 1] = A[k] @ x[k] + b[k]
    return x
