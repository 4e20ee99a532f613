"""Prescribed poles: exactness, span of Evers (4.23), coverage, the lowest bins, and where poles may come from."""

from __future__ import annotations

import control
import numpy as np
import pytest
from scipy.signal import cont2discrete

import robthermal as rt


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.abs(error) ** 2)))


@pytest.mark.parametrize("n_channels", [1, 2])
def test_exact_poles_make_the_estimate_exact_at_every_bin(network, n_channels: int) -> None:
    plant = network(n_channels)
    G = rt.identify.lrmp(plant.record(np.random.default_rng(0), 600, 0.0), poles=plant.poles)
    truth = plant.response(G.frequencies)
    assert np.max(np.abs(G.response - truth) / np.abs(truth)) < 1e-6
    # T(k) = C (zI - A)^-1 (x(0) - x(N)) z / sqrt(N), Evers (4.6); x(0) = 0.
    rng = np.random.default_rng(0)
    U, x = 10.0 + rng.normal(size=(600, n_channels)), np.zeros(3)
    for u in U:
        x = plant.A @ x + plant.B @ u
    z = np.exp(2j * np.pi * G.frequencies)
    T = -(plant.C @ np.linalg.inv(z[:, None, None] * np.eye(3) - plant.A) @ x).T * z / np.sqrt(600)
    np.testing.assert_allclose(G.transient, T, rtol=1e-5, atol=1e-7 * np.abs(T).max())


def test_lowest_bins_equal_least_squares_on_the_functions_of_the_thesis() -> None:
    # Far below Nyquist z-domain and omega-domain functions agree: constant + 1/(j omega - p), span of (4.23).
    rng, n, poles = np.random.default_rng(1), 2000, np.array([-0.002, -0.004 + 0.003j])
    record = rt.Record(
        sample_time=0.1,
        inputs=rng.normal(size=n),
        outputs=np.cumsum(rng.normal(size=n)),
        input_names=["u"],
        output_names=["y"],
    )
    G = rt.identify.lrmp(record, poles=poles)
    U, Y = (np.fft.rfft(x[:, 0] - x.mean(), norm="ortho") for x in (record.inputs, record.outputs))
    for k in (1, 5, 12, 40):
        rows = np.arange(max(k - 8, 1), max(k - 8, 1) + 17)
        omega = 2 * np.pi * rows / (n * 0.1)
        basis = np.stack([np.ones(17), *(1 / (1j * omega - p) for p in poles)], axis=1)
        center = np.array([1, *(1 / (2j * np.pi * k / (n * 0.1) - p) for p in poles)])
        K = np.hstack([basis * U[rows, None], basis])
        scale = np.linalg.norm(K, axis=0)
        theta = np.linalg.lstsq(K / scale, Y[rows], rcond=1e-14)[0] / scale
        np.testing.assert_allclose(G.response[0, 0, k - 1], center @ theta[:3], rtol=1e-3)


@pytest.mark.parametrize("n_channels", [1, 2])
def test_coverage_and_noise_level_also_at_the_lowest_bins(network, n_channels: int) -> None:
    plant, rng, sigma = network(n_channels), np.random.default_rng(2), 0.01
    inside, ratios = [], []
    for _ in range(40):
        G = rt.identify.lrmp(plant.record(rng, 2000, sigma), poles=plant.poles)
        inside.append(abs(G.response - plant.response(G.frequencies)) < G.confidence_radius(0.95))
        ratios.append(G.noise_variance.mean() / sigma**2)
    assert 0.94 < np.mean(inside) < 0.96
    assert 0.92 < np.mean([i[..., :12] for i in inside]) < 0.98
    assert abs(np.mean(ratios) - 1.0) < 0.02


def test_poles_30_percent_wrong_still_beat_the_polynomial_fivefold_at_the_lowest_dozen_bins(network) -> None:
    plant, rng = network(2), np.random.default_rng(3)
    errors: dict[str, list[np.ndarray]] = {"lpm": [], "slow": [], "fast": [], "auto": []}
    for _ in range(10):
        record = plant.record(rng, 4000, 0.01)
        truth = None
        for name, G in (
            ("lpm", rt.identify.lpm(record)),
            ("slow", rt.identify.lrmp(record, poles=0.7 * plant.poles)),
            ("fast", rt.identify.lrmp(record, poles=1.3 * plant.poles)),
            ("auto", rt.identify.lrmp(record, poles="auto")),
        ):
            truth = plant.response(G.frequencies[:12]) if truth is None else truth
            errors[name].append((G.response[..., :12] - truth) / np.abs(truth))
    for name in ("slow", "fast", "auto"):
        assert rms(np.array(errors[name])) < rms(np.array(errors["lpm"])) / 5


def test_wrong_poles_are_suspect_where_they_matter_and_right_ones_are_not(network) -> None:
    plant, rng = network(1), np.random.default_rng(4)
    wrong, right = [], []
    for _ in range(10):
        record = plant.record(rng, 3000, 0.01)
        wrong.append(rt.identify.lrmp(record, poles=2.0 * plant.poles).suspect)
        right.append(rt.identify.lrmp(record, poles=plant.poles).suspect)
    assert np.mean(wrong, axis=0)[:3].min() > 0.9
    assert np.mean(right) < 0.02


def test_poles_of_models_are_the_same_as_numbers(network) -> None:
    plant = network(1)
    record = plant.record(np.random.default_rng(5), 500, 0.01)
    slowest_first = np.sort(plant.poles)[::-1]

    class Model:
        def poles(self) -> np.ndarray:
            return slowest_first

    continuous = control.ss(np.diag(plant.poles), np.ones((3, 1)), np.ones((1, 3)), 0)
    sampled = control.ss(*cont2discrete((np.diag(plant.poles), np.ones((3, 1)), np.ones((1, 3)), 0), 0.25)[:4], 0.25)
    wanted = rt.identify.lrmp(record, poles=plant.poles)
    for model in (Model(), continuous, sampled):
        np.testing.assert_allclose(rt.identify.lrmp(record, poles=model).response, wanted.response, rtol=1e-7)


def test_a_model_gives_its_slowest_poles_as_many_as_the_window_permits(network) -> None:
    record = network(2).record(np.random.default_rng(6), 500, 0.01)
    model = control.ss(np.diag(-np.geomspace(1e-3, 1.0, 18)), np.ones((18, 1)), np.ones((1, 18)), 0)
    G = rt.identify.lrmp(record, poles=model)
    assert (G.degrees_of_freedom >= 5).all()
    np.testing.assert_allclose(G.response, rt.identify.lrmp(record, poles=-np.geomspace(1e-3, 1.0, 18)[:3]).response)


def test_complex_poles_of_the_mechanical_example(network) -> None:
    # Evers (4.27): resonances at 5 and 20 rad/s, damping 0.05, T_s = 1/20 s, two periods of 60 s of a multisine.
    G0 = sum((control.tf([w**2], [1, 2 * 0.05 * w, w**2]) for w in (5.0, 20.0)), start=control.tf([0], [1])).sample(
        1 / 20, "zoh"
    )
    rng, lines = np.random.default_rng(7), np.zeros(601, dtype=complex)
    lines[1:600] = np.exp(2j * np.pi * rng.random(599))
    u = np.tile(np.fft.irfft(lines, norm="forward"), 2)
    y = control.forced_response(G0, inputs=u).outputs
    record = rt.Record(sample_time=1 / 20, inputs=u, outputs=y, input_names=["F"], output_names=["x"])
    first = complex(-0.05 * 5, 5 * np.sqrt(1 - 0.05**2))
    poles = [first, 4 * first]
    estimates = [rt.identify.lpm(record), rt.identify.lrmp(record, poles[:1]), rt.identify.lrmp(record, poles)]
    f = estimates[0].frequencies
    truth = G0(np.exp(2j * np.pi * f / 20))
    errors = [np.abs(G.response[0, 0] - truth) for G in estimates]
    near_first, near_second = np.abs(f - 5 / 2 / np.pi) < 0.1, np.abs(f - 20 / 2 / np.pi) < 0.1
    assert rms(errors[1][near_first]) < 0.2 * rms(errors[0][near_first])
    assert rms(errors[2][near_second]) < 0.2 * rms(errors[1][near_second])


def test_very_fast_poles_and_slow_poles_at_high_frequency_stay_well_conditioned(network) -> None:
    # The window basis of Evers (4.23) has condition numbers up to 1e13 here; ours must still estimate a plain gain.
    rng = np.random.default_rng(8)
    u = rng.normal(size=6000)
    record = rt.Record(sample_time=1.0, inputs=u, outputs=2.0 * u, input_names=["u"], output_names=["y"])
    G = rt.identify.lrmp(record, poles=[-1.3e-3, -4.9e-3, -4e-2, -1e6])
    np.testing.assert_allclose(G.response, 2.0, rtol=1e-10)
    assert (G.degrees_of_freedom == 7).all()
