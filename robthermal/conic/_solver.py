"""Clarabel, with the settings of this package: the only file that imports a conic solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, triu

Array = NDArray[np.floating[Any]]
LOOSE = 1e-7  # looser than the solver's own: a matrix well inside is wanted, not the last digit


@dataclass(frozen=True)
class Point:
    """Coefficients the solver returned, which nobody has to believe.

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


def nonnegative(size: int) -> Any:
    """The cone s >= 0."""
    return clarabel.NonnegativeConeT(size)


def second_order(size: int) -> Any:
    """The cone s_0 >= |s_1...|."""
    return clarabel.SecondOrderConeT(size)


def semidefinite(side: int) -> Any:
    """The cone of positive semidefinite matrices, stacked by `stack`."""
    return clarabel.PSDTriangleConeT(side)


def solved(cost: Array, A: csc_matrix, offset: Array, cones: Sequence[Any], *, quadratic: Array | None = None,
           tolerance: float | None = None, decompose: bool = True) -> Point:
    """Minimize y'Py/2 + cost'y with offset - A y in the cones.

    Parameters
    ----------
    cost : ndarray, shape (n,)
        Linear part of the objective.
    A : csc_matrix, shape (m, n)
        Rows of all cones.
    offset : ndarray, shape (m,)
        Right-hand side b.
    cones : sequence
        In the order of the rows.
    quadratic : ndarray, shape (n, n), optional
        Quadratic part P of the objective, symmetric.
    tolerance : float, optional
        Of gap and feasibility; default the solver's own.
    decompose : bool
        Whether semidefinite cones may be split along their sparsity, in which Clarabel 0.11 may abort.

    Returns
    -------
    Point
        Every unknown, finite or not; its value is the solver's objective.
    """
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.chordal_decomposition_enable = decompose
    if tolerance is not None:
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    n = len(cost)
    P = csc_matrix((n, n)) if quadratic is None else triu(csc_matrix(quadratic), format="csc")
    solution = clarabel.DefaultSolver(P, cost, A, offset, list(cones), settings).solve()
    y, status = np.array(solution.x), str(solution.status)
    fine = status in ("Solved", "AlmostSolved") and bool(np.isfinite(y).all())
    return Point(y, float(solution.obj_val), status, fine)
