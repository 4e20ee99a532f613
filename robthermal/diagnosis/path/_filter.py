"""The compiled filter `_filter.c` where it was built, by ctypes; else None, and numpy does the same in blocks.

Sizes, types and layout of every array are made here, for the other side trusts them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..._library import functions

Array = NDArray[np.float64]
SOURCE, HEADERS = Path(__file__).with_suffix(".c"), ("../../_lanes.h",)
_MOST = 64  # states or sensors, as in the source


class _Filter(ctypes.Structure):
    """`filter` of the source."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("count", "n", "ns")),
        *((name, ctypes.c_void_p) for name in ("A", "C")),
        *((name, ctypes.c_int64) for name in ("A_step", "C_step")),
        *((name, ctypes.c_void_p) for name in ("gains", "roots")),
    )


@dataclass(frozen=True)
class Compiled:
    """Functions of the library.

    Parameters
    ----------
    whiten : callable
        Of a filter, a number of columns, residuals and where the innovations go.
    filter : callable
        Of a filter whose gains and roots are filled, noise of the readings, what every sample adds, and the first
        covariance: says how many samples were filtered.
    """

    whiten: Callable[..., None]
    filter: Callable[..., int]

    def filtered(self, A: Array, C: Array, R: Array, Q: Array, P: Array) -> tuple[Array, Array]:
        """Gains and roots, as `_riccati.filtered`.

        Raises
        ------
        numpy.linalg.LinAlgError
            Where the covariance of an innovation is not positive definite.
        """
        n, (n_s, n_z) = len(A), C.shape[1:]
        if (A.shape, C.shape, R.shape, Q.shape, P.shape) != ((n, n_z, n_z), (n, n_s, n_z), (n, n_s, n_s),
                                                             (n, n_z, n_z), (n_z, n_z)):
            raise ValueError("matrices of a filter do not fit")
        A, C, R, Q = map(_side_by_side, (A, C, R, Q))
        gains, roots, start = np.empty((n, n_z, n_s)), np.empty((n, n_s, n_s)), np.ascontiguousarray(P, float)
        done = self.filter(ctypes.byref(_of(A, C, gains, roots)), R.ctypes.data, R.strides[0] // 8, Q.ctypes.data,
                           Q.strides[0] // 8, start.ctypes.data)
        if done < n:
            raise np.linalg.LinAlgError(f"covariance of the innovations of sample {done} is not positive definite")
        return gains, roots

    def whitened(self, by: tuple[Array, Array, Array, Array], r: Array, out: Array) -> None:
        """White innovations of residuals r (n, n_s, m), into `out` of the same shape, by A, C, gains and roots."""
        A, C, gains, roots = (_side_by_side(by[0]), _side_by_side(by[1]), *map(np.ascontiguousarray, by[2:]))
        n, (n_s, n_z) = len(A), C.shape[1:]
        if ((A.shape, C.shape, gains.shape, roots.shape, r.shape[:2]) != (
                (n, n_z, n_z), (n, n_s, n_z), (n, n_z, n_s), (n, n_s, n_s), (n, n_s))
                or out.shape != r.shape or out.dtype != float or not out.flags.c_contiguous):
            raise ValueError("residuals do not fit their filter")
        given = np.ascontiguousarray(r, float)
        self.whiten(ctypes.byref(_of(A, C, gains, roots)), r.shape[2], given.ctypes.data, out.ctypes.data)


@cache
def compiled(folder: Path = SOURCE.parent, lanes: int | None = None) -> Compiled | None:
    """The compiled filter by the library in `folder`; None where it was not built, or from another source.

    With vectors as wide as this processor has, or of so many `lanes`.
    """
    found = functions(SOURCE, HEADERS, folder, lanes, ("whitened", "filtered"))
    if found is None:
        return None
    whiten, filtered = found
    whiten.restype, whiten.argtypes = None, [ctypes.POINTER(_Filter), ctypes.c_int64, *[ctypes.c_void_p] * 2]
    filtered.restype = ctypes.c_int64
    filtered.argtypes = [ctypes.POINTER(_Filter), *[ctypes.c_void_p, ctypes.c_int64] * 2, ctypes.c_void_p]
    return Compiled(whiten, filtered)


def compiled_for(C: Array) -> Compiled | None:
    """The compiled filter, if it is for so many states and sensors.

    Parameters
    ----------
    C : ndarray, shape (n, n_s, n_z)
        Readings by states.
    """
    return compiled() if max(C.shape[1:]) <= _MOST else None


def _of(A: Array, C: Array, gains: Array, roots: Array) -> _Filter:
    n_z, n_s = gains.shape[1:]
    return _Filter(len(A), n_z, n_s, A.ctypes.data, C.ctypes.data, A.strides[0] // 8, C.strides[0] // 8,
                   gains.ctypes.data, roots.ctypes.data)


def _side_by_side(each: Array) -> Array:
    """Matrices (n, a, b) whose numbers lie side by side; one for all samples stays one."""
    a, b = each.shape[1:]
    lie = each.dtype == float and each.strides[1:] == (8 * b, 8) and each.strides[0] in (0, 8 * a * b)
    return each if lie else np.ascontiguousarray(each, float)
