"""Usable currents of random machines: never left at 100 %, and not much below what an own simulation survives."""

import numpy as np
import pytest
from own_simulation import Network, switching
from random_machines import machine, simulated_limit

import robthermal as rt
from robthermal.certify._sections import system_section
from robthermal.verification import Certificate, establish


@pytest.mark.exhaustive
def test_random_machines_stay_in_their_boxes_and_use_most_of_what_they_bear() -> None:
    rng, ratios = np.random.default_rng(0), []
    for _ in range(9):
        case = machine(rng)
        system, network = case.system, Network(case.system)
        found = rt.certify.usable_current(system, temperature=case.temperature, ambient=case.ambient, heat=case.heat,
                                          lower=case.lower)
        assert found.holds and rt.verify(found.invariance).valid and rt.verify(found.contraction).valid
        box = np.array(list(found.box.values())).T
        assert box[1].max() <= case.temperature[1]
        assert case.lower == "reported" or box[0].min() >= case.temperature[0]
        low, high = np.array(list(found.range.values())).T
        for k in range(4):
            room = np.array([case.ambient["room"][k % 2]])
            load = np.array([case.heat.get(name, (0.0, 0.0))[k // 2] for name in system.lumps])
            start = np.where(rng.random(len(system.lumps)) < 0.5, box[0], box[1])
            constant = low + rng.random(len(low)) * (high - low)
            for states in (network.run(start, 8 * network.slowest(), constant, room, load)[1],
                           switching(network, start, low, high, rng, 5, room, load)):
                assert (states >= box[0] - 1e-4).all() and (states <= box[1] + 1e-4).all()
        others = min(found.limits["runaway"].current, found.limits["rating"].current, 30.0)
        ratios.append(found.current / simulated_limit(case, others))
    assert min(ratios) > 0.7 and np.median(ratios) > 0.95, ratios


def proven_again(certificate: Certificate, system: rt.System) -> bool:
    """The same claim with the same evidence about another machine."""
    return bool(establish(certificate.kind, system=system_section(system), region=certificate.region,
                          evidence=certificate.evidence, made_by=certificate.made_by).holds)


def test_certificates_survive_the_errors_of_a_calibration() -> None:
    """Three standard deviations of 0.1 % in random directions; with 10 % more Seebeck coefficient they must not."""
    system, rng = rt.systems.two_module(), np.random.default_rng(1)
    found = rt.certify.usable_current(system, temperature=(278.15, 358.15), lower="reported")
    names = [name for name in system.parameter_names if name.endswith((".capacity", ".conductance", ".value"))]
    for _ in range(6):
        change = rng.standard_normal(len(names))
        change *= 3e-3 / np.linalg.norm(change)
        other = system.with_parameters({name: system.parameter(name) * (1 + e)
                                        for name, e in zip(names, change, strict=True)})
        assert proven_again(found.invariance, other) and proven_again(found.contraction, other)
    worse = system.with_parameters({"modules.m1.seebeck.value": 1.1 * system.parameter("modules.m1.seebeck.value")})
    assert not proven_again(found.invariance, worse)
