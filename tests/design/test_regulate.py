"""Loops that regulate a sensor away from the module: against a machine in plain scipy, and what is refused."""

import control
import numpy as np
import pytest
from distant_plate import GAIN, JOINT, LAG, LEAK, OFFSET, PLATE, PLATE_LEAK, ROOM, STAGE, held, loop, machine

import robthermal as rt

REGULATE = {"m1": "T_plate"}


@pytest.fixture(scope="module")
def system():
    return machine()


@pytest.fixture(scope="module")
def law(system):
    return rt.design.feedback_linearization(system)


@pytest.fixture(scope="module")
def plant(law):
    return rt.design.cold_side(law, regulate=REGULATE)


def test_the_plant_is_the_network_to_the_reading(plant):
    """From the heat into the stage through the joint, the plate and the lag, by hand."""
    w = np.logspace(-4, 0, 7)
    s = 1j * w
    stage, plate = s * STAGE + LEAK + JOINT, s * PLATE + PLATE_LEAK + JOINT
    by_hand = GAIN * JOINT / (stage * plate - JOINT**2) / (1 + s * LAG)
    np.testing.assert_allclose(plant.response(w)[:, 0, 0], by_hand, rtol=1e-10)


@pytest.mark.parametrize("delay", [0.0, 0.4, 2.0, 3.7])
def test_a_delay_is_sampled_exactly(delay):
    """Delayed readings of the sampled plant are those of the fast-sampled plant without delay."""
    plain, late = (rt.design.cold_side(rt.design.feedback_linearization(machine(delay=d)), regulate=REGULATE)
                   for d in (0.0, delay))
    h, fine = 1.0, 0.1
    rng = np.random.default_rng(1)
    u = rng.standard_normal(40)
    A, B, C = plain.regulated(fine)
    x, fast = np.zeros(len(A)), []
    for value in np.repeat(u, 10):
        fast.append(float((C @ x)[0]))
        x = A @ x + B[:, 0] * value
    A, B, C = late.regulated(h)
    x, slow = np.zeros(len(A)), []
    for value in u:
        slow.append(float((C @ x)[0]))
        x = A @ x + B[:, 0] * value
    shift = round(delay / fine)
    expected = [fast[10 * k - shift] if 10 * k >= shift else 0.0 for k in range(40)]
    np.testing.assert_allclose(slow, expected, atol=1e-12)


def test_poles_agree_with_python_control(plant):
    h, kp, ki = 2.0, 0.4, 0.004
    ours = rt.design.loop_poles(plant, rt.design.pid(plant, proportional=kp, integral=ki, sample_time=h))
    A = np.array([[-(LEAK + JOINT) / STAGE, JOINT / STAGE, 0.0], [JOINT / PLATE, -(PLATE_LEAK + JOINT) / PLATE, 0.0],
                  [0.0, 1 / LAG, -1 / LAG]])
    G = control.sample_system(control.ss(A, [[1 / STAGE], [0], [0]], [[0, 0, GAIN]], 0), h, "zoh")
    theirs = control.feedback(G * control.ss([[1.0]], [[h]], [[ki]], [[kp]], h)).poles()
    ours = ours[np.abs(ours - np.exp(-0.5)) > 1e-9]  # the filter of a derivative that is off
    np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(theirs), atol=1e-9)


def test_the_loop_is_the_one_of_plain_scipy(system, law, plant):
    controller = rt.design.pid(plant, proportional=0.3, integral=0.003, sample_time=2.0)
    found = rt.design.simulate_loop(system, controller, 288.15, law=law, duration=400.0, regulate=REGULATE)
    readings, currents = loop(288.15, 0.3, 0.003, 2.0, 200)
    np.testing.assert_allclose(found.regulated[:, 0], readings, atol=2e-4)
    np.testing.assert_allclose(found.current[:, 0], currents, atol=2e-4)
    assert found.points == ("T_plate",) and np.abs(found.regulated - found.cold).max() > 1.0


def test_it_settles_at_the_reading_not_at_the_cold_face(system, law, plant):
    controller = rt.design.pid(plant, bandwidth=0.01, sample_time=2.0)
    found = rt.design.simulate_loop(system, controller, 285.15, law=law, duration=6000.0, regulate=REGULATE)
    x, current = held(285.15)
    assert found.outcome.code == "settled" and "regulated temperature" in str(found.outcome)
    assert found.regulated[-1, 0] == pytest.approx(285.15, abs=1e-3)
    assert found.cold[-1, 0] == pytest.approx(x[1], abs=2e-3)
    assert found.current[-1, 0] == pytest.approx(current, abs=1e-3)


def test_a_delayed_sensor_is_simulated(plant):
    """A delay of whole samples is a shift of what the sensor read."""
    late = machine(delay=4.0)
    law = rt.design.feedback_linearization(late)
    controller = rt.design.pid(plant, proportional=0.0, integral=0.0, sample_time=2.0)
    runs = [rt.design.simulate_loop(one, controller, 290.0, law=rt.design.feedback_linearization(one), duration=80.0,
                                    load={"plate": 3.0}, regulate=REGULATE) for one in (machine(), late)]
    np.testing.assert_allclose(runs[1].regulated[2:, 0], runs[0].regulated[:-2, 0], atol=1e-9)
    assert runs[1].regulated[1, 0] == runs[1].regulated[0, 0] and law.names == ("m1",)


def test_noise_of_the_sensor_reaches_the_controller(system, law, plant):
    controller = rt.design.pid(plant, bandwidth=0.01, sample_time=2.0)
    quiet, noisy = (rt.design.simulate_loop(system, controller, 290.15, law=law, duration=200.0, regulate=REGULATE,
                                            noise_seed=seed) for seed in (None, 3))
    assert np.std(noisy.wanted - quiet.wanted) == pytest.approx(0.01 * controller.proportional[0], rel=0.3)


@pytest.mark.parametrize("setpoint", [285.15, 300.15])
def test_reachable_readings_are_those_of_plain_scipy(law, setpoint):
    answer = rt.design.reachable(law, setpoint, regulate=REGULATE)
    x, current = held(setpoint, 0.5 if setpoint < ROOM else -0.3)
    assert answer.outcome.code == "reachable"
    assert answer.current["m1"] == pytest.approx(current, abs=1e-6)
    assert answer.faces["m1"] == pytest.approx(x[1], abs=1e-6)
    assert answer.passive["m1"] == pytest.approx(ROOM + OFFSET, abs=1e-6)
    np.testing.assert_allclose(list(answer.temperatures.values()), x[:3], atol=1e-6)


def test_an_unreachable_reading_is_refused_with_the_range(law):
    """Beyond the coldest steady plate, from a scan of the plain machine over the current."""
    answer = rt.design.reachable(law, 240.0, regulate=REGULATE)
    assert answer.outcome.code == "unreachable"
    from distant_plate import rates
    from scipy.optimize import root
    coldest, x = ROOM, np.full(4, ROOM)
    for current in np.linspace(0.0, 3.0, 301):
        x = root(lambda z, i=current: rates(z, i), x, tol=1e-12).x
        coldest = min(coldest, x[3])
    limit = ROOM + GAIN * (coldest - ROOM) + OFFSET
    assert answer.limit["m1"] == pytest.approx(limit, abs=0.05)
    with pytest.raises(rt.InputError, match="240"):
        answer.require()


def test_offset_moves_what_can_be_reached(law):
    plain = rt.design.reachable(law, 200.0, regulate={"m1": "plate"}).limit["m1"]
    read = rt.design.reachable(law, 200.0, regulate=REGULATE).limit["m1"]
    assert read == pytest.approx(ROOM + GAIN * (plain - ROOM) + OFFSET, abs=0.02)


@pytest.mark.parametrize(("regulate", "words"), [
    ({"m1": "T_sink"}, "does not influence sensor 'T_sink', on lump 'sink', through its cold face"),
    ({"m1": "sink"}, "does not influence lump 'sink' through its cold face: it is not on the cold side"),
    ({"m1": "nothing"}, "no sensor or lump 'nothing'"),
    ({"m9": "T_plate"}, "no module 'm9'"),
])
def test_points_that_cannot_be_regulated_are_refused(law, regulate, words):
    with pytest.raises(rt.InputError, match=words):
        rt.design.cold_side(law, regulate=regulate)


def test_pairs_that_cannot_be_regulated_are_refused():
    """Two modules: one point for both, each other's points, and a point on an island of its own."""
    two = rt.systems.two_module()
    law = rt.design.feedback_linearization(two)
    with pytest.raises(rt.InputError, match="independently of each other"):
        rt.design.cold_side(law, regulate={"m1": "x13", "m2": "x13"})
    crossed = rt.design.cold_side(law, regulate={"m1": "x12", "m2": "x11"})
    with pytest.raises(rt.InputError, match="relative gain"):
        rt.design.pid(crossed, bandwidth=0.01, sample_time=1.0)
    one, other = machine(), machine()
    apart = rt.System(
        ambients=one.ambients, lumps={**one.lumps, **{f"{k}2": v for k, v in other.lumps.items()}},
        links=[*one.links, *({"between": tuple(e if e == "room" else f"{e}2" for e in link.between),
                              "conductance": link.conductance} for link in other.links)],
        modules={"m1": one.modules["m1"],
                 "m2": {**one.modules["m1"].model_dump(), "hot": "sink2", "cold": "stage2"}})
    with pytest.raises(rt.InputError, match="'m1' does not influence lump 'plate2'.*no link joins it to 'stage'"):
        rt.design.cold_side(rt.design.feedback_linearization(apart), regulate={"m1": "plate2"})


def test_other_controllers_say_that_they_regulate_cold_faces_only(plant):
    pi = rt.design.pid(plant, bandwidth=0.01, sample_time=2.0)
    for make in (lambda: rt.design.state_feedback(plant, bandwidth=0.01, sample_time=2.0),
                 lambda: rt.design.feed_forward(plant, pi),
                 lambda: rt.design.disturbance_observer(plant, pi, time_constant=50.0)):
        with pytest.raises(rt.InputError, match="of T_plate.*regulates its cold faces"):
            make()


def test_a_name_with_two_meanings_is_refused(system):
    doubled = system.model_copy(update={"sensors": {**system.sensors, "stage": system.sensors["T_plate"]}})
    with pytest.raises(rt.InputError, match="'stage' is a lump, and a sensor on another lump"):
        rt.design.cold_side(rt.design.feedback_linearization(doubled), regulate={"m1": "stage"})


def test_the_certificate_of_a_loop_knows_what_is_regulated():
    """A lump away from the cold face is in the controller's matrices; a lag is not covered, and it is said."""
    system = machine(gain=1.03)
    law = rt.design.feedback_linearization(system, current_limits=(-0.05, 0.05))
    plant = rt.design.cold_side(law, regulate={"m1": "plate"})
    pi = rt.design.pid(plant, bandwidth=0.003, sample_time=2.0)
    done = rt.design.certify_loop(system, pi, law, regulate={"m1": "plate"})
    assert done.invariance.holds
    from robthermal.design._certify_loop import _matrices
    found = _matrices(pi, law, plant.points)
    np.testing.assert_allclose(found["D"], [[0.0, 0.0, -pi.proportional[0]]])
    np.testing.assert_allclose(found["B"], [[0.0, 0.0, -2.0 * pi.integral[0]]])
    lagging = rt.design.certify_loop(system, pi, law, regulate=REGULATE)
    assert not lagging.holds and not lagging.loop.holds and lagging.outcome.code == "not_certified"
    assert "the lag of sensor 'T_plate'" in str(lagging)
    quick = machine(lag=0.0)
    watcher = rt.design.observer(quick, ["T_sink"], sample_time=2.0)
    law = rt.design.feedback_linearization(quick, current_limits=(-0.05, 0.05))
    beside = rt.design.certify_loop(quick, pi, law, regulate=REGULATE, observer=watcher)
    assert not beside.holds and "Regulate the lump 'plate'" in str(beside)
