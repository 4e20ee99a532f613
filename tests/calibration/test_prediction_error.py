"""Prediction-error calibration on simulated data with process noise, whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm

import robthermal as rt
from robthermal.calibration._innovations import _sampled
from robthermal.errors import InputError

TRUE = {"lumps.a.capacity": 50.0, "links.a-room.conductance": 0.5}
RANGES = {"lumps.a.capacity": (5.0, 500.0), "links.a-room.conductance": (0.05, 5.0)}
STEP, ROOM, SENSOR_NOISE, DISTURBANCE = 8.0, 295.0, 0.05, 4.0


def plant(disturbance: float = DISTURBANCE, noise: float = SENSOR_NOISE) -> rt.System:
    return rt.System(
        ambients={"room": {"temperature": ROOM}},
        lumps={"a": {"capacity": 50.0, "disturbance": disturbance}, "b": {"capacity": 20.0}},
        links=[{"between": ("a", "room"), "conductance": 0.5}, {"between": ("a", "b"), "conductance": 1.0}],
        inputs={"q": {"lump": "a"}},
        sensors={"Ta": {"lump": "a", "noise": noise}, "Tb": {"lump": "b", "noise": noise}})


def runs(n_runs: int, n: int = 150, disturbance: float = DISTURBANCE, seed: int = 0) -> list[rt.Record]:
    """Euler-Maruyama on a fine grid, written out for this plant: dQ = s dW into lump a."""
    rng = np.random.default_rng(seed)
    heat = np.repeat(np.random.default_rng(1).uniform(0, 20, n // 3), 3)
    fine, readings = 40, np.empty((n_runs, n, 2))
    dt = STEP / fine
    a, b = np.full(n_runs, ROOM), np.full(n_runs, ROOM)
    for k in range(n):
        readings[:, k] = np.column_stack([a, b])
        for _ in range(fine):
            kick = disturbance * np.sqrt(dt) * rng.standard_normal(n_runs)
            a, b = (a + ((heat[k] - 0.5 * (a - ROOM) - (a - b)) * dt + kick) / 50.0, b + (a - b) * dt / 20.0)
    readings += SENSOR_NOISE * rng.standard_normal(readings.shape)
    return [rt.Record(sample_time=STEP, inputs=heat, outputs=y, input_names=["q"], output_names=["Ta", "Tb"])
            for y in readings]


def start(**options: float) -> rt.System:
    return plant(**options).with_parameters({"lumps.a.capacity": 80.0, "links.a-room.conductance": 0.3})


@pytest.mark.exhaustive
def test_prediction_error_scatters_less_and_its_intervals_cover() -> None:
    estimates, deviations = {}, {}
    records = runs(40)
    for method in ("output_error", "prediction_error"):
        fits = [rt.calibrate(plant(), run, parameters=RANGES, method=method) for run in records]
        assert all(fit.outcome.ok for fit in fits)
        estimates[method] = np.array([list(fit.parameters.values()) for fit in fits])
        deviations[method] = np.array([list(fit.std.values()) for fit in fits])
    scatter = {method: values.std(axis=0, ddof=1) for method, values in estimates.items()}
    # The conductance is a matter of the slowest response, where filtering the noise gains nothing.
    assert scatter["prediction_error"][1] < 1.1 * scatter["output_error"][1]
    assert scatter["prediction_error"][0] < 0.5 * scatter["output_error"][0]
    off = np.abs(estimates["prediction_error"] - list(TRUE.values()))
    covered = np.mean(off < 1.96 * deviations["prediction_error"], axis=0)
    assert np.all((covered >= 0.87) & (covered <= 1.0))  # of 40: below 0.87 by a chance of 1 in 70 each
    ratio = np.sqrt(np.mean(deviations["prediction_error"] ** 2, axis=0)) / scatter["prediction_error"]
    assert np.all((ratio > 0.75) & (ratio < 1.33))


def test_innovations_are_white_where_free_run_residuals_are_not() -> None:
    run = runs(1, seed=3)[0]
    by_error, by_innovation = (rt.calibrate(start(), run, parameters=RANGES, method=method)
                               for method in ("output_error", "prediction_error"))
    assert by_error.whiteness["Ta"].p_value < 1e-6
    assert by_innovation.whiteness["Ta"].p_value > 1e-3


def test_without_disturbance_both_methods_are_one() -> None:
    run = runs(1, disturbance=0.0)[0]
    by_error, by_innovation = (rt.calibrate(start(disturbance=0.0), run, parameters=RANGES, method=method)
                               for method in ("output_error", "prediction_error"))
    assert by_error.parameters == by_innovation.parameters
    # and the filter itself does nothing when what it filters is (nearly) nothing
    nearly = rt.calibrate(start(disturbance=1e-6), run, parameters=RANGES, method="prediction_error")
    np.testing.assert_allclose(list(nearly.parameters.values()), list(by_error.parameters.values()), rtol=1e-5)
    np.testing.assert_allclose(nearly.covariance, by_error.covariance, rtol=1e-3)


def test_gathered_noise_is_the_integral() -> None:
    A = np.array([[-3.0, 1.0, 0.0], [0.5, -0.2, 0.1], [0.0, 40.0, -40.0]])
    q = np.diag([0.5, 0.0, 0.2])
    step, Q = _sampled(A, q, 1.7)
    wanted, _ = quad_vec(lambda t: expm(A * t) @ q @ expm(A * t).T, 0.0, 1.7, epsabs=1e-12)
    np.testing.assert_allclose(Q, wanted, atol=1e-10)
    np.testing.assert_allclose(step, expm(1.7 * A), atol=1e-12)


def test_whitening_is_the_inverse_root_of_the_residuals_covariance() -> None:
    # L⁻¹ of a filter started at the known state satisfies L⁻¹ Σ L⁻ᵀ = 1 with Σ built by brute force over the samples.
    from robthermal.calibration._innovations import whitener
    from robthermal.fitting._data import as_data

    system, n = plant(), 12
    one = as_data(system, runs(1, n=21)[0][:n], "data")[0]
    white = whitener(system, one, np.full(2, SENSOR_NOISE))
    A = np.array([[-1.5 / 50, 1.0 / 50], [1.0 / 20, -1.0 / 20]])
    step, Q = _sampled(A, np.diag([(DISTURBANCE / 50) ** 2, 0.0]), STEP)
    reach = np.zeros((2 * n, 2 * n))  # x(k) = Σ_{j<k} A^{k-1-j} w(j)
    for k in range(n):
        for j in range(k):
            reach[2 * k:2 * k + 2, 2 * j:2 * j + 2] = np.linalg.matrix_power(step, k - 1 - j)
    sigma = reach @ np.kron(np.eye(n), Q) @ reach.T + SENSOR_NOISE**2 * np.eye(2 * n)
    inverse_root = white(np.eye(2 * n).reshape(n, 2, 2 * n)).reshape(2 * n, 2 * n)
    np.testing.assert_allclose(inverse_root @ sigma @ inverse_root.T, np.eye(2 * n), atol=1e-6)


def test_undeclared_noise_is_refused() -> None:
    with pytest.raises(InputError, match="noise of sensor 'Ta' is not declared"):
        rt.calibrate(start(noise=0.0), runs(1)[0], parameters=RANGES, method="prediction_error")
    with pytest.raises(InputError, match="method is 'ml'"):
        rt.calibrate(start(), runs(1)[0], parameters=RANGES, method="ml")
