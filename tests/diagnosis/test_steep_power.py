"""A bath that evaporates, which no effect says: a heater whose power falls faster than that of any wire has rivals."""

from __future__ import annotations

import robthermal as rt
from robthermal.diagnosis._steep_power import beyond_metals, loses_heat

from ..water_bath import BATH, day


def found(*effects: str) -> rt.Diagnosis:
    return rt.diagnose(BATH, day(3, 600), validation=day(4, 400), effects=effects)


def test_a_steep_power_is_no_name_of_its_own_where_a_loss_predicts_too() -> None:
    answer = found("heater_power_slope", "natural_convection", "radiation")
    assert answer.verdict == "ambiguous"
    assert [one.label for one in answer.effects] == ["heater_power_slope(heater)"]
    assert {name for name, _ in answer.alternatives[0]} == {"natural_convection", "radiation"}
    assert "what is missing may be neither" in answer.outcome.text
    assert "more than the resistance of a pure metal makes" in answer.outcome.text
    assert answer.next_experiment is not None


def test_who_leaves_much_less_of_another_day_stands_beside_a_name() -> None:
    answer = found("heater_power_slope", "natural_convection")
    assert answer.verdict == "ambiguous" and answer.effects[0].label == "natural_convection(water, lab)"
    assert ("heater_power_slope", ("heater",)) in answer.alternatives[0]
    assert "against 0.75 K with heater_power_slope(heater)" in answer.outcome.text


def test_powers_of_metals_and_other_effects_are_not_asked() -> None:
    assert beyond_metals("heater_power_slope", -0.0071) and beyond_metals("heater_power_slope", 0.01)
    assert not beyond_metals("heater_power_slope", -0.0039) and not beyond_metals("resistance_slope", 0.01)
    assert loses_heat("radiation") and not loses_heat("heat_source")
