"""Closed loops on the nonlinear plant: the set-point case of the errata, linearity of step responses, runaway."""

import numpy as np
import pytest

import robthermal as rt


def test_stepping_is_the_trajectory(system):
    rng = np.random.default_rng(3)
    U = np.column_stack([rng.uniform(-0.5, 1.5, (60, 2)), 298 + rng.normal(0, 0.1, 60)])
    record = rt.Record(sample_time=1.0, inputs=U, outputs=np.zeros((60, 0)), input_names=["m1", "m2", "room"],
                       output_names=[])
    run = rt.thermal.trajectory(system, record, tolerance=1e-7)
    plant = rt.thermal.Stepper(system, 1.0, initial=run.lumps[0], tolerance=1e-7)
    for k in range(59):
        np.testing.assert_allclose(plant.lumps, run.lumps[k], atol=1e-6)
        np.testing.assert_allclose(plant.readings, run.readings[k], atol=1e-6)
        plant.step(dict(zip(record.input_names, U[k].tolist(), strict=True)))
    assert plant.time == 59.0


def test_a_load_enters_its_lump():
    bar = rt.System(ambients={"room": {"temperature": 300.0}}, lumps={"bar": {"capacity": 100.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5}])
    plant = rt.thermal.Stepper(bar, 7.0, loads=["bar"])
    assert plant.step(load={"bar": 2.0})[0] == pytest.approx(300 + 4 * (1 - np.exp(-0.035)), rel=1e-10)
    with pytest.raises(rt.InputError, match="'bolt' was not named in loads"):
        plant.step(load={"bolt": 1.0})
    with pytest.raises(rt.InputError, match="no lump 'bolt'"):
        rt.thermal.Stepper(bar, 7.0, loads=["bolt"])
    with pytest.raises(rt.InputError, match="Celsius"):
        rt.thermal.Stepper(bar, 7.0, initial=[25.0])


@pytest.mark.exhaustive
def test_the_set_point_case_of_the_errata(system, pi):
    """10 °C with 5 W per module, infeasible by 1.6 K: limited to 1.55 A it settles at 11.7 °C, with 3.294 A it touches
    9.9 °C and then runs away to 54 °C cold, 142 °C hot."""
    def run(limit):
        law = rt.design.feedback_linearization(system, current_limits=(-limit, limit))
        loop = rt.design.simulate_loop(system, pi, 283.15, law=law, duration=6000.0, load={"x11": 5.0, "x12": 5.0})
        return loop, loop.cold - 273.15, loop.lumps[-1, 8:10] - 273.15

    safe, cold, hot = run(1.55)
    assert cold[-1].max() == pytest.approx(11.7, abs=0.1) and hot.max() == pytest.approx(54, abs=1)
    assert np.ptp(cold[-1000:], axis=0).max() < 0.02
    assert safe.outcome.code == "limited" and not safe.outcome and "reachable" in safe.outcome.text
    away, cold, hot = run(3.294)
    assert cold.min() == pytest.approx(9.87, abs=0.02)
    assert cold[-1].max() == pytest.approx(53.6, abs=0.5) and hot.max() == pytest.approx(142, abs=1)
    assert away.limit[-1].tolist() == ["optimum", "optimum"]


def test_runaway_in_heating_ends_the_run(system, pi):
    free = system.model_copy(update={"modules": {name: m.model_copy(update={"current_limits": None})
                                                 for name, m in system.modules.items()}})
    law = rt.design.feedback_linearization(free)
    loop = rt.design.simulate_loop(system, pi, 4000.0, law=law, duration=4000.0)
    assert loop.outcome.code == "ran_away" and not loop.outcome
    assert 3 < len(loop.time) < 4000 and loop.cold.shape == loop.current.shape


def test_normalized_steps_collapse(system, pi, law):
    found = rt.design.step_response_linearity(system, pi, law=law, base=308.15,
                                              steps=(-30.0, -10.0, 10.0, 30.0), duration=250.0)
    assert found.outcome.code == "collapsed"
    assert found.after < 0.005 < 0.1 < found.before
    assert found.ratio > 30
    assert len(found.plot()) == 2
    with pytest.raises(rt.InputError, match="none zero"):
        rt.design.step_response_linearity(system, pi, law=law, base=308.15, steps=(0.0, 1.0))
    with pytest.raises(rt.InputError, match="cannot be held"):
        rt.design.step_response_linearity(system, pi, law=law, base=230.0)


def test_a_limit_in_a_step_is_said(system, pi):
    tight = rt.design.feedback_linearization(system, current_limits=(-0.3, 0.3))
    found = rt.design.step_response_linearity(system, pi, law=tight, base=298.15, steps=(-20.0, 2.0), duration=60.0)
    assert found.outcome.code == "limited" and "-20 K" in found.outcome.text


def test_voltage_drive_settles_like_current_drive(system, pi, law):
    runs = [rt.design.simulate_loop(system, pi, 288.15, law=law, duration=500.0, drive=drive)
            for drive in ("current", "voltage")]
    assert all(run.outcome.code == "settled" for run in runs)
    assert np.abs(runs[0].cold - runs[1].cold).max() < 0.3
    assert np.abs(runs[0].cold[1:30] - runs[1].cold[1:30]).max() > 1e-4  # it is another plant


def test_two_sensors_and_an_observer_close_the_loop(system, law, pi):
    obs = rt.design.observer(system, ["T6", "T16"], sample_time=1.0)
    run = rt.design.simulate_loop(system, pi, 288.15, law=law, duration=900.0, observer=obs, noise_seed=0)
    assert np.abs(run.cold[-100:] - 288.15).max() < 0.3
    assert np.abs(run.estimate[-100:] - run.lumps[-100:]).max() < 0.3
    with pytest.raises(rt.InputError, match="observer's sample time is 2 s"):
        other = rt.design.observer(system, ["T6", "T16"], sample_time=2.0)
        rt.design.simulate_loop(system, pi, 288.15, law=law, duration=9.0, observer=other)


def test_a_wrong_model_still_settles_by_integral_action(system, law, pi):
    truth = system.with_parameters({"modules.m1.seebeck.value": 0.05, "modules.m2.conductance.value": 0.33})
    run = rt.design.simulate_loop(truth, pi, 288.15, law=law, duration=900.0)
    assert run.outcome.code == "settled" and "Settled" in str(run)
    assert len(run.plot()) == 2


@pytest.mark.parametrize(("arguments", "message"), [
    ({"reference": 15.0}, "set-point is 15 K.*273.15"),
    ({"drive": "power"}, "current.*voltage"),
    ({"inputs": {"m1": 1.0}}, "'m1' is driven by the feedback law"),
    ({"load": {"x11": np.ones(3)}}, "shape \\(3,\\).*one per sample"),
    ({"law": 3}, "law is a int"),
    ({"duration": -1.0}, "duration"),
])
def test_bad_arguments_are_refused(system, pi, law, arguments, message):
    given = {"reference": 290.0, "law": law, "duration": 10.0, **arguments}
    with pytest.raises(rt.InputError, match=message):
        rt.design.simulate_loop(system, pi, given.pop("reference"), **given)


def test_former_names_of_this_version() -> None:
    design = rt.design
    assert design.collapse is design.step_response_linearity and design.Collapse is design.StepResponseLinearity
    assert design.Seen is design.ControllerInput
