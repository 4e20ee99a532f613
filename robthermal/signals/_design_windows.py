"""The weights with which an estimator adds output lines up to G: they follow from the excitation alone.

The local polynomial method, Evers (3.15)-(3.23), is linear in the output: G(k) = sum_r w(k, r) Y(k+r). With the weights
known before the experiment, so are its variance, sigma^2 sum |w|^2, and its error for a machine with given poles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..errors import InputError
from ._checks import Array
from ._excitation_settings import whole_number

Complex = NDArray[np.complex128]

_LINE_SILENT = 1e3  # a line is excited when it exceeds this many times the rounding error of its signal
_RANK = 1e-8  # smallest singular value of a window that counts, relative to the largest
_CHUNK = 512  # bins solved at a time


@dataclass(frozen=True)
class Spectra:
    """DFT of the inputs, normalised by 1/sqrt(N) as in Evers (4.2), bins 1 ... (N-1)//2."""

    U: Complex  # (experiments, n_u, bins), exactly zero where not excited
    n_samples: int

    @property
    def excited(self) -> NDArray[np.intp]:
        """Bins, from 1, at which some input is excited."""
        return np.flatnonzero((self.U != 0.0).any(axis=(0, 1))) + 1

    @property
    def n_bins(self) -> int:
        return int(self.U.shape[2])


def spectra_of(u: Array) -> Spectra:
    """Spectra of experiments (experiments, n, n_u)."""
    n = u.shape[1]
    U = fft.rfft(u - u.mean(axis=1, keepdims=True), axis=1, norm="ortho")[:, 1 : (n - 1) // 2 + 1].transpose(0, 2, 1)
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
        return _rows_of_pseudoinverse(K.reshape(B, E * m, -1), slice(transients, transients + n_u)).reshape(B, n_u, E, m)


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


@dataclass(frozen=True)
class Expected:
    """Variance of G per unit of white output noise (n_u, n_f), and error of every pole's mode (n_p, n_f), relative."""

    gain: Array
    error: Array


def expect(method: Estimator, spectra: Spectra, bins: NDArray[np.intp], poles: Complex, held: Complex) -> Expected:
    """Noise gain and noise-free error at `bins`; `poles` are p T_s, `held` (n_p, experiments, n_u) the last states.

    The mode x(n+1) = gamma x(n) + u_i(n) that starts at zero has X = (U_i - z x(N)/sqrt(N)) g, g = 1/(z - gamma).
    """
    n_u, angle = spectra.U.shape[1], 2.0 * np.pi / spectra.n_samples
    gain, error = np.empty((n_u, bins.size)), np.zeros((len(poles), bins.size))
    for first in range(0, bins.size, _CHUNK):
        part = slice(first, first + _CHUNK)
        weights, rows = method.weights(spectra, bins[part]), method.windows(bins[part], spectra.n_bins)
        gain[:, part] = np.sum(np.abs(weights) ** 2, axis=(2, 3)).T
        z = np.exp(1j * angle * rows)
        for p, pole in enumerate(poles):
            # z_k - gamma over z - gamma, without the cancellation at slow poles and low bins
            centre = np.expm1(1j * angle * bins[part] - pole)
            ratio = centre[:, None] / np.expm1(1j * angle * rows - pole)
            for i in range(n_u):
                transient = held[p, :, i, None, None] / np.sqrt(spectra.n_samples) * z  # (experiments, B, m)
                seen = (spectra.U[:, i][:, rows - 1] - transient) * ratio
                wrong = np.abs(np.einsum("bem,ebm->b", weights[:, i], seen) - 1.0)
                error[p, part] = np.maximum(error[p, part], wrong)
    for undetermined in (gain, error):
        undetermined[np.isnan(undetermined)] = np.inf
    return Expected(gain, error)


def last_states(u: Array, poles: Complex) -> Complex:
    """x(N) of x(n+1) = gamma x(n) + u_i(n) from zero, (n_p, experiments, n_u); `poles` are p T_s, gamma = exp(p T_s)."""
    ages = np.arange(u.shape[1] - 1, -1, -1)
    return np.stack([np.einsum("n,eni->ei", np.exp(pole * ages), u) for pole in poles])
