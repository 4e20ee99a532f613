"""Certificates of large sparse cooperative networks: one sparse solve, no optimization."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array, csc_array, csr_array, issparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from ..errors import InputError
from ..verification import Certificate, establish, not_certified
from ._sections import made_by

_BACK_OFF = (1e-9, 1e-6, 1e-3, 0.1, 0.9)
_POLICIES = 60


def network(E: ArrayLike, A: Any, *, method: Literal["max", "sum"] = "max", uncertainty: float = 0.0) -> Certificate:
    """Certify that a sparse Metzler network E ẋ = A x is stable, with a decay rate.

    Parameters
    ----------
    E : array_like, shape (n,)
        Heat capacity of every node [J/K].
    A : scipy.sparse array, shape (n, n)
        Metzler (off-diagonals not negative) [W/K]; need not be symmetric.
    method : {"max", "sum"}
        Row sums A d < 0 or column sums cᵀA < 0.
    uncertainty : float
        Relative uncertainty of the conductances [-], method "max" only: every off-diagonal entry and every row sum (the
        conductance to the ambient) may differ from its value by this share, each on its own; the diagonal follows. Long
        chains of lumps bear little of it, because A need not stay symmetric.

    Returns
    -------
    Certificate
        The weights solve A d = -E (or Aᵀc = -E), which exists and is positive exactly when the network is stable.

    Raises
    ------
    InputError
        Wrong shapes, negative off-diagonals, lumps without a path to an ambient (0-based indices are named), an
        uncertainty that is not in [0, 1) or with method "sum".

    References
    ----------
    A. Rantzer, "Scalable control of positive systems", European Journal of Control 24 (2015).

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> from scipy.sparse import csr_array
    >>> A = csr_array(np.array([[-1.5, 1.0], [1.0, -1.0]]))
    >>> rt.certify.network(np.array([10.0, 20.0]), A).holds
    True
    """
    if method not in ("max", "sum"):
        raise InputError(f"method = {method!r}", where="argument method", expected='"max" or "sum"')
    if not 0.0 <= uncertainty < 1.0 or (uncertainty and method != "max"):
        raise InputError(f"uncertainty = {uncertainty!r}", where="argument uncertainty",
                         expected='a share in [0, 1), with method "max"')
    capacity, matrix = checked_network(E, A)
    entries = matrix.tocoo()
    _path_to_ambient(matrix, entries)
    parts: dict[str, Any] = {"system": {"capacity": capacity, "rows": entries.row.astype(np.int64),
                                        "cols": entries.col.astype(np.int64), "values": entries.data},
                             "region": {"uncertainty": float(uncertainty)} if uncertainty else {}}
    tried = csc_array(matrix if method == "max" else matrix.T)
    weights = _solve(tried, capacity)
    if uncertainty and weights is not None:
        tried, weights = _worst(csr_array(matrix), capacity, weights, uncertainty)
    author = made_by("SuperLU sparse solve", "found")
    if weights is None or not (np.isfinite(weights).all() and weights.min() > 0):
        worst = "with the worst conductances found in the range, " if uncertainty else ""
        return not_certified("network", **parts, evidence={"method": method}, made_by=author,
                             reason=worst + _unstable(weights))
    weights = weights / weights.max()
    rate = float(np.min(-(tried @ weights) / (capacity * weights)))
    for back_off in _BACK_OFF:
        evidence = {"method": method, "rate": max(rate, 0.0) * (1 - back_off), "weights": weights}
        cert = establish("network", **parts, evidence=evidence, made_by=author)
        if cert.holds:
            break
    return cert


def _worst(matrix: csr_array, capacity: np.ndarray, weights: np.ndarray,
           uncertainty: float) -> tuple[csc_array, np.ndarray | None]:
    """Worst network for the weights it has itself, and these weights: each row takes its worst factors in turn.

    Weights grow from policy to policy, to the least that serve all of them; without such weights they diverge.
    """
    entries = matrix.tocoo()
    off = entries.row != entries.col
    loss = matrix.sum(axis=1)
    rows, cols, values = entries.row[off], entries.col[off], entries.data[off]
    worst, found, chosen = csc_array(matrix), weights, None
    for _ in range(_POLICIES):
        rising = found[cols] > found[rows]
        if chosen is not None and np.array_equal(rising, chosen):
            break
        chosen = rising
        scaled = values * np.where(rising, 1 + uncertainty, 1 - uncertainty)
        diagonal = loss * np.where(loss > 0, 1 + uncertainty, 1 - uncertainty) - np.bincount(rows, scaled, len(loss))
        worst = csc_array(coo_array((np.concatenate([scaled, diagonal]),
                                     (np.concatenate([rows, np.arange(len(loss))]),
                                      np.concatenate([cols, np.arange(len(loss))]))), shape=matrix.shape))
        solved = _solve(worst, capacity)
        if solved is None or not (np.isfinite(solved).all() and solved.min() > 0):
            return worst, solved
        found = solved
    return worst, found


def _solve(matrix: csc_array, capacity: np.ndarray) -> np.ndarray | None:
    try:
        lu = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0)
    except RuntimeError:  # exactly singular
        return None
    weights = lu.solve(-capacity)
    return weights + lu.solve(-capacity - matrix @ weights)  # one refinement


def _unstable(weights: np.ndarray | None) -> str:
    if weights is None:
        return "A is singular: the network does not forget its initial temperatures"
    worst = int(np.argmin(np.where(np.isfinite(weights), weights, -np.inf)))
    return (f"the solution of A d = -E is not positive (index {worst}: {weights[worst]:.3g}): a Metzler network has a "
            "positive one exactly when it is stable, so this one is not")


def checked_network(E: ArrayLike, A: Any) -> tuple[np.ndarray, csr_array]:
    """Return capacities and a Metzler matrix with its duplicates summed, or raise InputError."""
    try:
        capacity = np.asarray(E, dtype=float)
        matrix = csr_array(A if issparse(A) else np.asarray(A, dtype=float), dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"not numbers ({error})", where="arguments E, A") from None
    n = capacity.size
    if capacity.ndim != 1 or not n:
        raise InputError(f"E has shape {capacity.shape}", where="argument E", expected="a vector of capacities [J/K]")
    if matrix.shape != (n, n):
        raise InputError(f"A has shape {matrix.shape}", where="argument A", expected=f"({n}, {n}) like E")
    bad = np.flatnonzero(~(np.isfinite(capacity) & (capacity > 0)))
    if bad.size:
        raise InputError(f"capacity {bad[0]} is {capacity[bad[0]]}", where="argument E",
                         expected="positive finite numbers")
    matrix.sum_duplicates()
    entries = matrix.tocoo()
    if not np.isfinite(entries.data).all():
        at = int(np.flatnonzero(~np.isfinite(entries.data))[0])
        raise InputError(f"entry ({entries.row[at]}, {entries.col[at]}) is {entries.data[at]}", where="argument A",
                         expected="finite numbers")
    negative = np.flatnonzero((entries.data < 0) & (entries.row != entries.col))
    if negative.size:
        at = negative[0]
        raise InputError(f"entry ({entries.row[at]}, {entries.col[at]}) is {entries.data[at]}", where="argument A",
                         expected="a Metzler matrix (off-diagonals not negative)",
                         remedy="A finite-element export: lump the mass, or refine obtuse elements.")
    return capacity, matrix


def _path_to_ambient(matrix: csr_array, entries: coo_array) -> None:
    """Refuse closed groups of lumps whose rows sum to zero: nothing ties their temperature to an ambient."""
    count, label = connected_components(matrix, directed=True, connection="strong")
    leaves = np.zeros(count, bool)  # groups that depend on a lump outside
    outward = (label[entries.row] != label[entries.col]) & (entries.data != 0)
    leaves[label[entries.row[outward]]] = True
    sums, sizes = matrix.sum(axis=1), abs(matrix).sum(axis=1)
    lossy = np.zeros(count, bool)  # groups with heat loss, or gain
    lossy[label[np.abs(sums) > 1e-13 * sizes]] = True
    stranded = np.flatnonzero(~leaves & ~lossy)
    if stranded.size:
        lumps = np.flatnonzero(label == stranded[0])
        shown = ", ".join(map(str, lumps[:20])) + (f" … ({lumps.size} lumps)" if lumps.size > 20 else "")
        raise InputError(f"no path to an ambient from the component of lumps {shown}", where="argument A",
                         expected="a row sum below zero in every closed component",
                         remedy="Add the missing conductance to an ambient, on the diagonal.")
