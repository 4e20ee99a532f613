"""x(k+1) = A(k) x(k) + b(k) for many columns at once: in C where that was built, else without a loop over the samples.

Without C the samples are cut into blocks. All blocks go through their samples together, from 0; then the states at
their ends are passed on from block to block, and what they add within each is one product.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._library import functions

Array = NDArray[np.floating[Any]]
SOURCE, HEADERS = Path(__file__).with_suffix(".c"), ("_lanes.h",)


@cache
def compiled(folder: Path = SOURCE.parent, lanes: int | None = None) -> Callable[..., None] | None:
    """The compiled recursion by the library in `folder`; None where it was not built, or from another source.

    With vectors as wide as this processor has, or of so many `lanes`.
    """
    found = functions(SOURCE, HEADERS, folder, lanes, ("recursion",))
    if found is None:
        return None
    run: Any = found[0]
    run.restype, run.argtypes = None, [ctypes.c_int64] * 4 + [ctypes.c_void_p] * 3
    return run


def recursion(A: Array, b: Array, start: Array | None = None, out: Array | None = None) -> Array:
    """States of a linear time-varying recursion.

    Parameters
    ----------
    A : ndarray, shape (n, n_z, n_z)
        Transition of every step.
    b : ndarray, shape (n, n_z, m)
        What every step adds.
    start : ndarray, shape (n_z, m), optional
        State before the first step; default 0.
    out : ndarray, shape (n + 1, n_z, m), optional
        Where the states are written; rows side by side.

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
    if A.shape != (n, n_z, n_z):
        raise ValueError(f"transitions {A.shape} for {b.shape}")
    x = np.empty((n + 1, n_z, m)) if out is None else out
    if x.shape != (n + 1, n_z, m) or x.dtype != float or not x.flags.c_contiguous:
        raise ValueError(f"states {x.shape} for {b.shape}")
    x[0] = 0.0 if start is None else start
    run = compiled()
    if run is not None and A.dtype == b.dtype == float:
        side_by_side = A.strides[1:] == (8 * n_z, 8) and A.strides[0] in (0, 8 * n_z * n_z)  # or one for all
        held, pushed = A if side_by_side else np.ascontiguousarray(A), np.ascontiguousarray(b)
        run(n, n_z, m, held.strides[0] // 8, held.ctypes.data, pushed.ctypes.data, x.ctypes.data)
    elif n:
        _in_blocks(A, b, x)
    return x


def _in_blocks(A: Array, b: Array, x: Array) -> None:
    """Fill x (n + 1, n_z, m) after its first."""
    n, n_z, m = b.shape
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
