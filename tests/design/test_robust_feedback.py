"""State feedback for several plants: the LQR for one, stable for all, honest when there is none; one loop for all."""

from dataclasses import replace

import control
import numpy as np
import pytest

import robthermal as rt

BOX = {"current": (0.0, 1.0), "temperature": (283.15, 323.15)}


@pytest.fixture(scope="module")
def plain(law):
    return rt.design.constant_gain(law, [298.15] * 18)


@pytest.fixture(scope="module")
def corners(plain):
    return rt.design.corner_plants(plain, **BOX)


def closed(loop, ss, h):
    """Closed-loop matrix with one plant, built here: x, integrators of the error."""
    d = control.sample_system(control.ss(ss.A, ss.B[:, :2], ss.C, np.zeros((2, 2))), h, method="zoh")
    A, B = np.asarray(d.A), np.asarray(d.B)
    feedback = np.hstack([-loop.K, np.eye(2)])
    return np.vstack([np.hstack([A, np.zeros((len(A), 2))]) + B @ feedback,
                      np.hstack([-h * loop.integral @ loop.plant.C, np.eye(2)])])


def test_for_one_plant_it_is_the_lqr(plant):
    """Another method, the Riccati equation, gives the same gains."""
    own = rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0)
    same = rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0, method="lmi", plants=[plant])
    np.testing.assert_allclose(same.K, own.K, atol=1e-3 * np.abs(own.K).max())
    np.testing.assert_allclose(same.integral, own.integral, atol=1e-3 * np.abs(own.integral).max())
    assert same.outcome and "not proven" in same.outcome.text


def test_corner_plants_are_the_derivatives_of_what_the_constant_gain_does(plain, plant, system):
    """Against differences of the true heat into the cold lump, current from the constant gain."""
    hot, cold, amps = 318.15, 283.15, 1.0
    found = rt.design.corner_plants(plain, current=(amps, amps), temperature=(hot, hot))
    other = rt.design.corner_plants(plain, current=(amps, amps), temperature=(cold, hot))
    assert len(found) == 64 and len(other) == 64

    def heat(x_h, x_c, v):
        current = plain.current - plain.gain * (v - plain.heat)
        x = np.full(18, 298.15)
        x[[8, 9]], x[[10, 11]] = x_h, x_c
        return plain.law.heat(current, x)

    v = plain.heat - (amps - plain.current) / plain.gain
    step, E = 1e-3, system.lumps["x11"].capacity
    at = [p for p in other if np.allclose((p.A - plant.A)[0, 0], (heat(hot, cold + step, v) - heat(hot, cold - step, v)
                                                                 )[0] / (2 * step) / E, rtol=1e-6)]
    assert at  # the corner hot, cold is among them
    gain = (heat(hot, cold, v + step) - heat(hot, cold, v - step))[0] / (2 * step) / E
    touch = (heat(hot + step, cold, v) - heat(hot - step, cold, v))[0] / (2 * step) / E
    assert any(np.isclose(p.B[0, 0], gain, rtol=1e-6) and np.isclose(p.B[0, 2], touch, rtol=1e-5) for p in at)


@pytest.mark.exhaustive
def test_it_stabilizes_every_corner_and_switching_between_them(plant, corners):
    loop = rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0, method="lmi", plants=corners)
    assert loop.outcome
    matrices = [closed(loop, ss, 1.0) for ss in corners]
    assert max(np.abs(np.linalg.eigvals(M)).max() for M in matrices) < 1
    rng, left = np.random.default_rng(0), np.eye(10)
    for _ in range(4000):  # any order of the plants
        left = matrices[int(rng.integers(len(matrices)))] @ left
    assert np.abs(left).max() < 1e-6


def test_plants_that_no_gain_stabilizes_are_refused(plant):
    """Heat that acts one way in one plant and the other way in the next."""
    turned = replace(plant, B=np.hstack([-plant.B[:, :2], plant.B[:, 2:]]))
    loop = rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0, method="lmi", plants=[turned])
    assert not loop.outcome and loop.outcome.code == "not_found" and "Narrow the range" in loop.outcome.text
    own = rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0)
    np.testing.assert_array_equal(loop.K, own.K)


@pytest.mark.exhaustive
def test_on_the_nonlinear_plant_it_does_as_well_as_the_lqr(plant, plain, corners, system):
    """Without the law, on the constant gain that the plants were made for: it settles, and overshoots no more."""
    runs = [rt.design.simulate_loop(system, loop, 289.15, law=plain, duration=600.0) for loop in (
        rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0),
        rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0, method="lmi", plants=corners))]
    assert all(run.outcome.code == "settled" for run in runs)
    costs = [np.square(run.cold - 289.15).sum() for run in runs]
    assert costs[1] < 1.2 * costs[0]
    assert runs[1].cold.min() > 289.15 - 0.5


@pytest.mark.parametrize(("arguments", "message"), [
    ({"method": "lmi"}, "'lmi' with 0 plants.*corner_plants"),
    ({"method": "h2"}, "method = 'h2'"),
    ({"method": "lmi", "plants": [3]}, "a int among the plants"),
    ({"method": "lmi", "plants": [control.ss(-1.0, 1.0, 1.0, 0.0)]}, "1 states and 1 inputs.*8 states, x11"),
    ({"method": "lmi", "plants": [control.ss(np.eye(8) / 2, np.eye(8), np.eye(8), 0, 3.0)]}, "sampled every 3 s"),
])
def test_bad_plants_are_refused(plant, arguments, message):
    with pytest.raises(rt.InputError, match=message):
        rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0, **arguments)


def test_bad_corners_are_refused(plain):
    with pytest.raises(rt.InputError, match="temperature = .*kelvin"):
        rt.design.corner_plants(plain, current=(0.0, 1.0), temperature=(5.0, 40.0))
    with pytest.raises(rt.InputError, match="current = 3"):
        rt.design.corner_plants(plain, current=3, temperature=(280.0, 300.0))


def test_a_constant_gain_beyond_the_optimum_stays_at_it(system):
    """More heat asked for than a module can take: the current must not come back on the other branch."""
    free = system.model_copy(update={"modules": {name: m.model_copy(update={"current_limits": None})
                                                 for name, m in system.modules.items()}})
    law = rt.design.feedback_linearization(free)
    at = [298.15] * 18
    asked = np.linspace(0.0, -80.0, 60)
    command = rt.design.constant_gain(law, at).command(np.column_stack([asked, asked]), at)
    optimum = law.bounds(at).current[0]
    assert (np.diff(command.current[:, 0]) >= 0).all()
    assert command.current[-1, 0] == pytest.approx(optimum, rel=1e-6)  # the root of a rounding error
    assert command.limit[-1].tolist() == ["optimum", "optimum"]


def test_a_controller_of_other_modules_is_refused(system, law):
    one = rt.design.cold_side(rt.design.feedback_linearization(system, ["m2"]))
    for loop in (rt.design.pid(one, bandwidth=0.05, sample_time=1.0),
                 rt.design.state_feedback(one, bandwidth=0.05, sample_time=1.0)):
        with pytest.raises(rt.InputError, match="of 1 modules for a feedback law of 2"):
            rt.design.simulate_loop(system, loop, 290.0, law=law, duration=10.0)


def test_gains_that_are_no_numbers_are_refused(plant):
    with pytest.raises(rt.InputError, match="proportional = 'much'"):
        rt.design.pid(plant, proportional="much", sample_time=1.0)
    with pytest.raises(rt.InputError, match=r"proportional has shape \(3,\).*2, one per module"):
        rt.design.pid(plant, proportional=[1.0, 1.0, 1.0], sample_time=1.0)
    with pytest.raises(rt.InputError, match="gain = 'x'"):
        rt.design.state_feedback(plant, gain="x", sample_time=1.0)


def test_a_slower_sample_time_is_named_for_every_controller(plant):
    one = control.ss(3.0 + 0.05 / control.tf("s"))
    with pytest.raises(rt.InputError, match="sampled every 30 s is unstable.*at most about") as refused:
        rt.design.linear_controller(plant, control.append(one, one), sample_time=30.0)
    slowest = float(str(refused.value).split("at most about ")[1].split(" s")[0])
    assert rt.design.linear_controller(plant, control.append(one, one), sample_time=0.95 * slowest)
    own = rt.design.state_feedback(plant, bandwidth=0.2, sample_time=1.0)
    with pytest.raises(rt.InputError, match="argument sample_time.*at most about"):
        rt.design.state_feedback(plant, gain=own.K, integral=own.integral, sample_time=60.0)


@pytest.mark.parametrize("part", ["seebeck", "resistance", "conductance"])
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_modules_without_positive_properties_are_refused(system, part, value):
    with pytest.raises(rt.InputError, match=f"{part}.value = .*greater than 0"):
        system.with_parameters({f"modules.m1.{part}.value": value})


def test_an_unreachable_set_point_above_is_answered_with_the_range(system):
    law = rt.design.feedback_linearization(system, current_limits=(-0.3, 0.3))
    answer = rt.design.reachable(law, 330.0)
    assert not answer.outcome and answer.binding == "current"
    with pytest.raises(rt.InputError, match=r"m1 298\.15 to 31\d\.\d+ K.*Choose set-points within it"):
        answer.require()
