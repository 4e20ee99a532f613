"""Means over a sample against an integral in a matrix exponential, and against a hundred times finer samples."""

from __future__ import annotations

import numpy as np
import pytest
from oven import OVEN, ROOM
from scipy.linalg import expm

import robthermal as rt

STEP = 60.0


def steps(n: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.column_stack([np.repeat(rng.choice([0.0, 5.0, 10.0, 20.0], n // 10), 10),
                            np.repeat(rng.choice([0.0, 5.0, 10.0, 20.0], n // 6), 6)])


def means(u: np.ndarray, lag: float) -> np.ndarray:
    """Means of the readings over every step, from rest: z = [block, plate, lag of T_block, two integrals]."""
    F = np.zeros((7, 7))
    F[:2, :2] = np.array([[-1.7, 1.5], [1.5, -2.3]]) / np.array([[200.0], [150.0]])
    F[0, 5], F[1, 6] = 1 / 200, 1 / 150
    F[2, [0, 2]] = (1 / lag, -1 / lag) if lag else (0.0, 0.0)
    F[3, 2 if lag else 0] = F[4, 1] = 1.0
    M, z, out = expm(F * STEP), np.zeros(3), []
    for row in u:
        after = M @ np.concatenate([z, [0.0, 0.0], row])
        z = after[:3]
        out.append(ROOM + after[3:5] / STEP)
    return np.array(out)


def log(u: np.ndarray, y: np.ndarray) -> rt.Record:
    return rt.Record(sample_time=STEP, inputs=u, outputs=y, input_names=["q", "p"], output_names=["T_block", "T_plate"])


@pytest.mark.parametrize("lag", [0.0, 40.0])
def test_means_are_those_of_a_matrix_exponential(lag: float) -> None:
    u = steps(60, 0)
    drive = log(u, np.zeros((60, 2))).select(outputs=[])
    system = OVEN.with_parameters({"sensors.T_block.time_constant": lag})
    run = rt.thermal.simulate(system, drive.changed(averaged=True), initial=ROOM)
    assert run.averaged and np.abs(run.outputs[1:] - means(u, lag)[:-1]).max() < 1e-6
    assert np.all(run.outputs[0] == ROOM)
    at_once = rt.thermal.simulate(system, drive, initial=ROOM)
    assert np.abs(at_once.outputs - run.outputs).max() > 0.5


def test_means_of_a_machine_with_modules_are_those_of_finer_samples() -> None:
    system = rt.systems.two_module()
    u = np.random.default_rng(0).uniform(-1.0, 1.0, (12, 2))
    names = list(system.modules)
    fine = rt.Record(sample_time=0.1, inputs=u.repeat(600, axis=0), outputs=np.zeros((7200, 0)), input_names=names,
                     output_names=[])
    y = rt.thermal.simulate(system, fine).outputs
    mean = (0.5 * (y[1:] + y[:-1]))[:6600].reshape(11, 600, -1).mean(axis=1)
    coarse = rt.Record(sample_time=60.0, inputs=u, outputs=np.zeros((12, 0)), input_names=names, output_names=[],
                       averaged=True)
    assert np.abs(rt.thermal.simulate(system, coarse).outputs[1:] - mean).max() < 1e-3


@pytest.mark.parametrize("name", ["lumps.block.capacity", "links.block-plate.conductance", "sensors.T_block.gain",
                                  "sensors.T_block.time_constant", "sensors.T_plate.delay"])
def test_derivatives_are_differences(name: str) -> None:
    system = OVEN.with_parameters({"sensors.T_block.time_constant": 40.0, "sensors.T_plate.delay": 15.0})
    drive = log(steps(30, 1), np.zeros((30, 2))).select(outputs=[]).changed(averaged=True)
    run = rt.thermal.trajectory(system, drive, initial=ROOM, sensitivities=[name])
    step = 1e-4 * system.parameter(name)
    up, down = (rt.thermal.trajectory(system.with_parameters({name: system.parameter(name) + sign * step}), drive,
                                      initial=ROOM).readings for sign in (1, -1))
    difference = (up - down) / (2 * step)
    assert np.abs(run.sensitivity[..., 0] - difference).max() < 1e-4 * np.abs(difference).max()


def test_the_first_mean_is_of_a_step_that_the_record_does_not_hold() -> None:
    """Counted for nothing: it is that of the record, whatever the parameters are."""
    u = steps(30, 2)
    record = rt.signals.as_means(log(u, means(u, 0.0)), "after")
    run = rt.thermal.trajectory(OVEN, record, sensitivities=["lumps.block.capacity"])
    assert np.array_equal(run.readings[0], record.outputs[0]) and not run.sensitivity[0].any()


def test_large_networks_take_the_mean_of_both_ends() -> None:
    n = 300
    links = [{"between": (f"x{i}", f"x{i + 1}"), "conductance": 5.0} for i in range(n - 1)]
    bar = rt.System(name="bar", ambients={"room": {"temperature": ROOM}},
                    lumps={f"x{i}": {"capacity": 50.0} for i in range(n)},
                    links=[*links, {"between": ("x0", "room"), "conductance": 1.0}], inputs={"q": {"lump": "x0"}},
                    sensors={"T": {"lump": "x3"}})
    drive = rt.Record(sample_time=5.0, inputs=np.ones(40), outputs=np.zeros((40, 0)), input_names=["q"],
                      output_names=[])
    y = rt.thermal.simulate(bar, drive)["T"]
    mean = rt.thermal.simulate(bar, drive.changed(averaged=True))["T"]
    assert np.allclose(mean[1:], 0.5 * (y[1:] + y[:-1]), atol=1e-9)


def test_voltages_are_refused() -> None:
    system = rt.systems.two_module()
    with_voltage = rt.System(**{**system.model_dump(), "sensors": {**system.model_dump()["sensors"],
                                                                  "V1": {"module": "m1"}}})
    drive = rt.Record(sample_time=5.0, inputs=np.ones((40, 2)), outputs=np.zeros((40, 0)),
                      input_names=list(system.modules), output_names=[], averaged=True)
    with pytest.raises(rt.InputError, match="voltage"):
        rt.thermal.simulate(with_voltage, drive)


def test_a_diagnosis_of_means_compares_with_means() -> None:
    """Undeclared, the model without any effect is said to be right as means; declared, nothing is missing."""
    u = steps(300, 3)
    y = means(u, 0.0) + 0.02 * np.random.default_rng(3).standard_normal((300, 2))
    raw = log(u, y)
    few = ["sensor_lag", "input_delay", "missing_link"]
    found = rt.diagnose(OVEN, raw, effects=few)
    assert found.verdict == "unexplained" and not found.effects
    assert 'averaged = "after"' in found.means and found.means in found.outcome.text
    declared = rt.diagnose(OVEN, rt.signals.as_means(raw, "after"), effects=few)
    assert declared.verdict == "consistent" and declared.means == ""


def test_a_long_log_of_means_is_asked_by_its_first_part_and_then_as_a_whole() -> None:
    u = steps(4200, 7)
    raw = log(u, means(u, 0.0) + 0.02 * np.random.default_rng(7).standard_normal((4200, 2)))
    found = rt.diagnose(OVEN, raw, effects=["heat_source"])
    assert found.verdict == "unexplained" and 'averaged = "after"' in found.means
    late = rt.thermal.simulate(OVEN.with_parameters({"inputs.q.drive.delay": 20.0}), raw.select(outputs=[]))
    noisy = late.with_outputs(late.outputs + 0.02 * np.random.default_rng(8).standard_normal((4200, 2)))
    right = rt.diagnose(OVEN, noisy, effects=["input_delay"])
    assert right.verdict == "named" and right.effects[0].where == ("q",) and right.means == ""


@pytest.mark.exhaustive
def test_a_delay_of_means_gets_no_name() -> None:
    """Readings averaged over the step before look like inputs half a step late."""
    u = steps(300, 4)
    y = means(u, 0.0) + 0.02 * np.random.default_rng(4).standard_normal((300, 2))
    raw = log(u[1:], y[:-1])
    found = rt.diagnose(OVEN, raw, effects=["input_delay"])
    assert found.verdict == "unexplained" and 'averaged = "readings"' in found.means
    late = rt.thermal.simulate(OVEN.with_parameters({"inputs.q.drive.delay": 20.0}), log(u, y).select(outputs=[]))
    noisy = late.with_outputs(late.outputs + 0.02 * np.random.default_rng(5).standard_normal((300, 2)))
    right = rt.diagnose(OVEN, noisy, effects=["input_delay"])
    assert right.verdict == "named" and right.effects[0].where == ("q",) and right.means == ""


def test_a_calibration_of_means_finds_the_parameters() -> None:
    u = steps(210, 6)
    y = means(u, 0.0) + 0.02 * np.random.default_rng(6).standard_normal((210, 2))
    fit = rt.calibrate(OVEN, rt.signals.as_means(log(u, y), "after"))
    assert fit.parameters["lumps.block.capacity"] == pytest.approx(200.0, rel=0.01)
    wrong = rt.calibrate(OVEN, log(u, y))
    assert abs(wrong.parameters["lumps.block.capacity"] / 200.0 - 1.0) > 0.03
