"""Uncertain parameters: closed forms, sampled machines of random networks, malformed ranges."""

from __future__ import annotations

import certificate_truth as truth
import numpy as np
import pytest
from uncertain_truth import machines, names_of, spans

from robthermal.errors import InputError
from robthermal.verification import establish

ROD = {"lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
       "links": [{"between": ["rod", "room"], "conductance": 0.5}]}
METHODS = {"sum": {"weights": [1.0]}, "max": {"weights": [1.0]}, "energy": {}, "lyapunov": {"matrix": [[1.0]]}}


def rod(method, rate, parameters):
    region = {"temperature": [280.0, 350.0], "current": {}, "parameters": parameters}
    return establish("contraction", system=ROD, region=region, made_by={}, margin={},
                     evidence={"method": method, "rate": rate, **METHODS[method]})


@pytest.mark.parametrize("method", METHODS)
def test_the_least_conductance_and_the_largest_capacity_decide(method):
    loss = {"links.rod-room.conductance": [0.4, 0.7]}
    assert rod(method, 0.0399999, loss).holds and not rod(method, 0.0400001, loss).holds
    if method != "lyapunov":
        both = {**loss, "lumps.rod.capacity": [8.0, 16.0]}
        assert rod(method, 0.0249999, both).holds and not rod(method, 0.0250001, both).holds


def test_the_claim_names_the_ranges():
    claim = rod("sum", 0.01, {"links.rod-room.conductance": [0.4, 0.7]}).claim
    assert "'links.rod-room.conductance' in [0.4, 0.7]" in claim


@pytest.mark.exhaustive
def test_no_machine_of_the_ranges_violates_an_accepted_claim():
    rng = np.random.default_rng(11)
    accepted = violated = 0
    for k in range(120):
        method = list(METHODS)[k % 4]
        system = truth.random_system(rng, modules=1, nonlinear=bool(rng.random() < 0.3), wild=bool(rng.random() < 0.4))
        names = [f"lumps.{name}.capacity" for name in system["lumps"]] * (method != "lyapunov")
        ranges = spans(system, names + 2 * names_of(system, nonlinear=True), rng, 4)
        region = truth.box(system, float(rng.uniform(0.5, 6)))
        evidence = truth.evidence_for(method, system, region, float(10 ** rng.uniform(-2.5, -1.3)), rng)
        cert = establish("contraction", system=system, region={**region, "parameters": ranges}, evidence=evidence,
                         made_by={}, margin={})
        worst = max(truth.violation({"system": other, "region": region, "evidence": evidence}, rng, 12)
                    for other in machines(system, ranges, rng, 8))
        assert not (cert.holds and worst > 1e-9), (cert.claim, worst)
        accepted += cert.holds
        violated += worst > 0
    assert accepted > 20 and violated > 20


@pytest.mark.parametrize(("parameters", "message"), [
    ({"lumps.attic.capacity": [1, 2]}, "no such number"), ({"links.rod-attic.conductance": [1, 2]}, "no such number"),
    ({"modules.m.seebeck.value": [1, 2]}, "no such number"), ({"rod": [1, 2]}, "no such number"),
    ({"lumps.rod.capacity": [0, 2]}, "not positive"), ({"links.rod-room.conductance": [-1, 2]}, "negative"),
    ({"links.rod-room.conductance": [2, 1]}, "is empty"), ({"links.rod-room.conductance": 2}, "not a list"),
    ([["links.rod-room.conductance", 1, 2]], "not an object")])
def test_malformed_ranges_are_refused(parameters, message):
    with pytest.raises(InputError, match=message):
        rod("sum", 0.01, parameters)


NONLINEAR = {**ROD, "links": [{"between": ["rod", "room"], "conductance": 0.5, "radiation": 2e-10,
                          "natural": {"gain": 0.1, "exponent": 0.0}}]}


@pytest.mark.parametrize("method", ["sum", "max", "energy"])
def test_the_least_convection_and_radiation_decide(method):
    """Exponent 0: the rod loses g + k + 4 c T³ per kelvin, least at 280 K."""
    ranges = {"links.rod-room.natural.gain": [0.05, 0.2], "links.rod-room.radiation": [1e-10, 1e-9]}
    region = {"temperature": [280.0, 350.0], "current": {}, "parameters": ranges}
    exact = (0.5 + 0.05 + 4e-10 * 280.0**3) / 10.0
    for rate, holds in ((exact * (1 - 1e-9), True), (exact * (1 + 1e-9), False)):
        cert = establish("contraction", system=NONLINEAR, region=region, made_by={}, margin={},
                         evidence={"method": method, "rate": rate, **METHODS[method]})
        assert cert.holds is holds, cert.reason
    assert "'links.rod-room.natural.gain' in [0.05, 0.2]" in cert.claim


def test_a_box_is_never_left_whatever_convection_and_radiation():
    """Load 10 W: out flow at the upper face is least at the least coefficients, the heat that comes in at the largest.
    """
    def region(upper, **more):
        return {"temperature": [290.0, upper], "current": {}, "ambient": {"room": [290.0, 300.0]}, "parameters": {
            "links.rod-room.natural.gain": [0.05, 0.2], "links.rod-room.radiation": [1e-10, 1e-9]}, **more}

    def left(upper):
        return 10.0 - 0.55 * (upper - 300.0) - 1e-10 * (upper**4 - 300.0**4)

    edge = 300.0 + 10.0 / 0.55
    for _ in range(50):
        edge += left(edge) / (0.55 + 4e-10 * edge**3)
    for upper, holds in ((edge + 1e-6, True), (edge - 1e-6, False)):
        cert = establish("invariance", system=NONLINEAR, region=region(upper, heat={"rod": [0.0, 10.0]}), made_by={},
                         evidence={}, margin={})
        assert cert.holds is holds, cert.reason
    inflow = (0.5 + 0.2) * 10.0 + 1e-9 * (330.0**4 - 320.0**4)  # from a room of 330 K, the upper face at 320 K
    for load, holds in ((inflow + 1e-6, True), (inflow - 1e-6, False)):
        warm = region(320.0, temperature=[200.0, 320.0], ambient={"room": [290.0, 330.0]}, heat={"rod": [-load, -load]})
        assert establish("invariance", system=NONLINEAR, region=warm, made_by={}, evidence={}, margin={}).holds is holds


@pytest.mark.parametrize(("name", "pair", "message"), [
    ("links.rod-room.natural.gain", [-0.1, 0.2], "negative"), ("links.rod-room.radiation", [-1e-10, 1e-9], "negative"),
    ("links.rod-room.natural.gain", [0.2, 0.3], "excludes the number of the system"),
    ("links.rod-room.radiation", [0.0, 1e-10], "excludes the number of the system"),
    ("links.rod-room.natural.exponent", [0.0, 0.5], "no such number"),
    ("lumps.rod.capacity", [11.0, 12.0], "excludes the number of the system")])
def test_ranges_of_convection_and_radiation_contain_the_number_of_the_system(name, pair, message):
    region = {"temperature": [280.0, 350.0], "current": {}, "parameters": {name: pair}}
    with pytest.raises(InputError, match=message):
        establish("contraction", system=NONLINEAR, region=region, made_by={},
                  evidence={"method": "energy", "rate": 0.0})


def test_two_links_of_one_name_cannot_be_meant():
    system = {**ROD, "links": ROD["links"] * 2}
    region = {"temperature": [280.0, 350.0], "current": {}, "parameters": {"links.rod-room.conductance": [0.4, 0.6]}}
    with pytest.raises(InputError, match="no such number"):
        establish("contraction", system=system, region=region, made_by={}, evidence={"method": "energy", "rate": 0.0})


def test_a_box_is_never_left_whatever_the_conductance():
    """A heater of 10 W holds the rod 10/g K above the room: at most 25 K for g >= 0.4 W/K."""
    region = {"temperature": [290.0, 325.0], "current": {}, "ambient": {"room": [290.0, 300.0]},
              "heat": {"rod": [0.0, 10.0]}, "parameters": {"links.rod-room.conductance": [0.4, 0.6],
                                                          "lumps.rod.capacity": [5.0, 20.0]}}
    assert establish("invariance", system=ROD, region=region, made_by={}, evidence={}).holds
    region["parameters"] = {"links.rod-room.conductance": [0.3999, 0.6]}
    refused = establish("invariance", system=ROD, region=region, made_by={}, evidence={})
    assert not refused.holds and "upper face" in refused.reason


def test_no_machine_of_the_ranges_leaves_an_accepted_box():
    """Sampled heat flows on the faces of the box."""
    rng = np.random.default_rng(3)
    accepted = violated = 0
    for k in range(60):
        system = truth.random_system(rng, modules=1, nonlinear=k % 3 == 0, wild=k % 2 == 0)
        ranges = spans(system, names_of(system, nonlinear=True), rng, 4)
        region = {**truth.box(system, float(rng.uniform(0.05, 1.5)), 265.0, 340.0), "ambient": {"room": [290.0, 300.0]}}
        cert = establish("invariance", system=system, region={**region, "parameters": ranges}, evidence={}, made_by={},
                         margin={})
        worst = min(least_inward(other, region, rng) for other in machines(system, ranges, rng, 5))
        assert not (cert.holds and worst < -1e-9), cert.claim
        accepted += cert.holds
        violated += worst < 0
    assert accepted > 8 and violated > 8


def least_inward(system, region, rng):
    """Least sampled heat into the box on its faces [W]."""
    least, n = np.inf, len(system["lumps"])
    for x, currents in truth.points(system, region, rng, 10):
        for k, (face, sign) in ((k, side) for k in range(n) for side in ((340.0, -1), (265.0, 1))):
            y = x.copy()
            y[k] = face
            flow = truth.heat(system, y, currents, {"room": 300.0 if sign < 0 else 290.0})
            least = min(least, sign * flow[k])
    return least
