"""Calibration on frequency responses: the aluminium-POM-aluminium bar, and what the covariance is worth."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

import robthermal as rt
from robthermal.errors import InputError
from robthermal.fitting._operating_point import OperatingPoint
from robthermal.fitting._sampled_response import sampled_response

AREA, POM_LENGTH, ALUMINIUM_LENGTH, LUMPS = 4e-4, 0.01, 0.06, 3
CONDUCTIVITY, NOISE, STEP = 0.31, 0.01, 20.0
JOINTS = ("left3-pom1", "pom1-right1")
POM = tuple(f"links.{name}.conductance" for name in JOINTS)
FILMS = tuple(f"links.{side}{i}-room.conductance" for side in ("left", "right") for i in range(1, LUMPS + 1))
RANGES = {POM: (0.005, 0.2), FILMS: (1e-3, 0.1)}


def bar() -> rt.System:
    """Aluminium, POM, aluminium; heater and sensor on the left, sensor on the right, room as an input."""
    a = rt.thermal.Assembly()
    a.ambient("room", 295.0)
    sides = [a.rod(name, length=ALUMINIUM_LENGTH, area=AREA, material="aluminium 6061", lumps=LUMPS, perimeter=0.08,
                   convection=10.0, ambient="room") for name in ("left", "right")]
    pom = a.rod("pom", length=POM_LENGTH, area=AREA, material="POM", lumps=1)
    a.join(sides[0][-1], pom[0])
    a.join(pom[-1], sides[1][0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the Biot number of the POM: model and truth are cut alike here
        return a.system(inputs={"q": {"lump": "left1"}},
                        sensors={"T1": {"lump": "left1"}, "T2": {"lump": "right3"}})


def conductivity(conductance: float) -> tuple[float, float]:
    """Of POM from a joint's conductance, and its derivative: half a POM lump in series with half an aluminium lump."""
    metal = ALUMINIUM_LENGTH / LUMPS / 2 / (AREA * float(rt.thermal.materials().loc["aluminium 6061", "conductivity"]))
    plastic = 1.0 / conductance - metal
    return POM_LENGTH / 2 / (AREA * plastic), POM_LENGTH / 2 / (AREA * plastic**2) / conductance**2


def record(seed: int, n: int = 1500) -> rt.Record:
    """Random heater, drifting room that is measured, transient from 295 K."""
    rng = np.random.default_rng(seed)
    heat = np.repeat(rng.uniform(0.0, 4.0, n // 5), 5)
    room = 295.0 + np.cumsum(0.05 * rng.standard_normal(n))
    empty = rt.Record(sample_time=STEP, inputs=np.column_stack([heat, room]), outputs=np.zeros((n, 0)),
                      input_names=["q", "room"], output_names=[])
    run = rt.thermal.simulate(bar(), empty, initial=295.0)
    return run.with_outputs(run.outputs + NOISE * rng.standard_normal(run.outputs.shape))


def started() -> rt.System:
    return bar().with_parameters(dict.fromkeys(POM, 0.05) | dict.fromkeys(FILMS, 0.03))


def pole_list() -> list[float]:
    constants = rt.thermal.time_constants(bar())["time constant [s]"]
    return (-1.0 / constants[:3]).tolist()


def test_pom_conductivity_is_recovered_within_its_uncertainty() -> None:
    assert conductivity(bar().parameter(POM[0]))[0] == pytest.approx(CONDUCTIVITY)
    response = rt.identify.lrmp(record(0), poles=pole_list())
    fit = rt.calibrate(started(), response, parameters=RANGES)
    assert fit.outcome.ok and fit.outcome.code == "converged"
    name = " = ".join(POM)
    found, slope = conductivity(fit.parameters[name])
    std = slope * fit.std[name]
    assert abs(found - CONDUCTIVITY) < 2.58 * std
    assert std < 0.01
    assert 0.22 <= found <= 0.39
    assert 0.7 < fit.misfit < 1.4


@pytest.mark.exhaustive
def test_intervals_cover_although_bins_share_data() -> None:
    fits = [rt.calibrate(bar(), rt.identify.lrmp(record(seed, 500), poles=pole_list()), parameters=RANGES)
            for seed in range(30)]
    truth = np.array([bar().parameter(POM[0]), bar().parameter(FILMS[0])])
    estimates = np.array([list(fit.parameters.values()) for fit in fits])
    deviations = np.array([list(fit.std.values()) for fit in fits])
    covered = np.mean(np.abs(estimates - truth) < 1.96 * deviations, axis=0)
    ratio = np.sqrt(np.mean(deviations**2, axis=0)) / estimates.std(axis=0, ddof=1)
    assert np.all(covered >= 0.87)
    assert np.all((ratio > 0.75) & (ratio < 1.5))


def test_correlation_between_bins_widens_the_intervals(tmp_path: Path) -> None:
    # A file keeps no correlation: then one bin per window is used, and the intervals are wider for it.
    response = rt.identify.lrmp(record(0, 600), poles=pole_list())
    response.save(tmp_path / "G.json")
    again = rt.identify.FrequencyResponse.load(tmp_path / "G.json")
    whole = rt.calibrate(started(), response, parameters=RANGES)
    part = rt.calibrate(started(), again, parameters=RANGES)
    assert part.responses[0].bins.size < whole.responses[0].bins.size / 10
    for name, value in whole.parameters.items():
        assert abs(part.parameters[name] - value) < 3.0 * part.std[name]
        assert part.std[name] > whole.std[name]


def test_operating_point_of_a_nonlinear_system() -> None:
    # Radiation 4 ε σ A T³ at the operating point: seen as a conductance of the hot bar, not of the cold one.
    hot = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": 50.0}},
                    links=[{"between": ("a", "room"), "radiation": 2e-9}], inputs={"q": {"lump": "a"}},
                    sensors={"T": {"lump": "a"}})
    rng, n = np.random.default_rng(0), 1200
    heat = 30.0 + np.repeat(rng.uniform(-1.0, 1.0, n // 4), 4)
    empty = rt.Record(sample_time=20.0, inputs=heat, outputs=np.zeros((n, 0)), input_names=["q"], output_names=[])
    rest = rt.thermal.steady_state(hot, {"q": 30.0}).equilibria[0].temperatures
    run = rt.thermal.simulate(hot, empty, initial=rest)
    response = rt.identify.lpm(run.with_outputs(run.outputs + 0.002 * rng.standard_normal((n, 1))))
    start = hot.with_parameters({"links.a-room.radiation": 1e-9})
    ranges = {"links.a-room.radiation": (1e-10, 1e-8)}
    fit = rt.calibrate(start, response, parameters=ranges, operating_point={"q": 30.0})
    assert fit.parameters["links.a-room.radiation"] == pytest.approx(2e-9, rel=0.02)
    own = rt.calibrate(start, response, parameters=ranges)  # the mean of its record
    assert own.responses[0].operating_point == {"q": pytest.approx(heat.mean())}
    assert own.parameters["links.a-room.radiation"] == pytest.approx(2e-9, rel=0.02)
    cold = rt.calibrate(start, response, parameters=ranges, operating_point={"q": 0.0})
    assert cold.parameters["links.a-room.radiation"] > 2.5e-9


def test_result_goes_to_json_text_and_picture() -> None:
    fit = rt.calibrate(started(), rt.identify.lpm(record(1, 400)), parameters=RANGES)
    again = json.loads(json.dumps(fit.to_dict(), allow_nan=False))
    (one,) = fit.responses
    assert again["responses"][0]["n_frequencies"] == one.bins.size
    assert "misfit" in str(fit)
    assert fit.plot().shape == (4, 2)
    assert one.model.shape == (2, 2, one.bins.size)
    np.testing.assert_array_equal(one.residuals, fit.response_residuals[0])
    np.testing.assert_allclose(one.residuals + one.model, one.response.response[:, :, one.bins], rtol=1e-12)


def test_bad_input_is_refused_by_name() -> None:
    response = rt.identify.lpm(record(1, 400))
    for match, options in {
        "the validation response": {"validation": response},
        "method is given": {"method": "prediction_error"},
        "no influence on the frequency response": {"parameters": {"sensors.T1.offset": (-1.0, 1.0)}},
    }.items():
        with pytest.raises(InputError, match=match):
            rt.calibrate(started(), response, **({"parameters": RANGES} | options))
    with pytest.raises(InputError, match="operating_point is given with a record"):
        rt.calibrate(started(), record(1, 100), parameters=RANGES, operating_point={"q": 1.0})
    other = rt.System(ambients={"lab": {"temperature": 295.0}}, lumps={"x": {"capacity": 50.0}},
                      links=[{"between": ("x", "lab"), "conductance": 1.0}], sensors={"T1": {"lump": "x"}})
    with pytest.raises(InputError, match="no input of the system"):
        rt.calibrate(other, response, parameters={"lumps.x.capacity": (1.0, 100.0)})


@pytest.mark.parametrize(("h", "read", "driven"), [
    (5.0, 0.0, 0.7), (5.0, 0.0, 5.0), (5.0, 0.0, 12.6), (5.0, 5.0, 3.1), (0.5, 0.62, 0.0), (0.5, 0.15, 1.0)])
def test_delays_of_held_inputs_are_exact_between_samples(h: float, read: float, driven: float) -> None:
    # periodic inputs: spectra of a simulation's last period, which interpolates late readings (error h^4, no jumps)
    n = 40
    plain = rt.System(
        ambients={"room": {"temperature": 295.0}}, lumps={"plate": {"capacity": 30.0}, "block": {"capacity": 12.0}},
        links=[{"between": ("plate", "room"), "conductance": 0.9}, {"between": ("plate", "block"), "conductance": 1.1}],
        inputs={"heater": {"lump": "block"}},
        sensors={"Tp": {"lump": "plate"}, "Tb": {"lump": "block", "time_constant": 4.0}})
    late = plain.with_parameters({"inputs.heater.drive.delay": driven, "sensors.Tp.delay": read})
    heater = np.tile(np.random.default_rng(2).uniform(0.0, 6.0, n), round(150 / h))
    drive = rt.Record(sample_time=h, inputs=heater, outputs=np.zeros((heater.size, 0)), input_names=["heater"],
                      output_names=[])
    readings = rt.thermal.simulate(late, drive, tolerance=1e-9).outputs[-n:]
    G = (np.fft.rfft(readings, axis=0) / np.fft.rfft(heater[-n:])[:, None])[1:]
    found = sampled_response(late, np.arange(1, n // 2 + 1) / (n * h), h, OperatingPoint({}), ("Tp", "Tb"), ("heater",))
    np.testing.assert_allclose(found[:, :, 0], G, rtol=0, atol=1e-6 * np.abs(G).max())
