"""V = eᵀPe for every vertex of a box at once: a full or block-diagonal P from a linear matrix inequality."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..conic import Form
from ..errors import InputError
from ..thermal import System
from ._jacobian import BoxJacobian
from ._polytope import MOST, Cuts, Polytope, common_form, polytope

Array = NDArray[np.floating[Any]]
Structure = Literal["full", "block"]
STRUCTURES = ("full", "block")
LARGEST = 40  # lumps: beyond, a dense matrix inequality is a choice made knowingly
_MOST_SOLVES = 12
_DIGITS = (4, 6, 9, 13)
_CLOSE = 0.98  # share of the rate that eigenvalues allow which is good enough
_GAIN = 1.02  # a search at the rate found is repeated as long as it gains this much


@dataclass(frozen=True)
class Candidate:
    """A matrix P with the rate it reaches in floats.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
        P of V = eᵀPe.
    rate : float
        Decay at the vertices [1/s]; negative when V grows at one of them.
    solves : int
        Linear matrix inequalities solved.
    """

    matrix: Array
    rate: float
    solves: int


def check_choice(system: System, structure: str, large: bool) -> None:
    """Refuse an unknown structure, and a dense matrix inequality that nobody asked for knowingly."""
    if structure not in STRUCTURES:
        raise InputError(f"structure = {structure!r}", where="argument structure", expected='"full" or "block"')
    if len(system.lumps) > LARGEST and not large:
        raise InputError(f"a dense matrix inequality for {len(system.lumps)} lumps", where="argument method",
                         expected=f"at most {LARGEST} lumps with method \"lyapunov\"",
                         remedy='Use "energy", "sum" or "max", reduce the system, or pass large=True: the time grows '
                                "with the sixth power of the number of lumps.")


def block_pattern(system: System, structure: str) -> NDArray[np.bool_]:
    """Entries of P that may differ from zero.

    "block" is Evers (2021), (5.20): every module face alone, and each side's other lumps together, where a side is what
    is connected by links without the modules.
    """
    n = len(system.lumps)
    if structure == "full":
        return np.ones((n, n), bool)
    index = {name: i for i, name in enumerate(system.lumps)}
    pairs = [(index[a], index[b]) for a, b in (link.between for link in system.links) if a in index and b in index]
    rows, columns = np.array(pairs or np.zeros((0, 2)), int).T
    _, side = connected_components(coo_array((np.ones(len(rows)), (rows, columns)), shape=(n, n)), directed=False)
    for face in sorted({index[face] for module in system.modules.values() for face in (module.hot, module.cold)}):
        side[face] = side.max() + 1
    return side[:, None] == side[None, :]


def best_matrix(box: BoxJacobian, pattern: NDArray[np.bool_] | None = None, *, cuts: Cuts | None = None,
                first: bool = False) -> Candidate | None:
    """P with a large decay rate over the box.

    Parameters
    ----------
    box : BoxJacobian
        Picture with ``hull=True``.
    pattern : ndarray of bool, optional
        Of `block_pattern`; default all entries.
    cuts : Cuts, optional
        Vertices to begin with.
    first : bool
        Any positive rate will do.

    Returns
    -------
    Candidate or None
        None when there are too many vertices to look at.
    """
    vertices, cuts = polytope(box), Cuts() if cuts is None else cuts
    if vertices.count > MOST:
        return None
    n = len(box.capacity)
    pattern = np.ones((n, n), bool) if pattern is None else pattern
    Q: Array = np.eye(n)
    rate, bound = decay_rate(vertices, Q), -largest_growth(vertices)  # V = eᵀEe costs nothing
    shift = 0.0
    share, solves = (0.0 if first else _CLOSE), cuts.solves
    while bound > 0 and not (rate > 0 and rate >= share * bound) and cuts.solves < solves + _MOST_SOLVES:
        found, least = common_form(vertices, _shifted(shift), pattern, cuts)
        reached = decay_rate(vertices, found)
        better = reached > max(rate, _GAIN * rate)
        if reached > rate:
            Q, rate = found, reached
        if first or not (least > 0 and better):
            break
        shift = rate
    root = np.sqrt(box.capacity)
    return Candidate(Q * np.outer(root, root), rate, cuts.solves)


def decay_rate(vertices: Polytope, Q: Array) -> float:
    """Largest rate with QM + MᵀQ <= -2 rate Q at all vertices [1/s]; -inf where Q is not positive definite."""
    try:
        factor = np.linalg.inv(np.linalg.cholesky(Q))
    except np.linalg.LinAlgError:
        return -np.inf

    def growth(M: Array) -> Array:
        half = factor @ Q @ M @ factor.T
        return np.linalg.eigvalsh(half + half.transpose(0, 2, 1))[:, -1]

    return -0.5 * vertices.largest(growth)


def largest_growth(vertices: Polytope) -> float:
    """Largest real part of an eigenvalue over the vertices [1/s]: no certificate survives a positive one."""
    return vertices.largest(lambda M: np.linalg.eigvals(M).real)


def short_matrices(P: Array) -> Iterator[list[list[float]]]:
    """P, largest entry below one, rounded to more and more digits of its diagonal, symmetric to the last."""
    P = P / np.abs(P).max()
    scale = np.sqrt(np.outer(np.diag(P), np.diag(P)))
    for digits in _DIGITS:
        places = (digits - np.floor(np.log10(scale))).astype(int)
        yield [[round(value, place) for value, place in zip(row, own, strict=True)]
               for row, own in zip((0.5 * (P + P.T)).tolist(), places.tolist(), strict=True)]


def _shifted(rate: float) -> Any:
    def form(M: Array) -> Form:
        eye = np.eye(len(M))
        return Form(((eye, -(M + rate * eye)),))

    return form
