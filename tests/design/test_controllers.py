"""Outer loops: sampled exactly, stable as computed elsewhere, no windup, surroundings and loads taken care of."""

import control
import numpy as np
import pytest

import robthermal as rt


def test_the_cold_side_is_the_thesis_network(plant, system):
    """(5.19): eight lumps with the published time constants, static impedance 17.3, 8.36 K/W."""
    assert plant.lumps == tuple(f"x{i}" for i in range(11, 19)) and plant.around == ("room",)
    tau = np.sort(-1 / np.linalg.eigvals(plant.A).real)
    np.testing.assert_allclose(tau, [0.372, 0.372, 17.0, 18.3, 63.6, 83.3, 199.7, 660.7], rtol=0.01)
    Z = -plant.C @ np.linalg.solve(plant.A, plant.B)
    np.testing.assert_allclose(Z[:, :2], [[17.3, 8.36], [8.36, 17.6]], rtol=0.01)
    np.testing.assert_allclose(Z[:, 2], 1.0, rtol=1e-9)  # a warmer room warms it as much


def test_hot_faces_that_touch_the_cold_side_act_like_ambients(system):
    screw = rt.thermal.Link(between=("x9", "x15"), conductance=0.01)
    screwed = system.model_copy(update={"links": (*system.links, screw)})
    found = rt.design.cold_side(rt.design.feedback_linearization(screwed))
    assert found.around == ("x9", "room") and len(found.lumps) == 8


def test_a_cascade_is_refused(system):
    top = system.modules["m1"].model_copy(update={"hot": "x11", "cold": "x13"})
    cascade = system.model_copy(update={"modules": {**system.modules, "top": top}})
    with pytest.raises(rt.InputError, match="'x11' of module 'm1'.*modules="):
        rt.design.cold_side(rt.design.feedback_linearization(cascade))


def test_poles_agree_with_python_control(plant):
    kp, ki, h = 0.6, 0.02, 1.0
    ours = rt.design.loop_poles(plant, rt.design.pid(plant, proportional=kp, integral=ki, sample_time=h))
    ss = plant.to_control()
    G = control.sample_system(control.ss(ss.A, ss.B[:, :2], ss.C, np.zeros((2, 2))), h, method="zoh")
    one = control.ss([[1.0]], [[h]], [[ki]], [[kp]], h)
    theirs = control.feedback(G * control.append(one, one), control.ss([], [], [], np.eye(2), h)).poles()
    filters = np.exp(-h / (2 * h)) * np.ones(2)  # of the derivative, which is off
    np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(np.concatenate([theirs, filters])), atol=1e-8)


def test_a_python_control_controller_does_what_the_pi_does(plant, law, system):
    kp, ki = 0.6, 0.01
    own = rt.design.pid(plant, proportional=kp, integral=ki, sample_time=1.0)
    s = control.tf("s")
    one = control.ss(kp + ki / s)
    given = rt.design.linear_controller(plant, control.append(one, one), sample_time=1.0)
    runs = [rt.design.simulate_loop(system, c, 292.15, law=law, duration=120.0) for c in (own, given)]
    np.testing.assert_allclose(runs[0].cold, runs[1].cold, atol=1e-8)


def test_too_slow_a_sample_time_is_refused_with_one_that_works(plant):
    with pytest.raises(rt.InputError, match="sampled every 30 s is unstable.*at most about") as refused:
        rt.design.pid(plant, proportional=3.0, integral=0.05, sample_time=30.0)
    slowest = float(str(refused.value).split("at most about ")[1].split(" s")[0])
    assert rt.design.pid(plant, proportional=3.0, integral=0.05, sample_time=0.95 * slowest)
    with pytest.raises(rt.InputError, match="too slow for a bandwidth of 0.05.*at most 20 s"):
        rt.design.state_feedback(plant, bandwidth=0.05, sample_time=40.0)


def test_wrong_sign_and_wrong_sizes_are_refused(plant):
    with pytest.raises(rt.InputError, match="proportional"):
        rt.design.pid(plant, proportional=-1.0, sample_time=1.0)
    one = control.ss(-2.0 / control.tf("s"))
    with pytest.raises(rt.InputError, match="check its sign"):
        rt.design.linear_controller(plant, control.append(one, one), sample_time=1.0)
    with pytest.raises(rt.InputError, match="errors of m1, m2"):
        rt.design.linear_controller(plant, one, sample_time=1.0)
    with pytest.raises(rt.InputError, match="sample time is 2 s"):
        rt.design.linear_controller(plant, control.ss([], [], [], np.eye(2), 2.0), sample_time=1.0)
    with pytest.raises(rt.InputError, match=r"\(2, 8\).*x11"):
        rt.design.state_feedback(plant, gain=np.eye(2), sample_time=1.0)
    with pytest.raises(rt.InputError, match="either bandwidth or proportional"):
        rt.design.pid(plant, sample_time=1.0)


@pytest.mark.parametrize("bandwidth", [0.03, 0.1])
def test_state_feedback_settles_without_overshoot(plant, law, system, bandwidth):
    loop = rt.design.state_feedback(plant, bandwidth=bandwidth, sample_time=1.0)
    run = rt.design.simulate_loop(system, loop, [288.15, 303.15], law=law, duration=20 / bandwidth)
    way = (run.cold - 298.15) / np.array([-10.0, 5.0])
    assert run.outcome.code == "settled" and way.max() < 1.05
    assert (way[int(1 / bandwidth)] > 0.4).all() and (way[int(4 / bandwidth)] > 0.9).all()


def test_lqr_gains_satisfy_the_bellman_equation(plant):
    """The cost-to-go of the loop it makes is not improved by any small change of its gains."""
    from scipy.linalg import block_diag, solve_discrete_lyapunov

    w, h = 0.05, 1.0
    loop = rt.design.state_feedback(plant, bandwidth=w, sample_time=h)
    A, B = plant.sampled(h)
    whole = np.block([[A, np.zeros((8, 2))], [-h * plant.C, np.eye(2)]])
    drive = np.vstack([B[:, :2], np.zeros((2, 2))])
    G = plant.C @ np.linalg.solve(1j * w * np.eye(8) - plant.A, plant.B[:, :2])
    Q, R = block_diag(plant.C.T @ plant.C, w**2 * np.eye(2)), np.diag(np.abs(np.diag(G)) ** 2)

    def cost(F):
        closed = whole - drive @ F
        return np.trace(solve_discrete_lyapunov(closed.T, Q + F.T @ R @ F))

    best = np.hstack([loop.K, -loop.integral])
    rng = np.random.default_rng(0)
    for _ in range(20):
        assert cost(best + 1e-3 * rng.normal(size=best.shape)) > cost(best)


def test_state_feedback_with_given_gains(plant):
    """The LQR gains passed by hand give the same poles."""
    own = rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0)
    given = rt.design.state_feedback(plant, gain=own.K, integral=own.integral, sample_time=1.0)
    ours, theirs = (np.sort_complex(rt.design.loop_poles(plant, c)) for c in (own, given))
    np.testing.assert_allclose(ours, theirs, atol=1e-9)


@pytest.mark.exhaustive
def test_feed_forward_holds_the_set_point_without_integral_action(plant, law, system):
    p = rt.design.pid(plant, proportional=0.5, sample_time=1.0)
    n = 3000
    room = np.where(np.arange(n) < 1500, 298.15, 306.15)
    setting = {"law": law, "duration": float(n), "inputs": {"room": room}}
    alone = rt.design.simulate_loop(system, p, 288.15, **setting)
    helped = rt.design.simulate_loop(system, rt.design.feed_forward(plant, p), 288.15, **setting)
    assert np.abs(helped.cold[-1] - 288.15).max() < 1e-3
    assert np.abs(alone.cold[-1] - 288.15).min() > 0.5


@pytest.mark.exhaustive
def test_the_disturbance_observer_finds_and_cancels_a_load(plant, law, system):
    p = rt.design.pid(plant, proportional=0.5, sample_time=1.0)
    fed = rt.design.feed_forward(plant, p)
    loop = rt.design.disturbance_observer(plant, fed, time_constant=30.0)
    n = 1600
    load = {"x11": np.where(np.arange(n) < 500, 0.0, 1.5)}
    with_it = rt.design.simulate_loop(system, loop, 293.15, law=law, duration=float(n), load=load)
    without = rt.design.simulate_loop(system, fed, 293.15, law=law, duration=float(n), load=load)
    assert np.abs(with_it.cold[-1] - 293.15).max() < 0.01
    assert np.abs(without.cold[-1] - 293.15).max() > 0.5
    change = with_it.wanted[-1] - with_it.wanted[499]  # what was added is the load, with its sign turned
    np.testing.assert_allclose(change, [-1.5, 0.0], atol=0.05)
    with pytest.raises(rt.InputError, match="Turn them round"):
        rt.design.feed_forward(plant, loop)
    with pytest.raises(rt.InputError, match="time_constant = 1 s"):
        rt.design.disturbance_observer(plant, p, time_constant=1.0)


@pytest.mark.exhaustive
@pytest.mark.parametrize("kind", ["pid", "state", "lti"])
def test_anti_windup_lets_go_of_a_limit(plant, system, kind):
    """Held at a current limit for 600 s, then asked for something easy: with the law's information it follows at once,
    without it the integrator has to unwind first."""
    law = rt.design.feedback_linearization(system, current_limits=(-0.4, 0.4))
    reference = np.where(np.arange(1000) < 600, 278.15, 296.15)
    reference = np.column_stack([reference, reference])

    def late(controller):
        run = rt.design.simulate_loop(system, controller, reference, law=law, duration=1000.0)
        assert (run.limit[300:600] == "current").all()
        return np.abs(run.cold[700:] - 296.15).max()

    if kind == "pid":
        with_it = rt.design.pid(plant, bandwidth=0.05, sample_time=1.0)
        wound = rt.design.pid(plant, bandwidth=0.05, sample_time=1.0, tracking_time=1e9)
    elif kind == "state":
        with_it = rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0)
        wound = rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0, tracking_time=1e9)
    else:
        one = control.ss(0.8 + 0.01 / control.tf("s"))
        with_it = rt.design.linear_controller(plant, control.append(one, one), sample_time=1.0)
        wound = rt.design.LinearController(with_it.A, with_it.B, with_it.C, with_it.D, 0 * with_it.L, 1.0)
    assert late(with_it) < 1.0 < 2.0 < late(wound)


def test_arguments_of_another_kind_are_refused(system, law, plant):
    for call in (lambda: rt.design.cold_side(3), lambda: rt.design.reachable(3, 280.0),
                 lambda: rt.design.pid(law, bandwidth=0.1, sample_time=1.0), lambda: rt.design.loop_poles(plant, 3),
                 lambda: rt.design.feed_forward(plant, law), lambda: rt.design.check_polarity(system, 3)):
        with pytest.raises(rt.InputError, match="Make one with rt"):
            call()
