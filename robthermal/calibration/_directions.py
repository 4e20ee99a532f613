"""Directions the data do not determine, in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from ..fitting import Ranges

_VISIBLE = 0.1  # components below this part of the largest are not mentioned


def in_words(ranges: Ranges, directions: tuple[Floats, ...]) -> tuple[str, ...]:
    """One sentence per undetermined direction (orthonormal, in units of `Ranges.unit`)."""
    if not directions:
        return ()
    return tuple(_sentence(ranges, direction) for direction in _sparse(np.array(directions)))


def named(ranges: Ranges, directions: tuple[Floats, ...]) -> tuple[str, ...]:
    """Names of the parameters with visible weight in some direction."""
    return tuple(name for name, seen in zip(ranges.names, weights(ranges, directions), strict=True) if seen)


def weights(ranges: Ranges, directions: tuple[Floats, ...]) -> NDArray[np.bool_]:
    """Which parameters (p,) have visible weight in some direction, written with as few parameters as possible."""
    if not directions:
        return np.zeros(len(ranges.names), np.bool_)
    return np.asarray((np.abs(_sparse(np.array(directions))) > _VISIBLE).any(axis=0))


def _sparse(basis: Floats) -> Floats:
    """Basis of the same space with as many zeros as elimination gives: each direction then speaks of few parameters."""
    B = basis.copy()
    for row in range(len(B)):
        rest = np.abs(B[row:])
        below, column = divmod(int(rest.argmax()), rest.shape[1])
        B[[row, row + below]] = B[[row + below, row]]
        B[row] /= B[row, column]
        others = np.arange(len(B)) != row
        B[others] -= np.outer(B[others, column], B[row])
    return B / np.abs(B).max(axis=1, keepdims=True)


def _sentence(ranges: Ranges, direction: Floats) -> str:
    direction = direction / direction[np.abs(direction).argmax()]
    seen = np.flatnonzero(np.abs(direction) > _VISIBLE).tolist()
    names = [ranges.names[i] for i in seen]
    if len(names) == 1:
        return f"{names[0]} is not determined"
    if ranges.logarithmic[seen].all():
        parts = direction[seen]
        listed = f"{', '.join(names[:-1])} and {names[-1]}"
        if np.all(np.abs(parts - 1.0) < 0.1):
            what = "their ratio" if len(names) == 2 else "ratios: a common factor is open"
            return f"{listed} are determined only as {what}"
        if len(names) == 2 and abs(parts.sum()) < 0.1:
            return f"{listed} are determined only as their product"
    moves = ", ".join(f"{name} {_move(ranges, i, direction[i])}" for i, name in zip(seen, names, strict=True))
    return f"only a combination is determined; these can move together: {moves}"


def _move(ranges: Ranges, i: int, part: float) -> str:
    """A tenth of the direction."""
    if ranges.logarithmic[i]:
        return f"{100 * (np.exp(0.1 * part) - 1):+.1f} %"
    return f"{0.1 * part * ranges.unit[i]:+.3g}"
