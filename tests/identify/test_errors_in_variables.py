"""Noisy inputs: consistent and covering with instruments or known noise, warned of where the record cannot tell."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import f

import robthermal as rt


def heated_room(network: Callable, seed: int, spread: float, n: int = 2000) -> tuple[rt.Record, np.ndarray]:
    """A heater that warms the room it stands in; the room is measured twice, each time with noise of `spread`."""
    plant, rng = network(2, speed=20.0), np.random.default_rng(seed)
    q = rng.normal(size=n)
    room = lfilter([0.3], [1, -0.8], rng.normal(size=n)) + lfilter([0.3], [1, -0.7], q)
    Y = plant.outputs(np.column_stack([q, room]), 0.1 * rng.normal(size=3)) + 0.02 * rng.normal(size=(n, 2))
    record = plant.record_of(np.column_stack([q, room + spread * rng.normal(size=n)]), Y)
    return record, 1.8 * (room + spread * rng.normal(size=n)) + 32.0  # the second sensor is in another unit


def first_order(G: rt.identify.FrequencyResponse) -> np.ndarray:
    """Circle of the covariance alone, without the widening for a doubtful divisor."""
    return np.sqrt(f.ppf(0.95, 2, 2 * G.degrees_of_freedom) * G.variance)


@pytest.mark.parametrize("known", ["instruments", "noise"])
def test_circles_cover_where_the_instrument_is_strong(network, known: str) -> None:
    """95 % within 1.5 %: 8 records, 8 independent windows and more in each, four responses."""
    plant, inside, widened, direct = network(2, speed=20.0), [], [], []
    for seed in range(8):
        record, second = heated_room(network, seed, 0.1)
        told = {"instruments": {"q1": second}} if known == "instruments" else {"noise": {"q1": 0.1}}
        G = rt.identify.errors_in_variables(record, half_width=12, **told)
        error = abs(G.response - plant.response(G.frequencies))
        strong = G.ratio_uncertainty.max(axis=(0, 1)) < 0.15
        strong[:40] = False
        assert strong.sum() > 150
        inside.append((error < first_order(G))[..., strong].mean())
        widened.append((error < G.confidence_radius(0.95))[..., strong].mean())
        D = rt.identify.lpm(record, half_width=12)
        direct.append((abs(D.response - plant.response(D.frequencies)) < D.confidence_radius(0.95))[0, :, 40:].mean())
    assert 0.935 < np.mean(inside) < 0.965
    assert 0.95 < np.mean(widened) < 0.99
    assert np.mean(direct) < 0.9


def test_the_bias_does_not_average_out_and_is_removed(network) -> None:
    """Mean over records and bins, relative to the truth: attenuation stays in lpm, and leaks to the heater."""
    plant, means = network(2, speed=20.0), {"lpm": [], "instruments": [], "noise": []}
    for seed in range(5):
        record, second = heated_room(network, 100 + seed, 0.3)
        for key, G in (("lpm", rt.identify.lpm(record, half_width=24)),
                       ("instruments", rt.identify.errors_in_variables(record, instruments={"q1": second},
                                                                       half_width=24)),
                       ("noise", rt.identify.errors_in_variables(record, noise={"q1": 0.3}, half_width=24))):
            relative = G.response / plant.response(G.frequencies) - 1.0
            means[key].append(relative[0, :, 60:160].mean(axis=1))
    heater, room = np.abs(np.mean(means["lpm"], axis=0))
    assert heater > 0.08 and room > 0.08, (heater, room)
    for key in ("instruments", "noise"):
        heater_left, room_left = np.abs(np.mean(means[key], axis=0))
        assert heater_left < 0.4 * heater and room_left < 0.4 * room


def test_without_noise_it_is_least_squares(network) -> None:
    record, second = heated_room(network, 3, 1e-9, n=600)
    G = rt.identify.errors_in_variables(record, instruments={"q1": second})
    H = rt.identify.lpm(record)
    np.testing.assert_allclose(G.response, H.response, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(G.covariance, H.covariance, rtol=1e-3, atol=1e-12)
    np.testing.assert_allclose(G.transient, H.transient, rtol=1e-3, atol=1e-6)
    assert G.degrees_of_freedom.tolist() == H.degrees_of_freedom.tolist()


def test_one_window_by_hand(network) -> None:
    """theta = (K^H K - s^2 P^H P)^-1 K^H Y with the regressors of the definition, written out."""
    record, _ = heated_room(network, 4, 0.02, n=400)
    U, Y = (np.fft.rfft(s - s.mean(axis=0), axis=0, norm="ortho") for s in (record.inputs, record.outputs))
    rows = np.arange(60, 77)
    P = ((rows - 68) / 8.0)[:, None] ** np.arange(3)
    K = np.hstack([P, P * U[rows, :1], P * U[rows, 1:]])
    N = np.zeros((9, 9))
    N[6:, 6:] = 0.02**2 * P.T @ P
    theta = np.linalg.solve(K.conj().T @ K - N, K.conj().T @ Y[rows])
    G = rt.identify.errors_in_variables(record, noise={"q1": 0.02})
    np.testing.assert_allclose(G.response[:, :, 67], theta[[3, 6]].T, rtol=1e-8)
    np.testing.assert_allclose(G.transient[:, 67], theta[0], rtol=1e-7)


def test_a_weak_instrument_is_said_so(network) -> None:
    record, _ = heated_room(network, 5, 0.1, n=800)
    G = rt.identify.errors_in_variables(record, instruments={"q1": np.random.default_rng(9).normal(size=800)})
    assert G.suspect.mean() > 0.7 and np.isinf(G.confidence_radius(0.95)).mean() > 0.7
    assert "bias may be left" in " ".join(G.notes) and not G.outcome.ok


def test_the_note_says_how_far_the_direct_estimate_is_off(network) -> None:
    record, second = heated_room(network, 6, 0.3)
    G = rt.identify.errors_in_variables(record, instruments={"q1": second}, half_width=24)
    told = next(note for note in G.notes if "'q1'" in note)
    assert float(told.split(" that is ")[1].split(" %")[0]) > 10.0


def test_several_records_and_an_input_without_lines() -> None:
    rng = np.random.default_rng(7)
    records, seconds = [], []
    for _ in range(2):
        t = np.arange(900)
        q, room = np.sin(2 * np.pi * 20 * t / 900), rng.normal(size=900)
        records.append(rt.Record(sample_time=1.0, inputs=np.column_stack([q, room + 0.2 * rng.normal(size=900)]),
                                 outputs=3.0 * q + 2.0 * room, input_names=["q", "room"], output_names=["T"]))
        seconds.append(room + 0.2 * rng.normal(size=900))
    G = rt.identify.errors_in_variables(records, instruments={"room": seconds})
    assert np.isnan(G.response[0, 0, 100:]).all() and np.isfinite(G.response[0, 1, 100:]).all()
    assert abs(np.mean(G.response[0, 1, 100:]) - 2.0) < 0.02


@pytest.mark.parametrize(("arguments", "words"), [
    ({}, "neither"), ({"instruments": {"q1": np.zeros(300)}, "noise": {"q1": 0.1}}, "both"),
    ({"noise": {"x": 0.1}}, "'x' is not an input"), ({"noise": {"q1": -1.0}}, "noise of 'q1'"),
    ({"noise": {"q1": 10.0}}, "whole standard deviation"), ({"instruments": {"q1": np.zeros(300)}}, "constant"),
    ({"instruments": {"q1": np.zeros(299)}}, "(299,)"), ({"instruments": {"q1": "text"}}, "numbers"),
    ({"noise": {"q1": 0.1}, "half_width": 3}, "unknowns"), ({"noise": {"q1": 0.1}, "half_width": 200}, "bins")])
def test_bad_arguments_are_named(network, arguments: dict, words: str) -> None:
    record, _ = heated_room(network, 8, 0.1, n=300)
    with pytest.raises(rt.InputError) as refused:
        rt.identify.errors_in_variables(record, **arguments)
    assert words in str(refused.value)


def test_the_input_itself_is_no_instrument(network) -> None:
    record, _ = heated_room(network, 8, 0.1, n=300)
    with pytest.raises(rt.InputError, match="the input itself"):
        rt.identify.errors_in_variables(record, instruments={"q1": record.inputs[:, 1]})


def test_repeated_periods_make_the_estimate_consistent(network) -> None:
    """A chamber that repeats twice, measured with noise of 0.4; the heater, in step with it, is exact."""
    plant, rng, kept, taken = network(2, speed=20.0), np.random.default_rng(11), [], []
    for _ in range(6):
        q = np.tile(rng.normal(size=1000), 2)
        room = 0.5 * q + np.tile(lfilter([0.3], [1, -0.8], rng.normal(size=1000)), 2)
        Y = plant.outputs(np.column_stack([q, room]), np.zeros(3)) + 0.02 * rng.normal(size=(2000, 2))
        mean, noise = rt.identify.mean_period(
            plant.record_of(np.column_stack([q, room + 0.4 * rng.normal(size=2000)]), Y), 1000)
        np.testing.assert_allclose(mean.outputs, (Y[:1000] + Y[1000:]) / 2, atol=1e-12)
        assert list(noise) == ["q1"] and noise["q1"] == pytest.approx(0.4 / np.sqrt(2), rel=0.07)  # 3 deviations
        for G, place in ((rt.identify.errors_in_variables(mean, noise=noise, half_width=20), kept),
                         (rt.identify.lpm(mean, half_width=20), taken)):
            place.append((G.response / plant.response(G.frequencies) - 1.0)[0, :, 30:80].mean(axis=1))
    left, direct = np.abs(np.mean(kept, axis=0)), np.abs(np.mean(taken, axis=0))
    assert (left < 0.4 * direct).all() and direct.min() > 0.05, (left, direct)
    with pytest.raises(rt.InputError, match="fits 1 times"):
        rt.identify.mean_period(mean, 600)
    with pytest.raises(rt.InputError, match="several records"):
        rt.identify.mean_period([mean, mean], 500)
