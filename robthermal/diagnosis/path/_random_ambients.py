"""An ambient that no record holds wanders: random states beside those of the filter, of which nobody knows more."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RandomAmbients:
    """Distance θ of ambients from what the model says: θ(k+1) = pole θ(k) + n, independent, stationary from the start.

    A heat G θ flows into the lumps, constant over every sample (Ornstein and Uhlenbeck 1930: a random walk that is
    drawn back).

    Parameters
    ----------
    std : ndarray, shape (n_ambients,)
        Standard deviation of every θ [K].
    pole : float
        Per sample, between 0 and 1.
    G : ndarray, shape (n_lumps, n_ambients)
        Heat into every lump per kelvin by which an ambient is warmer [W/K].
    """

    std: Array
    pole: float
    G: Array

    @property
    def covariance(self) -> Array:
        """Of θ, (n_ambients, n_ambients) [K²]."""
        return np.diag(self.std**2)

    def beside(self, A: Array, C: Array, Q: Array, B: Array) -> tuple[Array, Array, Array]:
        """Transition, sensors and noise of [δ; θ], from those of the deviations δ; each with or without samples.

        Parameters
        ----------
        A, C, Q : ndarray
            Transition, readings by deviations, and what every sample adds.
        B : ndarray, shape (..., n_z, n_lumps)
            How heats that are constant over a sample enter.
        """
        n, nz, na = A.shape[:-2], A.shape[-1], self.std.size
        wide_A, wide_Q = np.zeros((*n, nz + na, nz + na)), np.zeros((*n, nz + na, nz + na))
        wide_A[..., :nz, :nz], wide_A[..., nz:, nz:] = A, self.pole * np.eye(na)
        wide_A[..., :nz, nz:] = B @ self.G
        wide_Q[..., :nz, :nz], wide_Q[..., nz:, nz:] = Q, (1.0 - self.pole**2) * self.covariance
        return wide_A, np.concatenate([C, np.zeros((*C.shape[:-1], na))], axis=-1), wide_Q
