"""Heaters as they are and constant heats are covered by ranges of heat: nothing leaves the box, and it is tight."""

import numpy as np
import pytest

import robthermal as rt
from robthermal.verification import verify

ROOM, LIMITS = 293.15, (0.0, 10.0)
# effect, where, its numbers, largest heat into the coil [W]; None where another test says it
COVERED = [
    ("input_gain", ["q"], {"gain": 0.2}, 12.0), ("input_offset", ["q"], {"offset": 1.5}, 11.5),
    ("input_gain_slope", ["q"], {"slope": 0.05}, 15.0), ("input_gain_slope", ["q"], {"slope": -0.02}, 8.0),
    ("input_saturation", ["q"], {"cubic": 0.002}, 8.0), ("input_saturation", ["q"], {"cubic": 0.005}, None),
    ("input_saturation", ["q"], {"clip": 6.0}, 6.0), ("input_lag", ["q"], {"time_constant": 30.0}, 10.0),
    ("input_delay", ["q"], {"delay": 20.0}, 10.0), ("input_feedthrough", ["q", "core"], {"share": 0.3}, None),
    ("heat_source", ["coil"], {"heat": 2.0}, 12.0), ("heat_source", ["coil"], {"heat": -3.0}, 7.0),
    ("sensor_self_heating", ["T"], {"heat": 0.5}, 10.5),
    ("periodic_load", ["coil"], {"heat": 1.5, "period": 40000.0}, 11.5)]


def machine() -> rt.System:
    return rt.System(ambients={"room": {"temperature": ROOM}},
                     lumps={"coil": {"capacity": 40.0}, "core": {"capacity": 100.0}},
                     links=[{"between": ("coil", "core"), "conductance": 1.0},
                            {"between": ("core", "room"), "conductance": 0.5}],
                     sensors={"T": {"lump": "coil"}}, inputs={"q": {"lump": "coil", "limits": LIMITS}})


def with_effect(effect, where, values) -> rt.System:
    return rt.thermal.add_effect(machine(), effect, where, values).system


def hottest_and_coldest(system: rt.System, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Extremes of the lumps over random switching of the heater within its limits, full and no power for long."""
    held = np.concatenate([np.full(1500, LIMITS[1]), np.full(1500, LIMITS[0]), np.repeat(rng.uniform(*LIMITS, 40), 25),
                           np.repeat(rng.choice(LIMITS, 40), 50), np.full(1500, 0.8165 * LIMITS[1])])
    drive = rt.Record(sample_time=10.0, inputs=held, outputs=np.zeros((len(held), 0)), input_names=["q"],
                      output_names=[])
    lumps = rt.thermal.trajectory(system, drive).lumps
    return lumps.max(axis=0), lumps.min(axis=0)


@pytest.mark.parametrize(("effect", "where", "values", "most"), COVERED)
def test_no_trajectory_leaves_the_box_and_it_is_no_larger_than_it_must_be(effect, where, values, most):
    system = with_effect(effect, where, values)
    found = rt.certify.runaway_free(system, current={})
    assert found.holds and verify(found.invariance).valid and verify(found.contraction).valid
    hot, cold = hottest_and_coldest(system, np.random.default_rng(2))
    low, high = np.array([found.temperature[name] for name in ("coil", "core")]).T
    assert (hot < high).all() and (cold > low - 1e-9).all()
    assert high[0] - ROOM < 1.03 * (hot[0] - ROOM) + 0.3, "half a percent of every heat is in reserve"
    if most is not None:
        assert found.invariance.region["heat"]["coil"][1] == pytest.approx(most, rel=1e-12)


def test_what_a_cubic_saturation_gives_most_lies_within_the_limits():
    """v - 0.005 v³ is largest at √(1/0.015) = 8.165, and 5 W at the limit of 10."""
    found = rt.certify.heater_heat(with_effect("input_saturation", ["q"], {"cubic": 0.005}))
    assert found["coil"] == pytest.approx((0.0, 2 / 3 * np.sqrt(1 / 0.015)), rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_ranges_of_what_a_heater_does_are_those_of_a_dense_grid(seed):
    rng = np.random.default_rng(seed)
    drive = {"gain": rng.uniform(-0.3, 0.3), "offset": rng.uniform(-2, 2), "gain_slope": rng.uniform(-0.1, 0.1),
             "cubic": rng.uniform(-0.004, 0.01)}
    limits = tuple(np.sort(rng.uniform(-12, 12, 2)).tolist())
    system = rt.System(**{**dict(machine()), "inputs": {"q": {"lump": "coil", "limits": limits, "gain": -1.3,
                                                              "drive": drive}}})
    spread = {f"inputs.q.drive.{name}": (value - 0.1 * abs(value), value + 0.2 * abs(value))
              for name, value in drive.items()}
    for ranges in ({}, spread):
        given = rt.certify.heater_heat(system, ranges)["coil"]
        values = []
        for _ in range(300 if ranges else 1):
            at = {name: rng.choice(pair) if rng.random() < 0.9 else rng.uniform(*pair) for name, pair in ranges.items()}
            one = system.with_parameters({name: float(value) for name, value in at.items()})
            v = np.linspace(*limits, 4001)
            u = np.column_stack([v, np.full(v.size, ROOM)])
            values += rt.thermal.Equations(one).heat(np.full((v.size, 2), ROOM), u)[:, 0].tolist()
        assert given[0] <= min(values) + 1e-9 and max(values) <= given[1] + 1e-9
        loose = 0.0 if not ranges else 0.02
        assert max(values) >= given[1] - 1e-3 - loose * np.ptp(given)
        assert min(values) <= given[0] + 1e-3 + loose * np.ptp(given)


def test_uncertain_heats_are_counted_and_are_no_parameters_of_the_network():
    system = with_effect("heat_source", ["coil"], {"heat": 2.0}).with_parameters({"inputs.q.drive.gain": 0.1})
    ranges = {"lumps.coil.heat": (1.5, 2.5), "inputs.q.drive.gain": (0.05, 0.15), "links.core-room.conductance":
              (0.45, 0.55), "sensors.T.self_heating": (0.0, 0.1)}
    found = rt.certify.runaway_free(system, current={}, parameters=ranges)
    assert found.holds and found.invariance.region["heat"]["coil"] == pytest.approx([1.5, 14.1])
    assert list(found.invariance.region["parameters"]) == ["links.core-room.conductance"]
    box = rt.certify.contraction(system, current={}, temperature=(280.0, 400.0), parameters=ranges)
    assert box.holds and list(box.region["parameters"]) == ["links.core-room.conductance"]


@pytest.mark.parametrize(("name", "pair", "message"), [
    ("lumps.coil.heat", (2.0, 1.0), "lower <= upper"), ("sensors.T.self_heating", (0.0, np.nan), "finite numbers"),
    ("lumps.attic.heat", (0.0, 1.0), "no parameter 'lumps.attic.heat'")])
def test_ranges_of_heats_that_are_none_are_refused(name, pair, message):
    for claim in (lambda: rt.certify.runaway_free(machine(), current={}, parameters={name: pair}),
                  lambda: rt.certify.invariance(machine(), current={}, temperature=(280.0, 340.0),
                                                parameters={name: pair})):
        with pytest.raises(rt.InputError, match=message):
            claim()


def test_a_report_of_a_machine_with_a_lag_named_holds_for_the_range_of_its_gain():
    system = with_effect("input_lag", ["q"], {"time_constant": 30.0})
    done = rt.jobs.certify_system(system, rt.jobs.Boxes(temperature=(280.0, 400.0)), parameters={
        "inputs.q.gain": (0.9, 1.2), "inputs.q.drive.time_constant": (20.0, 40.0)})
    heats = {one.key: one.certificate.region["heat"]["coil"] for one in done.checked if one.key.startswith("box")
             and "contraction" not in one.key}
    assert done.holds and heats == {"box": [0.0, 10.0], "box_ranges": [0.0, 12.0]}


def test_given_heats_come_with_those_of_the_system():
    system = with_effect("heat_source", ["core"], {"heat": 2.0})
    box = {"coil": (292.0, 310.2), "core": (292.0, 306.0)}  # at most 305.15 and 309.15
    cert = rt.certify.invariance(system, current={}, temperature=box, heat={"coil": (0.0, 4.0)})
    assert cert.holds and cert.region["heat"] == {"coil": [0.0, 4.0], "core": [2.0, 2.0]}
    assert rt.certify.invariance(system, current={}, temperature=box).region["heat"] == {"core": [2.0, 2.0]}


def stack(resistance: float) -> rt.System:
    """Two modules; a lead of the first one heats its cold lump."""
    two = rt.systems.two_module()
    return rt.thermal.add_effect(two, "lead_heating", ["x9", "m1"], {"resistance": resistance}).system


def test_leads_heat_with_the_square_of_the_current():
    system, current = stack(0.4), {"m1": (-0.5, 1.0), "m2": (0.0, 1.0)}
    found = rt.certify.runaway_free(system, current=current)
    assert found.holds and found.invariance.region["heat"] == {"x9": [0.0, 0.4]}
    assert verify(found.invariance).valid and "no other heat" in found.invariance.claim
    plain = rt.certify.runaway_free(rt.systems.two_module(), current=current)
    assert found.temperature["x9"][1] > plain.temperature["x9"][1] + 0.1
    both = rt.certify.invariance(system, current={"m1": (0.5, 1.0), "m2": (0.0, 1.0)}, temperature=(200.0, 500.0),
                                 parameters={"leads.m1-x9.resistance": (0.3, 0.5)})
    assert both.region["heat"]["x9"] == pytest.approx([0.3 * 0.25, 0.5]) and "parameters" not in both.region
    rng = np.random.default_rng(4)
    held = np.repeat(np.column_stack([rng.choice([-0.5, 1.0], 60), rng.choice([0.0, 1.0], 60)]), 30, axis=0)
    held = np.concatenate([np.tile([1.0, 1.0], (1500, 1)), np.tile([1.0, 0.0], (1500, 1)), held])
    drive = rt.Record(sample_time=5.0, inputs=held, outputs=np.zeros((len(held), 0)), input_names=["m1", "m2"],
                      output_names=[])
    lumps = rt.thermal.trajectory(system, drive).lumps
    low, high = np.array([found.temperature[name] for name in system.lumps]).T
    assert (lumps.max(axis=0) < high).all() and (lumps.min(axis=0) > low).all()


def test_leads_cost_usable_current():
    """Of a lead in the cold lump more current heats earlier: the coldest steady state is at less."""
    stated = (278.15, 358.15)
    plain = rt.certify.usable_current(rt.systems.two_module(), temperature=stated, lower="reported")
    with_lead = rt.certify.usable_current(stack(2.0), temperature=stated, lower="reported",
                                          parameters={"leads.m1-x9.resistance": (1.5, 2.5)})
    assert with_lead.holds and 0.3 * plain.current < with_lead.current < 0.9 * plain.current
    c = with_lead.current
    assert with_lead.invariance.region["heat"]["x9"] == pytest.approx([0.0, 2.5 * c**2])
    low, high = np.array([with_lead.box[name] for name in stack(2.0).lumps]).T
    drive = rt.Record(sample_time=20.0, inputs=np.full((1500, 2), c), outputs=np.zeros((1500, 0)),
                      input_names=["m1", "m2"], output_names=[])
    lumps = rt.thermal.trajectory(stack(2.5), drive).lumps
    assert (lumps.max(axis=0) < high).all() and (lumps.min(axis=0) > low).all()


def test_regulated_claims_refuse_leads_and_pass_constant_heats():
    """Two trajectories under the same set-points have different currents in the modules that hold them."""
    asked = {"setpoint": {"m1": 278.15, "m2": 278.15}, "temperature": (278.15, 328.15),
             "current": {"m1": (0.0, 1.2), "m2": (0.0, 1.2)}}
    with pytest.raises(rt.InputError, match="leads.m1-x9.resistance = 0.4 .*no certificate covers"):
        rt.certify.regulated(stack(0.4), **asked)
    warm = rt.systems.two_module().with_parameters({"lumps.x9.heat": 0.3})
    assert rt.certify.regulated(warm, **asked).claim == rt.certify.regulated(rt.systems.two_module(), **asked).claim


def test_a_report_says_what_is_not_certified_of_a_machine_with_leads():
    boxes = rt.jobs.Boxes(current={"m1": (0.0, 1.0), "m2": (0.0, 1.0)}, setpoint={"m1": 283.15, "m2": 283.15})
    done = rt.jobs.certify_system(stack(0.4), boxes)
    refused = {one.key: one.certificate.reason for one in done.checked if not one.certificate.holds}
    assert done.holds and set(refused) == {"runaway", "regulated"}
    assert all("leads.m1-x9.resistance = 0.4 is an effect" in reason for reason in refused.values())
    with pytest.raises(rt.InputError, match="no module 'm3'"):
        rt.jobs.certify_system(stack(0.4), rt.jobs.Boxes(current=boxes.current, setpoint={"m3": 283.15}))


def test_a_law_takes_no_authority_from_a_box_without_the_heats_of_its_machine():
    """The network is the same, and so is its section of the certificate; a heat of 3 W is not in it."""
    plain = rt.systems.two_module()
    proof = rt.certify.usable_current(plain, temperature=(278.15, 358.15), lower="reported")
    rt.design.feedback_linearization(plain, certificate=proof)
    for other in (plain.with_parameters({"lumps.x9.heat": 3.0}), stack(0.4)):
        with pytest.raises(rt.InputError, match="the system itself heats lump 'x9' by"):
            rt.design.feedback_linearization(other, certificate=proof)
        own = rt.certify.usable_current(other, temperature=(278.15, 358.15), lower="reported")
        assert own.current < proof.current
        rt.design.feedback_linearization(other, certificate=own)


def observer(system, **more):
    return rt.certify.observer(system, gain=np.zeros((18, 1)), sensors=["T6"], sample_time=1.0,
                               current={"m1": (0.0, 0.5), "m2": (0.0, 0.5)}, temperature=(280.0, 330.0), **more)


def held(system, **more):
    return rt.certify.regulated(system, setpoint={"m1": 278.15, "m2": 278.15}, temperature=(278.15, 328.15),
                                current={"m1": (0.0, 1.2), "m2": (0.0, 1.2)}, **more)


def closed_form(system, **more):
    return rt.certify.runaway(system, setpoint={"m1": 283.15, "m2": 283.15}, **more)


def mapped(system, **more):
    return rt.certify.limit_map(system, ambient=[298.15], setpoint=[283.15], load=[1.0], temperature=(273.15, 358.15),
                                jobs=1, **more)


@pytest.mark.parametrize(("claim", "name"), [
    *((claim, name) for claim in (observer, closed_form, mapped)
      for name in ("lumps.x9.heat", "sensors.T6.self_heating", "leads.m1-x9.resistance")),
    (held, "leads.m1-x9.resistance")])
def test_ranges_of_heats_are_refused_by_claims_that_do_not_count_them(claim, name):
    """Zero in the system, up to something in the ranges: ignored, the claim would not be about all of them."""
    system = stack(0.0)
    with pytest.raises(rt.InputError, match=f"a range of {name} cannot be covered"):
        claim(system, parameters={name: (0.0, 1.0)})
    assert claim(system) is not None


def test_a_slope_that_may_be_is_refused_where_none_is_known():
    warm = rt.System(**{**dict(rt.systems.two_module()), "inputs": {
        "q": {"lump": "x1", "limits": (0.0, 1.0), "power_slope": 0.0}}})
    for claim in (observer, closed_form, held, mapped, lambda system, **more: rt.certify.usable_current(
            system, temperature=(278.15, 358.15), lower="reported", **more)):
        with pytest.raises(rt.InputError, match="a range of inputs.q.power_slope cannot be covered"):
            claim(warm, parameters={"inputs.q.power_slope": (0.0, 0.01)})


@pytest.mark.parametrize(("name", "pair"), [("lumps.x9.heat", (0.0, 0.5)), ("leads.m1-x9.resistance", (0.5, 1.0)),
                                            ("inputs.q.drive.gain", (-0.1, 0.1))])
def test_a_range_without_the_number_of_the_system_is_refused(name, pair):
    """A box for 0 to 0.5 W is none of a machine that heats itself by 2 W."""
    system = rt.System(**{**dict(stack(0.4)), "inputs": {
        "q": {"lump": "x1", "limits": (0.0, 1.0), "drive": {"gain": 0.3}}}}).with_parameters({"lumps.x9.heat": 2.0})
    current = {"m1": (0.0, 0.5), "m2": (0.0, 0.5)}
    for claim in (lambda: rt.certify.runaway_free(system, current=current, parameters={name: pair}),
                  lambda: rt.certify.invariance(system, current=current, temperature=(250.0, 400.0),
                                                parameters={name: pair}),
                  lambda: rt.certify.usable_current(system, temperature=(250.0, 400.0), parameters={name: pair})):
        with pytest.raises(rt.InputError, match="excludes the system's own value"):
            claim()


def test_a_map_refuses_a_machine_with_heats_of_its_own():
    """The loads of the map stand where these would be."""
    with pytest.raises(rt.InputError, match="lumps.x9.heat = 3 is an effect"):
        mapped(rt.systems.two_module().with_parameters({"lumps.x9.heat": 3.0}))


def test_the_closed_form_refuses_a_heater_that_heats_when_it_is_off():
    """3 W of an offset take 0.5 W off what the fold of the network carries."""
    warm = rt.System(**{**dict(rt.systems.two_module()), "inputs": {
        "q": {"lump": "x9", "limits": (0.0, 1.0), "drive": {"offset": 3.0}}}})
    with pytest.raises(rt.InputError, match="inputs.q.drive.offset = 3 is an effect"):
        closed_form(warm)
