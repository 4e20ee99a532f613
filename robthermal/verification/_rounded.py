"""Positive definiteness by one Cholesky factorisation in doubles, with a bound for every rounding error.

If the factorisation of B = A - c I runs to its end, its factor satisfies R'R = B + D with
|D| <= γ |R'||R|, γ = (n+1)u/(1-(n+1)u), in any order of summation (Higham, Accuracy and Stability, theorem 10.3). The
norm of |R'||R| is at most the trace of R'R, so |D| <= γ/(1-γ) trace B: with a larger c, A is positive definite
(Rump, Verification of positive definiteness, BIT 46, 2006). What the doubles of A leave out is added to c.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb_mat
from numpy.typing import NDArray

Array = NDArray[np.float64]
_UNIT = 2.0**-53
_SAFETY = 1 + 2.0**-20  # covers the roundings of the bounds themselves, at most a few hundred
_TINY = 1e-290  # far above all that underflow can lose in a matrix whose diagonal is near 1
_LARGEST = 10_000  # rows: n u stays far below one


@dataclass(frozen=True)
class Rounded:
    """A symmetric matrix in doubles, with a bound of the error of every entry."""

    middle: Array
    radius: Array


def rounded(matrix: arb_mat) -> Rounded:
    """Return the doubles nearest to the midpoints, and how far the balls reach from them."""
    entries = matrix.tolist()
    middle = np.array([[float(entry.mid()) for entry in row] for row in entries])
    balls = np.array([[float(entry.rad()) for entry in row] for row in entries])
    return Rounded(middle, (balls + _UNIT * np.abs(middle)) * _SAFETY + _TINY)


def add(parts: Sequence[Rounded]) -> Rounded:
    """Return the sum, with the roundings of the additions in its radius."""
    middle = np.sum([part.middle for part in parts], axis=0)
    size = np.sum([np.abs(part.middle) for part in parts], axis=0)
    radius = np.sum([part.radius for part in parts], axis=0)
    return Rounded(middle, (radius + len(parts) * _UNIT * size) * _SAFETY)


def is_positive_rounded(matrix: Rounded) -> bool:
    """Prove that every symmetric matrix within the radius is positive definite; False says nothing."""
    n = len(matrix.middle)
    diagonal = np.diag(matrix.middle)
    if n > _LARGEST or not np.all(np.isfinite(matrix.middle)) or not np.all(np.isfinite(matrix.radius)):
        return False
    if not np.all((diagonal > 1e-200) & (diagonal < 1e200)):
        return False
    scale = np.ldexp(1.0, -np.round(np.log2(diagonal) / 2).astype(int))  # powers of two: exact
    A = _mirrored(matrix.middle) * scale[:, None] * scale
    error = float(np.max(np.sum(_mirrored(matrix.radius) * scale[:, None] * scale, axis=1)))
    trace = float(np.sum(np.diag(A)))
    shift = (error + 4 * (n + 2) * _UNIT * trace) * _SAFETY + _TINY  # twice what the theorem asks, and the subtraction
    try:
        factor = np.linalg.cholesky(A - shift * np.eye(n))
    except np.linalg.LinAlgError:
        return False
    return bool(np.all(np.isfinite(factor)) and np.all(np.diag(factor) > 0))


def _mirrored(matrix: Array) -> Array:
    """Return the symmetric matrix of the lower triangle."""
    return np.tril(matrix) + np.tril(matrix, -1).T
