"""Spectra and simulation of a coupling, against the proven and exactly computed numbers of the same filters."""

from __future__ import annotations

import control
import numpy as np
import pytest

import robthermal as rt

DT = 0.01
P1, P2 = control.tf([0.01], [1, -0.99], DT), control.tf([0.02], [1, -0.98], DT)
C1, C2 = control.tf([20.0, -19.0], [1, -1], DT), control.tf([15.0], [1], DT)
NOISE = control.tf([2e-9], [1, -0.9], DT), 1e-9


@pytest.fixture(scope="module")
def filters() -> rt.coupling.Filters:
    omega = np.linspace(1.0, 314.0, 300)
    plants = np.eye(2)[:, :, None] * [[P(np.exp(1j * omega * DT)) * factor] for P, factor in ((P1, 1.2), (P2, 0.9))]
    return rt.coupling.evaluate(P1, P2, C1, C2, X_hat=control.tf([-0.5], [1, -0.4], DT), Y_hat=-0.3, window=0.2,
                                disturbances=NOISE, uncertainty=control.FRD(plants, omega, dt=DT))


def test_total_power_is_the_exact_variance(filters: rt.coupling.Filters) -> None:
    found, p = rt.coupling.spectra(filters, points=4000), filters.performance
    assert 9 * found.power_before[-1] == pytest.approx(p.ma_before**2 + p.msd_before**2, rel=2e-3)
    assert 9 * found.power_after[-1] == pytest.approx(p.ma_after**2 + p.msd_after**2, rel=2e-3)


def test_peaks_are_below_what_is_proven_and_close_to_it(filters: rt.coupling.Filters) -> None:
    found = rt.coupling.spectra(filters, points=4000)
    peaks = {"improvement_1": found.improvement[0], "improvement_2": found.improvement[1], "robust": found.robust,
             "small_gain": found.small_gain}
    for key, curve in peaks.items():
        assert 0.97 * filters.norms[key] < curve.max() <= filters.norms[key]


def test_sensitivities_are_those_of_python_control(filters: rt.coupling.Filters) -> None:
    found = rt.coupling.spectra(filters)
    z = np.exp(2j * np.pi * DT * found.frequency)
    for k, (P, C) in enumerate(((P1, C1), (P2, C2))):
        assert found.sensitivity_before[k] == pytest.approx(abs(1 / (1 + P(z) * C(z))), rel=1e-9)
    assert found.sensitivity_after[1] == pytest.approx(found.improvement[1] * found.sensitivity_before[1], rel=1e-12)


def test_continuous_time_power() -> None:
    """White noise of density 1 through 1/(s + 1): variance 1/2, half of it below 1 rad/s."""
    P, C = control.tf([1e-9], [1, 1]), control.tf([1.0], [1])
    filters = rt.coupling.evaluate(P, P, C, C, disturbances=(control.tf([1], [1, 1]), 0))
    found = rt.coupling.spectra(filters, points=4000)
    assert found.power_before[-1] == pytest.approx(0.5, rel=1e-2)
    assert np.interp(1 / (2 * np.pi), found.frequency, found.power_before) == pytest.approx(0.25, rel=1e-2)


def test_simulation_has_the_moving_average_that_was_computed(filters: rt.coupling.Filters) -> None:
    run, p = rt.coupling.simulate(filters, samples=20_000, seed=3), filters.performance
    for trace, expected in ((run.ma_before, p.ma_before), (run.ma_after, p.ma_after)):
        assert 3 * np.sqrt(np.mean(trace**2)) == pytest.approx(expected, rel=0.05)
    for trace, expected in ((run.msd_before, p.msd_before), (run.msd_after, p.msd_after)):
        assert 3 * np.sqrt(np.mean(trace**2)) == pytest.approx(expected, rel=0.05)


def test_simulation_is_the_filtered_noise(filters: rt.coupling.Filters) -> None:
    """Sample by sample: e12 = -(1+Y) S1 v1 + (1+X) S2 v2 (6.14), from rest."""
    run = rt.coupling.simulate(filters, samples=300, seed=5)
    white = np.random.default_rng(5).standard_normal((2, 600))
    time = DT * np.arange(600)
    v = np.array([control.forced_response(control.ss(NOISE[0]), time, white[0]).outputs, NOISE[1] * white[1]])
    e12 = control.forced_response(filters.e12, time, v).outputs
    assert run.after == pytest.approx(np.ravel(e12)[300:], rel=1e-6, abs=1e-15)


def test_simulation_of_continuous_time_is_refused() -> None:
    P, C = control.tf([1.0], [1, 1]), control.tf([1.0], [1])
    with pytest.raises(rt.InputError, match="continuous-time"):
        rt.coupling.simulate(rt.coupling.evaluate(P, P, C, C, X_hat=-0.1))


def test_fewer_samples_than_the_window_are_refused(filters: rt.coupling.Filters) -> None:
    with pytest.raises(rt.InputError, match="at least 20"):
        rt.coupling.simulate(filters, samples=19)


def test_an_unknown_panel_is_refused(filters: rt.coupling.Filters) -> None:
    with pytest.raises(rt.InputError, match="sensitivity, improvement, e12, power, robust"):
        rt.coupling.spectra(filters).plot(["bode"])
    assert len(filters.plot()) == 3
