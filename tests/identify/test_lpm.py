"""Local polynomial method against brute-force least squares, the true response, and Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import robthermal as rt

L, R = 8, 2


def dft(x: np.ndarray) -> np.ndarray:
    """(channels, bins 0 ... ) normalized by 1/sqrt(N), by the plain definition."""
    n = len(x)
    return np.exp(-2j * np.pi * np.outer(np.arange((n - 1) // 2 + 1), np.arange(n)) / n) @ (x - x.mean(axis=0)) / n**0.5


def brute_force(records: list[rt.Record], k: int) -> tuple[np.ndarray, ...]:
    """G, (K^H K)^-1 block, noise, transient and q of bin k, written down from Evers (3.15)-(3.23)."""
    rows, outputs, last = [], [], (len(records[0]) - 1) // 2
    start = min(max(k - L, 1), last - 2 * L)
    r = (np.arange(start, start + 2 * L + 1) - k) / L
    for m, record in enumerate(records):
        U, Y = dft(record.inputs)[start : start + 2 * L + 1], dft(record.outputs)[start : start + 2 * L + 1]
        plant = [U[:, i] * r**s for s in range(R + 1) for i in range(U.shape[1])]
        transient = [r**s * (j == m) for j in range(len(records)) for s in range(R + 1)]
        rows.append(np.stack([*plant, *transient], axis=1))
        outputs.append(Y)
    K, Y = np.vstack(rows), np.vstack(outputs)
    n_u = records[0].inputs.shape[1]
    theta = np.linalg.lstsq(K, Y, rcond=None)[0]
    residual, q = Y - K @ theta, K.shape[0] - K.shape[1]
    noise = np.array([[np.vdot(b, a) for b in residual.T] for a in residual.T]) / q  # E[V_o V_p*]
    gram = np.linalg.inv(K.conj().T @ K)[:n_u, :n_u]
    return theta[:n_u].T, gram, noise, theta[n_u * (R + 1)], q


@pytest.mark.parametrize(("n_u", "n_y", "n_records"), [(1, 1, 1), (2, 2, 1), (2, 3, 2), (3, 1, 2)])
def test_every_kind_of_bin_equals_brute_force(n_u: int, n_y: int, n_records: int) -> None:
    rng = np.random.default_rng(0)
    records = [
        rt.Record(
            sample_time=0.5,
            inputs=20.0 + rng.normal(size=(301, n_u)),
            outputs=300.0 + np.cumsum(rng.normal(size=(301, n_y)), axis=0),  # a large transient
            input_names=[f"u{i}" for i in range(n_u)],
            output_names=[f"y{o}" for o in range(n_y)],
        )
        for _ in range(n_records)
    ]
    G = rt.identify.lpm(records if n_records > 1 else records[0])
    np.testing.assert_allclose(G.frequencies, np.arange(1, 151) / (301 * 0.5))
    for k in (1, 4, 8, 9, 70, 142, 143, 150):
        response, gram, noise, transient, q = brute_force(records, k)
        np.testing.assert_allclose(G.response[..., k - 1], response, rtol=1e-9)
        np.testing.assert_allclose(G.noise_covariance[..., k - 1], noise, rtol=1e-8)
        np.testing.assert_allclose(G.transient[:, k - 1], transient, rtol=1e-8)
        assert G.degrees_of_freedom[k - 1] == q
        for i in range(n_u):
            for j in range(n_u):
                block = G.covariance[i * n_y : (i + 1) * n_y, j * n_y : (j + 1) * n_y, k - 1]
                np.testing.assert_allclose(block, gram[i, j] * noise, rtol=1e-8)


def test_a_noise_free_static_gain_is_exact_to_rounding() -> None:
    u = np.random.default_rng(1).normal(size=(5000, 2))
    record = rt.Record(
        sample_time=1.0, inputs=u, outputs=u @ [[1.0], [-2.0]], input_names=["a", "b"], output_names=["y"]
    )
    G = rt.identify.lpm(record)
    np.testing.assert_allclose(G.response[0].T, np.broadcast_to([1.0, -2.0], (len(G), 2)), atol=1e-12)
    assert G.noise_variance.max() < 1e-25


@pytest.mark.parametrize("n_channels", [1, 2])
def test_coverage_and_noise_level_under_a_start_up_transient(network, n_channels: int) -> None:
    plant, rng, sigma = network(n_channels), np.random.default_rng(2), 0.01
    inside, joint, ratios = [], [], []
    for _ in range(40):
        G = rt.identify.lpm(plant.record(rng, 2000, sigma))
        error = G.response - plant.response(G.frequencies)
        away = slice(100, None)
        inside.append((abs(error) < G.confidence_radius(0.95))[..., away].mean())
        ratios.append(G.noise_variance[:, away].mean() / sigma**2)
        # Hotelling: the errors of a row of G together.
        row, gram, q = error[0][:, away], G.gram[..., away], G.degrees_of_freedom[away]
        inverse = np.linalg.inv(gram.transpose(2, 0, 1))
        distance = np.einsum("if,fij,jf->f", row.conj(), inverse, row).real / G.noise_variance[0, away]
        joint.append((distance < n_channels * stats.f.ppf(0.95, 2 * n_channels, 2 * q)).mean())
    assert 0.94 < np.mean(inside) < 0.96
    assert 0.94 < np.mean(joint) < 0.96
    assert abs(np.mean(ratios) - 1.0) < 0.02


def test_covariance_between_outputs_has_the_right_conjugate() -> None:
    # The noise of y1 is that of y0 one sample later: E[V_0 V_1*] = sigma^2 exp(+j omega), not its conjugate.
    rng = np.random.default_rng(3)
    mean = 0.0
    for _ in range(20):
        u, v = rng.normal(size=1001), rng.normal(size=1001)
        record = rt.Record(
            sample_time=1.0,
            inputs=u[1:],
            outputs=np.stack([v[1:], v[:-1]], axis=1),
            input_names=["u"],
            output_names=["y0", "y1"],
        )
        G = rt.identify.lpm(record)
        mean = mean + G.noise_covariance[0, 1] / 20
    expected = np.exp(2j * np.pi * G.frequencies)
    assert np.abs(np.mean(mean / expected) - 1.0) < 0.05


def test_joint_region_of_a_row_needs_the_gram_block_unconjugated() -> None:
    # u1 is u0 one sample later: the gram block is genuinely complex, and its conjugate would lose coverage.
    rng, good, bad = np.random.default_rng(4), [], []
    for _ in range(30):
        w = rng.normal(size=1001)
        inputs = np.stack([w[1:], w[:-1] + 0.5 * rng.normal(size=1000)], axis=1)
        outputs = inputs @ [[1.0], [2.0]] + 0.1 * rng.normal(size=(1000, 1))
        G = rt.identify.lpm(
            rt.Record(sample_time=1.0, inputs=inputs, outputs=outputs, input_names=["a", "b"], output_names=["y"])
        )
        error = G.response[0] - np.array([[1.0], [2.0]])
        for kept, covariance in ((good, G.covariance), (bad, G.covariance.conj())):
            inverse = np.linalg.inv(covariance.transpose(2, 0, 1))
            distance = np.einsum("if,fij,jf->f", error.conj(), inverse, error).real
            kept.append((distance < 2 * stats.f.ppf(0.95, 4, 2 * G.degrees_of_freedom)).mean())
    assert 0.94 < np.mean(good) < 0.96
    assert np.mean(bad) < 0.93


def test_joint_covariance_of_neighboring_bins_equals_the_scatter() -> None:
    rng, bins = np.random.default_rng(5), np.array([100, 102, 105, 117])
    u, samples, predicted = rng.normal(size=400), [], []
    for _ in range(1000):
        record = rt.Record(
            sample_time=1.0, inputs=u, outputs=rng.normal(size=400), input_names=["u"], output_names=["y"]
        )
        G = rt.identify.lpm(record)
        samples.append(G.response[0, 0, bins])
        if len(predicted) < 50:
            predicted.append(G.joint_covariance(bins))
    scatter = np.einsum("na,nb->ab", samples, np.conj(samples)) / len(samples)
    predicted = np.mean(predicted, axis=0)
    scale = np.sqrt(np.outer(np.diag(scatter).real, np.diag(scatter).real))
    assert np.abs((scatter - predicted) / scale).max() < 0.2
    assert abs(predicted[0, 1]) > 0.4 * scale[0, 1]
    assert predicted[0, 3] == 0.0  # 17 bins apart: no shared data
    np.testing.assert_allclose(np.diag(G.joint_covariance(bins)), G.covariance[0, 0, bins])


def test_suspect_fires_where_the_window_is_wider_than_the_slowest_pole_and_hardly_elsewhere(network) -> None:
    plant, rng = network(2), np.random.default_rng(6)
    found = np.mean([rt.identify.lpm(plant.record(rng, 4000, 0.01)).suspect for _ in range(10)], axis=0)
    assert found[:12].min() > 0.9
    assert found[100:].mean() < 0.02


def test_one_input_at_a_time_in_two_records(network) -> None:
    plant, rng = network(2), np.random.default_rng(7)
    records = []
    for active in (0, 1):
        U = np.full((2000, 2), 5.0)  # the other heater holds its operating point
        U[:, active] += rng.normal(size=2000)
        records.append(plant.record_of(U, plant.outputs(U, np.zeros(3)) + 0.01 * rng.normal(size=(2000, 2))))
    G = rt.identify.lpm(records)
    inside = abs(G.response - plant.response(G.frequencies)) < G.confidence_radius(0.95)
    assert G.degrees_of_freedom[0] == 2 * 17 - 3 * (2 + 2)
    assert 0.9 < inside[..., 100:].mean() < 0.99


def test_records_of_different_lengths_are_one_estimate(network) -> None:
    plant, rng = network(1), np.random.default_rng(8)
    inside, ratios = [], []
    for _ in range(20):
        G = rt.identify.lpm([plant.record(rng, 1500, 0.01), plant.record(rng, 1000, 0.01)])
        inside.append((abs(G.response - plant.response(G.frequencies)) < G.confidence_radius(0.95))[..., 100:].mean())
        ratios.append(G.noise_variance[:, 100:].mean() / 1e-4)
    assert len(G) == 749
    assert G.degrees_of_freedom[300] == 17 + 11 - 3 * 3
    assert 0.93 < np.mean(inside) < 0.97
    assert abs(np.mean(ratios) - 1.0) < 0.05


def test_bins_without_excitation_are_nan_with_infinite_radius_and_said_so() -> None:
    lines = np.zeros(501, dtype=complex)
    rng = np.random.default_rng(9)
    lines[1:200] = np.exp(2j * np.pi * rng.random(199))
    u = np.fft.irfft(lines, norm="forward")
    y = 2.0 * u + 0.01 * rng.normal(size=1000)
    G = rt.identify.lpm(
        rt.Record(sample_time=1.0, inputs=u + 50.0, outputs=y, input_names=["heater"], output_names=["y"])
    )
    assert np.isfinite(G.response[0, 0, :199]).all()
    assert np.isnan(G.response[0, 0, 210:]).all()
    assert np.isinf(G.confidence_radius()[0, 0, 210:]).all()
    assert not G.outcome
    assert "heater" in str(G.outcome)
    np.testing.assert_allclose(G.noise_variance[0, 210:].mean(), 1e-4, rtol=0.2)


def test_an_ambient_without_power_falls_back_and_leaves_the_heater_alone() -> None:
    # The ambient varies in the lowest 60 lines only; the heater everywhere.
    rng, lines = np.random.default_rng(10), np.zeros(501, dtype=complex)
    lines[1:61] = np.exp(2j * np.pi * rng.random(60))
    heater, ambient = rng.normal(size=1000), np.fft.irfft(lines, norm="forward")
    y = 2.0 * heater + 0.5 * ambient + 0.01 * rng.normal(size=1000)
    record = rt.Record(
        sample_time=1.0,
        inputs=np.stack([heater, ambient + 295.0], axis=1),
        outputs=y,
        input_names=["heater", "room"],
        output_names=["y"],
    )
    G = rt.identify.lpm(record)
    assert np.isfinite(G.response[0, 0]).all()
    assert np.isfinite(G.response[0, 1, :58]).all()
    assert np.isnan(G.response[0, 1, 75:]).all()
    assert "room" in " ".join(G.notes) and "heater" not in " ".join(G.notes)
    assert (G.degrees_of_freedom[75:] == 17 - 6).all()
    inside = abs(G.response[0, 0] - 2.0) < G.confidence_radius()[0, 0]
    assert 0.9 < inside.mean() < 0.99


def test_two_periods_of_a_multisine_are_estimated_at_the_lines_between_too() -> None:
    rng, lines = np.random.default_rng(11), np.zeros(301, dtype=complex)
    lines[1:300] = np.exp(2j * np.pi * rng.random(299))
    u = np.tile(np.fft.irfft(lines, norm="forward"), 2)
    record = rt.Record(
        sample_time=1.0, inputs=u, outputs=3.0 * u + rng.normal(size=1200), input_names=["u"], output_names=["y"]
    )
    G = rt.identify.lpm(record)
    inside = abs(G.response[0, 0] - 3.0) < G.confidence_radius()[0, 0]
    assert 0.9 < inside.mean() < 0.99
