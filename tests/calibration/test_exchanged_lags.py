"""A lag and the time constant of its lump may change places: two optima, one of which is nearer to the start."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from slow_thermometers import GAINS, LAG, LOSS, PATH, board, run, staircase

import robthermal as rt

ROOM = 295.0


def test_slow_thermometers_on_quick_heaters_are_found_from_a_start_the_other_way_round() -> None:
    fit = rt.calibrate(board(path=True, lag=20.0), run(staircase(900, 5), 2), validation=run(staircase(900, 6), 3))
    truth = {"sensors.T1.time_constant": LAG, "sensors.T2.time_constant": LAG, "links.h1-h2.conductance": PATH,
             "links.h1-room.conductance": LOSS, "links.h2-room.conductance": LOSS, "inputs.Q1.gain": GAINS[0],
             "inputs.Q2.gain": GAINS[1]}
    assert fit.parameters == {name: pytest.approx(value, rel=0.03) for name, value in truth.items()}
    assert max(fit.validation_rmse.values()) < 0.12  # quantization and noise: 0.10 K
    assert not any("exchanged" in remark for remark in fit.remarks)


def bar(capacity: float, lag: float, **sensors: dict[str, Any]) -> rt.System:
    return rt.System(ambients={"room": {"temperature": ROOM}}, lumps={"bar": {"capacity": capacity}},
                     links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
                     sensors={"T": {"lump": "bar", "noise": 0.05, "time_constant": lag}, **sensors})


def measured(system: rt.System) -> rt.Record:
    heat = np.repeat(np.random.default_rng(0).uniform(0.0, 6.0, 12), 25)
    drive = rt.Record(sample_time=10.0, inputs=heat, outputs=np.zeros((300, 0)), input_names=["heater"],
                      output_names=[])
    exact = rt.thermal.simulate(system, drive)
    noise = 0.05 * np.random.default_rng(1).standard_normal(exact.outputs.shape)
    return exact.with_outputs(exact.outputs + noise)


def calibrated(system: rt.System, sigma: float | None = None, *, record: rt.Record | None = None
               ) -> rt.calibration.Fit:
    capacity = rt.thermal.FitRange(lower=5.0, upper=500.0, sigma=sigma)
    start = system.with_parameters({"lumps.bar.capacity": 110.0, "sensors.T.time_constant": 15.0})
    return rt.calibrate(start, measured(system) if record is None else record, parameters={
        "lumps.bar.capacity": capacity, "links.bar-room.conductance": rt.thermal.FitRange(lower=0.05, upper=5.0),
        "sensors.T.time_constant": rt.thermal.FitRange(lower=1.0, upper=500.0)})


def open_lags(fit: rt.calibration.Fit) -> list[str]:
    return [remark for remark in fit.remarks if "exchanged" in remark]


def test_a_bar_of_200_s_read_with_a_lag_of_30_s_reads_like_one_of_30_s_read_with_200_s() -> None:
    one, other = measured(bar(100.0, 30.0)), measured(bar(15.0, 200.0))
    assert np.abs(one.outputs - other.outputs).max() < 2e-3  # the simulation's tolerance, beside 12 K


def test_that_the_data_do_not_tell_is_said_with_the_other_lag() -> None:
    fit = calibrated(bar(100.0, 30.0))
    assert fit.parameters["lumps.bar.capacity"] == pytest.approx(100.0, rel=0.02)  # nearer to the start
    (said,) = open_lags(fit)
    assert "the lag of T 200 s as well as 30 s" in said and "Measure the lag by itself" in said


@pytest.mark.parametrize("sigma", [10.0, 25.0])
def test_a_capacity_that_is_known_tells(sigma: float) -> None:
    assert open_lags(calibrated(bar(100.0, 30.0), sigma)) == []


def test_a_second_thermometer_without_lag_tells() -> None:
    assert open_lags(calibrated(bar(100.0, 30.0, T_quick={"lump": "bar", "noise": 0.05}))) == []


def test_nothing_is_asked_of_a_lag_that_is_known() -> None:
    system = bar(100.0, 30.0)
    fit = rt.calibrate(system, measured(system), parameters={"lumps.bar.capacity": (10.0, 500.0)})
    assert open_lags(fit) == []


def test_what_was_tried_does_not_change_the_weights() -> None:
    """With the noise estimated, a fit that leaves much has weights of its own."""
    start = board(path=True, lag=20.0)
    system = start.model_copy(update={"sensors": {name: one.model_copy(update={"noise": 0.0})
                                                  for name, one in start.sensors.items()}})
    declared, estimated = (rt.calibrate(one, run(staircase(900, 5), 2)) for one in (start, system))
    assert estimated.noise == {name: pytest.approx(0.1, rel=0.1) for name in ("T1", "T2")}
    assert estimated.std == {name: pytest.approx(std, rel=0.2) for name, std in declared.std.items()}


@pytest.mark.parametrize("confidence", [0.5, 0.95])
def test_ranges_hold_the_truth_where_the_nearer_optimum_is_the_wrong_one(confidence: float) -> None:
    truth = bar(15.0, 200.0)
    fit = calibrated(truth, record=measured(truth))
    assert fit.parameters["lumps.bar.capacity"] == pytest.approx(100.0, rel=0.02)  # the start is nearer to it
    ranges = fit.ranges(confidence)
    for name, value in (("lumps.bar.capacity", 15.0), ("sensors.T.time_constant", 200.0)):
        assert ranges[name][0] < value < ranges[name][1]
    low, high = ranges["links.bar-room.conductance"]
    assert high - low < 0.01  # both optima agree
    told = calibrated(bar(100.0, 30.0), 10.0)
    assert told.other_optima == () and told.ranges(confidence)["lumps.bar.capacity"][0] > 98.0
