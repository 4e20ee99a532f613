"""A symmetric matrix that makes linear functions of it definite."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, vstack
from scipy.sparse.csgraph import connected_components

from ._solver import LOOSE, Array, semidefinite, solved
from ._stacked import stack, strictly


@dataclass(frozen=True)
class Form:
    """The linear function Q -> Σ LᵀQR + RᵀQL of a symmetric matrix Q.

    Parameters
    ----------
    terms : tuple of (ndarray, ndarray)
        Pairs (L, R), each (n, k), Q being (n, n) and the value (k, k).
    """

    terms: tuple[tuple[Array, Array], ...]

    def at(self, Q: Array) -> Array:
        """Value at a matrix."""
        side = self.terms[0][0].shape[1]
        half = sum((L.T @ Q @ R for L, R in self.terms), np.zeros((side, side)))
        return half + half.T


@dataclass(frozen=True)
class Candidate:
    """What the solver returned, which nobody has to believe.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
        The symmetric matrix Q found.
    margin : float
        t for which the solver claims every form >= t I; nan where it returned nothing.
    status : str
        Its own word.
    """

    matrix: Array
    margin: float
    status: str


def largest_margin(forms: Sequence[Form], pattern: NDArray[np.bool_], *, least: float = 1e-5) -> Candidate:
    """Find Q with least I <= Q <= I and every form >= t I, t as large as possible.

    Parameters
    ----------
    forms : sequence of Form
        Linear functions of Q.
    pattern : ndarray of bool, shape (n, n)
        Entries of Q that may differ from zero.
    least : float
        Smallest eigenvalue of Q allowed [-].

    Returns
    -------
    Candidate

    Examples
    --------
    >>> A = np.array([[-1.0, 3.0], [0.0, -1.0]])  # stable, but V = x'x grows
    >>> found = largest_margin([Form(((np.eye(2), -A),))], np.ones((2, 2), bool))
    >>> bool(np.linalg.eigvalsh(Form(((np.eye(2), -A),)).at(found.matrix)).min() > 0)
    True
    """
    n = len(pattern)
    rows, columns = np.nonzero(np.triu(pattern))
    # s = b - A y >= 0 with y = (free entries of Q, t)
    blocks = [strictly(_columns(form, rows, columns), 1.0) for form in forms]
    sides = [form.terms[0][0].shape[1] for form in forms]
    offsets = [np.zeros(len(block)) for block in blocks]
    for group in _independent(pattern):  # least I <= Q <= I, one small cone for each block of Q
        pick = np.eye(n)[:, group]
        own = _columns(Form(((0.5 * pick, pick),)), rows, columns)
        still, unit = np.zeros((len(own), 1)), stack(np.eye(len(group))[None])[0]
        blocks += [np.hstack([own, still]), np.hstack([-own, still])]
        offsets += [-least * unit, unit]
        sides += [len(group)] * 2
    A = vstack([csc_matrix(-block) for block in blocks], format="csc")
    cost = np.zeros(len(rows) + 1)
    cost[-1] = -1.0
    cones = [semidefinite(side) for side in sides]
    found = solved(cost, A, np.concatenate(offsets), cones, tolerance=LOOSE)
    y = found.x
    Q = np.zeros((n, n))
    if not np.isfinite(y).all():
        return Candidate(np.eye(n), np.nan, found.status)
    Q[rows, columns] = y[:-1]
    Q = Q + np.triu(Q, 1).T
    return Candidate(Q, float(y[-1]), found.status)


def _independent(pattern: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """Indices of the diagonal blocks of a pattern."""
    count, label = connected_components(pattern, directed=False)
    return [np.flatnonzero(label == k) for k in range(count)]


def _columns(form: Form, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Array:
    """Stacked values of a form at every symmetric unit matrix, one per column."""
    side = form.terms[0][0].shape[1]
    total = np.zeros((len(rows), side, side))
    for L, R in form.terms:
        total += L[rows][:, :, None] * R[columns][:, None, :]
        other = L[columns][:, :, None] * R[rows][:, None, :]
        total += other * (rows != columns)[:, None, None]
    return stack(total + total.transpose(0, 2, 1)).T
