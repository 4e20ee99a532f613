"""Two stages sampled at 5 kHz with rigid body, mode, delay and integrating controllers; random small pairs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import control
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[Any]
DT = 2e-4


@dataclass(frozen=True)
class Pair:
    """Two plants with their controllers."""

    P1: control.StateSpace
    P2: control.StateSpace
    C1: control.StateSpace
    C2: control.StateSpace


def at(system: Any, omega: Array) -> Array:
    """Frequency response (n_f,) or (p, m, n_f) by python-control, independent of the package."""
    points = np.exp(1j * omega * system.dt) if system.dt else 1j * omega
    return np.asarray(system(points))


def half_sample_late(system: control.StateSpace, dt: float) -> control.StateSpace:
    """Zero-order hold with an input delay of half a sample: no zero on the unit circle."""
    n = system.nstates
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n:] = system.A, system.B
    half = expm(whole * dt / 2)
    A, B = half[:n, :n], half[:n, n:]
    return control.StateSpace(np.block([[A @ A, A @ B], [np.zeros((1, n + 1))]]), np.vstack([B, [[1.0]]]),
                              np.hstack([system.C, [[0.0]]]), [[0.0]], dt)


def stage(mass: float, mode: float, damping: float, share: float) -> control.StateSpace:
    """Rigid body with one flexible mode [Hz], 1.5 samples late in total."""
    w = 2 * np.pi * mode
    A = np.array([[0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1], [0, 0, -w * w, -2 * damping * w]])
    B = np.array([[0], [1 / mass], [0], [share / mass]])
    return half_sample_late(control.StateSpace(A, B, [[1, 0, 1, 0]], [[0]]), DT)


def controller(mass: float, bandwidth: float) -> control.StateSpace:
    """PID with roll-off, Tustin at 5 kHz; its integrator is at z = 1."""
    w, s = 2 * np.pi * bandwidth, control.tf("s")
    law = mass * w * w / 3 * (1 + 3 * s / w) * (1 + w / 6 / s) / (1 + s / (6 * w))
    num, den = (np.asarray(c[0][0]) for c in (law.num, law.den))
    return control.ss(control.sample_system(control.tf(num, den), DT, method="tustin"))


@pytest.fixture(scope="session")
def pair() -> Pair:
    return Pair(stage(10.0, 900.0, 0.02, 0.3), stage(20.0, 700.0, 0.02, 0.3), controller(10.0, 120.0),
                controller(20.0, 80.0))


@pytest.fixture(scope="session")
def random_pair() -> Callable[[int], Pair]:
    return make_random_pair


def make_random_pair(seed: int) -> Pair:
    """Stable random plants with one wrong-side zero each and small stabilizing controllers."""
    rng = np.random.default_rng(seed)
    plants, controllers = [], []
    for _ in range(2):
        poles = np.concatenate([rng.uniform(0.3, 0.95, 2), rng.uniform(0.5, 0.9) * np.exp([0.7j, -0.7j])])
        zeros = np.concatenate([rng.uniform(1.2, 2.0, 1) * rng.choice([-1, 1]), rng.uniform(-0.6, 0.6, 1)])
        plant = control.zpk(zeros, poles, 0.05, dt=0.01)
        plants.append(control.ss(plant))
        gain = 0.4 / float(np.max(np.abs(at(plant, np.linspace(0, np.pi / 0.01, 400)))))
        controllers.append(control.ss([[0.7]], [[1.0]], [[0.3 * gain]], [[0.5 * gain]], 0.01))
    return Pair(*plants, *controllers)
