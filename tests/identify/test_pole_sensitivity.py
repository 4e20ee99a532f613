"""Prescribed poles that are not quite right: slopes, bands that contain it, and poles found from the data."""

from __future__ import annotations

import control
import numpy as np
import pytest

import robthermal as rt

PAIR = complex(-0.25, 5 * np.sqrt(1 - 0.05**2))  # 5 rad/s, damping 0.05


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.abs(error) ** 2)))


@pytest.fixture(scope="module")
def resonance() -> tuple[rt.Record, control.StateSpace]:
    """Two resonances, Evers (4.27), two periods of a multisine, noise of 0.1 %."""
    G0 = sum((control.tf([w**2], [1, 0.1 * w, w**2]) for w in (5.0, 20.0)), start=control.tf([0], [1])).sample(1 / 20)
    rng, lines = np.random.default_rng(7), np.zeros(601, dtype=complex)
    lines[1:600] = np.exp(2j * np.pi * rng.random(599))
    u = np.tile(np.fft.irfft(lines, norm="forward"), 2)
    y = control.forced_response(G0, inputs=u).outputs
    return rt.Record(sample_time=1 / 20, inputs=u, outputs=y + 1e-3 * y.std() * rng.normal(size=y.size),
                     input_names=["F"], output_names=["x"]), G0


def test_slopes_are_the_differences_of_estimates(network, resonance) -> None:
    record, poles = network(2).record(np.random.default_rng(0), 600, 0.01), np.array([-0.002, -0.04])
    found = rt.identify.pole_sensitivity(record, poles)
    assert found.moved == ((0, "real"), (1, "real"))
    for k, (pole, _) in enumerate(found.moved):
        step = 0.01 * abs(poles[pole]) * (np.arange(2) == pole)
        difference = (rt.identify.lrmp(record, poles + step).response
                      - rt.identify.lrmp(record, poles - step).response) / 0.02
        np.testing.assert_allclose(found.slopes[k], difference, rtol=5e-3, atol=1e-3 * np.abs(difference).max())
    found = rt.identify.pole_sensitivity(resonance[0], [PAIR, PAIR.conjugate()])
    assert found.moved == ((0, "real"), (0, "imaginary"))
    forth, back = (rt.identify.lrmp(resonance[0], [PAIR + d, (PAIR + d).conjugate()]).response
                   for d in (0.005j * abs(PAIR), -0.005j * abs(PAIR)))
    np.testing.assert_allclose(found.slopes[1], (forth - back) / 0.01, rtol=0.05,
                               atol=0.02 * np.abs(found.slopes[1]).max())


def test_covariance_is_that_of_estimates_with_random_poles(network) -> None:
    record, rng = network(2).record(np.random.default_rng(1), 300, 0.0), np.random.default_rng(2)
    poles, deviation = np.array([-0.002, -0.04]), [0.02, 0.01]
    found = rt.identify.pole_sensitivity(record, poles)
    # columns of G stacked: entry i n_y + o
    drawn = np.array([rt.identify.lrmp(record, poles * (1 + deviation * rng.normal(size=2))).response
                      .transpose(1, 0, 2).reshape(4, -1) for _ in range(120)])[..., :8]
    error = drawn - drawn.mean(axis=0)
    sampled = np.einsum("naf,nbf->abf", error, error.conj()) / (len(error) - 1)
    expected = found.covariance(deviation)[..., :8]
    assert np.abs(sampled - expected).max() < 0.3 * np.abs(expected).max()
    wide = found.with_uncertain_poles(deviation)
    np.testing.assert_allclose(wide.covariance, found.estimate.covariance + found.covariance(deviation), rtol=1e-12)
    assert (wide.confidence_radius() >= found.estimate.confidence_radius() - 1e-15).all()


def test_bands_with_uncertain_poles_cover(network) -> None:
    """Every pole off by a random 15 %: the lowest dozen bins, 20 records."""
    plant, rng, narrow, wide, tight = network(1), np.random.default_rng(3), [], [], []
    for _ in range(20):
        record = plant.record(rng, 1500, 0.01)
        found = rt.identify.pole_sensitivity(record, plant.poles * (1 + 0.15 * rng.normal(size=3)))
        error = np.abs(found.estimate.response - plant.response(found.estimate.frequencies))[0, 0, :12]
        narrow.append(error < found.estimate.confidence_radius()[0, 0, :12])
        radius = found.with_uncertain_poles(0.15).confidence_radius()[0, 0, :12]
        wide.append(error < radius)
        tight.append(error < 0.3 * radius)
    assert np.mean(narrow) < 0.8
    assert np.mean(wide) > 0.92 and np.mean(tight) < 0.85  # they cover, and are not wider than the errors


def test_the_report_says_where_and_how_much(network) -> None:
    plant = network(1)
    found = rt.identify.pole_sensitivity(plant.record(np.random.default_rng(4), 1500, 0.001), plant.poles)
    text = str(found)
    assert text.count("off by 10 %") == 3 and "0.000667 Hz" in text and "worse than no poles" in text
    limit = found.tolerance()
    finite = np.flatnonzero(np.isfinite(limit))
    assert limit.shape == (len(found.estimate),) and finite[0] < 4
    truth, k = plant.response(found.estimate.frequencies)[0, 0], int(finite[0])
    polynomial = abs(found.polynomial.response[0, 0, k] - truth[k])
    few = rt.identify.lrmp(plant.record(np.random.default_rng(4), 1500, 0.001), plant.poles * (1 + 0.2 * limit[k]))
    assert abs(few.response[0, 0, k] - truth[k]) < polynomial


def test_a_missing_value_of_deviation_is_refused(network) -> None:
    found = rt.identify.pole_sensitivity(network(1).record(np.random.default_rng(5), 400, 0.01), [-0.01, -0.1])
    for wrong in ([0.1], -0.1, "much", [0.1, np.nan]):
        with pytest.raises(rt.InputError, match="deviation"):
            found.with_uncertain_poles(wrong)


@pytest.mark.exhaustive
def test_resonant_poles_are_found_and_thermal_ones_too(network, resonance) -> None:
    record, G0 = resonance
    by_pair = rt.identify.pole_sensitivity(record, "resonant")
    found, near = by_pair.estimate, by_pair.poles
    truth = G0(np.exp(2j * np.pi * found.frequencies / 20))
    errors = {name: rms(G.response[0, 0] - truth) for name, G in (
        ("resonant", found), ("auto", rt.identify.lrmp(record, "auto")), ("lpm", rt.identify.lpm(record)))}
    assert errors["resonant"] < 0.1 * min(errors["auto"], errors["lpm"])
    assert np.abs(near - PAIR).min() < 0.02 * abs(PAIR)
    plant = network(1)
    slow = rt.identify.pole_sensitivity(plant.record(np.random.default_rng(6), 1200, 0.01), "resonant").poles
    assert (slow.imag == 0).all() and np.abs(slow - plant.poles.max()).min() < 0.1 * abs(plant.poles.max())
