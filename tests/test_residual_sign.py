"""Residual = measured − modelled: a machine 1 K warmer than its model has residual +1 K wherever it is shown."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from heated_bar import PROJECT

import robthermal as rt
from robthermal import report

GAIN = 0.05  # of the heater in the second record


def system() -> rt.System:
    return rt.System(ambients={"room": {"temperature": 293.15}}, lumps={"bar": {"capacity": 50.0}},
                     links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"Q": {"lump": "bar"}},
                     sensors={"T": {"lump": "bar", "noise": 0.01}})


def record(seed: int, offset: float, gain: float = 1.0) -> rt.Record:
    """Simulated with the model, then read `offset` warmer."""
    rng = np.random.default_rng(seed)
    heat = np.repeat(rng.uniform(0.0, 6.0, 10), 30)
    drive = rt.Record(sample_time=5.0, inputs=gain * heat, outputs=np.zeros((300, 0)), input_names=["Q"],
                      output_names=[])
    run = rt.thermal.simulate(system(), drive, initial={"bar": 293.15})
    readings = run.outputs + offset + 0.01 * rng.standard_normal((300, 1))
    return rt.Record(sample_time=5.0, inputs=heat, outputs=readings, input_names=["Q"], output_names=["T"],
                     name=f"seed {seed}")


def fixed_start() -> rt.System:
    return system().with_parameters({"lumps.bar.initial": 293.15})


def narrow() -> rt.System:
    """With a range of its conductance that says: known."""
    return fixed_start().model_copy(update={"temperature_unit": "degC", "fit": {
        "links.bar-room.conductance": rt.thermal.FitRange(lower=0.4999, upper=0.5001)}})


def test_calibration_of_a_machine_one_kelvin_warmer() -> None:
    fit = rt.calibrate(fixed_start(), record(1, 1.0), validation=record(2, 1.0), initial="system",
                       parameters={"links.bar-room.conductance": (0.4999, 0.5001)})
    assert fit.residuals[0]["T"].mean() == pytest.approx(1.0, abs=0.01)
    assert fit.validation_residuals[0]["T"].mean() == pytest.approx(1.0, abs=0.01)
    assert fit.rmse["T"] == fit.train[0].rmse["T"] == pytest.approx(1.0, abs=0.01)


def test_figure_of_a_calibration() -> None:
    fit = rt.calibrate(fixed_start(), record(1, 1.0), initial="system",
                       parameters={"links.bar-room.conductance": (0.4999, 0.5001)})
    above, below = fit.plot()[:, 0]
    measured, modelled = (line.get_ydata() for line in above.get_lines())
    drawn = below.get_lines()[0].get_ydata()
    plt.close("all")
    assert np.mean(measured - modelled) == pytest.approx(1.0, abs=0.01)
    assert drawn == pytest.approx(measured - modelled, abs=1e-9)
    assert below.get_ylabel() == "measured − model [K]"


def test_figure_of_measured_against_model() -> None:
    figure = report.measured_against_model([0.0, 1.0, 2.0], {"T": [301.0, 302.0, 303.0]}, {"T": [300.0, 301.0, 302.0]})
    assert figure.axes[-1].get_lines()[0].get_ydata().tolist() == [1.0, 1.0, 1.0]
    assert figure.axes[-1].get_ylabel() == "measured −\nmodel [K]"


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> rt.jobs.run.JobResult:
    folder = tmp_path_factory.mktemp("warm")
    for name, seed in (("train", 1), ("validation", 2)):
        one = record(seed, np.linspace(0.0, 2.0, 300)[:, None])  # warms up: a mean residual near +1 K
        rows = [f"{t:g},{q:.9g},{T - 273.15:.6f}" for t, q, T in zip(one.time, one["Q"], one["T"], strict=True)]
        (folder / f"{name}.csv").write_text("\n".join(["time,Q,T", *rows]))
    rt.thermal.write_system(narrow(), folder / "bar.toml")
    (folder / "project.toml").write_text(PROJECT)
    return rt.jobs.run_job(rt.jobs.read_project(folder / "project.toml"))


def test_main_job_shows_what_the_calibration_computed(job: rt.jobs.run.JobResult) -> None:
    train, validation = job.comparisons
    assert job.fit is not None
    for shown, computed, score in ((train, job.fit.residuals[0], job.fit.train[0]),
                                   (validation, job.fit.validation_residuals[0], job.fit.validation[0])):
        assert shown.residuals(shown.calibrated)["T"] == pytest.approx(computed["T"], abs=1e-9)
        assert shown.rmse(shown.calibrated)["T"] == pytest.approx(score.rmse["T"], rel=1e-9)
        assert shown.residuals(shown.nominal)["T"].mean() == pytest.approx(1.0, abs=0.1)


def test_free_start_is_shown_as_computed_too() -> None:
    """With free initial temperatures two root mean squares existed: that of the fit, and one from the first reading."""
    fit = rt.calibrate(system(), record(1, 0.0), validation=record(2, 0.0),
                       parameters={"links.bar-room.conductance": (0.4, 0.6)})
    assert fit.validation_rmse["T"] == pytest.approx(0.01, rel=0.2)
    assert fit.validation[0].rmse == pytest.approx(fit.validation_rmse)


@pytest.fixture(scope="module")
def warm() -> rt.jobs.diagnose.Diagnosed:
    """Train and validation drift away from the model upwards, which no effect of the catalog that is allowed does."""
    drift = np.linspace(0.0, 2.0, 300)[:, None]
    return diagnosed([record(1, drift)], [record(2, drift)])


def diagnosed(train: list[rt.Record], validation: list[rt.Record], **options: Any) -> rt.jobs.diagnose.Diagnosed:
    """With a catalog of two effects: what is compared here is how results are shown, not what is found."""
    with pytest.MonkeyPatch.context() as patch:
        few = partial(rt.diagnose, effects=["sensor_lag", "heat_source"])
        patch.setattr("robthermal.jobs.diagnose._diagnose.diagnose", few)
        return rt.jobs.diagnose_records(narrow(), (), list(map(with_room, train)), list(map(with_room, validation)),
                                        **options)


def with_room(one: rt.Record) -> rt.Record:
    """With the temperature of the room, which is an unknown of the record else, and explains what is warmer."""
    inputs = np.column_stack([one.inputs, np.full(len(one), 293.15)])
    return replace(one, inputs=inputs, input_names=[*one.input_names, "room"])


def test_diagnosis_of_a_machine_that_is_warmer(warm: rt.jobs.diagnose.Diagnosed) -> None:
    train, validation = warm.residuals
    assert (train.kind, validation.kind) == ("train", "validation")
    assert train.before["T"].mean() > 0.2
    assert validation.before["T"].mean() > 0.2


@pytest.mark.parametrize("session_gain", [False, True])
def test_the_figures_of_a_diagnosis_have_the_size_its_table_says(session_gain: bool, tmp_path: Path) -> None:
    """With session gains the table said 0.048 K, the figure below it 0.391 K, of one record."""
    found = diagnosed([record(1, 0.0), record(3, 0.0, 0.97)], [record(2, 0.0, 1.0 + GAIN)], session_gain=session_gain)
    shown = [one for one in found.residuals if one.kind == "validation"]
    gap = found.diagnosis.gap["validation"]
    for state in ("before", "after"):
        e = np.concatenate([values for one in shown for values in getattr(one, state).values()])
        assert np.sqrt(np.mean(e**2)) == pytest.approx(getattr(gap, state), rel=1e-9)
    assert gap.before < 0.03 if session_gain else gap.before > 0.1
