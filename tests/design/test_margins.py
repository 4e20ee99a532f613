"""Margins of the loop as implemented: python-control on finite differences of the simulated machine, Monte Carlo."""

from __future__ import annotations

import control
import numpy as np
import pytest
from distant_plate import advance, held, law, machine, reading

import robthermal as rt

REGULATE = {"m1": "T_plate"}
RANGES = {"links.stage-plate.conductance": (0.6, 1.0), "lumps.plate.capacity": (50.0, 70.0),
          "modules.m1.seebeck.value": (0.050, 0.056), "sensors.T_plate.time_constant": (15.0, 25.0)}


def differences(function, point, size=1e-3):
    """Jacobian by central differences."""
    moves = size * np.eye(len(point))
    return np.array([(function(point + move) - function(point - move)) / (2 * size) for move in moves]).T


def pi_in_the_loop(plant: control.StateSpace, kp: float, ki: float, h: float) -> control.StateSpace:
    """L of a PI whose integral is held over a sample, in front of a plant without sign."""
    return plant * control.ss([[1.0]], [[h]], [[ki]], [[kp]], h)


def stability(loop: control.StateSpace) -> tuple[float, float, float, float]:
    """Gain, phase [deg], modulus and delay [s] of a single loop, by python-control and the definition."""
    w = np.geomspace(1e-4, np.pi / loop.dt, 4000)
    L = np.asarray(loop(np.exp(1j * w * loop.dt))).ravel()
    with np.errstate(all="ignore"):
        gm, pm, sm, _, wc, _ = control.stability_margins(control.frd(L, w, smooth=True), returnall=True)
    delay = min(np.radians(phase % 360.0) / frequency for phase, frequency in zip(pm, wc, strict=True))
    return float(np.abs(np.log(gm)).min()), float(np.abs(pm).min()), float(np.min(sm)), float(delay)


def same(found: rt.design.Margins, by_hand: tuple[float, float, float, float], rel: float = 2e-3) -> None:
    assert np.log(found.gain) == pytest.approx(by_hand[0], rel=rel)
    assert (found.phase, found.modulus, found.delay) == pytest.approx(by_hand[1:], rel=rel)


@pytest.fixture(scope="module")
def loop_parts():
    nominal = rt.design.feedback_linearization(machine())
    plant = rt.design.cold_side(nominal, regulate=REGULATE)
    return nominal, plant, rt.design.pid(plant, proportional=1.2, integral=0.004, sample_time=2.0)


def test_margins_are_those_of_the_machine_in_plain_scipy(loop_parts):
    """Currents held over the sample, the law at the sampled faces: differences of the simulated sample."""
    nominal, _, pi = loop_parts
    x, current = held(288.15)
    from distant_plate import cold_heat

    point = np.array([*x, cold_heat(current, x[0], x[1])])
    J = differences(lambda s: advance(s[:4], law(s[4], s[0], s[1]), 2.0), point)
    C = differences(lambda s: np.array([reading(s)]), x)
    L = pi_in_the_loop(control.ss(J[:, :4], J[:, 4:], C, 0, 2.0), 1.2, 0.004, 2.0)
    found = rt.design.loop_margins(nominal, pi, 288.15, regulate=REGULATE)
    same(found.nominal.margins["m1"], stability(L))
    assert found.outcome.code == "margins"
    i = [20, 100, 200, 290]
    theirs = np.asarray(L(np.exp(2j * found.frequency[i]))).ravel()
    np.testing.assert_allclose(found.nominal.response[0, i], theirs, rtol=2e-3)


def composite(system, observer, feedback, sample_time, regulate):
    """One sample of plant and observer as a function of lumps, lags, estimates and heats; what is regulated."""
    stepper = rt.thermal.Stepper(system, sample_time)
    size, n = len(stepper.state), len(system.lumps)
    names = [*system.sensor_names]

    def step(s):
        stepper.state = s[:size].copy()
        estimate = s[size:size + n]
        readings = stepper.undelayed[[names.index(name) for name in observer.sensors]]
        current = feedback.current(s[size + n:], estimate)
        inputs = dict(zip(feedback.names, current.tolist(), strict=True))
        after = observer.step(estimate, readings, inputs)
        stepper.step(inputs)
        return np.concatenate([stepper.state, after])

    def seen(s):
        stepper.state = s[:size].copy()
        estimate = s[size:size + n]
        return np.array([stepper.undelayed[names.index(regulate[m])] if regulate.get(m) in names
                         else estimate[system.lump_names.index(regulate.get(m, system.modules[m].cold))]
                         for m in feedback.names])

    return step, seen, size


def settled(system, observer, feedback, controller, setpoint, regulate, duration):
    """State of plant and observer, and heats, at the end of a long simulation."""
    loop = rt.design.simulate_loop(system, controller, setpoint, law=feedback, duration=duration, observer=observer,
                                   regulate=regulate)
    assert np.abs(loop.lumps[-1] - loop.lumps[-2]).max() < 1e-6
    stepper = rt.thermal.Stepper(system, controller.sample_time, initial=loop.lumps[-1])
    return np.concatenate([stepper.state, loop.estimate[-1], loop.wanted[-1]])


@pytest.mark.exhaustive
def test_margins_with_an_observer_and_another_plant(loop_parts):
    """The observer and the law keep the nominal parameters; the plant is a corner of the ranges."""
    nominal, _, pi = loop_parts
    watcher = rt.design.observer(machine(), ["T_sink"], sample_time=2.0, process_noise=0.05)
    found = rt.design.loop_margins(nominal, pi, 288.15, regulate=REGULATE, observer=watcher, parameters=RANGES)
    assert len(found.corners) == found.total == 16 and "all 16 corners" in str(found.outcome)
    worst = found.worst_plant("m1")
    plant = machine().with_parameters(worst.corner)
    start = settled(plant, watcher, nominal, pi, 288.15, REGULATE, 12000.0)
    step, seen, size = composite(plant, watcher, nominal, 2.0, REGULATE)
    J = differences(step, start)
    n = size + 3
    P = control.ss(J[:, :n], J[:, n:], differences(seen, start)[:, :n], 0, 2.0)
    same(worst.margins["m1"], stability(pi_in_the_loop(P, 1.2, 0.004, 2.0)))
    assert found.worst("m1").modulus < found.nominal.margins["m1"].modulus
    assert found.worst("m1").gain == min(plant.margins["m1"].gain for plant in found.plants)


@pytest.mark.exhaustive
def test_margins_of_two_loops_are_opened_one_at_a_time(system, law, plant):
    """Two modules, an observer: one loop opened, the other closed, on differences of the simulated machine."""
    pi = rt.design.pid(plant, bandwidth=0.2, sample_time=1.0)
    watcher = rt.design.observer(system, ["T6", "T7", "T15", "T16"], sample_time=1.0)
    found = rt.design.loop_margins(law, pi, [288.15, 290.15], observer=watcher)
    start = settled(system, watcher, law, pi, [288.15, 290.15], {}, 4000.0)
    step, seen, size = composite(system, watcher, law, 1.0, {})
    J = differences(step, start)
    n = size + 18
    P = control.ss(J[:, :n], J[:, n:], differences(seen, start)[:, :n], 0, 1.0)
    one = [control.ss([[1.0]], [[1.0]], [[pi.integral[i]]], [[pi.proportional[i]]], 1.0) for i in range(2)]
    both = P * control.append(*one)
    w = found.frequency[::37]
    L = np.moveaxis(np.asarray(both(np.exp(1j * w))), -1, 0)
    # loop 1 with loop 2 closed; at the plant's output as at its input, since the controller is diagonal
    closed = L[:, 0, 0] - L[:, 0, 1] * L[:, 1, 0] / (1 + L[:, 1, 1])
    np.testing.assert_allclose(found.nominal.response[0, ::37], closed, rtol=3e-3)
    assert "others closed" in str(found.outcome)
    S = np.linalg.inv(np.eye(2) + L)
    assert found.disk <= 1 / np.linalg.norm(S - 0.5 * np.eye(2), 2, axis=(1, 2)).max() * 1.3


def test_the_disk_margin_of_all_loops_holds(system, law, plant):
    """No complex factors of modulus below it make the loop unstable: 400 random ones, and rings of the size itself."""
    pi = rt.design.pid(plant, bandwidth=0.4, sample_time=1.0)
    found = rt.design.loop_margins(law, pi, 290.15)
    from robthermal.design._operated_plants import Operation
    from robthermal.design._sampled_loop import LoopParts

    loop = Operation.of(law, 290.15, None, None).nominal.loop(LoopParts.of(law, pi))
    rng = np.random.default_rng(0)
    for size in (0.999, *rng.uniform(0.5, 0.999, 400)):
        e = size * found.disk * np.exp(2j * np.pi * rng.random(2))
        factor = (1 + e / 2) / (1 - e / 2)
        assert np.abs(np.linalg.eigvals(loop.A + loop.B @ np.diag(factor) @ loop.C)).max() < 1
    # and it is not far from the truth: twice of it breaks the loop for some factors
    broken = [np.abs(np.linalg.eigvals(loop.A + loop.B @ np.diag((1 + e / 2) / (1 - e / 2)) @ loop.C)).max() >= 1
              for e in 1.5 * found.disk * np.exp(2j * np.pi * rng.random((2000, 1))) * np.ones(2)]
    assert any(broken)


@pytest.mark.parametrize("margin", ["gain", "phase", "delay"])
def test_at_the_margin_the_loop_oscillates(loop_parts, margin):
    """Just inside a margin the closed loop is stable, just outside it is not: poles of plain scipy's machine."""
    nominal, _, pi = loop_parts
    found = rt.design.loop_margins(nominal, pi, 288.15, regulate=REGULATE).nominal.margins["m1"]
    x, current = held(288.15)
    from distant_plate import cold_heat

    point = np.array([*x, cold_heat(current, x[0], x[1])])
    J = differences(lambda s: advance(s[:4], law(s[4], s[0], s[1]), 2.0), point)
    C = differences(lambda s: np.array([reading(s)]), x)
    L = pi_in_the_loop(control.ss(J[:, :4], J[:, 4:], C, 0, 2.0), 1.2, 0.004, 2.0)

    def radius(share: float) -> float:
        count = int(found.delay * share // 2.0) if margin == "delay" else 0
        late = control.ss(np.eye(count, k=-1), np.eye(count)[:, :1], np.eye(count)[-1:], 0, 2.0) if count else 1.0
        factor = {"gain": found.gain**share, "phase": np.exp(-1j * np.radians(found.phase * share)), "delay": 1.0}
        changed = L * late
        return float(np.abs(np.linalg.eigvals(changed.A - factor[margin] * changed.B @ changed.C)).max())

    assert radius(0.93) < 1 < radius(1.07)


def test_an_unstable_corner_has_no_margin(loop_parts):
    nominal, _, pi = loop_parts
    slow = {"sensors.T_plate.time_constant": (20.0, 4000.0)}
    found = rt.design.loop_margins(nominal, pi, 288.15, regulate=REGULATE, parameters=slow)
    worst = found.worst("m1")
    assert found.outcome.code == "unstable" and "time_constant = 4000" in str(found.outcome)
    assert (worst.gain, worst.phase, worst.modulus, worst.delay, worst.stable) == (1.0, 0.0, 0.0, 0.0, False)
    assert found.to_dict()["m1"]["worst"]["stable"] is False and found.to_dict()["m1"]["stable"] is True


def test_a_corner_that_cannot_hold_the_set_point_is_said(loop_parts):
    nominal, _, pi = loop_parts
    found = rt.design.loop_margins(nominal, pi, 281.15, regulate=REGULATE,
                                   parameters={"modules.m1.seebeck.value": (0.02, 0.0537)})
    assert found.outcome.code == "not_held" and "seebeck.value = 0.02" in str(found.outcome)


@pytest.mark.exhaustive
def test_many_parameters_are_searched_where_the_margins_fall(loop_parts):
    """Eleven parameters have 2048 corners: 64 are computed, among them one as bad as the worst of all single moves."""
    nominal, plant, _ = loop_parts
    pi = rt.design.pid(plant, bandwidth=0.012, sample_time=2.0)
    base = machine()
    names = ["lumps.sink.capacity", "lumps.stage.capacity", "lumps.plate.capacity", "links.sink-room.conductance",
             "links.stage-room.conductance", "links.stage-plate.conductance", "links.plate-room.conductance",
             "modules.m1.seebeck.value", "modules.m1.resistance.value", "modules.m1.conductance.value",
             "sensors.T_plate.time_constant"]
    ranges = {name: (0.95 * base.parameter(name), 1.05 * base.parameter(name)) for name in names}
    found = rt.design.loop_margins(nominal, pi, 288.15, regulate=REGULATE, parameters=ranges)
    assert found.total == 2048 and len(found.corners) <= 64 and "of 2048 corners" in str(found.outcome)
    # a brute force over 300 other corners finds nothing worse
    rng = np.random.default_rng(5)
    from robthermal.design._loop_margins import analyzed
    from robthermal.design._operated_plants import Operation
    from robthermal.design._sampled_loop import LoopParts

    operation, parts = Operation.of(nominal, 288.15, REGULATE, None), LoopParts.of(nominal, pi, None, REGULATE)
    others = [{name: ranges[name][int(end)] for name, end in zip(names, rng.integers(0, 2, 11), strict=True)}
              for _ in range(300)]
    least = min(analyzed(operation.at(c), c, parts, found.frequency).margins["m1"].modulus for c in others)
    assert found.worst("m1").modulus <= least


def test_parameters_that_do_not_matter_make_no_corners(loop_parts):
    nominal, _, pi = loop_parts
    found = rt.design.loop_margins(nominal, pi, 288.15, regulate=REGULATE,
                                   parameters={"sensors.T_sink.offset": (-1.0, 1.0)})
    assert found.corners == () and found.total == 0
    assert found.to_dict()["m1"]["worst"] == {k: v for k, v in found.to_dict()["m1"].items() if k != "worst"}


@pytest.mark.parametrize(("arguments", "words"), [
    ({"setpoint": 240.0}, "240"),
    ({"parameters": {"lumps.none.capacity": (1.0, 2.0)}}, "lumps.none.capacity"),
    ({"parameters": {"lumps.plate.capacity": (70.0, 50.0)}}, "lower <= upper"),
    ({"observer": 3}, "constant gain"),
])
def test_bad_input_is_refused(loop_parts, arguments, words):
    nominal, _, pi = loop_parts
    with pytest.raises(rt.InputError, match=words):
        rt.design.loop_margins(nominal, pi, **{"setpoint": 288.15, "regulate": REGULATE, **arguments})


def test_pictures(loop_parts):
    nominal, _, pi = loop_parts
    found = rt.design.loop_margins(nominal, pi, 288.15, regulate=REGULATE,
                                   parameters={"lumps.plate.capacity": (50.0, 70.0)})
    gain, phase = found.plot_bode("m1")
    assert len(gain.lines) >= 4 and any("gain ×" in text.get_text() for text in gain.texts)
    assert any("phase" in text.get_text() and "delay" in text.get_text() for text in phase.texts)
    circle = found.plot_nyquist("m1").lines[-2].get_xydata()
    np.testing.assert_allclose(np.hypot(circle[:, 0] + 1, circle[:, 1]), found.worst("m1").modulus)
    with pytest.raises(rt.InputError, match="no loop 'm7'"):
        found.plot_bode("m7")
