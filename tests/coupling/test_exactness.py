"""What the coupled loop keeps of the uncoupled ones, to how many digits: Theorem 6.4 (c) block by block."""

from __future__ import annotations

import control
import numpy as np
import pytest
from scipy.signal import tf2ss

import robthermal as rt

from .conftest import DT, Array, at, half_sample_late

MACHINE = rt.systems.scanner()
W = 2 * np.pi * np.geomspace(2.0, 2499.9, 1200)


@pytest.fixture(scope="module")
def filters() -> rt.coupling.Filters:
    """Nominal filters of the demo scanner, as `synthesize` makes them."""
    return rt.coupling.synthesize(MACHINE.P1, MACHINE.P2, MACHINE.C1, MACHINE.C2, window=0.01, msd_limit=1.2,
                                  disturbances=MACHINE.disturbances)


def diagonal(first: control.StateSpace, second: control.StateSpace) -> Array:
    result = np.zeros((len(W), 2, 2), dtype=complex)
    result[:, 0, 0], result[:, 1, 1] = at(first, W), at(second, W)
    return result


def test_the_input_of_a_filter_is_the_plant_inverse_times_the_filter(filters: rt.coupling.Filters) -> None:
    for signal, inputs, plant in ((filters.X, filters.X_input, MACHINE.P1), (filters.Y, filters.Y_input, MACHINE.P2)):
        np.testing.assert_allclose(at(inputs, W), at(signal, W) / at(plant, W), rtol=1e-9)  # pointwise
        size = np.abs(at(inputs, W)).max()
        np.testing.assert_allclose(at(inputs, W), at(signal, W) / at(plant, W), rtol=0, atol=1e-12 * size)


def test_diagonal_blocks_of_the_coupled_loop_are_those_without_coupling(filters: rt.coupling.Filters) -> None:
    P, C = diagonal(MACHINE.P1, MACHINE.P2), diagonal(MACHINE.C1, MACHINE.C2)
    K = np.moveaxis(at(filters.controller, W), -1, 0)
    S, S0 = np.linalg.inv(np.eye(2) + P @ K), np.linalg.inv(np.eye(2) + P @ C)
    for with_coupling, without in ((S, S0), (K @ S, C @ S0), (P @ K @ S, P @ C @ S0), (S @ P, S0 @ P)):
        for k in (0, 1):  # pointwise, where the control sensitivity is almost zero near Nyquist as well
            np.testing.assert_allclose(with_coupling[:, k, k], without[:, k, k], rtol=1e-6)


def test_zeros_of_a_lightly_damped_stage() -> None:
    """Two modes with 0.1 % damping between which the response vanishes almost: P times Q is Z there too."""
    A = np.zeros((6, 6))
    A[0, 1] = 1.0
    for k, w in ((2, 2 * np.pi * 580.0), (4, 2 * np.pi * 640.0)):
        A[k: k + 2, k: k + 2] = [[0, 1], [-w * w, -2e-3 * w]]
    plant = half_sample_late(control.StateSpace(A, [[0], [0.1]] * 3, [[1, 0, -0.4, 0, 0.7, 0]], [[0]]), DT)
    Z, Q = rt.coupling.inner_factor(plant)
    np.testing.assert_allclose(at(Q, W) * at(plant, W), at(Z, W), rtol=1e-9)


def test_h2_without_coupling_is_the_integral_of_the_spectrum() -> None:
    """A rigid body under PID at 5 kHz with almost a triple closed-loop pole at 1 rad/s, 2e-4 from z = 1."""
    law = control.tf([0.4, 0.4, 0.4 / 3], [1, 40, 0])
    plant = half_sample_late(control.StateSpace([[0, 1], [0, 0]], [[0], [1]], [[300.0, 0]], [[0]]), DT)
    C = control.ss(control.sample_system(law, DT, method="tustin"))
    drift = control.ss(*tf2ss([1e-3], [1, -(1 - 1e-5)]), DT)
    filters = rt.coupling.evaluate(plant, plant, C, C, disturbances=(drift, 0))
    edges = np.concatenate([[0.0], np.geomspace(1e-10, 1.0, 1500)]) * np.pi
    nodes, weights = np.polynomial.legendre.leggauss(8)
    theta = (edges[:-1, None] + edges[1:, None]) / 2 + np.diff(edges)[:, None] / 2 * nodes
    z = np.exp(1j * theta.ravel())
    power = np.abs(drift(z) / (1 + plant(z) * C(z))) ** 2
    exact = np.sqrt(float(power @ (np.diff(edges)[:, None] / 2 * weights).ravel()) / np.pi)
    assert filters.norms["h2_uncoupled"] == pytest.approx(exact, rel=1e-7)
