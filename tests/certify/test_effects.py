"""A certificate that leaves out a heat is wrong: every effect is refused, or is shown not to be part of the claim."""

import numpy as np
import pytest

import robthermal as rt

CURRENT, BOX = {"m1": (0.0, 0.5), "m2": (0.0, 0.5)}, (280.0, 330.0)
PLACES = {"module": "m1", "lump": "x6", "ambient": "room", "link": "x1-x3", "sensor": "T6", "input": "heater",
          "input or module": "m1"}
OWN = {"natural_convection", "radiation", "missing_link", "missing_ambient_link", "hidden_mass", "sensor_lag",
       "sensor_offset", "sensor_gain", "seebeck_slope", "resistance_slope", "conductance_slope"}  # plain system content
FORCING = {"heat_source", "sensor_self_heating", "ambient_gradient", "periodic_load", "input_feedthrough",
           "input_gain_slope"}


def machine() -> rt.System:
    system = rt.systems.two_module()
    return rt.System(**{field: getattr(system, field) for field in type(system).model_fields}
                     | {"inputs": {"heater": {"lump": "x1", "limits": (0.0, 1.0)}}})


def with_effect(effect: str) -> rt.System:
    kind = rt.thermal.effects()[effect]
    where = [PLACES[what] for what in kind.where]
    if effect == "input_feedthrough":
        where = ["heater", "x6"]
    return rt.thermal.add_effect(machine(), effect, where, {kind.sizes[0]: 0.05}).system


@pytest.mark.parametrize("effect", sorted(set(rt.thermal.effects()) - OWN))
def test_every_new_effect_is_refused_or_is_no_part_of_the_jacobian(effect):
    system = with_effect(effect)
    name, = system.effects
    claims = [lambda: rt.certify.invariance(system, current=CURRENT, temperature=BOX),
              lambda: rt.certify.runaway_free(system, current=CURRENT),
              lambda: rt.certify.runaway(system, setpoint={"m1": 283.15, "m2": 283.15})]
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


def test_the_law_refuses_modules_it_does_not_know():
    system = rt.systems.two_module().with_parameters({"modules.m1.thomson": 1e-3})
    with pytest.raises(rt.InputError, match=r"modules\.m1\.thomson"):
        rt.design.feedback_linearization(system)
    assert rt.design.feedback_linearization(system, ["m2"]).names == ("m2",)


def winding(power: float, slope: float) -> tuple[rt.System, rt.System, rt.Record]:
    """A winding in water, the same without its slope, and an hour at full power: T - 293.15 K ends at P/(1 - s P)."""
    system = rt.System(ambients={"water": {"temperature": 293.15}}, lumps={"coil": {"capacity": 100.0}},
                       links=[{"between": ("coil", "water"), "conductance": 1.0}], sensors={"T": {"lump": "coil"}},
                       inputs={"drive": {"lump": "coil", "power_slope": slope}})
    drive = rt.Record(sample_time=10.0, inputs=np.full(360, power), outputs=np.zeros((360, 0)), input_names=["drive"],
                      output_names=[])
    return system, system.with_parameters({"inputs.drive.power_slope": 0.0}), drive


def test_a_range_of_heat_wide_enough_for_the_box_covers_a_heat_that_rises_with_temperature():
    """As the refusal says: 20 W at 20 °C are 36 W at 60 °C."""
    system, bare, drive = winding(20.0, 0.02)
    with pytest.raises(rt.InputError, match="power_slope.* wide enough for every temperature in the box"):
        rt.certify.invariance(system, current={}, temperature=(293.0, 333.15))
    box = rt.certify.invariance(bare, current={}, temperature=(293.0, 333.15), heat={"coil": (0.0, 36.0)})
    assert box.holds and rt.verify(box).valid
    hottest = rt.thermal.simulate(system, drive).outputs.max()
    assert hottest == pytest.approx(293.15 + 20.0 / 0.6, abs=0.1) and hottest < 333.15
    assert not rt.certify.invariance(bare, current={}, temperature=(293.0, 313.15), heat={"coil": (0.0, 28.0)}).holds


def test_contraction_without_such_a_heat_says_nothing_of_it():
    """Certified without the slope; with it the heat grows faster than the loss, and the winding runs away."""
    system, bare, drive = winding(60.0, 0.02)
    assert rt.certify.contraction(bare, current={}, temperature=(280.0, 400.0)).holds
    with pytest.raises(rt.InputError, match="contraction says nothing then of a heat that rises"):
        rt.certify.contraction(system, current={}, temperature=(280.0, 400.0))
    with pytest.raises(rt.Diverged):
        rt.thermal.simulate(system, drive)
