"""What the transient explains in every window of a chunk, by orthonormal functions of the offset.

For polynomials these functions are the same in every window. With prescribed poles plant and transient share the
denominator: with w = exp(j kappa delta R/2)/D at bin kappa, their functions are w phi_s U_i and w phi_s with the real
phi_s of `LocalBasis.real_functions`, so that only the moments of |w|^2 and |w|^2 U_i, w* Y are new.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import Array
from ._basis import LocalBasis
from ._moments import Moments, in_blocks


class ConstantTransient:
    """Polynomials: orthonormal functions that are the same for all windows."""

    def __init__(self, basis: LocalBasis):
        functions = basis.real_functions()
        orthonormal = np.linalg.qr(functions.T)[0].T
        self._size, self._constant = basis.size, Moments(orthonormal)
        self._powers = Moments((functions[:0:-1, None] * orthonormal).reshape(-1, basis.n_points))

    def project(self, U: Array, Y: Array, found: Array, blocks: Array) -> None:
        """Components (columns, R+1, B) of all columns along the orthonormal functions into `found`."""
        n_u, degree = len(U), self._size - 1
        for i, sequence in enumerate(U):
            neighbors = in_blocks(sequence, blocks)
            if degree:
                part = found[i * degree : (i + 1) * degree]
                self._powers(neighbors, part.reshape(degree * self._size, -1))
            self._constant(neighbors, found[n_u * degree + i])
        for o, sequence in enumerate(Y):
            self._constant(in_blocks(sequence, blocks), found[n_u * self._size + o])


@dataclass(frozen=True)
class Weights:
    """Of one chunk: the common factor of all functions, and the factors L D L' of the transient's normal equations."""

    sequence: Array  # w, complex, of all bins that the windows reach
    factors: Array  # (R+1, R+1, B), real numbers stored as complex: D^(-1/2) on the diagonal, column s of L in row s
    least: Array  # (B,): least energy left of a function, relative to the first


class WeightedTransient:
    """Rational functions with prescribed poles: orthogonalized in every window, from the moments of |w|^2."""

    def __init__(self, basis: LocalBasis):
        self._basis = basis
        self._products, self._functions = Moments(basis.real_products()), Moments(basis.real_functions())

    def weights(self, start: int, blocks: Array, moments: Array, factors: Array) -> Weights:
        """Of the windows centered at bin `start`, counted from 1, and the next; the arrays are used for the result.

        `blocks` and `moments` (2R+1, B) are real; `factors` (R+1, R+1, B) is complex with imaginary part zero.
        """
        basis, size, width = self._basis, self._basis.size, moments.shape[-1]
        bins = np.arange(start - basis.half_width, start + width + basis.half_width, dtype=float)
        w = 1.0 / basis.rotated_denominator(bins)
        self._products(in_blocks(w.real**2 + w.imag**2, blocks), moments)
        left = [moments[s : s + size].copy() for s in range(size)]
        least = np.ones(width)
        for s, row in enumerate(left):
            np.minimum(least, row[s] / moments[0], out=least)
            inverse = 1.0 / row[s]
            factors[s, s].real = np.sqrt(inverse)
            for t in range(s + 1, size):
                factor = row[t] * inverse
                left[t][t:] -= factor * row[t:]
                factors[s, t].real = factor
        return Weights(w, factors, least)

    def project(
        self, known: Weights, U: Array, Y: Array, found: Array, blocks: Array, moments: Array, scratch: Array
    ) -> None:
        """As `ConstantTransient.project`; U already multiplied by w, `moments` (2R+1, B), `scratch` like `found`."""
        n_u, size = len(U), self._basis.size
        degree, conjugate = size - 1, known.sequence.conj()
        for i, sequence in enumerate(U):
            self._products(in_blocks(conjugate * sequence, blocks), moments)
            for s in range(size):
                place = i * degree + degree - s if s else n_u * degree + i
                found[place] = moments[s : s + size]
        for o, sequence in enumerate(Y):
            self._functions(in_blocks(conjugate * sequence, blocks), found[n_u * size + o])
        for s in range(size):
            if s < degree:
                below = np.multiply(known.factors[s, s + 1 :], found[:, s, None], out=scratch[:, s + 1 :])
                np.subtract(found[:, s + 1 :], below, out=found[:, s + 1 :])
            found[:, s] *= known.factors[s, s]
