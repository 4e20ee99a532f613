"""Innovations of a Kalman filter as a linear map on residuals: what prediction-error calibration weighs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from .._arrays import Floats
from ..fitting import Data
from ..thermal import System, linearize, trajectory

_STEADY = 1e-12  # relative change of the state covariance at which the gain counts as constant


@dataclass(frozen=True)
class Whitener:
    """Maps free-run residuals to innovations of unit covariance: z = L⁻¹ r, linear in r.

    With the machine's deviation from the model δx(k+1) = A δx(k) + w, cov w = `Q`, and the residual r = measured −
    modelled = C δx + v, cov v = diag(noise²), the innovations e = r - C δx̂, measured − predicted, of the filter started
    at δx̂ = 0, P = 0 (the start is a parameter of the fit) are white; z divides them by the root of their covariance.
    The gain varies until P has settled, then stays.

    Parameters
    ----------
    A, C : ndarray
        Deviation of lumps and lags over one sample, and what the sensors read of it.
    gains : list of ndarray
        Filter gain of each sample; the last one holds for all later samples.
    roots : list of ndarray
        Inverse Cholesky factor of the innovation's covariance, likewise.
    """

    A: Floats
    C: Floats
    gains: list[Floats]
    roots: list[Floats]

    def __call__(self, r: Floats) -> Floats:
        """Whiten (n, n_sensors, ...) along time."""
        flat = r.reshape(*r.shape[:2], -1)
        z, x, last = np.empty_like(flat), np.zeros((len(self.A), flat.shape[2])), len(self.gains) - 1
        for k, now in enumerate(flat):
            place = min(k, last)
            e = now - self.C @ x
            z[k] = self.roots[place] @ e
            x = self.A @ (x + self.gains[place] @ e)
        return z.reshape(r.shape)


def has_disturbance(system: System) -> bool:
    """Whether any lump has process noise."""
    return any(lump.disturbance > 0 for lump in system.lumps.values())


def whitener(system: System, one: Data, noise: Floats) -> Whitener:
    """Filter of one record, linearized at its mean simulated temperatures and mean inputs.

    Parameters
    ----------
    system : System
        With the present parameters.
    one : Data
        Record with its sensors.
    noise : ndarray, shape (n_sensors,)
        Standard deviation of the record's sensors [K].
    """
    record = one.record
    mean = trajectory(system, record).lumps.mean(axis=0)
    held = {name: float(record[name].mean()) for name in system.exogenous_names if name in record.input_names}
    plant = linearize(system, mean, held)
    A, Q = _sampled(np.asarray(plant.A), _intensity(system, plant.nstates), record.sample_time)
    C = np.asarray(plant.C)[one.columns]
    return Whitener(A, C, *_gains(A, C, Q, np.diag(noise**2), len(record)))


def _intensity(system: System, n_states: int) -> Floats:
    """Process noise dx = (s / C) dW of every state [K²/s]; sensor lags have none of their own."""
    q = np.zeros(n_states)
    q[:len(system.lumps)] = [(lump.disturbance / lump.capacity) ** 2 for lump in system.lumps.values()]
    return np.diag(q)


def _sampled(A: Floats, q: Floats, h: float) -> tuple[Floats, Floats]:
    """Transition over one sample and the noise gathered in it, ∫ e^{At} q e^{Aᵀt} dt.

    Van Loan's (1978) block exponential over a step in which nothing decays much, for it holds e^{-At}; then doubled.
    """
    n = len(A)
    halvings = max(0, math.ceil(math.log2(max(float(np.linalg.norm(A, 1)) * h, 1.0))))
    block = scipy.linalg.expm(np.block([[-A, q], [np.zeros((n, n)), A.T]]) * (h / 2**halvings))
    step = block[n:, n:].T
    Q = step @ block[:n, n:]
    for _ in range(halvings):
        Q, step = Q + step @ Q @ step.T, step @ step
    return step, (Q + Q.T) / 2


def _gains(A: Floats, C: Floats, Q: Floats, R: Floats, n: int) -> tuple[list[Floats], list[Floats]]:
    gains: list[Floats] = []
    roots: list[Floats] = []
    P = np.zeros_like(A)
    for _ in range(n):
        S = C @ P @ C.T + R
        gains.append(np.asarray(np.linalg.solve(S, C @ P).T, np.float64))
        roots.append(np.asarray(np.linalg.inv(np.linalg.cholesky(S)), np.float64))
        keep = np.eye(len(A)) - gains[-1] @ C
        new = A @ (keep @ P @ keep.T + gains[-1] @ R @ gains[-1].T) @ A.T + Q
        if np.abs(new - P).max() <= _STEADY * np.abs(new).max():
            break
        P = new
    return gains, roots
