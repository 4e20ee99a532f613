"""Calibration on simulated data whose truth is known."""

from __future__ import annotations

import json

import numpy as np
import pytest

import robthermal as rt
from robthermal.errors import InputError

TRUE = {"lumps.a.capacity": 50.0, "links.a-room.conductance": 0.5}
RANGES = {"lumps.a.capacity": (5.0, 500.0), "links.a-room.conductance": (0.05, 5.0)}
COUPLING = {"links.a-b.conductance": (0.1, 10.0)}


def plant(**sensor: float) -> rt.System:
    return rt.System(
        ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": 50.0}, "b": {"capacity": 20.0}},
        links=[{"between": ("a", "room"), "conductance": 0.5}, {"between": ("a", "b"), "conductance": 1.0}],
        inputs={"q": {"lump": "a"}},
        sensors={"Ta": {"lump": "a", "noise": 0.1, **sensor}, "Tb": {"lump": "b", "noise": 0.1, **sensor}})


def started(system: rt.System) -> rt.System:
    return system.with_parameters({"lumps.a.capacity": 80.0, "links.a-room.conductance": 0.3})


def driven(system: rt.System, n: int = 150, seed: int = 0, start: float = 295.0) -> rt.Record:
    heat = np.repeat(np.random.default_rng(seed).uniform(0, 20, n // 15), 15)
    record = rt.Record(sample_time=8.0, inputs=heat, outputs=np.zeros((heat.size, 0)), input_names=["q"],
                       output_names=[])
    return rt.thermal.simulate(system, record, initial=start)


def heater_off() -> rt.Record:
    return rt.Record(sample_time=8.0, inputs=np.zeros(150), outputs=np.zeros((150, 0)), input_names=["q"],
                     output_names=[])


def noise(shape: tuple[int, int], seed: int, pole: float = 0.0) -> np.ndarray:
    """Unit variance, stationary, first-order."""
    white = np.random.default_rng(seed).standard_normal(shape)
    out = white.copy()
    for k in range(1, len(out)):
        out[k] = pole * out[k - 1] + np.sqrt(1 - pole**2) * white[k]
    return out


def noisy(run: rt.Record, seed: int, pole: float = 0.0, sigma: float = 0.1) -> rt.Record:
    return run.with_outputs(run.outputs + sigma * noise(run.outputs.shape, seed, pole))


@pytest.mark.exhaustive
@pytest.mark.parametrize(("pole", "n"), [(0.0, 150), (0.8, 300)])
def test_intervals_cover_and_deviations_match_the_scatter(pole: float, n: int) -> None:
    # 100 runs: a 95 % interval covers between 88 % and 99 % of them except by a chance of about 1 in 100. With the slow
    # noise the record holds 33 independent samples; with half of that it is about 90 % (docs, "How far to trust it").
    clean = driven(plant(), n=n)
    fits = [rt.calibrate(plant(), noisy(clean, seed, pole), parameters=RANGES) for seed in range(100)]  # a near start
    estimates = np.array([list(fit.parameters.values()) for fit in fits])
    deviations = np.array([list(fit.std.values()) for fit in fits])
    covered = np.mean(np.abs(estimates - list(TRUE.values())) < 1.96 * deviations, axis=0)
    assert np.all((covered >= 0.88) & (covered <= 0.99))
    ratio = np.sqrt(np.mean(deviations**2, axis=0)) / estimates.std(axis=0, ddof=1)
    assert np.all((ratio > 0.75) & (ratio < 1.33))


def test_correlated_residuals_widen_the_intervals() -> None:
    clean, start = driven(plant()), started(plant())
    white, slow = (rt.calibrate(start, noisy(clean, 3, pole), parameters=RANGES) for pole in (0.0, 0.8))
    assert slow.std["lumps.a.capacity"] > 1.5 * white.std["lumps.a.capacity"]
    assert white.whiteness["Ta"].p_value > 0.001
    assert slow.whiteness["Ta"].p_value < 1e-6


def test_unknown_start_is_found_and_measured_start_is_not_better() -> None:
    run = noisy(driven(plant(), start=310.0), 5)
    free = rt.calibrate(started(plant()), run, parameters=RANGES)
    assert abs(free.initial_temperatures[0]["a"] - 310.0) < 0.5
    fixed = rt.calibrate(started(plant()), run, parameters=RANGES, initial="measured")
    assert fixed.initial_temperatures[0]["a"] == run["Ta"][0]
    assert free.rmse["Ta"] <= fixed.rmse["Ta"]


def test_several_records_share_parameters_and_keep_their_own_starts() -> None:
    runs = [noisy(driven(plant(), seed=seed, start=start), seed) for seed, start in ((1, 295.0), (2, 305.0))]
    both = rt.calibrate(started(plant()), runs, parameters=RANGES)
    one = rt.calibrate(started(plant()), runs[0], parameters=RANGES)
    assert both.std["lumps.a.capacity"] < one.std["lumps.a.capacity"]
    assert both.initial_temperatures[1]["a"] - both.initial_temperatures[0]["a"] > 8.0
    for name, value in TRUE.items():
        assert abs(both.parameters[name] - value) < 4 * both.std[name]


@pytest.mark.parametrize("loss", ["soft_l1", "huber"])
def test_robust_loss_withstands_glitches(loss: str) -> None:
    run = noisy(driven(plant()), 7)
    outputs = run.outputs.copy()
    outputs[::17] += 15.0
    glitched = run.with_outputs(outputs)
    robust = rt.calibrate(started(plant()), glitched, parameters=RANGES, loss=loss)
    plain = rt.calibrate(started(plant()), glitched, parameters=RANGES)
    error = {name: abs(robust.parameters[name] / value - 1) for name, value in TRUE.items()}
    assert max(error.values()) < 0.02
    assert max(abs(plain.parameters[name] / value - 1) for name, value in TRUE.items()) > 2 * max(error.values())


def test_undeclared_noise_is_estimated() -> None:
    fit = rt.calibrate(started(plant(noise=0.0)), noisy(driven(plant()), 9, sigma=0.2), parameters=RANGES)
    assert fit.outcome.ok
    assert fit.noise["Ta"] == pytest.approx(0.2, rel=0.2)


def test_coarse_steps_are_not_believed_below_their_rounding() -> None:
    run = driven(plant())
    coarse = run.with_outputs(np.round(run.outputs / 2.0) * 2.0)
    fit = rt.calibrate(started(plant(noise=0.01)), coarse, parameters=RANGES)
    assert fit.noise["Ta"] == pytest.approx(2.0 / np.sqrt(12))


def test_a_common_factor_is_named_and_a_prior_settles_it() -> None:
    system = plant()
    ranges = {**RANGES, **COUPLING, "lumps.b.capacity": (2.0, 200.0), "inputs.q.gain": (0.1, 10.0)}
    run = noisy(driven(system), 11)
    fit = rt.calibrate(system, run, parameters=ranges)
    assert fit.outcome.code == "undetermined" and not fit.outcome.ok
    assert len(fit.undetermined) == 1
    assert "common factor" in fit.undetermined[0]
    assert all(name in fit.undetermined[0] for name in ranges)
    assert "Fix one of these parameters, give it a prior (sigma), or" in fit.outcome.text
    known = rt.thermal.FitRange(lower=0.1, upper=10.0, sigma=0.01)
    settled = rt.calibrate(system, run, parameters={**ranges, "inputs.q.gain": known})
    assert settled.std["inputs.q.gain"] == pytest.approx(0.01, rel=0.05)
    assert settled.std["lumps.a.capacity"] < 3.0
    said, others = settled.outcome.text, [name for name in ranges if name != "inputs.q.gain"]
    assert f"give {', '.join(others[:-1])} or {others[-1]} a prior (sigma)" in said and "its prior decides it" in said
    every = {name: rt.thermal.FitRange(lower=0.5 * value, upper=2.0 * value, sigma=0.2 * value)
             for name, value in settled.parameters.items()}
    said = rt.calibrate(system, run, parameters=every).outcome.text
    assert "Each of these parameters has a prior (sigma), and its prior decides it" in said and "give" not in said


def test_a_ratio_is_named() -> None:
    alone = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": 50.0}},
                      links=[{"between": ("a", "room"), "conductance": 0.5}], inputs={"q": {"lump": "a"}},
                      sensors={"T": {"lump": "a", "noise": 0.1}})
    run = driven(alone)
    off = heater_off()
    cooling = rt.thermal.simulate(alone, off, initial=340.0)
    fit = rt.calibrate(alone, noisy(cooling, 1), parameters=RANGES)
    assert fit.undetermined == ("lumps.a.capacity and links.a-room.conductance are determined only as their ratio",)
    assert rt.calibrate(alone, noisy(run, 1), parameters=RANGES).undetermined == ()


def test_validation_is_scored_on_validation_data() -> None:
    train, validation = noisy(driven(plant(), seed=1), 1), noisy(driven(plant(), seed=2, start=300.0), 2)
    fit = rt.calibrate(started(plant()), train, parameters=RANGES, validation=validation)
    assert 0.08 < fit.validation_rmse["Ta"] < 0.14
    assert fit.validation[0].fit_percent["Ta"] > 95


def test_estimate_at_a_bound_is_said() -> None:
    fit = rt.calibrate(started(plant()), noisy(driven(plant()), 1),
                       parameters={**RANGES, "links.a-room.conductance": (0.1, 0.4)})
    assert fit.outcome.code == "at_bound"
    assert fit.table().loc["links.a-room.conductance", "at_bound"]


def test_result_goes_to_json_text_and_picture() -> None:
    fit = rt.calibrate(started(plant()), noisy(driven(plant()), 1), parameters=RANGES)
    again = json.loads(json.dumps(fit.to_dict(), allow_nan=False))
    assert again["parameters"]["lumps.a.capacity"]["value"] == fit.parameters["lumps.a.capacity"]
    assert "lumps.a.capacity" in str(fit)
    assert fit.plot().shape == (2, 1)
    np.testing.assert_allclose(np.diag(fit.correlation), 1.0)


def twins(conductances: tuple[float, float] = (0.5, 0.5)) -> rt.System:
    return rt.System(
        ambients={"room": {"temperature": 295.0}}, lumps={name: {"capacity": 50.0} for name in "ab"},
        links=[{"between": (name, "room"), "conductance": g} for name, g in zip("ab", conductances, strict=True)],
        inputs={"q": {"lump": "a"}, "p": {"lump": "b"}},
        sensors={"Ta": {"lump": "a", "noise": 0.1}, "Tb": {"lump": "b", "noise": 0.1}})


def test_tied_parameters_share_one_value() -> None:
    # Two equal bodies without a path between them: tied is the mean of what each says alone, √2 better known.
    heat = np.repeat(np.random.default_rng(4).uniform(0, 20, 10), 15)
    empty = rt.Record(sample_time=8.0, inputs=np.column_stack([heat, heat]), outputs=np.zeros((150, 0)),
                      input_names=["q", "p"], output_names=[])
    run = noisy(rt.thermal.simulate(twins(), empty), 1)
    names = ("links.a-room.conductance", "links.b-room.conductance")
    free = rt.calibrate(twins((0.3, 0.3)), run, parameters=dict.fromkeys(names, (0.05, 5.0)))
    tied = rt.calibrate(twins((0.3, 0.3)), run, parameters={names: (0.05, 5.0)})
    label = " = ".join(names)
    assert list(tied.parameters) == [label]
    assert tied.system.parameter(names[0]) == tied.system.parameter(names[1]) == tied.parameters[label]
    assert tied.parameters[label] == pytest.approx(np.mean(list(free.parameters.values())), rel=1e-3)
    assert tied.std[label] == pytest.approx(np.mean(list(free.std.values())) / np.sqrt(2), rel=0.3)


def refused(match: str, system: rt.System | None = None, data: object = None, **options: object) -> None:
    run = noisy(driven(plant()), 1)
    with pytest.raises(InputError, match=match):
        rt.calibrate(started(plant()) if system is None else system, run if data is None else data,
                     **({"parameters": RANGES} | options))


def test_bad_input_is_refused_by_name() -> None:
    run = noisy(driven(plant()), 1)
    refused("no fit table", parameters=None)
    refused("Did you mean", parameters={"lumps.a.capacitty": (1.0, 2.0)})
    refused("has no range in the fit table", parameters=["lumps.a.capacity"])
    refused("outside its bounds", parameters={"lumps.a.capacity": (1.0, 2.0)})
    refused("lower < upper", parameters={"lumps.a.capacity": (2.0, 1.0)})
    refused("which the system refuses", parameters={"lumps.a.capacity": (-5.0, 100.0)})
    refused("has no column of any sensor", data=run.with_outputs(run.outputs, ["x", "y"]))
    refused("is the training record", validation=run)
    refused("readings for 2 unknowns", data=run.select(outputs=["Ta"])[:2])
    refused("expected|Expected", data=[])
    refused("initial is 'rest'", initial="rest")
    refused("loss is 'cauchy'", loss="cauchy")
    refused("positive standard deviation", noise={"Ta": 0.0})
    refused("but initial is 'free'", parameters={"lumps.a.initial": (290.0, 300.0)},
            system=plant().with_parameters({"lumps.a.initial": 295.0}))
    pair = ("links.a-room.conductance", "links.a-b.conductance")
    refused("start at different values", parameters={pair: (0.05, 5.0)})
    refused("not the same kind", parameters={("lumps.a.capacity", pair[0]): (0.05, 500.0)})
    refused("named twice", parameters={("lumps.a.capacity",): (5.0, 500.0), "lumps.a.capacity": (5.0, 500.0)})
    refused("Tie parameters in a mapping", parameters=[pair])
    refused("has no derivative", parameters={"sensors.Ta.time_constant": (0.0, 50.0)})


def test_a_heater_that_is_never_on_is_named() -> None:
    off = heater_off()
    cooling = noisy(rt.thermal.simulate(plant(), off, initial=340.0), 1)
    refused("heater 'q' is never on", data=cooling, parameters={"inputs.q.gain": (0.1, 10.0)})
