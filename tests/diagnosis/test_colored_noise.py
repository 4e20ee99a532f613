"""Sensor noise with a slow part: the filter against dense covariance, and what the question asked last may answer."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from blind.cases import Case, made
from numpy.typing import NDArray
from scipy.linalg import toeplitz
from scipy.signal import lfilter

import robthermal as rt
from robthermal.diagnosis.data import as_measured
from robthermal.diagnosis.fit import NoiseScaling, with_slow_part
from robthermal.diagnosis.fit._noise_scaling import refined
from robthermal.diagnosis.path import LinearizedRecord, SlowNoise, linearized_record, settled_cost, whitener
from robthermal.diagnosis.search import with_wider_noise

Array = NDArray[np.float64]
Hide = Callable[..., tuple[rt.Record, rt.Record]]
H, N = 3.0, 120
NOISE, HEAT, SLOW = np.array([0.02]), np.array([0.3]), SlowNoise(np.array([0.015]), 0.9)


@pytest.fixture(scope="module")
def bar() -> rt.System:
    return rt.System(ambients={"room": {"temperature": 300.0}}, lumps={"bar": {"capacity": 10.0, "disturbance": 0.3}},
                     links=[{"between": ("bar", "room"), "conductance": 0.2}],
                     sensors={"T": {"lump": "bar", "noise": 0.02}})


def at_rest(system: rt.System, n: int = N) -> LinearizedRecord:
    record = rt.Record(sample_time=H, inputs=np.full(n, 300.0), outputs=np.full((n, 1), 300.0), input_names=["room"],
                       output_names=["T"])
    return linearized_record(system, as_measured(system, record, "records")[0])


def dense(heat: Array, n: int) -> Array:
    """Covariance of the readings of one lump: an Ornstein-Uhlenbeck process from 0, plus AR(1), plus white noise."""
    rate, t = 0.2 / 10.0, H * np.arange(n)
    size = (heat[0] / 10.0) ** 2 / (2 * rate)
    moving = size * (np.exp(-rate * np.abs(t[:, None] - t)) - np.exp(-rate * (t[:, None] + t)))
    return moving + SLOW.std[0] ** 2 * toeplitz(SLOW.pole ** np.arange(n)) + NOISE[0] ** 2 * np.eye(n)


@pytest.mark.parametrize("heat", [HEAT, np.zeros(1)])
def test_whitener_with_a_slow_part_is_the_inverse_cholesky_factor(bar: rt.System, heat: Array) -> None:
    path = at_rest(bar)
    L_inverse = whitener(path, NOISE, heat, SLOW)(np.eye(N)[:, None, :])[:, 0]
    expected = np.linalg.inv(np.linalg.cholesky(dense(heat, N)))
    assert np.abs(L_inverse - expected).max() < 1e-6 * np.abs(expected).max()  # heat: Simpson's rule in every sample
    assert np.abs(L_inverse - whitener(path, NOISE, heat)(np.eye(N)[:, None, :])[:, 0]).max() > 1.0


def test_without_a_slow_part_nothing_is_different(bar: rt.System) -> None:
    path = at_rest(bar)
    r = np.random.default_rng(0).standard_normal((N, 1))
    none = SlowNoise(np.zeros(1), 0.9)
    for heat in (HEAT, np.zeros(1)):
        assert np.allclose(whitener(path, NOISE, heat, none)(r), whitener(path, NOISE, heat)(r), rtol=1e-12)


def test_a_missing_reading_counts_for_nothing(bar: rt.System) -> None:
    path = at_rest(bar)
    missing = np.zeros((N, 1), bool)
    missing[40] = True
    path = replace(path, one=replace(path.one, missing=missing))
    r = np.repeat(np.random.default_rng(0).standard_normal((N, 1, 1)), 2, axis=2)
    r[40, 0, 1] += 7.0
    z = whitener(path, NOISE, np.zeros(1), SLOW)(r)
    assert np.allclose(z[..., 0], z[..., 1], atol=1e-4)
    assert abs(z[40, 0, 0]) < 1e-4


@pytest.mark.parametrize("heat", [0.1 * HEAT, np.zeros(1)])
def test_settled_cost_is_the_log_likelihood(bar: rt.System, heat: Array) -> None:
    n = 600
    path = at_rest(bar, n)
    S = dense(heat, n)
    L = np.linalg.cholesky(S)
    r = L @ np.random.default_rng(2).standard_normal(n)
    exact = float(r @ np.linalg.solve(S, r)) + 2 * float(np.log(np.diag(L)).sum())
    assert settled_cost(path, r[:, None], NOISE, heat, SLOW) == pytest.approx(exact, abs=5.0)  # its start is settled
    assert settled_cost(path, r[:, None], NOISE, heat) > exact + 10.0
    with warnings.catch_warnings():  # of a model that runs away
        warnings.simplefilter("error")
        assert settled_cost(path, 1e200 * r[:, None], NOISE, heat) == np.inf


def fixed(A: Array, C: Array) -> SimpleNamespace:
    """A path with this transition throughout, without random heat from its rates."""
    return SimpleNamespace(mean=(A, C, np.zeros(A.shape)), kinds=(None, None), h=1.0,
                           equations=SimpleNamespace(capacity=np.ones(len(A))))


@pytest.mark.parametrize("step", [[[0.9, 0.1], [0.0, 0.9]], [[0.0, 1.0], [0.0, 0.0]], [[0.8, 0.3], [-0.3, 0.8]]])
def test_settled_cost_where_modes_are_alike(step: list[list[float]]) -> None:
    """Of two that are one its vectors are no basis: such a filter ended a diagnosis with a traceback."""
    A, C, heat, n = np.array(step), np.array([[1.0, 0.5]]), np.array([0.2, 0.0]), 400
    r = np.random.default_rng(3).standard_normal((n, 1))
    P, Q = np.zeros((2, 2)), np.diag(heat**2)
    for _ in range(2000):  # Riccati's equation, iterated
        gain = P @ C.T / (C @ P @ C.T + NOISE[0] ** 2)
        P = A @ (P - gain @ C @ P) @ A.T + Q
    S, x, expected = (C @ P @ C.T).item() + NOISE[0] ** 2, np.zeros((2, 1)), 0.0
    for value in r[:, 0]:
        e = value - (C @ x).item()
        expected += e**2 / S + np.log(S)
        x = A @ (x + P @ C.T * e / S)
    assert settled_cost(fixed(A, C), r, NOISE, heat) == pytest.approx(expected, rel=1e-9)


def test_settled_cost_of_what_nothing_holds_is_infinite() -> None:
    """Random heat into a lump that no sensor reads and no link holds: its temperature wanders without limit."""
    path = fixed(np.eye(2) * [0.9, 1.0], np.array([[1.0, 0.0]]))
    assert settled_cost(path, np.ones((50, 1)), NOISE, np.array([0.1, 0.1])) == np.inf


def colored(record: rt.Record, size: float, seed: int, pole: float = 0.9) -> rt.Record:
    """With AR(1) noise of that standard deviation on top."""
    drive = np.sqrt(1 - pole**2) * np.random.default_rng(seed).standard_normal(record.outputs.shape)
    drive[0] /= np.sqrt(1 - pole**2)
    return record.with_outputs(record.outputs + size * lfilter([1.0], [1.0, -pole], drive, axis=0))


def test_levels_keep_and_say_the_slow_part(bar: rt.System) -> None:
    path = at_rest(bar, 800)
    r = 0.02 * np.random.default_rng(3).standard_normal((800, 1))
    one = colored(path.one.record.with_outputs(path.readings + r), 0.01, 4)
    path = replace(path, one=as_measured(bar, one, "records")[0])
    floor = rt.diagnosis.noise_floor(bar, one)
    floor = replace(floor, disturbance={"bar": 0.0})
    levels = with_slow_part([path], floor, NoiseScaling(1.0, {}))
    assert levels is not None
    assert 0.35 < levels.share < 0.7
    assert 12.0 < levels.memory < 50.0  # 28.5 s in truth
    assert levels.disturbance == 1.0  # there is none: nothing to choose
    again = refined([path], floor, levels)
    assert (again.share, again.memory) == (levels.share, levels.memory)
    assert not levels.close_to(replace(levels, share=0.0))
    assert f"slow part of {levels.share:.2f} times its size that remembers {levels.memory:.3g} s" in str(levels)
    assert "slow" not in str(replace(levels, share=0.0))


def test_the_slow_part_is_never_more_than_the_declared_noise(bar: rt.System) -> None:
    path = at_rest(bar)
    floor = rt.diagnosis.noise_floor(bar, path.one.record, noise=0.02)
    slow = NoiseScaling(1.0, {"T": 1.4}, share=1.0, memory=9.0).slow(path, floor)
    assert slow is not None
    assert slow.std == pytest.approx(0.02)
    assert slow.pole == pytest.approx(np.exp(-3.0 / 9.0))


@pytest.mark.parametrize(("noise", "heat"), [(0.005, 0.0), (0.02, 0.05), (0.03, 0.2), (0.08, 0.5)])
def test_of_every_level_the_most_likely_is_taken(bar: rt.System, noise: float, heat: float) -> None:
    """The search halves the list; here every factor is tried."""
    path = at_rest(bar, 600)
    rng = np.random.default_rng(7)
    walk = lfilter([heat], [1.0, -0.97], 0.01 * rng.standard_normal((600, 1)), axis=0)
    one = path.one.record.with_outputs(path.readings + walk + noise * rng.standard_normal((600, 1)))
    path = replace(path, one=as_measured(bar, one, "records")[0])
    floor = replace(rt.diagnosis.noise_floor(bar, one, noise=0.02), disturbance={"bar": 0.05})
    first = NoiseScaling(1.0, {"T": 1.0})
    factors = np.geomspace(1.0 / first.limit, first.limit, 15)

    def least(levels: list[NoiseScaling]) -> NoiseScaling:
        return min(levels, key=lambda one: settled_cost(path, path.residual, *one.of(path, floor)))

    best = least([replace(first, noise={"T": float(f)}) for f in factors])
    best = least([replace(best, disturbance=float(f)) for f in factors])
    assert refined([path], floor, first) == best


@pytest.mark.exhaustive
def test_colored_noise_of_three_sensors_is_consistent() -> None:
    given, _ = made(Case("C", "noise", "colored", 2))
    found = rt.diagnose(given.system, given.train, validation=given.validation)
    assert found.verdict == "consistent"
    assert not found.effects
    assert "slow part" in found.outcome.text
    assert 0.3 < found.nominal.levels.share < 0.7
    assert found.hold_out is not None
    assert found.hold_out.outcome.ok
    assert found.gap["train"].noise == pytest.approx(found.gap["train"].after, rel=0.3)


@pytest.mark.exhaustive
@pytest.mark.parametrize("step", [0.0, 0.01])
def test_without_random_heat_and_with_steps_and_a_spike(plant: rt.System, hide: Hide, step: float) -> None:
    train, validation = (colored(record, 0.008, seed) for seed, record in enumerate(hide(), start=1))
    outputs = np.array(train.outputs)
    outputs[200, 0] += 1.0
    train = train.with_outputs(outputs if not step else step * np.round(outputs / step))
    if step:
        validation = validation.with_outputs(step * np.round(np.asarray(validation.outputs) / step))
    found = rt.diagnose(plant, train, validation=validation, effects=["sensor_lag", "heat_source"])
    assert found.verdict == "consistent"
    assert found.noise_floor.glitches == {"Tp": 1}
    assert "slow part" in found.outcome.text


@pytest.mark.exhaustive
@pytest.mark.parametrize(("effect", "topology"), [("humidity", "C"), ("fan", "C"), ("melting", "C"), ("fan", "A")])
def test_what_the_catalog_does_not_know_is_no_noise(effect: str, topology: str) -> None:
    given, _ = made(Case(topology, "outside", effect, 0))
    assert with_wider_noise(rt.diagnosis.refit(given.system, given.train), None) is None


@pytest.mark.exhaustive
@pytest.mark.parametrize(("effect", "seed", "factor"), [("fan", 0, 8.0), ("fan", 1, 40.0), ("melting", 0, 24.0)])
def test_weak_physics_is_no_noise_either(effect: str, seed: int, factor: float) -> None:
    # Whitened variance 1.00 to 1.04: small slow noise with a long memory would explain the second, the third if one
    # sensor might lend its color to the others.
    given, _ = made(Case("C", "outside", effect, seed))
    sigma = {name: sensor.noise for name, sensor in given.system.sensors.items()}
    system = given.system.with_parameters({f"sensors.{name}.noise": factor * s for name, s in sigma.items()})
    more = np.sqrt(factor**2 - 1.0) * np.array([sigma[name] for name in given.train.output_names])
    noisy = given.train.with_outputs(given.train.outputs
                                     + more * np.random.default_rng(5).standard_normal(given.train.outputs.shape))
    fit = rt.diagnosis.refit(system, noisy)
    assert fit.variance < 1.2
    assert not rt.diagnosis.adequacy(fit).outcome.ok
    assert with_wider_noise(fit, None) is None


@pytest.mark.exhaustive
def test_a_hidden_effect_in_colored_noise_is_not_called_noise(plant: rt.System, hide: Hide, rate: Callable) -> None:
    def lagged(t: float, x: Array, u: Array) -> Array:
        return np.append(rate(x[:2], u), (x[1] - x[2]) / 25.0)

    train, validation = (colored(record, 0.005, seed) for seed, record in enumerate(
        hide(lagged, extra_states=1, read=lambda T: T[:, [0, 2]]), start=1))
    found = rt.diagnose(plant, train, validation=validation, effects=["sensor_lag", "sensor_gain", "heat_source"])
    assert found.verdict != "consistent"
    assert [effect.label for effect in (*found.effects, *found.provisional)] == ["sensor_lag(Tb)"]
