"""A small thermal network with an exact zero-order-hold response: the truth that the estimators are held against."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

import robthermal as rt


@dataclass(frozen=True)
class Network:
    """x(n+1) = A x(n) + B u(n), y = C x around 298 K; `poles` are those of the continuous-time network [rad/s]."""

    A: NDArray[np.float64]
    B: NDArray[np.float64]
    C: NDArray[np.float64]
    poles: NDArray[np.float64]
    sample_time: float

    def response(self, frequencies: NDArray[np.float64]) -> NDArray[np.complex128]:
        z = np.exp(2j * np.pi * frequencies * self.sample_time)
        resolvent = np.linalg.inv(z[:, None, None] * np.eye(len(self.A)) - self.A)
        return np.moveaxis(self.C @ resolvent @ self.B, 0, -1)

    def outputs(self, U: NDArray[np.float64], start: NDArray[np.float64]) -> NDArray[np.float64]:
        x, Y = start, np.empty((len(U), len(self.C)))
        for n, u in enumerate(U):
            Y[n] = 298.0 + self.C @ x
            x = self.A @ x + self.B @ u
        return Y

    def record(self, rng: np.random.Generator, n: int, noise: float, level: float = 10.0) -> rt.Record:
        """Noise excitation around an operating point, cold start: a strong transient."""
        U = level + rng.normal(size=(n, self.B.shape[1]))
        return self.record_of(U, self.outputs(U, np.zeros(len(self.A))) + noise * rng.normal(size=(n, len(self.C))))

    def record_of(self, U: NDArray[np.float64], Y: NDArray[np.float64]) -> rt.Record:
        return rt.Record(
            sample_time=self.sample_time,
            inputs=U,
            outputs=Y,
            input_names=[f"q{i}" for i in range(U.shape[1])],
            output_names=[f"T{o}" for o in range(Y.shape[1])],
        )


def build(n_channels: int, sample_time: float = 1.0, speed: float = 1.0) -> Network:
    """Three lumps in a row, heated and measured at the ends; time constants 550, 25 and 4 s divided by `speed`."""
    capacity = np.array([200.0, 50.0, 20.0])
    flow = np.array([[-2.3, 2.0, 0.0], [2.0, -5.0, 3.0], [0.0, 3.0, -3.2]])
    A = speed * flow / capacity[:, None]
    B = (speed * np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]) / capacity[:, None])[:, :n_channels]
    block = np.zeros((3 + n_channels, 3 + n_channels))
    block[:3, :3], block[:3, 3:] = A, B
    step = expm(block * sample_time)
    C = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])[:n_channels]
    return Network(step[:3, :3], step[:3, 3:], C, np.linalg.eigvals(A).real, sample_time)


@pytest.fixture(scope="session")
def network() -> Callable[..., Network]:
    return build
