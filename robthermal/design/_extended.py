"""Extended Kalman filter, for comparison."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..signals import Record
from ._estimate import Estimate, along
from ._modules import Array
from ._observer_model import ObserverModel


@dataclass(frozen=True)
class ExtendedKalmanFilter:
    """Kalman filter with the model linearised at every estimate, for comparison: it comes with no guarantee.

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

    @property
    def sample_time(self) -> float:
        """[s]."""
        return self.model.sample_time

    @property
    def sensors(self) -> tuple[str, ...]:
        """What it reads."""
        return self.model.sensors

    def start(self, temperatures: Array) -> Array:
        """Memory at the first sample: estimate and covariance.

        Parameters
        ----------
        temperatures : ndarray or mapping
            Lump temperatures [K].
        """
        return np.concatenate([np.asarray(temperatures, float), self.first.ravel()])

    def estimate(self, memory: Array) -> Array:
        """Estimate of all lumps [K].

        Parameters
        ----------
        memory : ndarray
            Memory of the observer.
        """
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
        """Memory at the next sample: correct, then predict.

        Parameters
        ----------
        memory : ndarray
            Memory of the observer.
        readings : ndarray
            Sensor readings [K].
        inputs : ndarray
            Heaters, currents and ambients held over the sample [unit, A, K].
        """
        x, P, C = self.estimate(memory), self.covariance(memory), self.model.C
        u = self.model.exogenous(inputs)
        K = np.linalg.solve(C @ P @ C.T + self.noise, C @ P).T
        x = x + K @ (self.model.measured(readings) - C @ x)
        left = np.eye(len(x)) - K @ C  # Joseph form: stays positive
        P = left @ P @ left.T + K @ self.noise @ K.T
        M = self.model.A_d + self.model.Gamma @ self.model.rest_slope(x, u)
        return np.concatenate([self.model.predict(x, u), (M @ P @ M.T + self.process).ravel()])

    def run(self, record: Record, initial: ArrayLike | None = None) -> Estimate:
        """Estimate along a record; see `GainObserver.run`.

        Parameters
        ----------
        record : Record
            Inputs and readings by column name.
        initial : array_like, optional
            Temperatures at the start [K].
        """
        return along(self, self.model, record, initial)
