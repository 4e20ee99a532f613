"""The largest bandwidth that keeps margins: by a scan of its own, for corners, and the reason where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from distant_plate import machine

import robthermal as rt

REGULATE = {"m1": "T_plate"}
RANGES = {"links.stage-plate.conductance": (0.6, 1.0), "lumps.plate.capacity": (50.0, 70.0)}
WANTED = {"gain": 2.0, "phase": 45.0, "modulus": 0.5}


@pytest.fixture(scope="module")
def law():
    return rt.design.feedback_linearization(machine())


def kept(law, bandwidth, parameters, sample_time=2.0):
    """Whether the PI of a bandwidth keeps the margins at every corner, each plant as its own nominal one."""
    plant = rt.design.cold_side(law, regulate=REGULATE)
    try:
        pi = rt.design.pid(plant, bandwidth=bandwidth, sample_time=sample_time)
    except rt.InputError:
        return False
    found = rt.design.loop_margins(law, pi, 288.15, regulate=REGULATE, parameters=parameters)
    return all(one.stable and all(getattr(one, key) >= least for key, least in WANTED.items())
               for plant in found.plants for one in plant.margins.values())


@pytest.mark.exhaustive
@pytest.mark.parametrize("parameters", [{}, RANGES])
def test_it_is_the_largest_bandwidth(law, parameters):
    found = rt.design.tune_pi(law, 288.15, margins=WANTED, sample_time=2.0, regulate=REGULATE, parameters=parameters)
    assert found.outcome.code == "tuned"
    tried = [found.bandwidth * ratio for ratio in (0.5, 0.98, 1.02, 1.5, 4.0)]
    assert [kept(law, bandwidth, parameters) for bandwidth in tried] == [True, True, False, False, False]
    assert found.margins is not None and found.controller is not None
    worst = found.margins.worst("m1")
    assert min(worst.gain / 2.0, worst.phase / 45.0, worst.modulus / 0.5) == pytest.approx(1.0, abs=0.01)


@pytest.mark.exhaustive
def test_ranges_cost_bandwidth(law):
    nominal, robust = (rt.design.tune_pi(law, 288.15, margins=WANTED, sample_time=2.0, regulate=REGULATE,
                                         parameters=p).bandwidth for p in (None, RANGES))
    assert 0.5 * nominal < robust < 0.99 * nominal


@pytest.mark.parametrize(("lag", "delay", "sample_time", "regulate", "words"), [
    (400.0, 0.0, 1.0, REGULATE, "the lag of T_plate"), (0.0, 120.0, 5.0, REGULATE, "the delay of T_plate"),
    (0.0, 0.0, 1.0, {"m1": "plate"}, "the network between stage and plate"),
    (20.0, 0.0, 20.0, None, "the sample time")])
def test_what_limits_the_loop_is_named(lag, delay, sample_time, regulate, words):
    law = rt.design.feedback_linearization(machine(lag=lag, delay=delay))
    found = rt.design.tune_pi(law, 288.15, margins=WANTED, sample_time=sample_time, regulate=regulate)
    assert found.outcome.code == "tuned" and found.limited_by.startswith(words) and words in found.outcome.text


def test_no_bandwidth_is_the_answer_with_the_reason():
    """A delay margin of thirty years takes a slower loop than any that is tried."""
    law = rt.design.feedback_linearization(machine())
    found = rt.design.tune_pi(law, 288.15, margins={"modulus": 0.5, "delay": 1e9}, sample_time=2.0, regulate=REGULATE)
    assert (found.outcome.code, found.controller, found.bandwidth) == ("not_tuned", None, 0.0)
    assert "No bandwidth above" in found.outcome.text and "delay 1e+09 s" in found.outcome.text


def test_plants_that_cannot_hold_the_set_point_are_the_reason(law):
    found = rt.design.tune_pi(law, 281.15, margins=WANTED, sample_time=2.0, regulate=REGULATE,
                              parameters={"modules.m1.seebeck.value": (0.02, 0.0537)})
    assert found.outcome.code == "not_tuned" and "cannot be held" in found.outcome.text


def test_two_modules(system):
    law = rt.design.feedback_linearization(system)
    found = rt.design.tune_pi(law, {"m1": 288.15, "m2": 290.15}, margins=WANTED, sample_time=1.0)
    assert found.outcome.code == "tuned" and found.margins is not None
    for loop in ("m1", "m2"):
        worst = found.margins.worst(loop)
        assert worst.gain >= 2.0 and worst.phase >= 45.0 and worst.modulus >= 0.5
    assert np.isfinite(found.bandwidth)


@pytest.mark.parametrize(("wanted", "words"), [
    ({}, "no margin is given"), ({"speed": 1.0}, "no margin 'speed'"), ({"gain": 0.9}, "above 1"),
    ({"phase": 90.0}, "below 90"), ({"modulus": 1.0}, "below 1"), ({"phase": float("nan")}, "phase"),
    ({"gain": "two"}, "gain")])
def test_margins_that_no_loop_has_are_refused(law, wanted, words):
    with pytest.raises(rt.InputError, match=words):
        rt.design.tune_pi(law, 288.15, margins=wanted, sample_time=2.0)
