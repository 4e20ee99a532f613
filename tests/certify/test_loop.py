"""Certified closed loops against simulations of the nonlinear plant; loops that must not be certified."""

import dataclasses

import numpy as np
import pytest

import robthermal as rt


def machine(rng, nonlinear=False):
    """A hot and a cold face, with up to two more lumps behind them."""
    lumps = {"hot": {"capacity": rng.uniform(20, 80)}, "cold": {"capacity": rng.uniform(8, 30)},
             "sink": {"capacity": rng.uniform(50, 200)}, "mass": {"capacity": rng.uniform(5, 40)}}
    links = [{"between": ("hot", "sink"), "conductance": rng.uniform(3, 8)},
             {"between": ("sink", "room"), "conductance": rng.uniform(2, 5)},
             {"between": ("cold", "mass"), "conductance": rng.uniform(0.3, 3)},
             {"between": ("mass", "room"), "conductance": rng.uniform(0.05, 0.3)},
             {"between": ("cold", "room"), "conductance": rng.uniform(0.05, 0.3)}]
    if nonlinear:
        links[3] |= {"radiation": 2e-10}
        links.append({"name": "air", "between": ("cold", "sink"), "conductance": 0.0,
                      "natural": {"gain": 0.01, "exponent": 0.25}})
    module = {"hot": "hot", "cold": "cold", "seebeck": {"value": 0.05, "slope": rng.uniform(0, 1e-4)},
              "resistance": {"value": rng.uniform(3, 5), "slope": rng.uniform(0, 0.02)},
              "conductance": {"value": rng.uniform(0.2, 0.4)}, "reference_temperature": 298.15}
    return rt.System(ambients={"room": {"temperature": 298.15}}, lumps=lumps, links=links, modules={"m": module})


def design(system, limits, bandwidth=0.05, **more):
    law = rt.design.feedback_linearization(system, current_limits=limits)
    return law, rt.design.pid(rt.design.cold_side(law), bandwidth=bandwidth, sample_time=1.0, **more)


def pair(system, law, pi, box, rng, samples=40):
    """Two simulated loops from random starts: their differences in temperatures and integrators."""
    low, high = np.array([box[name] for name in system.lumps]).T
    states = []
    for _ in range(2):
        run = rt.design.simulate_loop(system, pi, 295.0, law=law, duration=samples, initial=rng.uniform(low, high),
                                      current=float(rng.uniform(law.current_low[0], law.current_high[0])))
        z = run.wanted - pi.proportional * (run.reference - run.cold)
        states.append(np.hstack([run.lumps, z]))
    return states[0] - states[1], run


@pytest.mark.parametrize("nonlinear", [False, True])
def test_certified_loops_contract_in_simulation(nonlinear):
    rng = np.random.default_rng(7 + nonlinear)
    certified = 0
    for _ in range(3):
        system = machine(rng, nonlinear)
        law, pi = design(system, (-0.15, 0.3), bandwidth=float(rng.uniform(0.02, 0.1)))
        proven = rt.design.certify_loop(system, pi, law)
        if not (proven.loop.holds if nonlinear else proven.holds):  # that the box is kept is seen below
            continue
        certified += 1
        box, P = proven.loop.region["temperature"], np.array(proven.loop.evidence["matrix"])
        for _ in range(2):
            e, run = pair(system, law, pi, box, rng)
            V = np.einsum("ka,ab,kb->k", e, P, e)
            assert (V[1:] <= proven.loop.evidence["contraction"] ** 2 * V[:-1] * (1 + 1e-6)).all()
            low, high = np.array([box[name] for name in system.lumps]).T
            assert (run.lumps >= low - 1e-6).all() and (run.lumps <= high + 1e-6).all()
    assert certified >= 2


def test_uncertain_links():
    """Every machine of the ranges contracts in the one certified norm; ranges that reach too far are refused."""
    rng = np.random.default_rng(7)
    system = machine(rng)
    law, pi = design(system, (-0.15, 0.3))
    names = ("links.sink-room.conductance", "links.cold-mass.conductance")
    ranges = {name: (0.9 * system.parameter(name), 1.1 * system.parameter(name)) for name in names}
    free = rt.certify.runaway_free(system, current={"m": (-0.15, 0.3)}).temperature
    box = {name: (low - 3.0, high + 3.0) for name, (low, high) in free.items()}
    proven = rt.design.certify_loop(system, pi, law, temperature=box, parameters=ranges)
    assert proven.loop.holds and "sink-room" in proven.loop.claim and rt.verify(proven.loop).valid
    P, c = np.array(proven.loop.evidence["matrix"]), proven.loop.evidence["contraction"]
    for _ in range(4):
        other = system.with_parameters({name: float(rng.choice(pair)) for name, pair in ranges.items()})
        e, _ = pair(other, law, pi, box, rng)
        V = np.einsum("ka,ab,kb->k", e, P, e)
        assert (V[1:] <= c**2 * V[:-1] * (1 + 1e-6)).all()
    wide = dataclasses.replace(proven.loop, region={**proven.loop.region, "parameters": {names[0]: [1e-6, 10.0]}})
    assert not rt.verify(wide).valid
    for parameters, message in (({"modules.m.seebeck.value": (0.049, 0.051)},
                                 "'modules.m.seebeck.value' cannot be uncertain in a loop: the feedback law is made "
                                 "of .*runaway_free and usable_current claim"),
                                ({"lumps.sink.capacity": (1.0, 1e3)}, "'lumps.sink.capacity' cannot be uncertain"),
                                ({names[0]: (0.1, 0.2)}, "excludes")):
        with pytest.raises(rt.InputError, match=message):
            rt.design.certify_loop(system, pi, law, temperature=box, parameters=parameters)


def test_ranges_of_a_calibration_in_a_loop():
    """A box is found for all conductances; what the loop does not depend on is ignored, the rest refused by name."""
    rng = np.random.default_rng(7)
    plain = machine(rng)
    system = rt.System(ambients=plain.ambients, links=plain.links, modules=plain.modules,
                       lumps={name: {"capacity": lump.capacity} for name, lump in plain.lumps.items()},
                       sensors={"T": {"lump": "cold", "noise": 0.01}},
                       inputs={"foil": {"lump": "mass", "limits": (0.0, 0.1)}})
    law, pi = design(system, (-0.15, 0.3))
    name = "links.sink-room.conductance"
    value = system.parameter(name)
    ranges = {name: (0.95 * value, 1.05 * value), "sensors.T.gain": (0.9, 1.1), "sensors.T.offset": (-0.5, 0.5),
              "inputs.foil.gain": (0.9, 1.1), "lumps.cold.initial": (280.0, 310.0)}
    ranges = {key: pair for key, pair in ranges.items() if key in system.parameter_names}
    assert len(ranges) >= 4
    proven = rt.design.certify_loop(system, pi, law, parameters=ranges)
    assert proven.holds and rt.verify(proven.loop).valid and rt.verify(proven.invariance).valid
    assert list(proven.loop.region["parameters"]) == list(proven.invariance.region["parameters"]) == [name]
    assert proven.invariance.region["heat"]["mass"] == [0.0, pytest.approx(0.11)]
    bare = rt.design.certify_loop(system, pi, law)
    low, high = np.array(list(bare.invariance.region["temperature"].values())).T
    wide = np.array(list(proven.invariance.region["temperature"].values())).T
    assert (wide[0] <= low).all() and (wide[1] >= high).all() and (wide[1] > high).any()
    read = rt.design.observer(system, ["T"], sample_time=pi.sample_time)
    box = {key: tuple(pair) for key, pair in bare.invariance.region["temperature"].items()}
    for parameters, message in (({"sensors.T.gain": (0.9, 1.1)}, "sensors.T.gain cannot be covered: the observer"),
                                ({name: ranges[name]}, "'links.sink-room.conductance' cannot be uncertain with an")):
        with pytest.raises(rt.InputError, match=message):
            rt.design.certify_loop(system, pi, law, observer=read, parameters=parameters)
    with pytest.raises(rt.InputError, match="the observer reads this sensor"):
        rt.certify.observer(system, gain=read.gain, sensors=["T"], current={"m": (0.0, 0.1)}, temperature=box,
                            parameters={"sensors.T.gain": (0.9, 1.1)})


def test_ranges_of_natural_convection_and_radiation_are_refused_in_a_loop():
    rng = np.random.default_rng(7)
    plain = machine(rng)
    links = [{"between": link.between, "conductance": link.conductance} for link in plain.links]
    ends = next(link["between"] for link in links if "room" not in link["between"])
    bent = [{**link, "natural": {"gain": 0.01, "exponent": 1.25}, "radiation": 1e-11}
            if link["between"] == ends else link for link in links]
    system = rt.System(ambients=plain.ambients, links=bent, modules=plain.modules, lumps=plain.lumps)
    law, pi = design(system, (-0.15, 0.3))
    for part, pair in (("natural.gain", (0.005, 0.02)), ("radiation", (0.0, 2e-11))):
        name = f"links.{ends[0]}-{ends[1]}.{part}"
        with pytest.raises(rt.InputError, match=f"'{name}' cannot be uncertain in a loop"):
            rt.design.certify_loop(system, pi, law, parameters={name: pair})


def test_limits_are_active_in_these_simulations():
    """Otherwise the test above says nothing about the limiter."""
    rng = np.random.default_rng(7)
    system = machine(rng)
    law, pi = design(system, (-0.15, 0.3))
    run = rt.design.simulate_loop(system, pi, 280.0, law=law, duration=60)
    assert (run.limit == "current").any()


def test_unstable_loops_are_refused():
    system = machine(np.random.default_rng(7))
    law, pi = design(system, (-0.15, 0.3))
    for change in ({"proportional": 60 * pi.proportional}, {"integral": 200 * pi.integral},
                   {"proportional": -pi.proportional}, {"sample_time": 300.0}, {"integral": -pi.integral}):
        wrong = dataclasses.replace(pi, **change)
        proven = rt.design.certify_loop(system, wrong, law)
        assert not proven.holds and "no certificate exists" in proven.outcome.text, change


def test_too_much_current_is_refused():
    system = machine(np.random.default_rng(7))
    law, pi = design(system, (-0.1, 6.0))
    proven = rt.design.certify_loop(system, pi, law, temperature=(270.0, 320.0))
    assert not proven.holds


def test_an_integrator_without_anti_windup_is_refused():
    """Under a limit it drifts: two loops never meet again."""
    system = machine(np.random.default_rng(7))
    law, pi = design(system, (-0.15, 0.3))
    proven = rt.design.certify_loop(system, dataclasses.replace(pi, tracking_time=np.array([np.inf])), law)
    assert not proven.loop.holds


def test_other_controllers():
    system = machine(np.random.default_rng(7))
    law, pi = design(system, (-0.15, 0.3))
    plant = rt.design.cold_side(law)
    feedback = rt.design.state_feedback(plant, bandwidth=0.03, sample_time=1.0)
    derivative = rt.design.pid(plant, proportional=0.5, integral=0.005, derivative=0.5, sample_time=1.0)
    p_only = rt.design.pid(plant, proportional=0.5, sample_time=1.0)
    for controller in (feedback, derivative, p_only):
        proven = rt.design.certify_loop(system, controller, law)
        assert proven.holds and rt.verify(proven.loop).valid, proven.outcome.text


def test_with_an_observer_too_large_for_the_search_it_is_the_sampled_model(monkeypatch):
    """Where the continuous plant is out of reach the words "sampled model" stand in outcome and claim."""
    monkeypatch.setattr("robthermal.certify._loop._FLOW_SIZE", 4)
    system = machine(np.random.default_rng(7))
    system = system.model_copy(update={"sensors": rt.System(
        ambients=system.ambients, lumps=system.lumps, links=system.links, modules=system.modules,
        sensors={"Th": {"lump": "hot"}, "Tc": {"lump": "cold"}}).sensors})
    law, pi = design(system, (-0.15, 0.3))
    estimator = rt.design.observer(system, ["Th", "Tc"], sensor_noise=0.01)
    proven = rt.design.certify_loop(system, pi, law, observer=estimator)
    assert proven.holds and "estimates" in proven.outcome.text and proven.loop.region["plant"] == "held"
    assert "sampled model only" in str(proven) and "sampled model" in proven.loop.claim
    assert proven.outcome.code == "certified_sampled_model" and "too many for the search" in str(proven)
    rng, starts, ends = np.random.default_rng(3), [], []
    for _ in range(2):
        x, guess, z = rng.uniform(290, 305, 4), rng.uniform(290, 305, 4), rng.uniform(-2, 2, 1)
        starts.append(np.concatenate([x, guess, z]))
        for _ in range(400):
            cold = guess[[1]]
            v = pi.proportional * (295.0 - cold) + z
            command = law.command(v, guess)
            z = z + pi.integral * (295.0 - cold) - np.expm1(-1 / pi.tracking_time) * (command.heat - v)
            u = estimator.model.exogenous({"m": float(command.current[0])})
            x, guess = estimator.model.predict(x, u), estimator.model.predict(guess, u) + estimator.gain @ (
                estimator.model.C @ (x - guess))
        ends.append(np.concatenate([x, guess, z]))
    assert np.abs(ends[0] - ends[1]).max() < 0.1 * np.abs(starts[0] - starts[1]).max()


@pytest.mark.exhaustive
def test_two_modules_in_sampled_form():
    """The demo set-up, limits 0 to 0.5 A, over the box that these currents cannot leave."""
    system = rt.systems.two_module()
    law = rt.design.feedback_linearization(system, current_limits=(0.0, 0.5))
    plant = rt.design.cold_side(law)
    pi = rt.design.pid(plant, bandwidth=0.05, sample_time=1.0)
    box = {"m1": (0.0, 0.5), "m2": (0.0, 0.5)}
    faces = np.eye(18)[[10, 11]]
    cert = rt.certify.loop(system, current=box, temperature=rt.certify.runaway_free(system, current=box).temperature,
                           sample_time=1.0, plant="held", controller={
                               "A": np.eye(2), "B": -pi.integral[:, None] * faces, "C": np.eye(2),
                               "D": -pi.proportional[:, None] * faces,
                               "windup": np.diag(-np.expm1(-1 / pi.tracking_time))})
    assert cert.holds and rt.verify(cert).valid


def test_refusals():
    system = machine(np.random.default_rng(7))
    law, pi = design(system, (-0.15, 0.3))
    with pytest.raises(rt.InputError, match="voltage or slew"):
        rt.design.certify_loop(system, pi, rt.design.feedback_linearization(system, current_limits=(-0.1, 0.1),
                                                                            slew=0.1))
    with pytest.raises(rt.InputError, match="no current limits"):
        rt.design.certify_loop(system, pi, rt.design.feedback_linearization(system))
    with pytest.raises(rt.InputError, match="another system"):
        rt.design.certify_loop(machine(np.random.default_rng(1)), pi, law)
    with pytest.raises(rt.InputError, match="controller is a str"):
        rt.design.certify_loop(system, "pi", law)
    with pytest.raises(rt.InputError, match="windup has shape"):
        rt.certify.loop(system, current={"m": (0, 0.1)}, temperature=(290.0, 300.0), sample_time=1.0, controller={
            "A": [[1.0]], "B": np.zeros((1, 4)), "C": [[1.0]], "D": np.zeros((1, 4)), "windup": [[0.1, 0.2]]})
    air = system.model_copy(update={"links": (*system.links[:-1], rt.System(
        ambients=system.ambients, lumps=system.lumps, links=[{"between": ("cold", "room"), "conductance": 0.1,
                                                              "natural": {"gain": 0.1, "exponent": 0.25}},
                                                             *system.links[:-1]],
        modules=system.modules).links[0])})
    law, pi = design(air, (-0.15, 0.3))
    proven = rt.design.certify_loop(air, pi, law, temperature=(285.0, 310.0))
    assert not proven.holds and "natural convection" in proven.loop.reason
