"""Records that begin while the machine moves, as every part of a log after a gap does: machines from an exponential."""

from __future__ import annotations

import numpy as np
import pytest
from oven import NOISE, OVEN, ROOM
from scipy.linalg import expm

import robthermal as rt

STEP, FINE = 10.0, 10
FEW = ["sensor_lag", "input_lag", "input_delay", "conductance_step", "condensation", "hidden_mass"]


def log(kind: str, size: float, n: int = 560) -> rt.Record:
    """A log from rest: z = [block, plate, lagged heat q, lagged reading of block], then q and p."""
    rng = np.random.default_rng(1)
    u = np.column_stack([np.repeat(rng.choice([0.0, 5.0, 10.0, 20.0], n // 10), 10),
                         np.repeat(rng.choice([0.0, 5.0, 10.0, 20.0], n // 14), 14)])
    F = np.zeros((6, 6))
    F[:2, :2] = np.array([[-1.7, 1.5], [1.5, -2.3]]) / np.array([[200.0], [150.0]])
    F[0, 2 if kind == "input_lag" else 4], F[1, 5] = 1 / 200, 1 / 150
    for row, source, own in ((2, 4, "input_lag"), (3, 0, "sensor_lag")):
        F[row, [row, source]] = (-1 / size, 1 / size) if kind == own else (0.0, 0.0)
    M, z, y, drive = expm(F * STEP / FINE), np.zeros(4), [], u.repeat(FINE, axis=0)
    if kind == "input_delay":
        late = round(size * FINE / STEP)
        drive[late:, 0], drive[:late, 0] = drive[:-late, 0].copy(), 0.0
    for k, row in enumerate(drive):
        if k % FINE == 0:
            y.append(ROOM + z[[3 if kind == "sensor_lag" else 0, 1]])
        z = (M @ np.concatenate([z, row]))[:4]
    return rt.Record(sample_time=STEP, inputs=u, outputs=np.array(y) + NOISE * rng.standard_normal((n, 2)),
                     input_names=["q", "p"], output_names=["T_block", "T_plate"])


@pytest.mark.parametrize(("kind", "where", "size"), [
    ("sensor_lag", "T_block", 120.0), ("input_lag", "q", 60.0), ("input_delay", "q", 35.0)])
@pytest.mark.parametrize("first", [0, 57])
def test_a_lag_or_delay_is_named_alone_wherever_the_record_begins(kind: str, where: str, size: float, first: int
                                                                  ) -> None:
    """With settled lags at the start, steps of conductances, masses and condensation were named beside them."""
    found = rt.diagnose(OVEN, log(kind, size)[first:], effects=FEW)
    assert found.verdict == "named" and [(one.effect, one.where) for one in found.effects] == [(kind, (where,))]
    value, std, _ = next(iter(found.effects[0].values.values()))
    assert abs(value - size) < 4 * std < 0.02 * size


def test_a_declared_lag_is_consistent_wherever_the_record_begins() -> None:
    """And its parameters are those of the machine: with a settled lag the fit would bend them."""
    known = OVEN.with_parameters({"sensors.T_block.time_constant": 120.0})
    record = log("sensor_lag", 120.0)[57:]
    assert rt.diagnose(known, record, effects=FEW).verdict == "consistent"
    fit = rt.calibrate(known, record)
    assert fit.parameters["lumps.block.capacity"] == pytest.approx(200.0, rel=0.01)
    assert fit.train[0].rmse["T_block"] == pytest.approx(NOISE, rel=0.1)


@pytest.mark.parametrize("name", ["sensors.T_block.initial", "inputs.q.drive.before", "inputs.q.drive.gain"])
def test_derivatives_by_the_start_are_differences(name: str) -> None:
    system = OVEN.with_parameters({"sensors.T_block.time_constant": 40.0, "sensors.T_block.initial": 301.0,
                                   "inputs.q.drive.time_constant": 25.0, "inputs.q.drive.delay": 17.0,
                                   "inputs.q.drive.before": 7.0, "inputs.q.drive.gain": 0.1})
    drive = log("sensor_lag", 40.0, n=70).select(outputs=[])
    run = rt.thermal.trajectory(system, drive, initial=ROOM, sensitivities=[name])
    step = 1e-3 * system.parameter(name)
    up, down = (rt.thermal.trajectory(system.with_parameters({name: system.parameter(name) + sign * step}), drive,
                                      initial=ROOM).readings for sign in (1, -1))
    difference = (up - down) / (2 * step)
    assert np.abs(difference).max() > 1e-3
    assert np.abs(run.sensitivity[..., 0] - difference).max() < 1e-5 * np.abs(difference).max()


def test_the_start_acts_as_a_record_that_begins_earlier_says() -> None:
    """A record cut in two: with what its parts had before, the second continues the first."""
    system = OVEN.with_parameters({"inputs.q.drive.delay": 4.0, "inputs.q.drive.time_constant": 30.0,
                                   "sensors.T_block.time_constant": 50.0})
    whole = log("sensor_lag", 40.0, n=140).select(outputs=[])
    run = rt.thermal.trajectory(system, whole, initial=ROOM)
    cut = 45  # q has not changed for several lags: what it was before is what it is
    held = whole.changed(inputs=np.where(np.arange(140)[:, None] < cut, [[5.0, 0.0]], whole.inputs))
    run = rt.thermal.trajectory(system, held, initial=ROOM)
    began = {"inputs.q.drive.before": 5.0, "sensors.T_block.initial": float(run["T_block"][cut])}
    after = rt.thermal.trajectory(system.with_parameters(began), held[cut:], initial=dict(
        zip(system.lump_names, run.lumps[cut].tolist(), strict=True)))
    assert np.abs(after.readings - run.readings[cut:]).max() < 1e-3
    settled = rt.thermal.trajectory(system, held[cut:], initial=dict(
        zip(system.lump_names, run.lumps[cut].tolist(), strict=True)))
    assert np.abs(settled.readings - run.readings[cut:]).max() > 0.05


def test_a_step_from_rest_is_fitted_from_rest() -> None:
    """Lag and motion at the start are hard to tell apart there, and nothing asks for motion."""
    known = OVEN.with_parameters({"sensors.T_block.time_constant": 100.0})
    free = {"sensors.T_block.time_constant": (10.0, 500.0), "lumps.block.capacity": (50.0, 800.0)}
    fit = rt.calibrate(known, log("sensor_lag", 120.0, n=140), parameters=free)
    assert fit.parameters["sensors.T_block.time_constant"] == pytest.approx(120.0, rel=0.01)
    assert fit.initial_temperatures[0]["block"] == pytest.approx(ROOM, abs=0.05)
    moving = rt.calibrate(known, log("sensor_lag", 120.0)[57:], parameters=free)
    assert moving.parameters["sensors.T_block.time_constant"] == pytest.approx(120.0, rel=0.01)


def test_a_voltage_has_no_initial_temperature() -> None:
    with pytest.raises(rt.InputError, match="initial does not belong to a voltage"):
        rt.System(**{**rt.systems.two_module().model_dump(), "sensors": {"V": {"module": "m1", "initial": 300.0}}})


def test_modelica_knows_no_value_from_before() -> None:
    system = OVEN.with_parameters({"inputs.q.drive.time_constant": 25.0, "inputs.q.drive.before": 7.0})
    with pytest.raises(rt.InputError, match="from before the record"):
        rt.thermal.format_modelica(system)
