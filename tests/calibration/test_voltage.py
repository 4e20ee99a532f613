"""Calibration on voltages: S, R and K of a foreign rig, with honest standard deviations."""

import numpy as np
import pytest
from scipy.stats import binomtest
from voltage_rig import TRUE, drive, log, system

import robthermal as rt
from robthermal.fitting import OperatingPoint, sampled_response

H = 4.0
STEPS = np.repeat([0.0, 1.0, -0.6, 1.8, 0.4, 0.0, 2.2, -1.0, 1.4, 0.7], 12)  # currents of Algorithm 1: steps and pauses
NAMES = {"modules.m1.seebeck.value": ("S", 0.03, 0.08), "modules.m1.resistance.value": ("R", 1.0, 4.0),
         "modules.m1.conductance.value": ("K", 0.1, 1.5), "modules.m1.seebeck.slope": ("dS", 0.0, 5e-4),
         "modules.m1.resistance.slope": ("dR", 0.0, 0.05)}
RANGES = {name: (low, high) for name, (_, low, high) in NAMES.items()}
START = {"modules.m1.seebeck.value": 0.06, "modules.m1.resistance.value": 2.8, "modules.m1.conductance.value": 0.7,
         "modules.m1.seebeck.slope": 2e-4, "modules.m1.resistance.slope": 0.02}


@pytest.fixture(scope="module")
def clean() -> np.ndarray:
    return log(STEPS, H)[0]


def measured(clean: np.ndarray, seed: int, sensors: tuple[str, ...] = ("T_cold", "V1")) -> rt.Record:
    noise = np.random.default_rng(seed).standard_normal(clean.shape) * [0.02, 0.002]
    return drive(STEPS, H).with_outputs(clean + noise, ["T_cold", "V1"]).select(outputs=sensors)


def test_the_rig_of_algorithm_1_gives_its_module(clean: np.ndarray) -> None:
    fit = rt.calibrate(system().with_parameters(START), measured(clean, 1), parameters=RANGES)
    assert fit.outcome.code == "converged"
    for name, (true, _, _) in NAMES.items():
        assert abs(fit.parameters[name] - TRUE[true]) < 4 * fit.std[name], name
    assert fit.std["modules.m1.seebeck.value"] < 1e-3 * TRUE["S"] * 3
    assert fit.std["modules.m1.resistance.value"] < 1e-3 * TRUE["R"]
    assert fit.rmse["V1"] == pytest.approx(0.002, rel=0.25) and fit.rmse["T_cold"] == pytest.approx(0.02, rel=0.25)
    assert "V1 0.00" in str(fit) and " V\n" in str(fit).replace(" V,", " V\n")


@pytest.mark.exhaustive
def test_ranges_cover_the_truth(clean: np.ndarray) -> None:
    """60 logs: a 95 % interval of every parameter covers as a 95 % interval does (two-sided test, 1 in 1000)."""
    inside = dict.fromkeys(NAMES, 0)
    for seed in range(60):
        fit = rt.calibrate(system(), measured(clean, seed), parameters=RANGES)
        for name, (true, _, _) in NAMES.items():
            inside[name] += abs(fit.parameters[name] - TRUE[true]) < 1.96 * fit.std[name]
    assert {name: binomtest(count, 60, 0.95).pvalue > 1e-3 for name, count in inside.items()} == dict.fromkeys(
        NAMES, True)


def test_voltage_alone_identifies_s_and_r(clean: np.ndarray) -> None:
    """Without it, a thermometer alone leaves S and R far less certain."""
    start = system().with_parameters(START)
    two = {name: RANGES[name] for name in ("modules.m1.seebeck.value", "modules.m1.resistance.value")}
    kept = start.with_parameters({name: TRUE[NAMES[name][0]] for name in NAMES if name not in two})
    alone = rt.calibrate(kept, measured(clean, 2, ("V1",)), parameters=two)
    thermometer = rt.calibrate(kept, measured(clean, 2, ("T_cold",)), parameters=two)
    for name in two:
        assert abs(alone.parameters[name] - TRUE[NAMES[name][0]]) < 4 * alone.std[name]
    assert alone.std["modules.m1.resistance.value"] < 0.2 * thermometer.std["modules.m1.resistance.value"]


def test_noise_nobody_declared_is_found_in_volts(clean: np.ndarray) -> None:
    silent = system().with_parameters({"sensors.V1.noise": 0.0})
    fit = rt.calibrate(silent.with_parameters(START), measured(clean, 3), parameters=RANGES)
    assert fit.noise["V1"] == pytest.approx(0.002, rel=0.2)
    fine = drive(STEPS, H).with_outputs(clean, ["T_cold", "V1"])  # no noise at all: the floor is microvolts, not 1e-4
    assert rt.calibrate(silent, fine, parameters=RANGES).noise["V1"] < 2e-5


def test_kelvin_checks_leave_volts_alone(clean: np.ndarray) -> None:
    record = measured(clean, 4)
    assert record["V1"].min() < 0 < record["V1"].max()
    with pytest.raises(rt.InputError, match="sensor 'T_cold' reads .* K.*kelvin inside a Record"):
        rt.calibrate(system(), record.with_outputs(record.outputs - [273.15, 0.0]), parameters=RANGES)


def test_frequency_responses_hold_voltages() -> None:
    """The analytic linearization, sampled and with a late current, against a simulated sine."""
    made = system().with_parameters({"modules.m1.drive.delay": 6.0})
    period, n = 24, 40 * 24
    sine = 0.8 + 1e-3 * np.sin(2 * np.pi * np.arange(n) / period)
    rest = rt.thermal.steady_state(made, {"m1": 0.8}).equilibria[0].temperatures
    run = rt.thermal.simulate(made, drive(sine, H), initial=rest, tolerance=1e-9)
    tail = slice(n - 10 * period, n)
    line = np.exp(-2j * np.pi * np.arange(n) / period)[tail]
    response = np.array([np.mean(run[name][tail] * line) for name in ("T_cold", "V1")]) / np.mean(sine[tail] * line)
    found = sampled_response(made, np.array([1 / (period * H)]), H, OperatingPoint({"m1": 0.8}), ("T_cold", "V1"),
                             ("m1",))[0, :, 0]
    assert np.abs(found - response) / np.abs(response) == pytest.approx([0.0, 0.0], abs=2e-4)
