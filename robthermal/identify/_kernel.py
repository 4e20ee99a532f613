"""Interior windows of equal records, many at a time: modified Gram-Schmidt with the bins along the last axis.

The columns of every window are [transient | U_1 x^R ... U_1 x^1 | U_2 x^R ... | U x^0 | Y]. After
orthogonalization, G and its block of (K^H K)^-1 follow from the last n_u columns alone, and what is left of Y is the
residual: no Q, no solution with the whole triangle, and no normal equations, whose squared condition number would
spoil the residual of clean data.
For polynomials the transient is removed by one constant matrix, the orthonormal complement of the powers.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import as_strided

from .._arrays import Array
from ._basis import LocalBasis
from ._records import Spectrum

_scratch = threading.local()
_DOUBTFUL = 1e-14  # remaining energy of a regressor relative to its input; below it `_windows` decides the rank


@dataclass(frozen=True)
class BlockFit:
    """Results of consecutive interior bins; `noise` holds the diagonal (n_y, B) or the matrix (n_y, n_y, B)."""

    response: Array
    gram: Array
    noise: Array
    doubtful: Array  # (B,) bool: to be solved again with a rank decision
    variance: Array | None = None  # (n_y, B): the diagonal, where it was written too


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

    def solve(self, start: int, stop: int, *, chunk: int, full_noise: bool) -> BlockFit:
        """Windows centered at bins start ... stop-1, counted from 1; all of them must fit between the edges.

        The windows are orthogonalized `chunk` bins at a time, which stay in the cache; what follows from the last
        columns is small and is done for all bins at once, in calls long enough for other threads to run meanwhile.
        """
        count, n_k = stop - start, self.n_u * self.basis.size
        triangle = np.zeros((self.n_u, self.n_u + self.n_y, count), dtype=complex)
        remains = np.empty((n_k, count))
        shape = (self.n_y, self.n_y, count) if full_noise else (self.n_y, count)
        noise = np.empty(shape, dtype=complex if full_noise else float)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # of doubtful bins, which are solved again
            for a in range(start, stop, chunk):
                b = min(a + chunk, stop)
                columns = self._rational(a, b) if self.basis.poles.size else self._polynomial(a, b)
                part = slice(a - start, b - start)
                self._orthogonalize(columns, triangle[..., part], remains[:, part])
                _residual_power(columns[n_k:], noise[..., part])
                remains[:, part] /= self._energy_of_columns(a, b)
            doubtful = np.logical_not((remains > _DOUBTFUL).all(axis=0))
            response, gram = fit_of_triangle(triangle)
        noise /= self.degrees_of_freedom
        return BlockFit(response, gram, noise, doubtful)

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
        """The same with prescribed poles: the transient functions differ between bins and are orthogonalized first."""
        size, degree, n_u, m = self.basis.size, self.basis.degree, self.n_u, self.basis.n_points
        part, width = self._slices(start, stop), stop - start
        # D(k)/D(k+r): the denominator of every bin once, then its windows.
        D = self.basis.denominator(np.arange(start - self.basis.half_width, stop + self.basis.half_width, dtype=float))
        row_weights = _windows(1.0 / D, m).view(complex) * D[self.basis.half_width : -self.basis.half_width]
        shape = (size, m, width)
        descending = np.multiply(self.powers.T[::-1, :, None], row_weights, out=_buffer("descending", shape))
        functions = _buffer("functions", shape)
        functions[...] = descending
        inverses = []
        for s in range(size):
            products = _products(functions[s], functions[s:])
            inverses.append(1.0 / products[0].real)
            _subtract(functions[s], products[1:] * inverses[s], functions[s + 1 :])
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
            for function, inverse in zip(functions, inverses, strict=True):
                _subtract(function, _products(function, mine) * inverse, mine)
        return columns

    def _energy_of_columns(self, start: int, stop: int) -> Array:
        """Energy of the input of each regressor in each window, all records together, (n_k, B)."""
        part, m = self._slices(start, stop), self.basis.n_points
        energy = np.zeros((self.n_u, stop - start))
        for spectrum in self.spectra:
            U = spectrum.U[:, part]
            sums = np.cumsum(U.real**2 + U.imag**2, axis=1)
            energy += sums[:, m - 1 :]
            energy[:, 1:] -= sums[:, :-m]
        return np.concatenate([np.repeat(energy, self.basis.degree, axis=0), energy])

    def _orthogonalize(self, columns: Array, triangle: Array, remains: Array) -> None:
        """Fill the rows of the triangular factor that belong to U x^0, and the energy left of each regressor."""
        n_u = self.n_u
        n_k = n_u * self.basis.size
        for c in range(n_k):
            products = _products(columns[c], columns[c:])
            remains[c] = products[0].real
            inverse = 1.0 / remains[c]
            _subtract(columns[c], products[1:] * inverse, columns[c + 1 :])
            row = c - (n_k - n_u)
            if row >= 0:
                triangle[row, row:] = products * np.sqrt(inverse)


def _residual_power(residual: Array, noise: Array) -> None:
    """Products of the residuals (n_y, rows, B) over the rows into `noise`, all of them or the diagonal alone."""
    for o, row in enumerate(residual):
        if noise.ndim == 2:
            noise[o] = _energy(row)
        elif len(residual) == 1:
            noise[o, o] = _energy(row)
        else:
            noise[:, o] = _sum_rows((residual * row.conj()).view(float)).view(complex)


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


def _products(column: Array, columns: Array) -> Array:
    """Inner products over the rows of `column` (rows, B) with each of `columns` (n, rows, B), as (n, B)."""
    # All columns at once: few long calls, during which another thread can have the interpreter.
    conjugate = np.conjugate(column, out=_buffer("conjugate", column.shape))
    work = np.multiply(conjugate, columns, out=_buffer("work", columns.shape))
    return np.asarray(_sum_rows(work.view(float)).view(complex))


def _subtract(column: Array, coefficients: Array, others: Array) -> None:
    """Take `coefficients` (n, B) times `column` (rows, B) from `others` (n, rows, B), in place."""
    others -= np.multiply(column, coefficients[:, None], out=_buffer("work", others.shape))


def fit_of_triangle(triangle: Array) -> tuple[Array, Array]:
    """Response (n_y, n_u, B) and gram block from the last rows (n_u, n_u + n_y, B) of the triangular factor."""
    n_u = triangle.shape[0]
    inverse = _invert_triangle(triangle[:, :n_u])
    if n_u == 1:
        return (inverse * triangle[:, 1:]).swapaxes(0, 1), inverse * inverse.conj()
    response, gram = np.empty((triangle.shape[1] - n_u, *inverse.shape[1:]), dtype=complex), np.empty_like(inverse)
    for i in range(n_u):  # plane by plane: several times faster than np.einsum over the first axes
        for o, output in enumerate(response):
            output[i] = sum(inverse[i, j] * triangle[j, n_u + o] for j in range(i, n_u))
        for j in range(i, n_u):
            gram[i, j] = sum(inverse[i, a] * inverse[j, a].conj() for a in range(j, n_u))
            gram[j, i] = gram[i, j].conj()
    return response, gram


def _invert_triangle(triangle: Array) -> Array:
    """Inverse of upper triangles (n, n, B), whose diagonal is not zero."""
    n = triangle.shape[0]
    inverse = np.zeros_like(triangle)
    for j in range(n):
        inverse[j, j] = 1.0 / triangle[j, j]
        for i in range(j - 1, -1, -1):
            total = sum(triangle[i, k] * inverse[k, j] for k in range(i + 1, j + 1))
            inverse[i, j] = -total * inverse[i, i]
    return inverse
