"""Local basis of the plant and of the transient: polynomials, or rational functions with prescribed poles."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .._arrays import Array

_TURNS = 64  # neighboring bins whose angles are sums of one common angle and one of as many


@dataclass(frozen=True)
class LocalBasis:
    """Functions of the offset r [bins] from the center k of a window, 1 at r = 0 for the first, 0 there for the others.

    Without poles, (r/l)^s for s = 0 ... degree: the local polynomial method, Evers (3.16).
    With n poles, x^s D(k)/D(k+r), s = 0 ... n, with x proportional to exp(j r delta) - 1, D(k) = prod(z_k - gamma_i),
    z_k = exp(j k delta). These span the constant and the n functions with poles gamma_i, hence the same space as
    (4.23) with the constant added, but stay well conditioned far from the poles, where (4.23) is nearly collinear.
    In z, not in omega, because under zero-order hold response and transient are rational in z, Evers (4.5)-(4.6).
    """

    half_width: int
    degree: int
    n_samples: int  # of the record whose bins are the frequency grid
    poles: Array = field(default_factory=lambda: np.empty(0, dtype=complex))  # p T_s, dimensionless: gamma = exp(p T_s)

    @property
    def n_points(self) -> int:
        return 2 * self.half_width + 1

    @property
    def size(self) -> int:
        return self.degree + 1

    @property
    def transient_size(self) -> int:
        """Functions of the transient of one record."""
        return self.size

    @property
    def sliding(self) -> bool:
        """Whether the sums of neighboring windows share their terms, so that the fast solvers can be used."""
        return True

    @property
    def step(self) -> float:
        """Angle between neighboring bins [rad]."""
        return 2.0 * np.pi / self.n_samples

    def powers(self, offsets: Array) -> Array:
        """Powers of the local variable at `offsets` [bins], of shape (*offsets.shape, degree+1)."""
        if self.poles.size:
            x = np.expm1(1j * self.step * offsets) / (self.step * self.half_width)
        else:
            x = offsets / self.half_width
        return np.stack([x**s for s in range(self.size)], axis=-1)

    def functions(self, bins: Array, offsets: Array) -> tuple[Array, Array]:
        """Functions of plant and transient, (B, m, size) and (B, m, transient_size), with `bins` (B,) counted from 1
        and `offsets` (B, m)."""
        found = self.powers(offsets) * self.weights(bins, offsets)[..., None]
        return found, found

    def real_functions(self) -> Array:
        """Real functions phi_s of the offsets -l ... l, (R+1, m), that span the powers up to a common phase."""
        sine, cosine = self._sine_cosine()
        return np.stack([sine**s * cosine ** (self.degree - s) for s in range(self.size)])

    def real_products(self) -> Array:
        """psi_p with phi_s phi_t = psi_(s+t), p = 0 ... 2R, (2R+1, m)."""
        sine, cosine = self._sine_cosine()
        return np.stack([sine**p * cosine ** (2 * self.degree - p) for p in range(2 * self.degree + 1)])

    def _sine_cosine(self) -> tuple[Array, Array]:
        """Without poles r/l and 1; else 2 sin(r delta/2)/(l delta) and cos(r delta/2), whose products of degree R span
        exp(-j r delta R/2) x^s."""
        offsets = np.arange(-self.half_width, self.half_width + 1.0)
        if not self.poles.size:
            return offsets / self.half_width, np.ones_like(offsets)
        half = 0.5 * self.step * offsets
        return np.sin(half) / (0.5 * self.step * self.half_width), np.cos(half)

    def denominator(self, bins: Array) -> Array:
        """D = prod(z - gamma_i) at (fractional) bins; one when there are no poles."""
        return np.asarray(np.exp(0.5j * self.poles.size * self.step * bins) * self.rotated_denominator(bins))

    def rotated_denominator(self, bins: Array) -> Array:
        """D/z^(n/2) for n poles, the product of (1 - gamma) cos(theta/2) + j (1 + gamma) sin(theta/2), z = e^(j theta):
        no cancellation for slow poles at low bins."""
        D, half = np.ones(np.shape(bins), dtype=complex), 0.5 * self.step * bins
        cosine, sine = np.cos(half), np.sin(half)
        for alpha, beta in self.factors_of_denominator():
            D *= alpha * cosine + 1j * beta * sine
        return D

    def factors_of_denominator(self) -> Array:
        """alpha and beta (n_poles, 2) whose products of alpha cos(theta/2) + j beta sin(theta/2) are D/z^(n/2)."""
        return np.stack([-np.expm1(self.poles), 1.0 + np.exp(self.poles)], axis=-1)

    def half_turns(self, start: int, stop: int) -> Array:
        """exp(j theta/2) of bins start ... stop-1, to rounding in both parts: products of two angles from 0 to pi/2."""
        first, length = start // _TURNS, -(-stop // _TURNS)
        coarse = np.exp(0.5j * self.step * _TURNS * np.arange(first, length))
        fine = np.exp(0.5j * self.step * np.arange(_TURNS))
        return np.outer(coarse, fine).ravel()[start - first * _TURNS : stop - first * _TURNS]

    def weights(self, bins: Array, offsets: Array) -> Array:
        """D(k)/D(k+r), with `bins` (B,) counted from 1 and `offsets` (B, m)."""
        return np.asarray(self.denominator(bins)[:, None] / self.denominator(bins[:, None] + offsets))


def window_starts(bins: Array, n_bins: int, n_points: int) -> Array:
    """First bin (from 1) of each window: centered, shifted at the edges, never wrapped over bin 0 or Nyquist."""
    return np.clip(bins - n_points // 2, 1, n_bins - n_points + 1)
