"""What happens within a sample: currents that switch, given by their mean and ripple, and lags far shorter than it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import thermocycler
from scipy.integrate import solve_ivp

import robthermal as rt

SYSTEM = thermocycler.SYSTEM.with_parameters(thermocycler.TRUE)
START = {"block": 300.0, "tube": 300.0, "sink": 300.0, "lid": 350.0}


@pytest.fixture(scope="module")
def switched() -> tuple[rt.Record, np.ndarray]:
    """A record whose current switches somewhere within every third sample, and the block between, from scipy."""
    rng = np.random.default_rng(1)
    n = 90
    first, second = rng.uniform(-7.0, 7.0, (2, n))
    second[np.arange(n) % 3 > 0] = first[np.arange(n) % 3 > 0]
    part = rng.uniform(0.2, 0.8, n)
    state, block = np.array([*START.values(), 300.0, 0.0]), []
    for k in range(n):
        block.append(state[0])
        for current, length in ((first[k], part[k]), (second[k], 1.0 - part[k])):
            state = solve_ivp(thermocycler.rate, (0.0, length), state, args=(current, 20.0, 0.0, 0.0), method="LSODA",
                              rtol=1e-9, atol=1e-9).y[:, -1]
    mean = part * first + (1.0 - part) * second
    ripple = np.sqrt(part * (1.0 - part)) * np.abs(first - second)
    record = rt.Record(sample_time=1.0, inputs=np.column_stack([mean, np.full(n, 20.0)]), outputs=np.zeros((n, 0)),
                       input_names=["m1", "heater"], output_names=[], ripple={"m1": ripple})
    return record, np.array(block)


def test_mean_and_ripple_say_what_a_switched_current_does(switched: tuple[rt.Record, np.ndarray]) -> None:
    record, block = switched
    run = rt.thermal.trajectory(SYSTEM, record, initial=START)
    without = rt.thermal.trajectory(SYSTEM, record.changed(ripple=None), initial=START)
    assert np.abs(run["block"] - block).max() < 0.05
    assert np.abs(without["block"] - block).max() > 1.0
    assert np.abs(run.energy_residual).max() < 1e-6


def test_a_part_of_a_record_keeps_its_ripple(switched: tuple[rt.Record, np.ndarray]) -> None:
    record, _ = switched
    np.testing.assert_array_equal(record[10:30].ripple["m1"], record.ripple["m1"][10:30])
    assert record.select(inputs=["heater"]).ripple == {} and set(record.select(inputs=["m1"]).ripple) == {"m1"}
    assert record.changed(inputs=2.0 * record.inputs).ripple == {}
    assert set(rt.thermal.simulate(SYSTEM, record).ripple) == {"m1"}
    with pytest.raises(rt.InputError, match="ripple of 'm1'"):
        record.changed(ripple={"m1": -record.ripple["m1"]})
    with pytest.raises(rt.InputError, match="from input to its ripple"):
        record.changed(ripple={"m2": record.ripple["m1"]})


@pytest.mark.parametrize("name", ["modules.m1.resistance.value", "modules.m1.resistance.slope",
                                  "modules.m1.seebeck.value", "modules.m1.conductance.value",
                                  "modules.m1.joule_split", "lumps.block.capacity"])
@pytest.mark.parametrize("changes", [{}, {"modules.m1.drive.delay": 0.4}, {"modules.m1.drive.time_constant": 0.3}])
def test_derivatives_know_the_ripple(switched: tuple[rt.Record, np.ndarray], name: str, changes: dict[str, float]
                                      ) -> None:
    _derivative_is_difference(SYSTEM.with_parameters(changes), switched[0], name)


def test_derivative_by_a_lag_knows_the_ripple(switched: tuple[rt.Record, np.ndarray]) -> None:
    lagged = SYSTEM.with_parameters({"modules.m1.drive.time_constant": 0.3})
    _derivative_is_difference(lagged, switched[0], "modules.m1.drive.time_constant")


def _derivative_is_difference(system: rt.System, record: rt.Record, name: str) -> None:
    value = system.parameter(name)
    step = 1e-4 * value or 1e-4
    options: dict[str, Any] = {"initial": START, "tolerance": 1e-8}
    run = rt.thermal.trajectory(system, record, sensitivities=[name], **options)
    up, down = (rt.thermal.trajectory(system.with_parameters({name: value + sign * step}), record, **options).readings
                for sign in (1, -1))
    difference = (up - down) / (2.0 * step)
    np.testing.assert_allclose(run.sensitivity[..., 0], difference, atol=2e-5 * np.abs(difference).max())


def test_a_lag_far_shorter_than_a_sample_costs_a_few_steps(switched: tuple[rt.Record, np.ndarray]) -> None:
    """Samples had been halved evenly: 500 steps for every sample in which a lag of a thousandth of it dies away."""
    record = switched[0].changed(ripple=None)
    exact = rt.thermal.trajectory(SYSTEM, record, initial=START)["block"]
    for lag in (0.1, 0.01, 0.001):
        short = SYSTEM.with_parameters({"modules.m1.drive.time_constant": lag})
        run = rt.thermal.trajectory(short, record, initial=START)
        steps: Any = run.derivative
        assert len(steps.path.segment) < 14 * len(record)
        fine = rt.thermal.trajectory(short, record, initial=START, tolerance=1e-9)
        assert np.abs(run.lumps - fine.lumps).max() < 1e-4
        assert np.abs(run["block"] - exact).max() < 60.0 * lag
