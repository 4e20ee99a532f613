"""A comparison with a model that has what the records of the healthy machine name by themselves.

The truth is three bodies in a row with a path that the network has not, and days that differ.
"""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
from differing_days import CONTACT, FEW, PATH, SYSTEM, day

import robthermal as rt
from robthermal.diagnosis._augment import augmented
from robthermal.jobs.diagnose import Diagnosed, diagnosis_report


@cache
def compared(contact: float = 1.0, path: float = PATH, today: float = PATH, augment: bool = True) -> rt.Diagnosis:
    """Three healthy days and a new one."""
    return rt.diagnose(SYSTEM, day(9, today, contact), reference=[day(seed, path) for seed in (1, 2, 3)], effects=FEW,
                       augment=augment)


def added(found: rt.Diagnosis) -> rt.diagnosis.Augmented:
    assert found.reference is not None and found.reference.augmented is not None
    return found.reference.augmented


def test_the_path_is_added_and_the_contact_that_came_loose_is_named_with_its_size() -> None:
    found = compared(contact=0.5)
    assert [one.label for one in added(found).effects] in (["missing_link(a, sink)"], ["missing_link(sink, a)"])
    assert added(found).rms < 0.5 * added(found).without
    (change,) = found.effects
    assert change.key == ("parameter_change", (CONTACT,))
    value, std, _ = change.values["relative"]
    assert value == pytest.approx(-0.5, abs=3.0 * np.hypot(std, 0.02))
    assert any({"a", "sink"} == set(link.between) for link in found.system.links)
    plain = compared(contact=0.5, augment=False)
    assert plain.reference is not None and plain.reference.augmented is None
    assert "augment" in plain.outcome.text and "(augment)" not in found.outcome.text
    assert found.reference is not None and found.reference.remainder < 0.5 * plain.reference.remainder


def test_a_healthy_day_of_that_machine_is_consistent() -> None:
    found = compared()
    assert added(found).effects and found.verdict == "consistent"


def test_a_change_of_the_added_path_is_named() -> None:
    found = compared(today=0.08)
    (link,) = (link for link in added(found).system.links if {"a", "sink"} == set(link.between))
    assert [one.key for one in found.effects] == [("parameter_change", (f"links.{link.name}.conductance",))]
    assert found.effects[0].values["relative"][0] == pytest.approx(-0.6, abs=0.1)


def test_nothing_is_added_where_nothing_is_missing() -> None:
    found = compared(contact=0.5, path=0.0, today=0.0)
    assert not added(found).effects and added(found).verdict in ("consistent", "unexplained")
    assert [one.key for one in found.effects] == [("parameter_change", (CONTACT,))]
    assert "the model of this comparison has no effect added" in found.outcome.text


def test_the_answer_says_what_was_added() -> None:
    found = compared(contact=0.5)
    (sentence,) = [said for said in found.caveats if said.startswith("The reference records alone name missing_link(")]
    assert sentence in found.outcome.text
    written = json.loads(json.dumps(found.to_dict()))["reference"]["augmented"]
    assert written["rms"] < written["rms_without"] and written["effects"][0]["effect"] == "missing_link"
    assert written["effects"][0]["parameters"]["conductance"]["value"] == pytest.approx(PATH, rel=0.1)
    headline = diagnosis_report(Diagnosed(found, (), (), ())).headline
    assert "a heat path between" in headline and "missing_link" not in headline


class Answer:
    """What a diagnosis of the reference records would say."""

    def __init__(self, verdict: str):
        self.verdict = verdict
        self.effects = (rt.diagnosis.Found("sensor_lag", ("T_b",), {"time_constant": (40.0, 1.0, "s")}, 1e-9, 1e3),)
        self.alternatives = ((("input_lag", ("q_b",)),),)
        self.gap = {"train": rt.diagnosis.Gap(0.4, 0.1, 0.02)}


@pytest.mark.parametrize("verdict", ["named", "named_with_remainder", "ambiguous", "unexplained", "consistent"])
def test_only_what_stands_alone_is_added(verdict: str) -> None:
    one = augmented(SYSTEM, [day(1)], None, lambda *given, **held_out: Answer(verdict))
    assert bool(one.effects) == verdict.startswith("named")
    assert ("name sensor_lag(T_b) (or input_lag(q_b)): " in str(one)) == bool(one.effects)
    assert one.to_dict()["alternatives"] == [[{"effect": "input_lag", "where": ["q_b"]}]] * bool(one.effects)
    assert (one.system.sensors["T_b"].time_constant or 0.0) == (40.0 if one.effects else 0.0)
    assert ("sensors.T_b.time_constant" in one.system.fit) == bool(one.effects)


def test_what_no_system_can_have_is_not_added() -> None:
    answer = Answer("named")
    answer.effects = (rt.diagnosis.Found("ambient_drift", ("room",), {"difference": (2.0, 0.1, "K")}, 1e-9, 50.0),)
    one = augmented(SYSTEM, [day(1)], None, lambda *given, **held_out: answer)
    assert not one.effects and one.system is SYSTEM and "no system can have" in str(one)


def test_one_day_is_fitted_and_predicts_the_others() -> None:
    seen = []

    def diagnosed(system: rt.System, training: list[rt.Record], validation: list[rt.Record] | None) -> Answer:
        seen.append((len(training), len(validation or [])))
        return Answer("consistent")

    for n in (1, 2, 3):
        augmented(SYSTEM, [day(1)] * n, None, diagnosed)
    assert seen == [(1, 0), (1, 1), (1, 2)]


def test_numbers_of_the_effect_are_fitted_beside_those_that_were_chosen() -> None:
    def fitted(system: rt.System, parameters: object) -> tuple[rt.System, object]:
        one = augmented(system, [day(1)], parameters, lambda *given, **held_out: Answer("named"))
        return one.system, one.parameters

    system, chosen = fitted(SYSTEM, {CONTACT: (0.3, 3.0)})
    assert set(chosen) == {CONTACT, "sensors.T_b.time_constant"} and chosen[CONTACT].upper == 3.0
    assert fitted(SYSTEM, None)[1] is None
    bare = rt.System(**{**dict(SYSTEM), "fit": {}})
    system, chosen = fitted(bare, None)  # without a fit table all numbers are taken as right
    assert not system.fit and chosen is None and system.sensors["T_b"].time_constant == 40.0


def test_it_is_refused_without_reference_records() -> None:
    with pytest.raises(rt.InputError, match="augment is given without reference records"):
        rt.diagnose(SYSTEM, day(1), augment=True)
