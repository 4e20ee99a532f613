"""Extended Kalman filter, for comparison."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ._estimate import Observer
from ._modules import Array
from ._observer_model import ObserverModel


@dataclass(frozen=True)
class ExtendedKalmanFilter(Observer):
    """Kalman filter with the model linearized at every estimate, for comparison: it comes with no guarantee.

    Parameters
    ----------
    model : ObserverModel
        A_d, Γ, C.
    process, noise, first : ndarray
        Covariances of a sample's disturbance, of the readings and of the first guess [K²].
    """

    model: ObserverModel
    process: Array
    noise: Array
    first: Array

    def start(self, temperatures: Array) -> Array:
        # estimate and covariance
        return np.concatenate([np.asarray(temperatures, float), self.first.ravel()])

    def estimate(self, memory: Array) -> Array:
        return memory[:len(self.first)]

    def covariance(self, memory: Array) -> Array:
        """Its own idea of the error's covariance [K²].

        Parameters
        ----------
        memory : ndarray
            Memory of the observer.
        """
        return memory[len(self.first):].reshape(self.first.shape)

    def step(self, memory: Array, readings: Array, inputs: Mapping[str, float]) -> Array:
        # correct, then predict
        x, P, C = self.estimate(memory), self.covariance(memory), self.model.C
        u = self.model.exogenous(inputs)
        K = np.linalg.solve(C @ P @ C.T + self.noise, C @ P).T
        x = x + K @ (self.model.measured(readings) - C @ x)
        left = np.eye(len(x)) - K @ C  # Joseph form: stays positive
        P = left @ P @ left.T + K @ self.noise @ K.T
        M = self.model.A_d + self.model.Gamma @ self.model.rest_slope(x, u)
        return np.concatenate([self.model.predict(x, u), (M @ P @ M.T + self.process).ravel()])
