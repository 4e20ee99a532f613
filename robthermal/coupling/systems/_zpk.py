"""Zeros, poles and gain: the form in which cancellations are exact and low frequencies stay accurate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..._arrays import Array

_SAME = 1e-9  # relative distance below which a stable pole and a zero are one


@dataclass(frozen=True, eq=False)
class Zpk:
    """gain * prod(lambda - zeros) / prod(lambda - poles), lambda = s or z.

    Parameters
    ----------
    zeros, poles : ndarray of complex
        Finite roots, in conjugate pairs.
    gain : float
        Leading coefficient of the numerator.
    dt : float
        Sample time [s]; 0 in continuous time.
    """

    zeros: Array
    poles: Array
    gain: float
    dt: float

    @property
    def excess(self) -> int:
        """Relative degree: poles minus zeros."""
        return len(self.poles) - len(self.zeros)

    def at(self, omega: ArrayLike) -> Array:
        """Frequency response at frequencies [rad/s]; infinite at a pole."""
        frequencies = np.asarray(omega, dtype=float)
        flat = frequencies.reshape(-1)
        shift, origin = from_origin(flat, self.dt)
        value = np.full(flat.shape, complex(self.gain))
        with np.errstate(divide="ignore", invalid="ignore"):
            for k in range(max(len(self.zeros), len(self.poles))):  # alternately, so that no product overflows
                if k < len(self.zeros):
                    value = value * (shift + (origin - self.zeros[k]))
                if k < len(self.poles):
                    value = value / (shift + (origin - self.poles[k]))
        return value.reshape(frequencies.shape)

    def at_infinity(self) -> float:
        """Direct feedthrough."""
        return float(self.gain) if self.excess == 0 else 0.0

    def inverse(self) -> Zpk:
        """1 / self, proper or not."""
        return Zpk(self.poles, self.zeros, 1.0 / self.gain, self.dt)

    def times(self, *others: Zpk) -> Zpk:
        """Product; roots that are equal to the last bit cancel, wherever they are."""
        factors = (self, *others)
        zeros = [complex(z) for factor in factors for z in factor.zeros]
        poles = []
        for pole in (complex(p) for factor in factors for p in factor.poles):
            if pole in zeros:
                zeros.remove(pole)
            else:
                poles.append(pole)
        gain = float(np.prod([factor.gain for factor in factors]))
        return Zpk(np.array(zeros, dtype=complex), np.array(poles, dtype=complex), gain, self.dt)

    def negated(self) -> Zpk:
        """-self."""
        return Zpk(self.zeros, self.poles, -self.gain, self.dt)

    def without_hidden(self) -> Zpk:
        """Without stable pole-zero pairs closer than rounding; unstable ones stay, for the stability check to find."""
        zeros, poles = list(self.zeros), []
        for pole in self.poles:
            near = [k for k, z in enumerate(zeros) if abs(z - pole) <= _SAME * max(abs(pole), self._unit())]
            if near and bool(stable(np.array([pole]), self.dt)[0]):
                del zeros[near[0]]
            else:
                poles.append(pole)
        return Zpk(np.array(zeros, dtype=complex), np.array(poles, dtype=complex), self.gain, self.dt)

    def _unit(self) -> float:
        return 1.0 if self.dt else 1e-12


def constant(value: float, dt: float) -> Zpk:
    """A gain.

    Parameters
    ----------
    value : float
        The constant gain.
    dt : float
        Sample time of the loop [s].
    """
    return Zpk(np.array([], dtype=complex), np.array([], dtype=complex), float(value), dt)


def from_origin(omega: Array, dt: float) -> tuple[Array, float]:
    """Lambda minus its value at zero frequency, without cancellation, and that value.

    Parameters
    ----------
    omega : ndarray
        Frequencies of the responses [rad/s].
    dt : float
        Sample time [s]; 0 in continuous time.
    """
    if not dt:
        return 1j * omega, 0.0
    half = omega * dt / 2  # exp(j theta) - 1 = 2j sin(theta/2) exp(j theta/2)
    return 2j * np.sin(half) * np.exp(1j * half), 1.0


def stable(roots: Array, dt: float) -> Array:
    """Whether each root is inside the unit circle or in the left half-plane.

    Parameters
    ----------
    roots : ndarray of complex
        Poles or zeros.
    dt : float
        Sample time [s]; 0 in continuous time.
    """
    return np.abs(roots) < 1.0 if dt else np.real(roots) < 0.0


def on_boundary(roots: Array, dt: float, tolerance: float = 1e-7) -> Array:
    """Whether each root lies on the unit circle or imaginary axis, to rounding.

    Parameters
    ----------
    roots : ndarray of complex
        Poles or zeros.
    dt : float
        Sample time [s]; 0 in continuous time.
    tolerance : float
        Relative distance that counts as none.
    """
    if dt:
        return np.abs(np.abs(roots) - 1.0) <= tolerance
    return np.abs(np.real(roots)) <= tolerance * np.maximum(np.abs(roots), 1e-12)


def natural(roots: Array, dt: float) -> Array:
    """Continuous-time equivalents s [rad/s]: log(z)/dt, or the roots themselves.

    Parameters
    ----------
    roots : ndarray of complex
        Poles or zeros.
    dt : float
        Sample time [s]; 0 in continuous time.
    """
    roots = np.asarray(roots, dtype=complex)
    if not dt:
        return roots
    rates = np.full(roots.shape, complex(-np.inf))
    known = roots != 0  # a delay has no finite equivalent
    rates[known] = np.log(roots[known]) / dt
    return rates
