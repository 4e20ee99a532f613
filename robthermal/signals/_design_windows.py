"""The weights with which an estimator adds output lines up to G: they follow from the excitation alone.

The local polynomial method, Evers (3.15)-(3.23), is linear in the output: G(k) = sum_r w(k, r) Y(k+r). With the weights
known before the experiment, so are its variance, sigma^2 sum |w|^2, and its error for a machine with given poles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from .._checks import whole_number
from ..errors import InputError
from ._checks import Array

Complex = NDArray[np.complex128]

_LINE_SILENT = 1e3  # a line is excited when it exceeds this many times the rounding error of its signal
_RANK = 1e-8  # smallest singular value of a window that counts, relative to the largest


@dataclass(frozen=True)
class Spectra:
    """DFT of the inputs, normalized by 1/sqrt(N) as in Evers (4.2), bins 1 ... (N-1)//2."""

    U: Complex  # (experiments, n_u, bins), exactly zero where not excited
    n_samples: int

    @property
    def excited(self) -> NDArray[np.intp]:
        """Bins, from 1, at which some input is excited."""
        return np.flatnonzero((self.U != 0.0).any(axis=(0, 1))) + 1

    def points(self, bins: NDArray[np.intp]) -> Complex:
        """z of bins, on the unit circle."""
        return np.asarray(np.exp(2j * np.pi / self.n_samples * bins))

    @property
    def n_bins(self) -> int:
        return int(self.U.shape[2])


def spectra_of(u: Array) -> Spectra:
    """Spectra of experiments (experiments, n, n_u)."""
    n = u.shape[1]
    lines = scipy.fft.rfft(u - u.mean(axis=1, keepdims=True), axis=1, norm="ortho")[:, 1 : (n - 1) // 2 + 1]
    U = lines.transpose(0, 2, 1)
    level = _LINE_SILENT * np.finfo(float).eps * np.abs(u).max(axis=(0, 1))
    return Spectra(np.where(np.abs(U) > level[None, :, None], U, 0.0), n)


@dataclass(frozen=True)
class Estimator:
    """Polynomials of `degree` in windows of 2 half_width + 1 bins, or quotients of spectra (degree None)."""

    degree: int | None
    half_width: int

    def windows(self, bins: NDArray[np.intp], n_bins: int) -> NDArray[np.intp]:
        """Bins in the windows around `bins`, (B, m): shifted at the edges, never wrapped."""
        m = 2 * self.half_width + 1
        return np.clip(bins - self.half_width, 1, n_bins - m + 1)[:, None] + np.arange(m)

    def weights(self, spectra: Spectra, bins: NDArray[np.intp]) -> Complex:
        """w (B, n_u, experiments, m); NaN for an input whose G the window does not determine."""
        rows = self.windows(bins, spectra.n_bins)
        E, n_u, (B, m) = spectra.U.shape[0], spectra.U.shape[1], rows.shape
        powers = ((rows - bins[:, None]) / max(self.half_width, 1))[..., None] ** np.arange((self.degree or 0) + 1)
        size = powers.shape[2]
        transients = 0 if self.degree is None else size * E
        K = np.zeros((B, E, m, transients + size * n_u), dtype=complex)
        for e in range(E):
            if transients:
                K[:, e, :, e * size : (e + 1) * size] = powers
            for s in range(size):  # U x^0 stands first among the columns of the inputs
                first = transients + s * n_u
                K[:, e, :, first : first + n_u] = spectra.U[e][:, rows - 1].transpose(1, 2, 0) * powers[..., s, None]
        found = _rows_of_pseudoinverse(K.reshape(B, E * m, -1), slice(transients, transients + n_u))
        return found.reshape(B, n_u, E, m)


def estimator(method: str, degree: object, half_width: object, spectra: Spectra) -> Estimator:
    """The estimator asked for, if its windows fit the record."""
    R, width = whole_number(degree, "degree", 0), whole_number(half_width, "half_width", 1)
    experiments, n_u, n_bins = spectra.U.shape
    if method == "etfe":
        if experiments < n_u:
            raise InputError(
                f"{experiments} experiment(s) for {n_u} inputs",
                where="argument u",
                expected="at least as many experiments as inputs for the ETFE",
                remedy="Use orthogonal multisines, or method='lpm'.",
            )
        return Estimator(None, 0)
    points, unknowns = experiments * (2 * width + 1), (R + 1) * (n_u + experiments)
    if 2 * width + 1 > n_bins:
        raise InputError(
            f"half_width {width} needs {2 * width + 1} bins, the record has {n_bins}",
            where="argument half_width",
            remedy="Use a longer record or a smaller half_width.",
        )
    if points <= unknowns:
        raise InputError(
            f"no degrees of freedom left: {points} points per window for {unknowns} unknowns",
            where="argument half_width",
            remedy="Increase half_width, or lower the degree.",
        )
    return Estimator(R, width)


def _rows_of_pseudoinverse(K: Complex, part: slice) -> Complex:
    """Some rows of the pseudo-inverse of K (B, rows, n); NaN where the coefficient is not determined."""
    scale = np.linalg.norm(K, axis=1)
    scale[scale == 0.0] = 1.0
    left, sizes, right = np.linalg.svd(K / scale[:, None, :], full_matrices=False)
    keep = sizes > _RANK * sizes[:, :1]
    mine = right[:, :, part].conj().transpose(0, 2, 1)  # (B, part, rank)
    inverse = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=keep)
    rows = (mine * inverse[:, None, :]) @ left.conj().transpose(0, 2, 1) / scale[:, part, None]
    # A coefficient is determined when its unit vector lies in the row space of K.
    rows[np.sum(np.abs(mine) ** 2 * keep[:, None, :], axis=2) < 1.0 - 1e-6] = np.nan
    return np.asarray(rows)


def noise_gain(weights: Complex) -> Array:
    """Variance of G per unit of white output noise, (n_u, B); infinite where the window does not determine it."""
    gain = np.sum(np.abs(weights) ** 2, axis=(2, 3)).T
    return np.where(np.isnan(gain), np.inf, gain)


def noise_free_errors(weights: Complex, rows: NDArray[np.intp], Y: Complex, G: Complex, scale: Array) -> Array:
    """Largest error of the G (n_y, n_u, B) of each output relative to `scale`, (n_y, B); outputs Y (E, n_y, bins)."""
    found = np.stack([np.einsum("biem,ebm->ib", weights, Y[:, y][:, rows - 1]) for y in range(Y.shape[1])])
    error = (np.abs(found - G) / scale).max(axis=1)
    return np.where(np.isnan(error), np.inf, error)
