"""Water that gets warm at one plate and reaches the next: `coolant_warming`, and what it had been taken for."""

from __future__ import annotations

from math import exp

import pytest

import robthermal as rt

from ..cooled_plates import FILM, record, system

EFFECTS = ["coolant_warming", "missing_link", "input_feedthrough", "input_lag", "sensor_lag", "missing_ambient_link"]


def diagnosed(flow: float, coolant: tuple[str, ...]) -> rt.Diagnosis:
    train, held_out = record(31, 600, flow), record(32, 400, flow)
    return rt.diagnose(system(coolant), train, validation=held_out, effects=EFFECTS)


@pytest.mark.parametrize("flow", [40.0, 150.0])
def test_the_warming_is_named_with_its_size(flow: float) -> None:
    answer = diagnosed(flow, ("A", "B", "C"))
    found, = answer.effects
    assert (answer.verdict, found.label) == ("named", "coolant_warming(water)")
    assert found.values["warming"][0] == pytest.approx(1.0 / flow, rel=0.01)
    G = flow * (1.0 - exp(-FILM / flow))  # of a plate to the water that reaches it
    carried = {one.name: one.conductance for one in answer.system.flows}
    assert carried["A-B"] == pytest.approx(G * G / flow, rel=0.02)
    assert carried["A-C"] == pytest.approx(G * G / flow * (1.0 - G / flow), rel=0.05)
    augmented = rt.diagnosis.with_named_effects(system(("A", "B", "C")), answer.effects)
    assert [one.name for one in augmented.flows] == ["A-B", "A-C", "B-C"]
    assert not any(name.startswith("flows.") for name in augmented.fit)  # they belong together
    assert answer.gap["validation"].after < 1.1 * answer.gap["validation"].noise < 0.2 * answer.gap["validation"].before


def test_the_other_way_round_it_is_not_named() -> None:
    answer = diagnosed(40.0, ("C", "B", "A"))
    assert "coolant_warming" not in {one.effect for one in answer.effects}


def test_a_coolant_that_is_not_declared_is_asked_for() -> None:
    answer = diagnosed(40.0, ())
    said, = (one for one in answer.caveats if "coolant = " in one)
    assert 'coolant = ["A", "B", "C"], in the order of the flow, in [ambients.water]' in said


@pytest.mark.parametrize(("coolant", "message"), [(("A", "D"), "'D' does not exist"), (("A", "A"), "twice")])
def test_a_path_that_is_none_is_refused(coolant: tuple[str, ...], message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        system(coolant)
