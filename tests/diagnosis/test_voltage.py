"""Diagnosis with the voltage of a module among the readings: signatures, whitening, verdicts in volts."""

import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
from voltage_rig import drive, system

import robthermal as rt
from robthermal.diagnosis._doubts import which_is_off
from robthermal.diagnosis.data import as_measured
from robthermal.diagnosis.evidence import Gap, expected_rms, remainder
from robthermal.diagnosis.fit import exact
from robthermal.diagnosis.path import LinearizedRecord, gathered, linearized_record, whitener

H = 4.0
CURRENTS = np.repeat(np.random.default_rng(5).uniform(-1.0, 1.8, 30), 10)
FIT = {"modules.m1.seebeck.value": {"lower": 0.03, "upper": 0.08},
       "modules.m1.resistance.value": {"lower": 1.0, "upper": 4.0},
       "modules.m1.conductance.value": {"lower": 0.1, "upper": 1.5}}


def plain(**numbers: float) -> rt.System:
    """The rig with constant properties, which calibration may change."""
    made = system().with_parameters({"modules.m1.seebeck.slope": 0.0, "modules.m1.resistance.slope": 0.0} | numbers)
    return rt.System(**{**dict(made), "fit": FIT})


def logged(machine: rt.System, seed: int) -> rt.Record:
    """What the rig logs: a simulation with the noise of its sensors."""
    rng = np.random.default_rng(seed)
    run = rt.thermal.simulate(machine, drive(CURRENTS if seed % 2 else CURRENTS[::-1], H), initial=295.15)
    return run.with_outputs(run.outputs + rng.standard_normal(run.outputs.shape) * [0.02, 0.002])


@pytest.fixture(scope="module")
def path() -> LinearizedRecord:
    made = rt.System(**{**dict(plain()), "lumps": {"hot": {"capacity": 70.0, "initial": 295.15, "disturbance": 0.05},
                                                   "cold": {"capacity": 35.0, "initial": 295.15, "disturbance": 0.02}}})
    made = made.with_parameters({"modules.m1.resistance.slope": 0.01, "modules.m1.seebeck.slope": 5e-5})
    return linearized_record(made, as_measured(made, logged(made, 1), "records")[0])


EFFECTS = ["seebeck_slope", "resistance_slope", "conductance_slope", "thomson", "joule_split", "heat_source",
           "natural_convection", "radiation", "missing_link", "lead_heating", "input_gain", "input_offset",
           "hysteresis", "sensor_offset", "sensor_gain", "ambient_gradient"]


def test_signatures_are_what_a_small_effect_does_to_volts_and_kelvin(path: LinearizedRecord) -> None:
    tried = rt.diagnosis.candidates(path.system, EFFECTS)
    assert {one.effect.name for one in tried} >= {"thomson", "resistance_slope", "heat_source", "lead_heating"}
    errors = {}
    for one in tried:
        size = one.effect.size
        step = min(1e-4 * size.upper, size.typical)
        trial = one.trials(path)[0]
        changed = rt.thermal.trajectory(trial.add(path.system, step), path.one.record, tolerance=1e-8).readings
        before = rt.thermal.trajectory(path.system, path.one.record, tolerance=1e-8).readings
        truth, found = (changed - before) / step, path.columns([trial])[..., 0]
        scale = np.abs(truth).max(axis=0) + 1e-9
        errors[one.effect.name, one.where] = (np.abs(found - truth).max(axis=0) / scale).tolist()
    assert {key: error for key, error in errors.items() if max(error) > 0.03} == {}


def test_whitener_inverts_the_dense_covariance(path: LinearizedRecord) -> None:
    noise, disturbance, n = np.array([0.02, 0.002]), np.array([0.05, 0.02]), 30
    A, C, Q = path.steps[0], path.C, gathered(path, disturbance)
    assert np.ptp(C[:, 1], axis=0).max() > 1e-4  # V/K: what a voltage reads of the temperatures changes
    states = np.zeros((n, n, *A.shape[1:]))
    for k in range(1, n):
        for j in range(k):
            states[k, j] = A[k - 1] @ states[k - 1, j]
            states[j, k] = states[k, j].T
        states[k, k] = A[k - 1] @ states[k - 1, k - 1] @ A[k - 1].T + Q[k - 1]
    dense = np.block([[C[j] @ states[j, k] @ C[k].T + (np.diag(noise**2) if j == k else 0.0) for k in range(n)]
                      for j in range(n)])
    columns = np.zeros((len(A), 2, 2 * n))
    columns[:n].reshape(2 * n, 2 * n)[:] = np.eye(2 * n)
    L_inverse = whitener(path, noise, disturbance)(columns)[:n].reshape(2 * n, 2 * n)
    assert np.allclose(L_inverse @ dense @ L_inverse.T, np.eye(2 * n), atol=1e-9)


def test_a_right_model_is_consistent() -> None:
    found = rt.diagnose(plain(), logged(plain(), 1), validation=logged(plain(), 2))
    assert found.verdict == "consistent" and found.gap["train"].unit == "K"
    assert found.gap["train"].after == pytest.approx(0.02, rel=0.15)  # of the thermometer: volts are no kelvin


def test_a_slope_of_the_resistance_is_named() -> None:
    hidden = plain(**{"modules.m1.resistance.slope": 0.02})
    found = rt.diagnose(plain(), logged(hidden, 1), validation=logged(hidden, 2))
    assert found.verdict == "named" and [one.effect for one in found.effects] == ["resistance_slope"]
    slope, std, _ = found.effects[0].values["slope"]
    assert abs(slope - 0.02) < 4 * std and std < 0.002


def test_noise_is_said_in_the_unit_of_the_sensor() -> None:
    machine = plain()
    sensors = {name: {**dict(sensor), "noise": 10.0 * sensor.noise} for name, sensor in machine.sensors.items()}
    floor = rt.diagnosis.noise_floor(rt.System(**{**dict(machine), "sensors": sensors}), logged(machine, 1))
    assert floor.units == {"T_cold": "K", "V1": "V"}
    rows = {line.split()[0]: line.split()[-1] for line in str(floor).splitlines()[1:3]}
    assert rows == floor.units
    said = floor.outcome.text
    assert re.search(r"T_cold \(declared 0.2 K, record [0-9.]+ K\), V1 \(declared 0.02 V, record [0-9.]+ V\)", said)
    assert floor.plot().get_ylabel() == "noise [K, V]"


def test_residuals_of_voltages_are_drawn_on_an_axis_of_volts(path: LinearizedRecord) -> None:
    figure, ax = plt.subplots()
    r = np.column_stack([np.full(len(path.time), 0.5), np.full(len(path.time), 0.003)])
    path.draw(ax, r)
    drawn = {axes.get_ylabel(): [line.get_ydata()[0] for line in axes.get_lines() if len(line.get_ydata())]
             for axes in figure.axes}
    plt.close(figure)
    assert drawn == {"measured − model [K]": [0.5], "measured − model [V]": [0.003]}
    assert [line.get_label() for line in ax.get_lines()] == ["T_cold", "V1 [V], right"]


def test_what_is_left_of_a_voltage_is_said_in_volts() -> None:
    """Thermometers that fit beside a voltage that is off by 50 mV: kelvin alone said nothing of it."""
    machine, record = plain(), logged(plain(), 1)
    (volts,) = (k for k, name in enumerate(record.output_names) if name not in machine.thermometers)
    beside = record.outputs.copy()
    beside[:, volts] += 0.05 * np.sin(np.arange(len(beside)))
    name, wrong = record.output_names[volts], record.with_outputs(beside)
    left = {}
    for key, data in (("right", record), ("off", wrong)):
        fit = rt.diagnosis.refit(machine, data)
        gap = {"train": Gap(fit.rms, fit.rms, expected_rms(fit))}
        left[key] = remainder(exact(fit), gap)
    assert left["right"].voltages == {} and "voltage" not in str(left["right"])
    assert list(left["off"].voltages) == [name] and 0.025 < left["off"].voltages[name] < 0.04  # 0.05 V / √2
    assert f"In the training records the voltage {name} is off by 0.03" in str(left["off"])
    assert name not in left["off"].sensors
    assert left["off"].to_dict()["voltages"] == left["off"].voltages and "voltages" not in left["right"].to_dict()


@pytest.mark.parametrize(("named", "thermometers", "said"), [
    ("T_cold", ["T_cold", "T_hot"], True), ("T_cold", ["T_cold"], False), ("V1", ["T_cold", "T_hot"], False)])
def test_an_offset_does_not_say_which_thermometer_is_off(named: str, thermometers: list[str], said: bool) -> None:
    """A measured cell: 0.503 K left with one of its thermocouples off, 0.517 K with the other one."""
    rig = system()
    sensors = {name: {"lump": "hot" if name == "T_hot" else "cold", "noise": 0.02} for name in thermometers}
    rig = rt.System(**{**dict(rig), "sensors": {**sensors, "V1": {"module": "m1", "noise": 0.002}}})
    found = which_is_off(rig, [("sensor_offset", (named,)), ("sensor_lag", ("T_cold",))])
    assert bool(found) == said
    assert not said or found == ["Whether T_cold is off, or the other thermometers the other way, a model that leaves "
                                 "so much cannot say: compare them at rest, with nothing driven."]


def test_a_diagnosis_beside_a_remainder_says_so() -> None:
    """One of two thermometers 2 K off, and a resistance whose slope the file lacks: the other one comes first."""
    hot = {"T_hot": {"lump": "hot", "noise": 0.02}}
    rig = rt.System(**{**dict(plain()), "sensors": {**dict(dict(plain())["sensors"]), **hot}})
    truth = rig.with_parameters({"sensors.T_hot.offset": 2.0, "modules.m1.resistance.slope": 0.02})
    rng, records = np.random.default_rng(4), []
    for currents in (CURRENTS, CURRENTS[::-1]):
        run = rt.thermal.simulate(truth, drive(currents, H), initial=295.15)
        records.append(run.with_outputs(run.outputs + rng.standard_normal(run.outputs.shape) * 0.002))
    found = rt.diagnose(rig, records[0], validation=records[1], effects=["sensor_offset"])
    assert [one.label for one in found.effects] == ["sensor_offset(T_cold)"] and found.remainder is not None
    assert found.verdict == "ambiguous" and found.alternatives == ((("sensor_offset", ("T_hot",)),),)
    assert any(text.startswith("Whether T_cold is off, or the other thermometers") for text in found.caveats)
