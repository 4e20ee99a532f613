"""Matrix gains of largest integral action under a bound of the sensitivity: a convex-concave sequence of cone programs.

Hermitian 2x2 matrices H >= c I are one second-order cone, h11 + h22 - 2c >= |(h11 - h22, 2 Re h12, 2 Im h12)|; larger
ones are real matrices [Re H, -Im H; Im H, Re H] of twice the size.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .._arrays import Array
from ..conic import ConeBounds, Inequality, least_cost

Accept = Callable[[Array], bool]
_ROUNDS = 60
_SHARES = (1.0, 0.5, 0.25, 0.1, 0.03)  # of a step, in turn, until the loop can be followed
_STEP = 1e-4  # relative: gains of the objective below it end the sequence
_CAUTION = 1e-6  # relative, of the margin above what is asked
_FURTHER = 1e4  # times the integral action of the last gains, in one step: some plants bear any
_FIRST, _MORE, _ADDITIONS = 40, 20, 12  # bins of matrices above 2x2: at first, more where they are missed, how often
_MISSED = 1e-9  # of the smallest eigenvalue


@dataclass(frozen=True)
class MatrixBins:
    """Everything at the bins of all responses.

    Parameters
    ----------
    center : ndarray, shape (n_f, m, m)
        Measured values of the responses.
    spread : ndarray, shape (n_f,)
        Bound of the largest singular value of what a plant in the circles differs by.
    basis : ndarray, shape (n_f, n_basis)
        Basis functions of the controller.
    patterns : ndarray, shape (n_x, n_basis, m, m)
        What every free number adds to the gains of the basis functions.
    static : list of ndarray, shape (m, m)
        Static gain of every response, for the objective.
    integral : int
        Place of the integral in the basis.
    """

    center: Array
    spread: Array
    basis: Array
    patterns: Array
    static: list[Array]
    integral: int

    def gains(self, x: Array) -> Array:
        """Gain matrices of the basis functions, (n_basis, m, m)."""
        return np.tensordot(x, self.patterns, 1)

    def controller(self, x: Array) -> Array:
        """Controller at the bins, (n_f, m, m)."""
        return np.einsum("fb,bij->fij", self.basis, self.gains(x))

    def distance(self, x: Array) -> Array:
        """Bound from below of the smallest singular value of I + GK over the circles of every bin."""
        K = self.controller(x)
        small = np.linalg.svd(np.eye(K.shape[1]) + self.center @ K, compute_uv=False)[:, -1]
        return np.asarray(small - self.spread * np.linalg.norm(K, 2, axis=(1, 2)))

    def action(self, x: Array) -> float:
        """Smallest eigenvalue of the Hermitian part of static gain times integral gain, over all responses."""
        Ki = self.gains(x)[self.integral]
        return min(float(np.linalg.eigvalsh(G @ Ki + (G @ Ki).T)[0]) / 2 for G in self.static)


def ascend_matrix(bins: MatrixBins, start: Array, margin: float, accept: Accept) -> tuple[Array, int]:
    """Gains from a stabilizing start that keep its winding number: first the margin, then integral action.

    Parameters
    ----------
    bins : MatrixBins
        Responses and what is free.
    start : ndarray, shape (n_x,)
        Stabilizing gains to start from.
    margin : float
        Smallest singular value of I + GK that is asked for.
    accept : callable
        Whether a loop can be followed from bin to bin and is stable.
    """
    x, count = start, 0
    for goal in ("margin", "action"):
        for _ in range(_ROUNDS):
            kept = bins.distance(x).min() >= margin
            if goal == "margin" and kept:
                break
            if goal == "action" and not kept:
                return x, count
            found = _step(bins, x, margin, goal)
            count += 1
            moved = None if found is None else next(
                (tried for share in _SHARES if accept(tried := x + share * (found - x))), None)
            if moved is None:
                break
            before = bins.action(x) if goal == "action" else float(bins.distance(x).min())
            after = bins.action(moved) if goal == "action" else float(bins.distance(moved).min())
            if after <= before + _STEP * abs(before):
                x = moved if after > before else x
                break
            x = moved
    return x, count


def _step(bins: MatrixBins, at: Array, margin: float, goal: str) -> Array | None:
    """One program around the last gains.

    With the polar factor U of I + GK of the last gains, the smallest singular value of I + GK is at least the smallest
    eigenvalue of the Hermitian part of U*(I + GK): what is kept here is kept, and the segment from the last gains to
    the new ones does not meet det(I + GK) = 0. Beside the gains there is a bound of the size of each basis function's
    gains, whose sum bounds K, and the margin or the integral action that is maximized.
    """
    n, kinds, m = len(at), bins.basis.shape[1], bins.center.shape[1]
    W, _, Vh = np.linalg.svd(np.eye(m) + bins.center @ bins.controller(at))
    left = (W @ Vh).conj().transpose(0, 2, 1)
    lines = np.einsum("fij,fjk,fb,xbkl->filx", left, bins.center, bins.basis, bins.patterns, optimize=True)
    sizes, last = bins.spread[:, None] * abs(bins.basis), np.full((len(left), 1), float(goal == "margin"))
    slope, least = np.hstack([sizes, last]), 0.0 if goal == "margin" else margin * (1 + _CAUTION)
    parts = []
    for G in bins.static:
        integral = np.einsum("ij,xjk->ikx", G, bins.patterns[:, bins.integral])[None]
        action = np.append(np.zeros(kinds), float(goal == "action"))[None]
        parts.append(_above(integral.astype(complex), np.zeros((1, m, m), complex), action, 0.0))
    norms = np.moveaxis(bins.patterns.reshape(n, kinds, m * m), 0, -1)
    own = np.hstack([np.zeros((kinds, n)), np.eye(kinds), np.zeros((kinds, 1))])
    cost = np.zeros(n + kinds + 1)
    cost[-1] = -1.0
    most = 1.01 * margin if goal == "margin" else _FURTHER * max(bins.action(at), np.finfo(float).tiny)
    common = [ConeBounds(_wider(norms, kinds + 1), np.zeros((kinds, m * m)), own, np.zeros(kinds)),
              ConeBounds(np.zeros((1, 1, len(cost))), np.zeros((1, 1)), cost[None], np.array([most]))]
    count = len(left)
    taken = np.unique(np.linspace(0, count - 1, count if m == 2 else min(count, _FIRST)).astype(int))
    for _ in range(_ADDITIONS):
        every = [*parts, _above(lines[taken], left[taken], slope[taken], least)]
        found = least_cost(cost, [*common, *(cone for one, _ in every for cone in one)],
                           [matrix for _, one in every for matrix in one])
        if not found.solved:
            return None
        values = np.linalg.eigvalsh(_real(left + lines @ found.x[:n]))[:, 0]
        missing = slope @ found.x[n:] + least - values
        missing[taken] = 0.0
        late = np.argsort(-missing)[:_MORE]
        late = late[missing[late] > _MISSED]
        if not len(late):
            break
        taken = np.union1d(taken, late)
    return found.x[:n]


def _above(lines: Array, constant: Array, slope: Array, least: float) -> tuple[list[ConeBounds], list[Inequality]]:
    """Hermitian part of constant + Σ x lines at least least + slope'y, y the unknowns after x; a row per matrix."""
    if constant.shape[1] == 2:
        matrix, offset, trace, sum_ = _cone(lines, constant)
        wide = _wider(matrix, slope.shape[1])
        return [ConeBounds(wide, offset, np.hstack([trace, -2 * slope]), sum_ - 2 * least)], []
    eye, found = np.eye(2 * constant.shape[1]), []
    for own, fixed, more in zip(lines, constant, slope, strict=True):
        slopes = np.concatenate([_real(np.moveaxis(own, -1, 0)), -more[:, None, None] * eye])
        found.append(Inequality(_real(fixed[None])[0] - least * eye, slopes))
    return [], found


def _real(M: Array) -> Array:
    """Hermitian parts of matrices (k, m, m) as real symmetric ones (k, 2m, 2m)."""
    H = (M + M.conj().transpose(0, 2, 1)) / 2
    return np.concatenate([np.concatenate([H.real, -H.imag], 2), np.concatenate([H.imag, H.real], 2)], 1)


def _cone(lines: Array, constant: Array) -> tuple[Array, Array, Array, Array]:
    """Hermitian part H(x) of constant + Σ x lines, 2x2: rows of |(h11 - h22, 2 h12)|, and of its trace."""
    def parts(M: Array) -> tuple[Array, Array]:
        cross = M[:, 0, 1] + M[:, 1, 0].conj()
        rows = np.stack([(M[:, 0, 0] - M[:, 1, 1]).real, cross.real, cross.imag], axis=1)
        return rows, (M[:, 0, 0] + M[:, 1, 1]).real

    matrix, trace = parts(lines)
    offset, sum_ = parts(constant)
    return matrix, offset, trace, sum_


def _wider(matrix: Array, more: int) -> Array:
    return np.concatenate([matrix, np.zeros((*matrix.shape[:2], more))], axis=2)
