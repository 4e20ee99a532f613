"""The one door to the conic solver: matrices that make linear functions definite, coefficients that keep norms small.

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
    offset = np.concatenate([np.zeros(sum(map(len, blocks[:-2]))), -least * unit, unit])
    A = vstack([csc_matrix(-block) for block in blocks], format="csc")
    cost = np.zeros(len(rows) + 1)
    cost[-1] = -1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    sides = [form.terms[0][0].shape[1] for form in forms] + [n, n]
    cones = [clarabel.PSDTriangleConeT(side) for side in sides]
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
    side = form.terms[0][0].shape[1]
    total = np.zeros((len(rows), side, side))
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


@dataclass(frozen=True)
class NormBounds:
    """Many bounds of one shape: |M_k x + m_k| <= b_k + c_k t, Euclidean norm.

    Parameters
    ----------
    matrix : ndarray, shape (n_k, d, n)
        M_k.
    offset : ndarray, shape (n_k, d)
        m_k.
    bound : ndarray, shape (n_k,)
        b_k.
    slope : float
        c_k, the same for all: 0 for a plain constraint, 1 where t bounds the norm.
    """

    matrix: Array
    offset: Array
    bound: Array
    slope: float = 0.0


@dataclass(frozen=True)
class Point:
    """Coefficients the solver returned, believed by nobody.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Zero where it returned nothing.
    value : float
        Its t; nan where it returned nothing.
    status : str
        Its own word.
    solved : bool
        Whether it says that it found an optimum, if an inaccurate one.
    """

    x: Array
    value: float
    status: str
    solved: bool


def smallest_bound(bounds: Sequence[NormBounds], n: int) -> Point:
    """Find x with the smallest t under bounds on norms: a second-order cone program.

    The cones are stacked as arrays: a program of 60 coefficients and 4000 frequencies is assembled in milliseconds.

    Parameters
    ----------
    bounds : sequence of NormBounds
        At least one of them with a slope.
    n : int
        Number of coefficients.

    Returns
    -------
    Point

    Examples
    --------
    >>> far = NormBounds(np.eye(2)[None], np.array([[-3.0, -4.0]]), np.zeros(1), 1.0)  # distance to (3, 4)
    >>> disc = NormBounds(np.eye(2)[None], np.zeros((1, 2)), np.ones(1))  # inside the unit circle
    >>> found = smallest_bound([far, disc], 2)
    >>> print(found.x.round(4), round(found.value, 4))
    [0.6 0.8] 4.0
    """
    rows, offsets, cones = [], [], []
    for group in bounds:
        count, d, _ = group.matrix.shape
        # s = offset - rows (x, t) lies in the cone s_0 >= |s_1..d|
        block = np.zeros((count, d + 1, n + 1))
        block[:, 0, -1] = -group.slope
        block[:, 1:, :-1] = -group.matrix
        rows.append(csc_matrix(block.reshape(-1, n + 1)))
        offsets.append(np.column_stack([group.bound, group.offset]).ravel())
        cones += [clarabel.SecondOrderConeT(d + 1)] * count
    cost = np.zeros(n + 1)
    cost[-1] = 1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    nothing = csc_matrix((n + 1, n + 1))
    solution = clarabel.DefaultSolver(nothing, cost, vstack(rows, format="csc"), np.concatenate(offsets), cones,
                                      settings).solve()
    y, status = np.array(solution.x), str(solution.status)
    solved = status in ("Solved", "AlmostSolved") and bool(np.isfinite(y).all())
    if not solved:
        return Point(np.zeros(n), np.nan, status, False)
    return Point(y[:-1], float(y[-1]), status, True)


@dataclass(frozen=True)
class Inequality:
    """The matrix inequality constant + Σ x_k slopes[k] >= margin t I.

    Parameters
    ----------
    constant : ndarray, shape (s, s)
        Symmetric.
    slopes : ndarray, shape (n, s, s)
        Symmetric, one per coefficient.
    margin : float
        0 for a plain inequality.
    """

    constant: Array
    slopes: Array
    margin: float = 0.0


def inside(inequalities: Sequence[Inequality], cost: Array | None = None) -> Point:
    """Find x deep inside linear matrix inequalities: the largest t, or the least cost at t = 1.

    Parameters
    ----------
    inequalities : sequence of Inequality
        Their margins bound t when no cost is given.
    cost : ndarray, shape (n,), optional
        Minimises costᵀx instead.

    Returns
    -------
    Point
        Its value is t, or the cost.

    Examples
    --------
    >>> hyperbola = Inequality(np.array([[0.0, 1.0], [1.0, 0.0]]),  # [[x, 1], [1, y]] >= 0: x y >= 1
    ...                        np.array([[[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]]))
    >>> print(inside([hyperbola], np.array([4.0, 1.0])).x.round(2))  # of least 4 x + y
    [0.5 2. ]
    """
    columns = vstack([csc_matrix(strictly(_stack(one.slopes).T, one.margin)) for one in inequalities], format="csc")
    offset = np.concatenate([_stack(one.constant[None])[0] for one in inequalities])
    n = columns.shape[1] - 1
    if cost is not None:  # t = 1 is no unknown
        columns, offset = columns[:, :n], offset + columns[:, n].toarray().ravel()
    linear = np.eye(n + 1)[n] * -1.0 if cost is None else cost
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    cones = [clarabel.PSDTriangleConeT(len(one.constant)) for one in inequalities]
    nothing = csc_matrix((len(linear), len(linear)))
    solution = clarabel.DefaultSolver(nothing, linear, -columns, offset, cones, settings).solve()
    y, status = np.array(solution.x), str(solution.status)
    if not np.isfinite(y).all():
        return Point(np.zeros(n), np.nan, status, False)
    value = float(y[-1]) if cost is None else float(linear @ y)
    return Point(y[:n], value, status, status in ("Solved", "AlmostSolved"))
