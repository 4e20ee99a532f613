"""Effects that a finer network explains away in training: named only where they alone predict the validation data.

The truth is a stack of 160 cells and more around a module with legs of its own, from the suite of foreign truth.
"""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import pytest

import robthermal as rt
from robthermal.diagnosis import _explained_away
from robthermal.diagnosis._explained_away import predicting_alone
from robthermal.diagnosis._judge import Validation
from robthermal.diagnosis.fit import Refit, coarsened
from robthermal.diagnosis.search import begin

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from foreign.cases import Case, Made, made  # noqa: E402 - beside the benchmarks

EFFECTS = ("missing_ambient_link", "hidden_mass")
CONVECTION = ("natural_convection", "missing_ambient_link")


@cache
def stack(group: str, effect: str, seed: int) -> Made:
    return made(Case("stack", group, effect, seed))


@cache
def nominal(group: str, effect: str, seed: int) -> Refit:
    one = stack(group, effect, seed)
    return rt.diagnosis.refit(one.system, one.train)


@cache
def finer(group: str, effect: str, seed: int) -> Refit:
    return coarsened(nominal(group, effect, seed))


LOST = ("hidden", "missing_ambient_link", 13)  # from the spreader to the room


def diagnosed(one: Made, **given) -> rt.diagnosis.Diagnosis:
    return rt.diagnose(one.system, one.train, effects=EFFECTS, **given)


@pytest.mark.exhaustive
def test_a_path_that_alone_predicts_is_named_although_a_finer_network_fits_the_training_records():
    one = stack(*LOST)
    assert nominal(*LOST).variance > 20.0 and finer(*LOST).variance < 1.1  # nothing to be seen beside a finer network
    found = diagnosed(one, validation=one.unseen)
    assert found.verdict == "named_with_remainder"
    (name,), (others,) = found.effects, found.alternatives
    assert {name.where, *(where for _, where in others)} == {("cold", "room"), ("spreader", "room")}
    assert found.gap["validation"].after < 0.1 * found.gap["validation"].before
    assert "would explain the training records without it, with 14 more unknowns" in found.outcome.text


@pytest.mark.exhaustive
def test_a_place_whose_fit_the_short_list_ended_is_listed_too():
    """The cold face does more at once; refitted, the true place, the spreader, removes 98 % of what the face does."""
    one = stack("hidden", "missing_ambient_link", 34)
    found = diagnosed(one, validation=one.unseen)
    (name,), (others,) = found.effects, found.alternatives
    assert found.verdict == "named_with_remainder"
    assert {name.where, *(where for _, where in others)} == {("cold", "room"), ("spreader", "room")}


@pytest.mark.exhaustive
def test_a_face_does_as_much_beside_a_finer_network_and_less_where_it_is_as_it_is():
    """Convection of a sink: the hot face of the module does 43 % of it; beside a finer network nine tenths."""
    one = stack("hidden", "natural_convection", 38)
    found = rt.diagnose(one.system, one.train, validation=one.unseen, effects=CONVECTION)
    assert [name.label for name in found.effects] == ["natural_convection(sink, room)"]
    assert found.verdict == "named_with_remainder" and found.alternatives == ((),)


@pytest.mark.exhaustive
def test_a_place_that_does_little_beside_a_finer_network_is_listed_where_it_does_as_much_as_it_is():
    """Beside a finer network the true place, the spreader, does an eighth of what the face does (seed 37)."""
    one = stack("hidden", "missing_ambient_link", 37)
    found = diagnosed(one, validation=one.unseen)
    (name,), (others,) = found.effects, found.alternatives
    assert {name.where, *(where for _, where in others)} == {("cold", "room"), ("spreader", "room")}


@pytest.mark.exhaustive
def test_a_share_of_a_heater_that_closes_seven_eighths_is_named():
    """In training 87 % of the gap, 94 % of the other day's; lumps that are too few do not move heat from its heater."""
    one = made(Case("bar", "hidden", "input_feedthrough", 54))
    found = rt.diagnose(one.system, one.train, validation=one.unseen,
                        effects=["input_feedthrough", "hidden_mass", "heat_source", "missing_link"])
    assert [name.label for name in found.effects] == ["input_feedthrough(q2, x6)"] and found.alternatives == ((),)
    assert found.verdict == "named_with_remainder"
    assert "would explain the training records without it" in found.outcome.text


@pytest.mark.parametrize(("names", "share"), [
    (["missing_link"], 0.85), (["input_feedthrough", "sensor_gain"], 0.85), (["hidden_mass"], 0.92),
    (["missing_link", "sensor_lag"], 0.92)])
def test_what_stores_heat_or_is_late_has_to_close_more(names: list[str], share: float):
    rounds = [SimpleNamespace(best=SimpleNamespace(candidate=SimpleNamespace(effect=SimpleNamespace(name=name))))
              for name in names]
    assert _explained_away._needed(SimpleNamespace(rounds=rounds)) == share


@pytest.mark.exhaustive
def test_without_validation_data_nothing_is_predicted():
    assert diagnosed(stack(*LOST)).verdict == "unexplained"


@pytest.mark.exhaustive
@pytest.mark.parametrize("seed", [26, 27])
def test_what_lumps_do_not_hold_alone_closes_too_little(seed):
    """Nothing is hidden: a mass at the hot face lasts over blocks and segments and closes four fifths of the gap."""
    one = stack("nothing", "nothing", seed)
    assert diagnosed(one, validation=one.unseen).verdict == "unexplained"


def test_nothing_found_or_nothing_to_predict_is_no_name():
    fit, one = nominal(*LOST), stack(*LOST)
    assert predicting_alone(begin(fit, EFFECTS), finer(*LOST), Validation(one.unseen)) is None
    assert predicting_alone(begin(fit, EFFECTS), finer(*LOST), Validation(None)) is None
