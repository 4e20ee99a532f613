"""Interior windows of equal records through their normal equations, from moments of a few sequences.

With real functions phi_s(r) whose products phi_s phi_t = psi_(s+t) depend on s + t alone, the normal equations of
every window are sums over it of |U|^2, U_i* U_j, U_i* Y_o, |Y|^2, U and Y times fixed functions (`Moments`). What the
transient explains is taken away by its orthonormal functions (`_transients`); the regressors are eliminated for all
bins of a chunk at a time. With prescribed poles every U is multiplied by w at its bin first, and G is w times what the
regressor w U says.

Normal equations square the condition number. What that costs is known bin by bin, from the energy that is left of
each regressor and of each output: where it is too much, `_kernel` orthogonalizes instead.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np

from .._arrays import Array
from ._basis import LocalBasis
from ._kernel import BlockFit, fit_of_triangle
from ._moments import BLOCK, Moments, in_blocks, ordered
from ._records import Spectrum
from ._transients import ConstantTransient, WeightedTransient, Weights

WEAK_PIVOT = 1e-6  # energy left of a regressor, relative to its input: rounding costs 1e-16/1e-6 of G
WEAK_RESIDUAL = 1e-8  # energy left of an output, relative to it: rounding costs 1e-15/1e-8 of the noise variance
WEAK_BOTH = 1e-10  # their product: large coefficients amplify the rounding of what is left, 1e-16/1e-10
# Bins of a chunk, and bytes of its normal equations: calls are long, memory is near, rows do not share cache lines
# as they would 2**k bytes apart.
_WIDEST, _BYTES = 4112, 2**23


class _Work:
    """Arrays of one chunk, used again for the next: fresh memory costs more than what is computed in it."""

    def __init__(self, n_u: int, n_y: int, size: int, m: int, width: int):
        n = n_u * size + n_y
        self.H = np.empty((n, n, width), dtype=complex)
        self.energy = np.empty((n_u + n_y, width))
        self.product = np.empty(width + m - 1, dtype=complex)
        self.squares, self.power = np.empty(2 * (width + m - 1)), np.empty(width + m - 1)
        self.blocks = np.empty((BLOCK + m - 1, width // BLOCK), dtype=complex)
        self.real_blocks = np.empty(self.blocks.shape)
        self.real_sums, self.sums = np.empty((2 * size - 1, width)), np.empty((2 * size - 1, width), dtype=complex)
        self.transient, self.conjugate = np.empty((2, n, size, width), dtype=complex)
        self.term = np.empty((n, width), dtype=complex)
        # Real numbers stored as complex, imaginary part zero: products of one type run several times faster.
        self.inverse, self.factors = np.zeros(width, dtype=complex), np.zeros((size, size, width), dtype=complex)

    def power_of(self, sequence: Array) -> Array:
        """|.|^2 of a sequence, in blocks."""
        pairs = sequence.view(float)
        np.multiply(pairs, pairs, out=self.squares)
        np.add(self.squares[0::2], self.squares[1::2], out=self.power)
        return in_blocks(self.power, self.real_blocks)

    def product_of(self, first: Array, second: Array) -> Array:
        """Product of two sequences, in blocks."""
        return in_blocks(np.multiply(first, second, out=self.product), self.blocks)


class NormalKernel:
    """Solver of chunks of interior windows.

    Parameters
    ----------
    spectra : sequence of Spectrum
        Records of equal length.
    basis : LocalBasis
        Functions of plant and transient.
    """

    def __init__(self, spectra: Sequence[Spectrum], basis: LocalBasis):
        self.spectra, self.basis = spectra, basis
        self.n_u, self.n_y = spectra[0].U.shape[0], spectra[0].Y.shape[0]
        self._n_k = self.n_u * basis.size
        functions = basis.real_functions()
        self._products, self._functions = Moments(basis.real_products()), Moments(functions)
        self._one = Moments(np.ones((1, basis.n_points)))
        self._constant = None if basis.poles.size else ConstantTransient(basis)
        self._weighted = WeightedTransient(basis) if basis.poles.size else None
        self.degrees_of_freedom = len(spectra) * (basis.n_points - basis.size) - self._n_k
        self._local = threading.local()

    @property
    def chunk(self) -> int:
        """Bins to solve at a time."""
        return max(256, min(_WIDEST, _BYTES // (16 * (self._n_k + self.n_y) ** 2) // BLOCK * BLOCK))

    def solve(self, start: int, stop: int, *, full_noise: bool) -> BlockFit:
        """Windows centered at bins start ... stop-1, counted from 1; all of them must fit between the edges.

        `doubtful` are the bins where the squared condition number costs too much.
        """
        count = stop - start
        width, n_k = -(-count // BLOCK) * BLOCK, self._n_k
        work = self._work(width)
        part = slice(start - 1 - self.basis.half_width, stop - 1 + self.basis.half_width)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            known = (self._weighted.weights(start, work.real_blocks, work.real_sums, work.factors)
                     if self._weighted else None)
            for place, spectrum in enumerate(self.spectra):
                U, Y = _padded(spectrum.U[:, part], width - count), _padded(spectrum.Y[:, part], width - count)
                if place:
                    before = work.H.copy(), work.energy.copy()
                self._add_up(U, Y, known, work, full_noise)
                if place:
                    work.H += before[0]
                    work.energy += before[1]
            weak = self._eliminate(work, known.least if known else np.ones(width), full_noise)
            response, gram = fit_of_triangle(ordered(work.H[n_k - self.n_u : n_k, n_k - self.n_u :], count))
        if known:
            w = known.sequence[self.basis.half_width : self.basis.half_width + count]
            response *= w
            gram *= w.real**2 + w.imag**2
        return BlockFit(response, gram, self._noise(work.H[n_k:, n_k:], count, full_noise), ordered(weak, count))

    def _add_up(self, U: Array, Y: Array, known: Weights | None, work: _Work, full_noise: bool) -> None:
        """Products of all columns of one record, without what the transient explains."""
        if self._weighted and known:
            U = U * known.sequence
            self._multiply(U, Y, work, full_noise)
            self._weighted.project(known, U, Y, work.transient, work.blocks, work.sums, work.conjugate)
        elif self._constant:
            self._multiply(U, Y, work, full_noise)
            self._constant.project(U, Y, work.transient, work.blocks)
        self._remove_transient(work, full_noise)

    def _noise(self, left: Array, count: int, full: bool) -> Array:
        """E[V_o V_p*] from the upper triangle of what is left of the products Y_o* Y_p, or its diagonal."""
        with np.errstate(divide="ignore", invalid="ignore"):  # no degree of freedom left: not known
            return self._spread(left, count, full)

    def _spread(self, left: Array, count: int, full: bool) -> Array:
        if not full:
            return ordered(np.einsum("oob->ob", left).real, count) / self.degrees_of_freedom
        noise = np.empty((self.n_y, self.n_y, count), dtype=complex)
        for o in range(self.n_y):
            for p in range(o, self.n_y):
                noise[p, o] = ordered(left[o, p], count)
                noise[o, p] = noise[p, o].conj()
            noise[o, o].imag = 0.0
        noise /= self.degrees_of_freedom
        return noise

    def _work(self, width: int) -> _Work:
        kept: _Work | None = getattr(self._local, "work", None)
        if kept is None or kept.inverse.size != width:
            kept = self._local.work = _Work(self.n_u, self.n_y, self.basis.size, self.basis.n_points, width)
        return kept

    def _multiply(self, U: Array, Y: Array, work: _Work, full_noise: bool) -> None:
        """Upper triangle of the products of all columns of the windows of one record."""
        n_u, n_y, n_k, degree, H = self.n_u, self.n_y, self._n_k, self.basis.degree, work.H
        conjugate = U.conj()
        for i in range(n_u):
            own = self._products(work.power_of(U[i]), work.real_sums)
            work.energy[i] = own[0]
            for s in range(degree + 1):
                row, first = self._column(i, s), i * degree + degree - s
                H[row, first : first + s] = own[2 * s : s : -1]
                H[row, n_u * degree + i] = own[s]
            for j in range(i + 1, n_u):
                cross = self._products(work.product_of(conjugate[i], U[j]), work.sums)
                for s, t in ((s, t) for s in range(degree + 1) for t in range(degree + 1)):
                    row, column = self._column(i, s), self._column(j, t)
                    if row < column:
                        H[row, column] = cross[s + t]
                    else:
                        np.conjugate(cross[s + t], out=H[column, row])
            for o in range(n_y):
                cross = self._functions(work.product_of(conjugate[i], Y[o]), work.sums[: degree + 1])
                H[i * degree : (i + 1) * degree, n_k + o] = cross[:0:-1]
                H[n_u * degree + i, n_k + o] = cross[0]
        for o in range(n_y):
            own = self._one(work.power_of(Y[o]), work.real_sums[:1])[0]
            H[n_k + o, n_k + o] = work.energy[n_u + o] = own
            for p in range(o + 1, n_y if full_noise else 0):
                self._one(work.product_of(Y[o].conj(), Y[p]), H[n_k + o, n_k + p, None])

    def _remove_transient(self, work: _Work, full_noise: bool) -> None:
        """Take away what the orthonormal functions of the transient explain."""
        np.conjugate(work.transient, out=work.conjugate)
        for a in range(self.basis.size):
            self._take_away(work.transient[:, a], work.conjugate[:, a], 0, work, full_noise)

    def _eliminate(self, work: _Work, least: Array, full_noise: bool) -> Array:
        """Cholesky factorization in place, as far as the regressors; which bins are weak, with `least` before."""
        n_u, n_k, H, degree = self.n_u, self._n_k, work.H, self.basis.degree
        scale, conjugates = 1.0 / work.energy[:n_u], work.conjugate[:, 0]
        for c in range(n_k):
            pivot, constant = H[c, c].real, c - n_u * degree
            np.minimum(least, pivot * scale[constant if constant >= 0 else c // degree], out=least)
            root = np.sqrt(pivot)
            np.divide(1.0, root, out=work.inverse.real)
            H[c, c] = root
            row = np.multiply(H[c, c + 1 :], work.inverse, out=H[c, c + 1 :])
            np.conjugate(row, out=conjugates[c + 1 :])
            self._take_away(H[c], conjugates, c + 1, work, full_noise)
        fine = least > WEAK_PIVOT  # not where least is NaN
        for o in range(self.n_y):
            left = H[n_k + o, n_k + o].real / work.energy[n_u + o]
            fine &= (left > WEAK_RESIDUAL) & (left * least > WEAK_BOTH)
        return np.logical_not(fine)

    def _take_away(self, row: Array, conjugate: Array, first: int, work: _Work, full_noise: bool) -> None:
        """Subtract conj(row_d) row_e from entry (d, e) of the upper triangle, d from `first`."""
        n, H, term = len(work.H), work.H, work.term
        for d in range(first, n):
            stop = n if full_noise or d < self._n_k else d + 1
            own = H[d, d:stop]
            np.subtract(own, np.multiply(conjugate[d], row[d:stop], out=term[d:stop]), out=own)

    def _column(self, i: int, s: int) -> int:
        """Place of the regressor phi_s U_i: the constants of G come last."""
        degree = self.basis.degree
        return i * degree + degree - s if s else self.n_u * degree + i


def _padded(sequences: Array, more: int) -> Array:
    return np.pad(sequences, ((0, 0), (0, more))) if more else np.ascontiguousarray(sequences)
