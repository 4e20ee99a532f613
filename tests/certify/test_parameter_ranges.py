"""Ranges of parameters in every claim on currents: what is covered, ignored, refused, and that claims are robust."""

import numpy as np
import pytest
from own_simulation import Network
from random_machines import machine

import robthermal as rt
from robthermal.certify._faces import Faces
from robthermal.verification import establish

RANGES = {"modules.m.seebeck.value": (0.049, 0.051), "modules.m.resistance.value": (2.9, 3.1),
          "links.h-room.conductance": (1.9, 2.1), "links.c-room.conductance": (0.0, 0.1)}


def bench(**extra):
    module = {"hot": "h", "cold": "c", "seebeck": 0.05, "resistance": 3.0, "conductance": 0.3}
    return rt.System(
        ambients={"room": {"temperature": 295.0}}, modules={"m": module}, **extra,
        links=[{"between": ("h", "room"), "conductance": 2.0, "natural": {"gain": 0.05, "exponent": 0.25}},
               {"between": ("c", "room"), "conductance": 0.05}],
        lumps={"h": {"capacity": 40.0}, "c": {"capacity": 10.0}})


HEATER = {"inputs": {"foil": {"lump": "h", "gain": 2.0, "limits": (0.0, 1.0)}},
          "sensors": {"T": {"lump": "c", "noise": 0.01}}}


def test_what_a_claim_does_not_depend_on_is_ignored() -> None:
    system = bench(**HEATER)
    others = {"sensors.T.time_constant": (0.0, 3.0), "inputs.foil.gain": (1.0, 9.0), "lumps.c.disturbance": (0.0, 1.0)}
    heat = {"h": (0.0, 2.0)}
    plain = rt.certify.runaway_free(system, current={"m": (0.0, 1.0)}, heat=heat)
    given = rt.certify.runaway_free(system, current={"m": (0.0, 1.0)}, heat=heat, parameters=others)
    assert given.holds and given.temperature == plain.temperature and "parameters" not in given.invariance.region
    certain = rt.certify.contraction(system, current={"m": (0.0, 1.0)}, temperature=(270.0, 330.0), parameters=others)
    assert certain.holds and "parameters" not in certain.region


def test_gain_of_a_heater_widens_its_heat() -> None:
    system, gain = bench(**HEATER), {"inputs.foil.gain": (1.9, 2.5)}
    found = rt.certify.runaway_free(system, current={"m": (0.0, 1.0)}, parameters=gain)
    assert [float(end) for end in found.invariance.region["heat"]["h"]] == [0.0, 2.5]
    imperfect = {"inputs.foil.drive.gain": (-0.1, 0.1)}
    more = rt.certify.runaway_free(system, current={"m": (0.0, 1.0)}, parameters=imperfect)
    assert more.invariance.region["heat"]["h"] == pytest.approx([0.0, 2.2])


@pytest.mark.parametrize("name", ["modules.m.reference_temperature", "modules.m.thomson",
                                  "links.h-room.natural.exponent", "lumps.h.gradient"])
def test_what_no_checker_covers_is_refused_by_name(name) -> None:
    system = bench(**HEATER)
    value = system.parameter(name)
    with pytest.raises(rt.InputError, match=f"{name} cannot be covered"):
        rt.certify.usable_current(system, temperature=(250.0, 350.0), parameters={name: (value - 0.01, value + 0.01)})
    with pytest.raises(rt.InputError, match="no parameter"):
        rt.certify.usable_current(system, temperature=(250.0, 350.0), parameters={"modules.n.thomson": (0.0, 1.0)})


def test_ambient_parameter_is_the_range_of_the_ambient() -> None:
    found = rt.certify.usable_current(bench(), temperature=(250.0, 350.0),
                                      parameters={"ambients.room.temperature": (290.0, 300.0)})
    assert [float(end) for end in found.invariance.region["ambient"]["room"]] == [290.0, 300.0]


def test_robust_claim_covers_the_corners_and_costs_current() -> None:
    system, stated = bench(), (250.0, 330.0)
    nominal = rt.certify.usable_current(system, temperature=stated)
    robust = rt.certify.usable_current(system, temperature=stated, parameters=RANGES)
    assert robust.holds and rt.verify(robust.invariance).valid and rt.verify(robust.contraction).valid
    assert 0.6 * nominal.current < robust.current < nominal.current
    assert set(robust.invariance.region["parameters"]) == set(RANGES)
    box, rng = np.array(list(robust.box.values())).T, np.random.default_rng(0)
    for _ in range(12):
        numbers = {name: float(rng.choice(pair)) for name, pair in RANGES.items()}
        network = Network(system.with_parameters(numbers))
        for current in (0.0, robust.current):
            _, states = network.run(np.where(rng.random(2) < 0.5, *box), 2000.0, np.array([current]))
            assert (states >= box[0] - 1e-5).all() and (states <= box[1] + 1e-5).all()
        single = rt.certify.usable_current(system.with_parameters(numbers), temperature=stated)
        assert single.current >= robust.current * (1 - 2e-4)


def test_the_parameter_that_limits_is_named() -> None:
    ranges = {"modules.m.seebeck.value": (0.0499, 0.0501), "links.h-room.conductance": (0.8, 2.1)}
    robust = rt.certify.usable_current(bench(), temperature=(250.0, 330.0), parameters=ranges)
    assert robust.limiting_parameter == "links.h-room.conductance"
    broken = rt.certify.runaway_free(bench(), current={"m": (0.0, 4.0)},
                                     parameters=ranges | {"links.h-room.conductance": (0.0, 2.1)})
    assert not broken.holds and broken.limiting_parameter == "links.h-room.conductance"
    assert rt.certify.runaway_free(bench(), current={"m": (0.0, 4.0)}).holds


def test_ranges_cost_the_runaway_bound_what_the_worst_corner_costs() -> None:
    two = rt.systems.two_module()
    ranges = {"modules.m1.resistance.value": (4.5, 4.8), "links.x1-room.conductance": (0.66, 0.72)}
    points = dict.fromkeys(two.modules, 278.15)
    found = rt.certify.usable_current(two, temperature=(273.15, 358.15), lower="reported", setpoint=points,
                                      parameters=ranges)
    corners = [rt.thermal.fold(two.with_parameters({"modules.m1.resistance.value": R, "links.x1-room.conductance": g}),
                               points).current[-1].min() for R in (4.5, 4.8) for g in (0.66, 0.72)]
    assert found.limits["runaway"].current == pytest.approx(0.98 * min(corners), rel=1e-6)


def test_picture_of_the_faces_is_what_the_checker_proves() -> None:
    """Largest outward heat of random boxes, in floating point and exactly."""
    rng = np.random.default_rng(3)
    for _ in range(12):
        case = machine(rng)
        system = case.system
        box = np.sort(rng.uniform(270.0, 330.0, (2, len(system.lumps))), axis=0)
        current = {name: tuple(np.sort(rng.uniform(-2.0, 2.0, 2))) for name in system.modules}
        ranges = {f"links.{link.name}.conductance": (0.9 * link.conductance, 1.2 * link.conductance)
                  for link in system.links[:2]}
        ranges |= {f"modules.{name}.seebeck.value": (0.9 * module.seebeck.value, 1.1 * module.seebeck.value)
                   for name, module in system.modules.items()}
        faces = Faces(system, case.ambient, case.heat, ranges)
        found = faces.around(current, box).heat - np.tile(faces.margin, 2)
        named = {name: tuple(pair) for name, pair in zip(system.lumps, box.T.tolist(), strict=True)}
        exact = rt.certify.invariance(system, current=current, temperature=named, ambient=case.ambient,
                                      heat=case.heat or None, parameters=ranges)
        assert not exact.holds
        least = float(establish("invariance", system=exact.system, region=exact.region, evidence={}, made_by={}).margin
                      .get("heat", 0.0))
        assert least == 0.0
        said = float(exact.reason.split(" can be ")[1].split(" W")[0])
        assert said == pytest.approx(-found.max(), rel=2e-2, abs=1e-3)
