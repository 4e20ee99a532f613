"""Heaters whose power follows temperature: closed forms, own simulations, refusals.

A winding of constant current gains power as it warms: P (1 + s (T - w)) against a loss G (T - w) ends at a rise of
P / (G - s P), and runs away from P = G / s on.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import recheck
import robthermal as rt
from robthermal.verification import establish

WATER, C, G = 293.15, 100.0, 1.0


def winding(slope: float, top: float, bottom: float = 0.0, **more) -> rt.System:
    return rt.System(ambients={"water": {"temperature": WATER}}, lumps={"coil": {"capacity": C}},
                     links=[{"between": ("coil", "water"), "conductance": G}], sensors={"T": {"lump": "coil"}},
                     inputs={"drive": {"lump": "coil", "limits": (bottom, top), "power_slope": slope, **more}})


def motor(slope: float, top: float) -> rt.System:
    return rt.System(ambients={"water": {"temperature": WATER}},
                     lumps={"coil": {"capacity": 50.0}, "core": {"capacity": 300.0}},
                     links=[{"between": ("coil", "core"), "conductance": 0.8},
                            {"between": ("core", "water"), "conductance": 0.5}],
                     inputs={"drive": {"lump": "coil", "limits": (-5.0, top), "power_slope": slope}})


def twice_valid(certificate, tmp_path) -> bool:
    certificate.save(tmp_path / "certificate.json")
    return rt.verify(certificate).valid and recheck.check(tmp_path / "certificate.json").status == "valid"


@pytest.mark.parametrize(("slope", "top"), [(0.02, 20.0), (0.02, 40.0), (-0.004, 100.0)])
def test_the_box_is_that_of_the_closed_form(slope, top, tmp_path):
    found = rt.certify.runaway_free(winding(slope, top), current={})
    rise = found.temperature["coil"][1] - WATER
    exact = top / (G - slope * top)
    reserved = 1.005 * top / (0.995 * G - 1.005 * slope * top)  # half a percent of every heat
    assert found.holds and rise == pytest.approx(reserved, abs=0.01)
    assert twice_valid(found.invariance, tmp_path) and twice_valid(found.contraction, tmp_path)
    assert "heater powers 'drive' in [0, " in found.invariance.claim
    tight = rt.certify.invariance(winding(slope, top), current={}, temperature=(WATER - 1.0, WATER + 1.0001 * exact))
    assert tight.holds and twice_valid(tight, tmp_path)
    assert not rt.certify.invariance(winding(slope, top), current={},
                                     temperature=(WATER - 1.0, WATER + 0.9999 * exact)).holds


def test_what_runs_away_is_not_certified():
    """60 W of a slope of 2 % per kelvin gain 1.2 W/K, and 1 W/K is lost."""
    system = winding(0.02, 60.0)
    found = rt.certify.runaway_free(system, current={})
    assert not found.holds and "no box was found" in found.outcome.text
    assert not rt.certify.contraction(system, current={}, temperature=(WATER, 340.0)).holds
    assert rt.certify.contraction(winding(0.02, 49.9), current={}, temperature=(WATER, 340.0)).holds


@pytest.mark.parametrize("method", ["sum", "max", "energy", "lyapunov"])
@pytest.mark.parametrize(("slope", "powers"), [(0.02, (-10.0, 20.0)), (-0.02, (-10.0, 20.0)), (0.0, (0.0, 20.0))])
def test_the_rate_is_that_of_the_slowest_power(method, slope, powers):
    section = {"lumps": {"coil": {"capacity": C}}, "ambients": ["water"], "modules": {},
               "links": [{"between": ["coil", "water"], "conductance": G}],
               "inputs": {"drive": {"lump": "coil", "power_slope": slope, "reference_temperature": WATER}}}
    region = {"temperature": [280.0, 400.0], "current": {}, "power": {"drive": list(powers)}}
    exact = (G - max(slope * power for power in powers)) / C
    own = {"sum": {"weights": [1.0]}, "max": {"weights": [1.0]}, "energy": {}, "lyapunov": {"matrix": [[1.0]]}}[method]
    for factor, holds in ((0.999999, True), (1.000001, False)):
        cert = establish("contraction", system=section, region=region, made_by={}, margin={},
                         evidence={"method": method, "rate": factor * exact, **own})
        assert cert.holds is holds
        content = {"format": cert.format, "kind": cert.kind, "claim": cert.claim, "system": section, "region": region,
                   "evidence": cert.evidence, "margin": {}, "made_by": {}}
        assert recheck.check(content).status == ("valid" if holds else "not valid")


def test_no_switching_of_the_power_leaves_the_box():
    """By scipy's integrator, from every corner of the box, with powers held at random for random times."""
    system = motor(0.0039, 40.0)
    found = rt.certify.runaway_free(system, current={})
    low, high = np.array([found.temperature[name] for name in ("coil", "core")]).T
    assert found.holds and high[0] > 450.0
    rng, worst = np.random.default_rng(3), -np.inf
    for corner in ((0, 0), (0, 1), (1, 0), (1, 1)):
        x = np.where(corner, high, low)
        for held in [40.0, -5.0, 40.0, *rng.choice([-5.0, 40.0], 12), *rng.uniform(-5.0, 40.0, 6)]:
            def rate(_, T, q=held):
                heat = q * (1 + 0.0039 * (T[0] - WATER))
                across = 0.8 * (T[0] - T[1])
                return [(heat - across) / 50.0, (across - 0.5 * (T[1] - WATER)) / 300.0]
            run = solve_ivp(rate, (0.0, float(rng.uniform(50, 6000))), x, rtol=1e-9, atol=1e-9)
            x = run.y[:, -1]
            worst = max(worst, float((run.y - high[:, None]).max()), float((low[:, None] - run.y).max()))
    assert worst < 1e-6


def test_ranges_of_slope_and_gain_are_part_of_the_claim():
    system = winding(0.004, 20.0)
    reserved = 1.005 * 25.0 / (0.995 * G - 1.005 * 0.006 * 25.0)  # gain up to 1.25, slope up to 0.006
    ranges = {"inputs.drive.power_slope": (0.003, 0.006), "inputs.drive.gain": (0.9, 1.25)}
    found = rt.certify.runaway_free(system, current={}, parameters=ranges)
    assert found.holds and found.temperature["coil"][1] - WATER == pytest.approx(reserved, abs=0.01)
    assert found.invariance.region["power"] == {"drive": [0.0, 25.0]}
    assert "'inputs.drive.power_slope' in [0.003, 0.006]" in found.contraction.claim
    flat = winding(0.0, 20.0)
    assert "power" not in rt.certify.runaway_free(flat, current={}).invariance.region
    unsure = rt.certify.runaway_free(flat, current={}, parameters={"inputs.drive.power_slope": (-0.001, 0.001)})
    assert unsure.holds and unsure.invariance.region["power"] == {"drive": [0.0, 20.0]}


def test_other_heat_comes_on_top():
    found = rt.certify.runaway_free(winding(0.02, 20.0), current={}, heat={"coil": (0.0, 6.0)})
    reserved = 1.005 * 26.0 / (0.995 * G - 1.005 * 0.02 * 20.0)
    assert found.temperature["coil"][1] - WATER == pytest.approx(reserved, abs=0.01)
    assert rt.certify.heater_heat(winding(0.02, 20.0)) == {}


@pytest.mark.parametrize(("change", "message"), [
    ({"limits": None}, "has no limits"),
    ({"drive": {"gain": 0.1}}, r"drive.gain = 0.1 and inputs.drive.power_slope together"),
    ({"feedthrough": {"lump": "core", "share": 0.2}}, "feedthrough.share = 0.2 and .* together")])
def test_what_is_more_than_linear_in_temperature_is_refused(change, message):
    system = motor(0.004, 20.0)
    heater = {"lump": "coil", "limits": (-5.0, 20.0), "power_slope": 0.004, **change}
    other = rt.System(**{field: getattr(system, field) for field in type(system).model_fields}
                      | {"inputs": {"drive": heater}})
    for claim in (lambda: rt.certify.contraction(other, current={}, temperature=(280.0, 400.0)),
                  lambda: rt.certify.invariance(other, current={}, temperature=(280.0, 400.0)),
                  lambda: rt.certify.runaway_free(other, current={})):
        with pytest.raises(rt.InputError, match=message):
            claim()


def test_a_delayed_heater_is_covered():
    system = winding(0.004, 20.0).with_parameters({"inputs.drive.drive.delay": 5.0})
    assert rt.certify.contraction(system, current={}, temperature=(280.0, 400.0)).holds


def test_claims_that_do_not_know_it_refuse():
    system = winding(0.004, 20.0)
    with pytest.raises(rt.InputError, match=r"power_slope = 0\.004 is an effect"):
        rt.certify.gains(system, current={}, temperature=(280.0, 400.0))
    with pytest.raises(rt.InputError, match="the powers of 'drive' are stated at this temperature"):
        rt.certify.runaway_free(system, current={}, parameters={"ambients.water.temperature": (290.0, 296.0)})
    section = rt.certify.invariance(system, current={}, temperature=(280.0, 400.0)).system
    with pytest.raises(rt.InputError, match="'power_slope' is an effect that this claim does not take into account"):
        establish("gain", system=section, region={"temperature": [280.0, 400.0], "current": {}, "power": {
            "drive": [0.0, 20.0]}}, evidence={"rate": 0.0, "gains": {"heat": {"coil": [2.0]}}}, made_by={})


def test_the_machine_is_named_by_its_slope():
    a, b, plain = (rt.certify.invariance(winding(slope, 20.0), current={}, temperature=(280.0, 400.0),
                                         heat={} if slope else {"coil": (0.0, 20.0)})
                   for slope in (0.004, 0.005, 0.0))
    machines = {cert.claim.split("machine ")[1][:12] for cert in (a, b, plain)}
    assert len(machines) == 3
    assert not rt.verification.same_system(a, b.system)


def simulated(system: rt.System, power: float) -> rt.Record:
    """An hour at one power."""
    return rt.thermal.simulate(system, rt.Record(sample_time=10.0, inputs=np.full(360, power),
                                                 outputs=np.zeros((360, 0)), input_names=["drive"], output_names=[]))


def test_a_range_of_heat_wide_enough_for_the_box_covers_a_heat_that_rises_with_temperature():
    """As the refusal of other effects says: 20 W at 20 °C are 36 W at 60 °C."""
    damp = rt.thermal.add_effect(winding(0.0, 20.0), "condensation", ["coil"], {"conductance": 0.1}).system
    with pytest.raises(rt.InputError, match="condensation.* wide enough for every temperature in the box"):
        rt.certify.invariance(damp, current={}, temperature=(293.0, 333.15))
    bare = winding(0.0, 20.0)
    box = rt.certify.invariance(bare, current={}, temperature=(293.0, 333.15), heat={"coil": (0.0, 36.0)})
    assert box.holds and rt.verify(box).valid
    hottest = simulated(winding(0.02, 20.0), 20.0).outputs.max()
    assert hottest == pytest.approx(293.15 + 20.0 / 0.6, abs=0.1) and hottest < 333.15
    assert not rt.certify.invariance(bare, current={}, temperature=(293.0, 313.15), heat={"coil": (0.0, 28.0)}).holds


def test_contraction_without_such_a_heat_says_nothing_of_it():
    """Certified without the slope; with it the heat grows faster than the loss, and the winding runs away."""
    system, bare = winding(0.02, 60.0), winding(0.0, 60.0)
    assert rt.certify.contraction(bare, current={}, temperature=(280.0, 400.0)).holds
    assert not rt.certify.contraction(system, current={}, temperature=(280.0, 400.0)).holds
    with pytest.raises(rt.Diverged):
        simulated(system, 60.0)
