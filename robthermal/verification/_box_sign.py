"""Polynomials in several variables on a box: positive where all Bernstein coefficients are, exactly.

On [0, 1]^k a polynomial is a convex combination of its Bernstein coefficients, which at the corners are its values.
Where they do not decide, the box is halved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import comb
from typing import Any

import numpy as np
from flint import fmpq

from ._fields import Interval

_MOST = 3_000  # boxes
Terms = Mapping[tuple[int, ...], fmpq]  # exponents to coefficient
Tensor = np.ndarray[Any, Any]  # of rational numbers


def positive_on(terms: Terms, box: Sequence[Interval], *, strict: bool = True) -> bool:
    """Prove a polynomial positive (or, not strict, nowhere negative) on a box; false also where undecided."""
    tensor = _tensor(terms, len(box))
    waiting = [tuple(box)]
    for _ in range(_MOST):
        if not waiting:
            return True
        part = waiting.pop()
        found = _bernstein(tensor, part)
        if _holds(found, strict):
            continue
        corners = found[np.ix_(*([0, size - 1] if size > 1 else [0] for size in found.shape))]
        if not _holds(corners, strict):
            return False
        waiting += _halves(part, found)
    return False


def _holds(values: Tensor, strict: bool) -> bool:
    least = min(values.flat)
    return bool(least > 0 or (least == 0 and not strict))


def _tensor(terms: Terms, count: int) -> Tensor:
    degrees = [max((powers[axis] for powers in terms), default=0) for axis in range(count)]
    tensor = np.full([degree + 1 for degree in degrees], fmpq(0), dtype=object)
    for powers, value in terms.items():
        tensor[tuple(powers)] = value
    return tensor


def _bernstein(tensor: Tensor, box: Sequence[Interval]) -> Tensor:
    """Return the Bernstein coefficients on a box, one axis at a time."""
    for axis, interval in enumerate(box):
        rows = _basis_change(tensor.shape[axis] - 1, interval)
        moved = np.moveaxis(tensor, axis, 0)
        changed = [sum((factor * part for factor, part in zip(row, moved, strict=True)), 0 * moved[0]) for row in rows]
        tensor = np.moveaxis(np.array(changed, dtype=object).reshape(-1, *moved.shape[1:]), 0, axis)
    return tensor


def _basis_change(degree: int, interval: Interval) -> list[list[fmpq]]:
    """Return the matrix from coefficients of x^m to Bernstein coefficients on an interval; one row for a point."""
    low, width = interval[0], interval[1] - interval[0]
    if width == 0:
        return [[low**m for m in range(degree + 1)]]
    return [[sum((fmpq(comb(j, k), comb(degree, k)) * comb(m, k) * low ** (m - k) * width**k
                  for k in range(min(j, m) + 1)), fmpq(0)) for m in range(degree + 1)] for j in range(degree + 1)]


def _halves(box: tuple[Interval, ...], found: Tensor) -> list[tuple[Interval, ...]]:
    """Cut the box across the variable along which the coefficients differ most."""
    spread = [max((abs(value) for value in np.diff(found, axis=axis).flat), default=fmpq(-1))
              for axis in range(len(box))]
    axis = spread.index(max(spread))
    low, high = box[axis]
    middle = (low + high) / 2
    return [(*box[:axis], half, *box[axis + 1:]) for half in ((low, middle), (middle, high))]
