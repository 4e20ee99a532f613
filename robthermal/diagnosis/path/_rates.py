"""Rates of the deviations along a record: derivatives of the heats, and the matrices of its samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...thermal import Equations
from ..effects import Response

Array = NDArray[np.float64]
Places = NDArray[np.intp]


def each(kinds: Array, kind: Places) -> Array:
    """The matrix of every sample; one in memory where all are the same."""
    return kinds[kind] if len(kinds) > 1 else np.broadcast_to(kinds[0], (len(kind), *kinds.shape[1:]))


def kinds_of(each: Array, rounded: Array) -> tuple[Array, Places]:
    """One each of those matrices (n, ...) whose rounded ones, of whole numbers, differ, and which one each is.

    These are distinguished by their sums with fixed random factors modulo 2^64, which are sooner sorted: two different
    ones have the same sum with a chance of 2^-63.
    """
    rows = rounded.astype(np.int64).reshape(len(rounded), -1)
    factors = np.random.default_rng(0).integers(-2**62, 2**62, rows.shape[1]) * 2 + 1
    _, first, kind = np.unique(rows @ factors, return_index=True, return_inverse=True)
    return each[first], kind


def sliced(places: list[int]) -> list[int] | slice:
    """The same places, as a slice where they follow each other: columns there are copied at once."""
    return slice(places[0], places[-1] + 1) if places[-1] - places[0] < len(places) else places


def is_diagonal(A: Array) -> bool:
    """Whether a matrix is square, with nothing beside its diagonal."""
    return A.shape[0] == A.shape[1] and not np.any(A - np.diag(np.diag(A)))


def heat_slopes(equations: Equations, x: Array, u: Array) -> Array:
    """Derivative (n, n_lumps, n_lumps) of the heats by the temperatures x (n, n_lumps) [W/K]."""
    nl = x.shape[1]
    out = np.broadcast_to(equations.dense[0], (len(x), nl, nl)).copy()
    for term in equations.terms:
        s = term.slopes(*equations.ends(term, x, u))
        for pair, (a, b) in enumerate(zip(term.a, term.b, strict=True)):
            for row, column, slope in ((a, a, s.aa), (a, b, s.ab), (b, a, s.ba), (b, b, s.bb)):
                if row < nl and column < nl:
                    out[:, row, column] += slope[..., pair]
    return out


def heats_of(responses: Sequence[Response], shape: tuple[int, ...], some: slice) -> tuple[Array, Array]:
    """Heats at the start and at the end of some samples, (n, n_lumps, m) [W], that m responses add.

    Parameters
    ----------
    responses : sequence of Response
        Of effects; without a heat, 0.
    shape : tuple of int
        How many samples and lumps.
    some : slice
        Which samples of the record.
    """
    start = np.zeros((*shape, len(responses)))
    end = np.zeros_like(start)
    for j, response in enumerate(responses):
        for lump, (first, last) in (response.heat or {}).items():
            start[:, lump, j], end[:, lump, j] = first[some], last[some]
    return start, end
