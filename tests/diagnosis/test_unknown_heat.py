"""The smoothed heat: against what was injected, a dense Gaussian conditional, and where there is none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import robthermal as rt

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def injected(inputs_of: Callable, integrated: Callable, recorded: Callable, rate: Callable
             ) -> Callable[[int], tuple[rt.Record, Callable[[Array], Array]]]:
    """Record of the plant with a random walk of heat into the block, and the heat at any time."""

    def measure(seed: int, n: int = 300) -> tuple[rt.Record, Callable[[Array], Array]]:
        rng = np.random.default_rng(seed)
        at = np.arange(0.0, 5.0 * n + 100.0, 100.0)
        walk = 0.02 * np.sqrt(100.0) * np.cumsum(rng.standard_normal(at.size))
        u = inputs_of(n, seed)
        T = integrated(lambda t, T, u: rate(T, u, np.array([0.0, np.interp(t, at, walk)])), np.full(2, 298.15), u)
        return recorded(T, u, ["heater", "room"], ["Tp", "Tb"], seed), lambda t: np.interp(t, at, walk)

    return measure


def test_band_covers_the_injected_heat(plant: rt.System, injected: Callable) -> None:
    inside, errors = [], []
    for seed in range(8):
        record, heat = injected(seed)
        found = rt.diagnosis.unknown_heat(rt.diagnosis.refit(plant, record), "block")
        assert found.outcome.code == "found"
        error = found.heat[0] - heat(found.time[0])
        inside.append(np.mean(np.abs(error) < 1.96 * found.std[0]))
        errors.append(np.sqrt(np.mean(error**2)) / np.std(heat(found.time[0])))
    # Errors are correlated over a record, so 8 records give the coverage of 95 % within about 8 %.
    assert 0.87 < np.mean(inside) <= 1.0
    assert np.median(errors) < 0.3


def test_posterior_is_the_dense_gaussian_conditional(plant: rt.System) -> None:
    # Second method: the joint covariance of knots and readings written out, conditioned by one dense solve. A linear
    # plant with known parameters and no other unknowns than the initial temperatures with their priors.
    still = plant.model_copy(update={"fit": {}})
    n, h, noise = 60, 5.0, 0.01
    A = np.array([[-0.6 - 1.5, 1.5], [1.5, -1.5 - 0.1]]) / np.array([[120.0], [40.0]])
    time = h * np.arange(n)
    u = np.column_stack([np.full(n, 3.0), np.full(n, 298.15)])
    drive = rt.Record(sample_time=h, inputs=u, outputs=np.zeros((n, 0)), input_names=["heater", "room"],
                      output_names=[])
    rng = np.random.default_rng(2)
    hidden = drive.inputs.copy()
    hidden[:, 0] += 0.4 * np.sin(2 * np.pi * time / 200.0)
    run = rt.thermal.simulate(still, rt.Record(sample_time=h, inputs=hidden, outputs=np.zeros((n, 0)),
                                               input_names=["heater", "room"], output_names=[]), initial=298.15)
    record = rt.Record(sample_time=h, inputs=u, outputs=run.outputs + noise * rng.standard_normal((n, 2)),
                       input_names=["heater", "room"], output_names=["Tp", "Tb"])
    fit = rt.diagnosis.refit(still, record)
    found = rt.diagnosis.unknown_heat(fit, "block")

    knots = found.time[0]
    fine = 50  # steps a sample, of an Euler integration whose error is far below the tolerance
    step, x = h / fine, np.zeros((2, knots.size + 2))
    x[:, knots.size:] = np.eye(2)  # initial temperatures
    answers = []
    for k in range(n):
        answers.append(x.copy())
        for i in range(fine):
            t = min(time[k] + (i + 0.5) * step, time[-1])
            heat = np.concatenate([[np.interp(t, knots, unit) for unit in np.eye(knots.size)], [0.0, 0.0]])
            mid = x + 0.5 * step * (A @ x + np.outer([0.0, 1.0 / 40.0], heat))
            x = x + step * (A @ mid + np.outer([0.0, 1.0 / 40.0], heat))
    H = np.array(answers).reshape(2 * n, -1)
    levels = np.array([fit.levels.noise[name] * fit.floor.noise[name] for name in ("Tp", "Tb")])
    since = knots - knots[0]
    prior = np.zeros((knots.size + 2,) * 2)
    prior[:-2, :-2] = found.rate**2 * (np.minimum(since[:, None], since) + since[-1])
    prior[-2:, -2:] = fit.structure.starts[0].sigma ** 2 * np.eye(2)
    S = H @ prior @ H.T + np.diag(np.tile(levels**2, n))
    start = fit.structure.starts[0].mean
    flat = rt.thermal.simulate(still, drive, initial=start).outputs
    gain = prior @ H.T @ np.linalg.inv(S)
    mean = gain @ (record.outputs - flat).ravel()
    covariance = prior - gain @ H @ prior
    assert np.allclose(found.heat[0], mean[:-2], atol=0.05 * np.median(found.std[0]))
    assert np.allclose(found.std[0], np.sqrt(np.diag(covariance))[:-2], rtol=0.02)
    assert np.std(mean) > 3 * np.median(found.std[0])  # otherwise the comparison says nothing


def test_no_heat_where_nothing_is_hidden(plant: rt.System, hide: Callable[..., tuple[rt.Record, rt.Record]]) -> None:
    fit = rt.diagnosis.refit(plant, hide(n=300)[0])
    found = rt.diagnosis.unknown_heat(fit, "plate")
    assert found.gain < 3.0
    assert np.all(np.abs(found.heat[0]) <= 3.0 * found.std[0] + 1e-12)


def test_unexplained_diagnosis_brings_its_heat_and_draws_it(plant: rt.System, injected: Callable) -> None:
    record, heat = injected(3)
    found = rt.diagnose(plant, record, effects=["sensor_lag", "sensor_gain"])
    assert found.verdict == "unexplained" and found.unknown_heat is not None
    assert found.unknown_heat.lump == found.located.lump == "block"
    assert found.to_dict()["unknown_heat"]["lump"] == "block"
    axes = found.unknown_heat.plot()
    assert axes.size == 1 and "95 %" in axes[0].get_legend_handles_labels()[1]
    error = found.unknown_heat.heat[0] - heat(found.unknown_heat.time[0])
    assert np.sqrt(np.mean(error**2)) < 0.3 * np.std(heat(found.unknown_heat.time[0]))


def test_two_records_have_heats_of_their_own(plant: rt.System, injected: Callable) -> None:
    (first, one), (second, two) = injected(5, 160), injected(6, 160)
    found = rt.diagnosis.unknown_heat(rt.diagnosis.refit(plant, [first, second]), "block")
    assert len(found.heat) == 2
    for heat, truth, t in zip(found.heat, (one, two), found.time, strict=True):
        assert np.corrcoef(heat, truth(t))[0, 1] > 0.7


def test_unknown_lump_is_refused(plant: rt.System, hide: Callable[..., tuple[rt.Record, rt.Record]]) -> None:
    with pytest.raises(rt.InputError, match="no lump 'tail'"):
        rt.diagnosis.unknown_heat(rt.diagnosis.refit(plant, hide(n=100)[0]), "tail")
