"""The local least-squares problem, window by window, without shortcuts: Evers (4.12)-(4.17).

Used at the edges, where the rank is in doubt, for records of different lengths, and for what is computed on request
(transient, weights, coherence). Interior windows of equal records go through `_kernel`, with the same results.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._arrays import Array
from ._basis import LocalBasis, window_starts
from ._records import Spectrum

RANK_TOLERANCE = 1e-8  # part of a column that must remain after removing the other columns, relative to the column


@dataclass(frozen=True)
class Regression:
    """Windows of a set of bins: rows (B, m), regressors (B, m, n), outputs (B, m, n_y).

    Columns of K: transients of the records (powers within a record), then U x^R ... U x^1, then U x^0, so that the
    constants of G come last and need no solution with the whole triangle.
    """

    K: Array
    Y: Array
    n_u: int
    first_transient: int  # column of the transient at the center, first record


def points_per_record(spectra: Sequence[Spectrum], basis: LocalBasis) -> tuple[int, ...]:
    """Bins per window in each record: a shorter record has fewer bins in the same frequency window."""
    return tuple(
        min(s.n_bins, max(1, round(basis.n_points * s.n_samples / basis.n_samples)))
        if s.n_samples != basis.n_samples
        else basis.n_points
        for s in spectra
    )


def regression(spectra: Sequence[Spectrum], basis: LocalBasis, bins: Array) -> Regression:
    """Regressors and outputs of the windows centered at `bins` (B,), counted from 1 on the grid of the basis."""
    n_u, rows = spectra[0].U.shape[0], points_per_record(spectra, basis)
    n_transient = basis.transient_size * len(spectra)
    K = np.zeros((bins.size, sum(rows), n_transient + n_u * basis.size), dtype=complex)
    Y = np.empty((bins.size, sum(rows), spectra[0].Y.shape[0]), dtype=complex)
    top = 0
    for place, (spectrum, m) in enumerate(zip(spectra, rows, strict=True)):
        mine, offsets = rows_of(spectrum, basis, bins)
        functions, of_transient = basis.functions(bins, offsets)
        part = slice(top, top + m)
        K[:, part, place * basis.transient_size : (place + 1) * basis.transient_size] = of_transient
        U = np.moveaxis(spectrum.U[:, mine - 1], 0, -1)  # (B, m, n_u)
        for s in range(basis.size):
            column = n_transient + (basis.degree - s) * n_u
            K[:, part, column : column + n_u] = functions[..., s, None] * U
        Y[:, part] = np.moveaxis(spectrum.Y[:, mine - 1], 0, -1)
        top += m
    return Regression(K=K, Y=Y, n_u=n_u, first_transient=0)


def rows_of(spectrum: Spectrum, basis: LocalBasis, bins: Array) -> tuple[Array, Array]:
    """Bins of one record (from 1) in the windows centered at `bins` of the grid, and their offsets [bins], (B, m)."""
    ratio, m = basis.n_samples / spectrum.n_samples, points_per_record([spectrum], basis)[0]
    start = window_starts(np.rint(bins / ratio).astype(int), spectrum.n_bins, m)
    mine = start[:, None] + np.arange(m)
    return mine, mine * ratio - bins[:, None]


@dataclass(frozen=True)
class WindowFit:
    """Solution of the windows of B bins; inputs whose G is not determined by the window hold NaN."""

    response: Array  # (n_y, n_u, B)
    gram: Array  # (n_u, n_u, B): the block of (K^H K)^-1 that belongs to G
    noise: Array  # (n_y, n_y, B)
    degrees_of_freedom: Array  # (B,)
    transient: Array  # (n_y, B)
    weights: Array  # (n_u, m, B): G_oi = sum_f weights_if Y_o(f)


def solve_windows(problem: Regression) -> WindowFit:
    """Least squares with a rank decision per window; q = rows - rank, Evers (4.15) corrected."""
    K, Y, n_u = problem.K, problem.Y, problem.n_u
    scale = np.linalg.norm(K, axis=1)
    scale[scale == 0.0] = 1.0
    left, sizes, right = np.linalg.svd(K / scale[:, None, :], full_matrices=False)
    keep = sizes > RANK_TOLERANCE * sizes[:, :1]
    inverse = np.where(keep, 1.0 / np.where(keep, sizes, 1.0), 0.0)
    pinv = (right.conj().transpose(0, 2, 1) * inverse[:, None, :]) @ left.conj().transpose(0, 2, 1)
    pinv /= scale[:, :, None]
    # A coefficient is determined when its unit vector lies in the row space of K.
    inside = np.sum(np.abs(right) ** 2 * keep[..., None], axis=1)  # (B, n), 1 if determined
    undetermined = inside[:, -n_u:] < 1.0 - 1e-6
    weights = pinv[:, -n_u:]
    residual = _residual(left, keep, Y)
    q = K.shape[1] - keep.sum(axis=1)
    theta = weights @ Y  # (B, n_u, n_y)
    gram = weights @ weights.conj().transpose(0, 2, 1)
    theta[undetermined] = np.nan
    gram[undetermined] = np.nan
    gram.transpose(0, 2, 1)[undetermined] = np.nan
    transient = pinv[:, problem.first_transient, None] @ Y
    with np.errstate(divide="ignore", invalid="ignore"):
        # E[V_o V_p*]: the rows of the residual are the window, hence the transpose.
        noise = residual.transpose(0, 2, 1) @ residual.conj() / q[:, None, None]
    return WindowFit(
        response=theta.transpose(2, 1, 0),
        gram=gram.transpose(1, 2, 0),
        noise=noise.transpose(1, 2, 0),
        degrees_of_freedom=q,
        transient=transient[:, 0].T,
        weights=weights.transpose(1, 2, 0),
    )


def _residual(left: Array, keep: Array, Y: Array) -> Array:
    basis = left * keep[:, None, :]
    residual = Y - basis @ (basis.conj().transpose(0, 2, 1) @ Y)
    return residual - basis @ (basis.conj().transpose(0, 2, 1) @ residual)  # once more: exact to rounding
