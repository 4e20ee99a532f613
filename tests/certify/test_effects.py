"""A certificate that leaves out a heat is wrong: every effect is refused, or is shown not to be part of the claim."""

import numpy as np
import pytest

import robthermal as rt

CURRENT, BOX = {"m1": (0.0, 0.5), "m2": (0.0, 0.5)}, (280.0, 330.0)
PLACES = {"module": "m1", "lump": "x6", "ambient": "room", "link": "x1-x3", "sensor": "T6", "input": "heater",
          "input or module": "m1", "lump or ambient": "room"}
OWN = {"natural_convection", "radiation", "missing_link", "missing_ambient_link", "hidden_mass", "path_mass",
       "sensor_lag", "sensor_offset", "sensor_gain", "seebeck_slope", "resistance_slope", "conductance_slope",
       "driven_heat"}  # plain system content: a heater with another gain
FOLLOWING = {"heater_power_slope"}  # a heat that the certificates of a network know
COUNTED = {"heat_source", "sensor_self_heating", "periodic_load", "input_feedthrough", "input_gain_slope",
           "lead_heating"}  # as heat
FORCING = {*COUNTED, "ambient_gradient"}


def machine() -> rt.System:
    system = rt.systems.two_module()
    return rt.System(**{field: getattr(system, field) for field in type(system).model_fields}
                     | {"ambients": {"room": {"temperature": 298.15, "coolant": ("x1", "x2")}}}
                     | {"inputs": {"heater": {"lump": "x1", "limits": (0.0, 1.0)}}})


def with_effect(effect: str) -> rt.System:
    kind = rt.thermal.effects()[effect]
    where = [PLACES[what] for what in kind.where]
    if effect == "input_feedthrough":
        where = ["heater", "x6"]
    return rt.thermal.add_effect(machine(), effect, where, {kind.sizes[0]: 0.05}).system


def test_no_range_lets_a_flow_that_is_zero_into_a_claim():
    still = rt.System(**{**dict(machine()), "flows": [{"upstream": "x1", "downstream": "x2", "ambient": "room"}]})
    assert still.effects == ()
    for claim in (lambda range_: rt.certify.contraction(still, current=CURRENT, temperature=BOX, parameters=range_),
                  lambda range_: rt.certify.invariance(still, current=CURRENT, temperature=BOX, parameters=range_),
                  lambda range_: rt.certify.runaway_free(still, current=CURRENT, parameters=range_)):
        with pytest.raises(rt.InputError, match="flows.x1-x2.conductance"):
            claim({"flows.x1-x2.conductance": (0.0, 0.5)})


@pytest.mark.parametrize("effect", sorted(set(rt.thermal.effects()) - OWN - FOLLOWING))
def test_every_new_effect_is_refused_or_is_no_part_of_the_jacobian(effect):
    system = with_effect(effect)
    name, = system.effects
    claims = [lambda: rt.certify.invariance(system, current=CURRENT, temperature=BOX),
              lambda: rt.certify.runaway_free(system, current=CURRENT)] * (effect not in COUNTED)
    claims.append(lambda: rt.certify.runaway(system, setpoint={"m1": 283.15, "m2": 283.15}))
    claims.append(lambda: rt.certify.limit_map(system, ambient=[298.15], setpoint=[283.15], load=[1.0],
                                               temperature=(273.15, 358.15), jobs=1))
    if effect in COUNTED:  # tests/certify/test_own_heat.py shows that they are
        assert rt.certify.runaway_free(system, current=CURRENT).invariance.region["heat"]
    for claim in claims:
        with pytest.raises(rt.InputError, match=f"{name} = .*no certificate covers"):
            claim()
    if effect not in FORCING:
        with pytest.raises(rt.InputError, match=f"{name} = .*no certificate covers"):
            rt.certify.contraction(system, current=CURRENT, temperature=BOX)
        return
    cert = rt.certify.contraction(system, current=CURRENT, temperature=BOX)
    assert cert.holds
    rng = np.random.default_rng(1)
    ours, plain = rt.thermal.Equations(system), rt.thermal.Equations(machine())
    for _ in range(20):
        x, u = rng.uniform(*BOX, len(ours.capacity)), np.array([rng.uniform(), *rng.uniform(0, 0.5, 2), 298.0])
        assert np.abs((ours.jacobian(x, u) - plain.jacobian(x, u)).toarray()).max() == 0.0


def test_heaters_may_be_imperfect_where_only_the_jacobian_counts_but_module_currents_may_not():
    box = {"current": CURRENT, "temperature": BOX}
    heater = machine().with_parameters({"inputs.heater.drive.gain": 0.1, "inputs.heater.drive.delay": 3.0})
    assert rt.certify.contraction(heater, **box).holds
    amplifier = machine().with_parameters({"modules.m1.drive.gain": 0.1})
    with pytest.raises(rt.InputError, match=r"modules\.m1\.drive\.gain"):
        rt.certify.contraction(amplifier, **box)


def test_a_gradient_is_refused_beside_natural_convection():
    system = machine().with_parameters({"lumps.x6.gradient": 5.0})
    breezy = rt.thermal.add_effect(system, "natural_convection", ["x6", "room"], {"gain": 0.02}).system
    with pytest.raises(rt.InputError, match=r"lumps\.x6\.gradient"):
        rt.certify.contraction(breezy, current=CURRENT, temperature=BOX)


def test_an_effect_of_size_zero_is_no_effect():
    system = rt.thermal.add_effect(machine(), "condensation", ["x6"]).system
    assert rt.certify.contraction(system, current=CURRENT, temperature=BOX).holds


def test_no_range_lets_a_temperature_law_into_a_claim():
    first, *others = machine().links
    link = rt.thermal.Link(between=first.between, conductance=first.conductance,
                           temperature_law={"exponent": 0.0, "reference_temperature": 298.15})
    system = machine().model_copy(update={"links": (link, *others)})
    assert rt.certify.contraction(system, current=CURRENT, temperature=BOX).holds
    name = f"links.{link.name}.temperature_law.exponent"
    with pytest.raises(rt.InputError, match=name):
        rt.certify.contraction(system, current=CURRENT, temperature=BOX, parameters={name: (0.0, 0.5)})
    with pytest.raises(rt.InputError, match=name):
        rt.certify.contraction(system.with_parameters({name: 0.5}), current=CURRENT, temperature=BOX)


def test_the_law_refuses_modules_it_does_not_know():
    system = rt.systems.two_module().with_parameters({"modules.m1.thomson": 1e-3})
    with pytest.raises(rt.InputError, match=r"modules\.m1\.thomson"):
        rt.design.feedback_linearization(system)
    assert rt.design.feedback_linearization(system, ["m2"]).names == ("m2",)


def test_a_heater_that_follows_temperature_is_part_of_the_claims():
    """tests/certify/test_following_heaters.py shows what they are; those of single modules do not know it."""
    system = with_effect("heater_power_slope")
    stays = rt.certify.invariance(system, current={"m1": (0.0, 0.0), "m2": (0.0, 0.0)}, temperature=(290.0, 330.0))
    assert stays.holds and "heater powers 'heater' in [0, 1] W" in stays.claim
    assert "heater" in rt.certify.contraction(system, current=CURRENT, temperature=BOX).region["power"]
    for claim in (rt.certify.runaway, rt.certify.usable_current):
        with pytest.raises(rt.InputError, match="power_slope = .*no certificate covers"):
            claim(system, **({"setpoint": {"m1": 283.15, "m2": 283.15}} if claim is rt.certify.runaway else
                             {"temperature": (278.15, 358.15)}))
