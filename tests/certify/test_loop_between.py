"""Loops of the continuous plant, with and without observer: against an own integration of the equations."""

import dataclasses

import numpy as np
import pytest
from loop_machines import AMBIENT, Machine, peltier

import robthermal as rt
from robthermal.verification import establish


def designed(system, limits, time=1.0, bandwidth=0.05):
    law = rt.design.feedback_linearization(system, current_limits=limits)
    return law, rt.design.pid(rt.design.cold_side(law), bandwidth=bandwidth, sample_time=time)


def certified(system, limits, sensors=None, time=1.0, bandwidth=0.05, gain=None):
    law, pi = designed(system, limits, time, bandwidth)
    estimator = None
    if sensors:
        estimator = rt.design.observer(system, sensors, sample_time=time)
        estimator = estimator if gain is None else dataclasses.replace(estimator, gain=gain)
    proven = rt.design.certify_loop(system, pi, law, ambient=AMBIENT, observer=estimator)
    return proven, Machine(system, pi, limits, time, estimator)


def ratios(proven, machine, rng, pairs=12, samples=3):
    """e'Pe over c² times its value a sample before, for pairs from random starts, near and far."""
    c, P = proven.loop.evidence["contraction"], np.array(proven.loop.evidence["matrix"])
    low, high = np.array([proven.loop.region["temperature"][name] for name in ("plate", "cold", "hot", "sink")]).T
    count = 2 if machine.observer else 1
    found, kept = [], 0
    for _ in range(pairs):
        near = 10.0 ** rng.uniform(-3, 0)
        one = np.concatenate([*rng.uniform(low, high, (count, 4)), rng.uniform(-25, 12, 1)])
        other = np.concatenate([*rng.uniform(low, high, (count, 4)), rng.uniform(-25, 12, 1)])
        pair = [one, one + near * (other - one)]
        reference = rng.uniform(265, 300)
        for _ in range(samples):
            new = [machine.sample(state, reference)[0] for state in pair]
            before, after = pair[1] - pair[0], new[1] - new[0]
            inside = all((np.r_[low, low][:4 * count] <= state[:4 * count]).all()
                         and (state[:4 * count] <= np.r_[high, high][:4 * count]).all() for state in pair)
            if inside:
                kept += 1
                found.append((after @ P @ after) / (c**2 * (before @ P @ before)))
            pair = new
    assert kept > pairs
    return np.array(found)


@pytest.mark.parametrize(("limits", "sensors"), [
    ((0.0, 2.0), None), ((0.0, 3.5), None), ((0.0, 2.0), ["Tp", "Th", "Ts"]), ((0.0, 3.5), ["Tp", "Th", "Ts"])])
def test_the_one_peltier_machine_at_useful_currents(limits, sensors):
    proven, machine = certified(peltier(), limits, sensors)
    assert proven.holds and proven.loop.region["plant"] == "continuous" and proven.outcome.code == "certified", proven
    assert rt.verify(proven.loop).valid and "continuous plant" in proven.loop.claim
    assert ("estimates" in proven.loop.claim) == ("estimates" in proven.outcome.text) == bool(sensors)
    assert ratios(proven, machine, np.random.default_rng(11)).max() <= 1 + 1e-6


def test_the_margin_of_the_claim_is_not_idle():
    """The slowest pair shrinks hardly faster than claimed: a much smaller factor would be false."""
    proven, machine = certified(peltier(), (0.0, 2.0))
    c = proven.loop.evidence["contraction"]
    found = ratios(proven, machine, np.random.default_rng(12), pairs=60)
    assert found.max() * c**2 > 1 - 20 * (1 - c**2)


def test_random_machines_and_observers():
    """Whatever is certified shrinks in an own integration, with limits active; some must be certified."""
    rng, held = np.random.default_rng(13), 0
    for _ in range(6):
        system = peltier(plate=rng.uniform(60, 200), face=rng.uniform(5, 12), sink=rng.uniform(90, 300),
                         outer=rng.uniform(4, 10), water=rng.uniform(5, 20))
        time = float(rng.choice([0.5, 1.0, 3.0, 10.0]))
        sensors = ["Tp", "Th", "Ts"] if rng.random() < 0.7 else None
        proven, machine = certified(system, (0.0, float(rng.uniform(1.0, 3.0))), sensors, time,
                                    float(rng.uniform(0.02, 0.08)))
        if proven.loop.holds and proven.loop.region["plant"] == "continuous":
            held += 1
            assert ratios(proven, machine, rng, pairs=6, samples=2).max() <= 1 + 1e-6
    assert held >= 3


def test_loops_that_oscillate_are_never_certified_for_the_machine():
    """Observer gains, sample times and bandwidths at random: whoever keeps oscillating has no certificate."""
    rng, oscillating = np.random.default_rng(14), 0
    for _ in range(14):
        time, faster = float(rng.choice([1.0, 5.0, 10.0, 20.0, 30.0])), float(np.exp(rng.uniform(0, np.log(12))))
        system = peltier(plate=rng.uniform(20, 100), inner=rng.uniform(0.5, 5), outer=rng.uniform(2, 10))
        law, pi = designed(system, (0.0, 2.5), 1.0, 0.02)
        pi = dataclasses.replace(pi, sample_time=time, proportional=faster * pi.proportional,
                                 integral=faster * pi.integral)
        gain = rng.uniform(0.2, 1.0) * np.eye(4)[[0, 2, 3]].T
        gain[1, 0] = rng.uniform(0.0, 1.5)
        estimator = dataclasses.replace(rt.design.observer(system, ["Tp", "Th", "Ts"], sample_time=time), gain=gain)
        machine = Machine(system, pi, (0.0, 2.5), time, estimator)
        state, path = np.concatenate([np.full(8, 296.0), [0.0]]), []
        for _ in range(120):
            state, _ = machine.sample(state, 283.0)
            path.append(state[1])
        first, last = np.ptp(path[60:90]), np.ptp(path[90:])
        turns = np.count_nonzero(np.diff(np.sign(np.diff(path[90:]))))
        if last < 0.3 or last < 0.9 * first or turns < 3:
            continue
        oscillating += 1
        proven = rt.design.certify_loop(system, pi, law, ambient=AMBIENT, observer=estimator)
        assert not proven.holds or proven.outcome.code == "certified_sampled_model"
    assert oscillating >= 2


def test_sensors_with_a_gain():
    """The observer undoes the gain of its sensors: the claim is the same as with plain ones."""
    plain = peltier()
    table = {name: {"lump": sensor.lump, "noise": sensor.noise} for name, sensor in plain.sensors.items()}
    other = rt.System(ambients=plain.ambients, lumps=plain.lumps, links=plain.links, modules=plain.modules,
                      sensors={**table, "Tp": {**table["Tp"], "gain": 2.0}})
    gain = 0.5 * np.eye(4)[[0, 2, 3]].T
    found = [certified(system, (0.0, 1.0), ["Tp", "Th", "Ts"], gain=gain)[0] for system in (plain, other)]
    assert all(proven.holds for proven in found)
    assert found[0].loop.evidence["contraction"] == pytest.approx(found[1].loop.evidence["contraction"], abs=1e-5)


def test_other_observers_are_not_proven_by_the_same_matrices():
    """Gains that make the observer unstable or that the matrices were not made for; a file that says another plant."""
    loop = certified(peltier(), (0.0, 2.0), ["Tp", "Th", "Ts"])[0].loop
    for factor in (-1.0, 0.0, 4.0):
        gain = (factor * np.array(loop.system["gain"])).tolist()
        assert not establish("loop", system={**loop.system, "gain": gain}, region=loop.region, evidence=loop.evidence,
                             made_by={}).holds
    longer = {**loop.region, "sample_time": 8.0}
    assert not establish("loop", system=loop.system, region=longer, evidence=loop.evidence, made_by={}).holds
    for region in ({**loop.region, "plant": "held"},
                   {**loop.region, "parameters": {"links.hot-sink.conductance": [5.0, 7.0]}}):
        with pytest.raises(rt.InputError, match="observer in the loop"):
            establish("loop", system=loop.system, region=region, evidence=loop.evidence, made_by={})
