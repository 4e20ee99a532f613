"""The one door to the conic solver: a symmetric matrix that makes linear functions of it positive definite.

What comes back is a candidate. The solver's status and objective are for the record: whoever asked checks the matrix,
and the certificate's checker proves it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, vstack

Array = NDArray[np.floating[Any]]
_TOLERANCE = 1e-7  # looser than the solver's own: a matrix well inside is wanted, not the last digit


@dataclass(frozen=True)
class Form:
    """The linear function Q -> Σ LᵀQR + RᵀQL of a symmetric matrix Q.

    Parameters
    ----------
    terms : tuple of (ndarray, ndarray)
        Pairs (L, R), each (n, n).
    """

    terms: tuple[tuple[Array, Array], ...]

    def at(self, Q: Array) -> Array:
        """Value at a matrix."""
        half = sum((L.T @ Q @ R for L, R in self.terms), np.zeros_like(Q))
        return half + half.T


@dataclass(frozen=True)
class Candidate:
    """What the solver returned, believed by nobody.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
        Q, symmetric.
    margin : float
        t for which the solver claims every form >= t I; nan where it returned nothing.
    status : str
        Its own word.
    """

    matrix: Array
    margin: float
    status: str


def strictly(form: Array, margin: float) -> Array:
    """Append the column of ``margin * eye`` to the columns of a form: form(Q) - margin I >= 0.

    The only place where strictness enters: an elementwise `form >> margin` would subtract margin from every entry.
    """
    side = round((np.sqrt(8 * len(form) + 1) - 1) / 2)
    return np.column_stack([form, -margin * _stack(np.eye(side)[None])[0]])


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
    identity = Form(((0.5 * np.eye(n), np.eye(n)),))
    own = _columns(identity, rows, columns)
    # s = b - A y >= 0 with y = (free entries of Q, t)
    blocks = [strictly(_columns(form, rows, columns), 1.0) for form in forms]
    still = np.zeros((len(own), 1))
    blocks += [np.hstack([own, still]), np.hstack([-own, still])]
    unit = _stack(np.eye(n)[None])[0]
    offset = np.concatenate([np.zeros(len(forms) * len(own)), -least * unit, unit])
    A = vstack([csc_matrix(-block) for block in blocks], format="csc")
    cost = np.zeros(len(rows) + 1)
    cost[-1] = -1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    cones = [clarabel.PSDTriangleConeT(n)] * len(blocks)
    solution = clarabel.DefaultSolver(csc_matrix((len(cost), len(cost))), cost, A, offset, cones, settings).solve()
    y = np.array(solution.x)
    Q = np.zeros((n, n))
    if not np.isfinite(y).all():
        return Candidate(np.eye(n), np.nan, str(solution.status))
    Q[rows, columns] = y[:-1]
    Q = Q + np.triu(Q, 1).T
    return Candidate(Q, float(y[-1]), str(solution.status))


def _columns(form: Form, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Array:
    """Stacked values of a form at every symmetric unit matrix, one per column."""
    n = len(form.terms[0][0])
    total = np.zeros((len(rows), n, n))
    for L, R in form.terms:
        total += L[rows][:, :, None] * R[columns][:, None, :]
        other = L[columns][:, :, None] * R[rows][:, None, :]
        total += other * (rows != columns)[:, None, None]
    return _stack(total + total.transpose(0, 2, 1)).T


def _stack(matrices: Array) -> Array:
    """Upper triangles column by column, off-diagonals times √2, as the solver's cone wants them."""
    n = matrices.shape[-1]
    j, i = np.tril_indices(n)
    return matrices[:, i, j] * np.where(i == j, 1.0, np.sqrt(2.0))
