"""Interior windows of equal records, many at a time: modified Gram-Schmidt with the bins along the last axis.

The columns of every window are [transient | U_1 x^R ... U_1 x^1 | U_2 x^R ... | U x^0 | Y]. After
orthogonalisation, G and its block of (K^H K)^-1 follow from the last n_u columns alone, and what is left of Y is the
residual: no Q, no solution with the whole triangle, and no normal equations, whose squared condition number would
spoil the residual of clean data.
For polynomials the transient is removed by one constant matrix, the orthonormal complement of the powers.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from ._basis import LocalBasis
from ._records import Spectrum

Array = NDArray[Any]

_scratch = threading.local()
_DOUBTFUL = 1e-14  # remaining energy of a regressor relative to its input; below it `_windows` decides the rank


@dataclass(frozen=True)
class ChunkFit:
    """Results of consecutive interior bins; `noise` holds the diagonal (n_y, B) or the matrix (n_y, n_y, B)."""

    response: Array
    gram: Array
    noise: Array
    doubtful: Array  # (B,) bool: to be solved again with a rank decision


class Kernel:
    """Solver of chunks of interior windows for one set of spectra and one basis."""

    def __init__(self, spectra: Sequence[Spectrum], basis: LocalBasis):
        self.spectra, self.basis = spectra, basis
        self.n_u, self.n_y = spectra[0].U.shape[0], spectra[0].Y.shape[0]
        offsets = np.arange(-basis.half_width, basis.half_width + 1.0)
        self.powers = basis.powers(offsets)  # (m, R+1)
        self.n_columns = self.n_u * basis.size + self.n_y
        self.degrees_of_freedom = len(spectra) * (basis.n_points - basis.size) - self.n_u * basis.size
        if not basis.poles.size:
            complement = np.linalg.qr(self.powers, mode="complete")[0][:, basis.size :].T
            descending = self.powers.T[:0:-1, None, :]
            self.project_powers = (complement * descending).reshape(-1, basis.n_points)
            self.project_constant = np.ascontiguousarray(complement)

    def solve(self, start: int, stop: int, *, full_noise: bool) -> ChunkFit:
        """Windows centred at bins start ... stop-1, counted from 1; all of them must fit between the edges."""
        columns = self._rational(start, stop) if self.basis.poles.size else self._polynomial(start, stop)
        energy = self._input_energy(start, stop)
        return self._orthogonalise(columns, energy, full_noise=full_noise)

    def _slices(self, start: int, stop: int) -> slice:
        return slice(start - 1 - self.basis.half_width, stop - 1 + self.basis.half_width)

    def _polynomial(self, start: int, stop: int) -> Array:
        """Columns with the transient projected out, (n_columns, rows, B)."""
        degree, n_u, m = self.basis.degree, self.n_u, self.basis.n_points
        part, rows = self._slices(start, stop), m - self.basis.size
        columns = _buffer("columns", (self.n_columns, len(self.spectra) * rows, stop - start))
        for place, spectrum in enumerate(self.spectra):
            mine = columns[:, place * rows : (place + 1) * rows]
            for i in range(n_u):
                windows = _windows(spectrum.U[i, part], m)
                if degree:
                    _multiply(self.project_powers, windows, mine[i * degree : (i + 1) * degree])
                _multiply(self.project_constant, windows, mine[degree * n_u + i, None])
            for o in range(self.n_y):
                _multiply(self.project_constant, _windows(spectrum.Y[o, part], m), mine[degree * n_u + n_u + o, None])
        return columns

    def _rational(self, start: int, stop: int) -> Array:
        """The same with prescribed poles: the transient functions differ between bins and are orthogonalised first."""
        size, degree, n_u, m = self.basis.size, self.basis.degree, self.n_u, self.basis.n_points
        part, width = self._slices(start, stop), stop - start
        # D(k)/D(k+r): the denominator of every bin once, then its windows.
        D = self.basis.denominator(np.arange(start - self.basis.half_width, stop + self.basis.half_width, dtype=float))
        row_weights = _windows(1.0 / D, m).view(complex) * D[self.basis.half_width : -self.basis.half_width]
        shape = (size, m, width)
        descending = np.multiply(self.powers.T[::-1, :, None], row_weights, out=_buffer("descending", shape))
        functions = _buffer("functions", shape)
        functions[...] = descending
        for s in range(size):
            _remove(functions[s], functions[s + 1 :], 0.0)
        columns = _buffer("columns", (self.n_columns, len(self.spectra) * m, width))
        for place, spectrum in enumerate(self.spectra):
            mine = columns[:, place * m : (place + 1) * m]
            for i in range(n_u):
                U = _windows(spectrum.U[i, part], m).view(complex)
                for s in range(degree):
                    np.multiply(descending[s], U, out=mine[i * degree + s])
                np.multiply(descending[degree], U, out=mine[degree * n_u + i])
            for o in range(self.n_y):
                mine[size * n_u + o] = _windows(spectrum.Y[o, part], m).view(complex)
            for function in functions:
                _remove(function, mine, 0.0)
        return columns

    def _input_energy(self, start: int, stop: int) -> Array:
        """Energy of each input in each window, all records together, (n_u, B)."""
        part, m = self._slices(start, stop), self.basis.n_points
        energy = np.zeros((self.n_u, stop - start))
        for spectrum in self.spectra:
            U = spectrum.U[:, part]
            sums = np.cumsum(U.real**2 + U.imag**2, axis=1)
            energy += sums[:, m - 1 :]
            energy[:, 1:] -= sums[:, :-m]
        return energy

    def _orthogonalise(self, columns: Array, energy: Array, *, full_noise: bool) -> ChunkFit:
        size, n_u, width = self.basis.size, self.n_u, columns.shape[2]
        n_k = size * n_u
        doubtful = np.zeros(width, dtype=bool)
        triangle = np.empty((n_u, columns.shape[0], width), dtype=complex)  # rows of R that belong to U x^0
        for c in range(n_k):
            of_input = c // self.basis.degree if c < n_k - n_u else c - n_k + n_u
            norms, coefficients = _remove(columns[c], columns[c + 1 :], _DOUBTFUL * energy[of_input])
            doubtful |= norms == 0.0
            if c >= n_k - n_u:
                triangle[c - n_k + n_u, c] = norms
                triangle[c - n_k + n_u, c + 1 :] = coefficients
        inverse = _invert_triangle(triangle[:, n_k - n_u : n_k])
        response = np.einsum("ijb,job->oib", inverse, triangle[:, n_k:])
        gram = np.einsum("iab,jab->ijb", inverse, inverse.conj())
        residual = columns[n_k:]
        if full_noise and self.n_y > 1:
            pairs = [_sum_rows((residual * row.conj()).view(float)).view(complex) for row in residual]
            noise = np.stack(pairs, axis=1)
        else:
            noise = np.stack([_energy(row) for row in residual])
            noise = noise[None] if full_noise else noise
        return ChunkFit(response, gram, noise / self.degrees_of_freedom, doubtful)


def _buffer(name: str, shape: tuple[int, ...]) -> Array:
    """Complex array for use within one chunk, kept by each thread: fresh memory for every chunk costs more than it."""
    size, kept = math.prod(shape), _scratch.__dict__
    if name not in kept or kept[name].size < size:
        kept[name] = np.empty(size, dtype=complex)
    return np.asarray(kept[name][:size].reshape(shape))


def _windows(spectrum: Array, m: int) -> Array:
    """Row r holds the bins shifted by r, as pairs of real numbers: (m, 2B); valid until the next call."""
    shape, strides = (m, spectrum.size - m + 1), (spectrum.itemsize, spectrum.itemsize)
    found = _buffer("windows", shape)
    np.copyto(found, as_strided(np.ascontiguousarray(spectrum), shape, strides, writeable=False))
    return found.view(float)


def _multiply(left: Array, windows: Array, out: Array) -> None:
    """Real matrix times complex windows (as pairs of real numbers) into `out` (n, rows, B), in place if possible."""
    if out.flags.c_contiguous:
        np.matmul(left, windows, out=out.view(float).reshape(left.shape[0], -1))
    else:
        out[...] = (left @ windows).view(complex).reshape(out.shape)


def _sum_rows(values: Array) -> Array:
    """Sum over the last axis but one, by BLAS: unlike np.sum it lets other threads run."""
    return np.asarray(np.matmul(np.ones((1, values.shape[-2])), values)[..., 0, :])


def _energy(column: Array) -> Array:
    """Sum of |.|^2 over the rows of (rows, B), through the pairs of real numbers: squares of .real would be strided."""
    pairs = column.view(float)
    sums = _sum_rows(np.multiply(pairs, pairs, out=_buffer("work", column.shape).view(float)))
    return np.asarray(sums[0::2] + sums[1::2])


def _remove(column: Array, others: Array, floor: Array | float) -> tuple[Array, Array]:
    """Remove `column` (rows, B) from `others` (n, rows, B) in place, where its energy is above `floor`.

    Returns the row of the triangular factor: the norms of the column (B,), zero where it is not above the floor and
    nothing was removed, and the coefficients of the others (n, B).
    """
    square = _energy(column)
    norms = np.sqrt(np.where(square > floor, square, 0.0))
    inverse = np.divide(1.0, norms, out=np.zeros_like(norms), where=norms > 0.0)
    # All columns at once: long calls, during which another thread can have the interpreter.
    conjugate = np.conjugate(column, out=_buffer("conjugate", column.shape))
    work = np.multiply(conjugate, others, out=_buffer("work", others.shape))
    coefficients = _sum_rows(work.view(float)).view(complex)
    coefficients *= inverse
    np.multiply(column, (coefficients * inverse)[:, None], out=work)
    others -= work
    return norms, coefficients


def _invert_triangle(triangle: Array) -> Array:
    """Inverse of upper triangles (n, n, B); zero diagonal entries give zeros, their bins are solved again."""
    n = triangle.shape[0]
    inverse = np.zeros_like(triangle)
    for j in range(n):
        inverse[j, j] = np.divide(1.0, triangle[j, j], out=np.zeros_like(triangle[j, j]), where=triangle[j, j] != 0.0)
        for i in range(j - 1, -1, -1):
            total = sum(triangle[i, k] * inverse[k, j] for k in range(i + 1, j + 1))
            inverse[i, j] = -total * np.divide(
                1.0, triangle[i, i], out=np.zeros_like(triangle[i, i]), where=triangle[i, i] != 0.0
            )
    return inverse
