"""Closed loop: plant and equivalent plant, coverage, and honesty where the loop hides the plant."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt


def loop(plant, rng: np.random.Generator, n: int, noise: float, gain: np.ndarray) -> tuple[rt.Record, np.ndarray]:
    """u = r - K (y - 298), r white, y with white noise."""
    channels = plant.B.shape[1]
    r, v, x = rng.normal(size=(n, channels)), noise * rng.normal(size=(n, channels)), 0.1 * rng.normal(size=3)
    U, Y = np.zeros((n, channels)), np.zeros((n, channels))
    for k in range(n):
        Y[k] = plant.C @ x + v[k]
        U[k] = r[k] - gain @ Y[k]
        x = plant.A @ x + plant.B @ U[k]
    return plant.record_of(U, Y + 298.0), r


def test_matrix_inverse_gives_the_plant_with_its_covariance(network) -> None:
    plant, rng, gain = network(2, speed=20.0), np.random.default_rng(0), np.diag([1.5, 3.0])
    inside, suspect, noise = [], [], []
    for _ in range(15):
        record, r = loop(plant, rng, 2000, 0.01, gain)
        G = rt.identify.closed_loop(record, reference=r)
        inside.append((abs(G.response - plant.response(G.frequencies)) < G.confidence_radius(0.95))[..., 40:].mean())
        suspect.append(G.suspect[40:].mean())
        noise.append(G.noise_variance[:, 40:].mean() / 1e-4)
    assert 0.94 < np.mean(inside) < 0.98  # the radius contains Fieller's region and is a little larger
    assert np.mean(suspect) < 0.02
    assert abs(np.mean(noise) - 1.0) < 0.03


def test_elementwise_diagonal_is_the_equivalent_plant(network) -> None:
    plant, rng, gain = network(2, speed=20.0), np.random.default_rng(1), np.diag([1.5, 3.0])
    inside, apart = [], []
    for _ in range(15):
        record, r = loop(plant, rng, 2000, 0.01, gain)
        G = rt.identify.closed_loop(record, reference=r, inverse="elementwise")
        P = plant.response(G.frequencies)
        for i, j in ((0, 1), (1, 0)):  # (3.27): G_ii - G_ij K_j G_ji / (1 + K_j G_jj)
            equivalent = P[i, i] - P[i, j] * gain[j, j] * P[j, i] / (1.0 + gain[j, j] * P[j, j])
            error = abs(G.response[i, i] - equivalent)
            inside.append((error < G.confidence_radius(0.95)[i, i])[40:].mean())
            apart.append((abs(equivalent - P[i, i]) > 5 * error)[40:200].mean())
    assert 0.94 < np.mean(inside) < 0.98
    assert np.mean(apart) > 0.5  # the two plants are not the same thing


def test_scalar_plants_have_one_inverse(network) -> None:
    record, r = loop(network(1), np.random.default_rng(2), 800, 0.01, np.array([[3.0]]))
    one = rt.identify.closed_loop(record, reference=r)
    other = rt.identify.closed_loop(record, reference=r[:, 0], inverse="elementwise")
    np.testing.assert_allclose(one.response, other.response)
    np.testing.assert_allclose(one.covariance, other.covariance, rtol=1e-8)
    np.testing.assert_allclose(one.noise_covariance, other.noise_covariance, rtol=1e-8)
    np.testing.assert_allclose(one.confidence_radius(), other.confidence_radius(), rtol=1e-6)


def test_direct_estimate_is_biased_and_indirect_covers(network) -> None:
    plant, rng = network(1, speed=20.0), np.random.default_rng(3)
    direct, indirect = [], []
    for _ in range(10):
        record, r = loop(plant, rng, 2000, 1.0, np.array([[1.5]]))
        for G, kept in ((rt.identify.lpm(record), direct), (rt.identify.closed_loop(record, reference=r), indirect)):
            kept.append((abs(G.response - plant.response(G.frequencies)) < G.confidence_radius(0.95)).mean())
    assert np.mean(direct) < 0.6
    assert np.mean(indirect) > 0.94


def test_a_loop_that_hides_the_plant_is_suspect_with_large_radius(network) -> None:
    plant, rng = network(1, speed=20.0), np.random.default_rng(4)
    record, r = loop(plant, rng, 2000, 10.0, np.array([[1.5]]))  # noise drowns the reference in u
    G = rt.identify.closed_loop(record, reference=r)
    assert G.suspect.mean() > 0.5
    assert np.isinf(G.confidence_radius(0.95)).mean() > 0.3
    assert "hides" in str(G.outcome)


def test_transient_and_noise_are_those_of_the_plant(network) -> None:
    plant, rng = network(1, speed=20.0), np.random.default_rng(5)
    record, r = loop(plant, rng, 1000, 0.0, np.array([[1.5]]))
    G = rt.identify.closed_loop(record, reference=r)
    U, Y = (np.fft.rfft(s[:, 0] - s.mean(), norm="ortho")[1:500] for s in (record.inputs, record.outputs))
    np.testing.assert_allclose((G.response[0, 0] * U + G.transient[0])[60:], Y[60:], atol=2e-3 * np.abs(Y).mean())


def test_several_records_take_one_reference_each(network) -> None:
    plant, rng = network(1, speed=20.0), np.random.default_rng(6)
    (a, ra), (b, rb) = (loop(plant, rng, 900, 0.01, np.array([[1.5]])) for _ in range(2))
    G = rt.identify.closed_loop([a, b], reference=[ra, rb])
    assert G.degrees_of_freedom[50] == 2 * 17 - 3 * 3
    with pytest.raises(rt.InputError, match="1 references for 2 records"):
        rt.identify.closed_loop([a, b], reference=[ra])
