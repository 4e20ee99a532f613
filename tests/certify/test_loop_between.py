"""Loops of the continuous plant, with and without observer: against an own integration of the equations."""

import dataclasses

import numpy as np
import pytest
from loop_machines import AMBIENT, Machine, peltier
from scipy.linalg import expm

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


@pytest.mark.exhaustive
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


@pytest.mark.exhaustive
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


def test_a_loop_that_limit_cycles_is_at_most_certified_as_a_sampled_model():
    """Observer gain 0.9, samples of 20 s: once certified without a word on the model, and it swings by 13 K."""
    S, R, K, G_hot, G_cold, room, time = 0.05, 2.0, 0.5, 5.5, 0.24, 298.15, 20.0
    E = np.array([55.0, 13.0])
    system = rt.System(
        ambients={"room": {"temperature": room}}, lumps={"hot": {"capacity": E[0]}, "cold": {"capacity": E[1]}},
        links=[{"between": ("hot", "room"), "conductance": G_hot},
               {"between": ("cold", "room"), "conductance": G_cold}],
        modules={"m": {"hot": "hot", "cold": "cold", "seebeck": {"value": S}, "resistance": {"value": R},
                       "conductance": {"value": K}, "reference_temperature": room}},
        sensors={"Th": {"lump": "hot", "noise": 0.01}, "Tc": {"lump": "cold", "noise": 0.01}})
    law = rt.design.feedback_linearization(system, current_limits=(0.0, 1.8))
    pi = dataclasses.replace(rt.design.pid(rt.design.cold_side(law), bandwidth=0.2, sample_time=time),
                             proportional=np.array([3.0]), integral=np.array([0.1]))
    observer = dataclasses.replace(rt.design.observer(system, ["Th", "Tc"], sample_time=time), gain=0.9 * np.eye(2))
    proof = rt.design.certify_loop(system, pi, law, observer=observer)

    def motion(current):
        """x(t + h) = F x(t) + g at a constant current: its equations are linear."""
        A = np.array([[S * current - G_hot - K, K], [K, -S * current - G_cold - K]]) / E[:, None]
        b = (np.array([G_hot, G_cold]) * room + 0.5 * R * current**2) / E
        F = expm(np.block([[A, b[:, None]], [np.zeros((1, 3))]]) * time)
        return F[:2, :2], F[:2, 2]

    rest, still = motion(0.0)
    hold = np.linalg.solve(np.array([[-G_hot - K, K], [K, -G_cold - K]]) / E[:, None], rest - np.eye(2)) / E
    x, seen, z, reference, cold = np.array([290.0, 290.0]), np.array([290.0, 290.0]), 0.0, 285.0, []
    for _ in range(400):
        v = pi.proportional[0] * (reference - seen[1]) + z
        slope = S * seen[1]
        root = slope**2 + 2 * R * (v - K * (seen[0] - seen[1]))
        current = min(max((slope - np.sqrt(max(root, 0.0))) / R, 0.0), 1.8)
        given = K * (seen[0] - seen[1]) + 0.5 * R * current**2 - S * seen[1] * current
        z += (pi.integral[0] * time * (reference - seen[1])
              + (1 - np.exp(-time / pi.tracking_time[0])) * (given - v))
        heat = np.array([S * seen[0], -S * seen[1]]) * current + 0.5 * R * current**2
        F, g = motion(current)
        x, seen = F @ x + g, rest @ seen + still + hold @ heat + 0.9 * (x - seen)
        cold.append(x[1])
    assert np.ptp(cold[-100:]) == pytest.approx(13.48, abs=0.02) and min(cold) > 268.0 and max(cold) < 303.0
    run = rt.design.simulate_loop(system, pi, reference, law=law, observer=observer, duration=8000.0)
    assert np.ptp(run.cold[-100:]) == pytest.approx(np.ptp(cold[-100:]), rel=1e-3)
    assert not proof.holds or (proof.outcome.code == "certified_sampled_model" and "sampled model" in proof.loop.claim
                               and "sampled model" in str(proof))
    assert "plant" not in proof.loop.region or proof.loop.region["plant"] == "held"


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
