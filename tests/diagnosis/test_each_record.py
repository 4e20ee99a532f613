"""Several training records of days on which the numbers of the machine differ."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from differing_days import FEW, PATH, SYSTEM, day

import robthermal as rt
from robthermal.diagnosis._each_record import differing
from robthermal.jobs.diagnose._answer import answer_sentence


@pytest.mark.parametrize("held_out", [True, False])
def test_a_path_is_named_although_conductances_differ_from_day_to_day(held_out: bool) -> None:
    """Together the records leave 0.15 K beside the path, which named nothing."""
    found = rt.diagnose(SYSTEM, [day(1), day(2)], validation=day(3) if held_out else None, effects=FEW)
    assert [one.key for one in found.effects] == [("missing_link", ("a", "sink"))]
    value, std, _ = found.effects[0].values["conductance"]
    assert value == pytest.approx(PATH, abs=3.0 * std)
    assert found.gap["validation"].after < 0.7 * found.gap["validation"].before
    assert found.caveats[-1].startswith("Numbers of the machine differ from record to record: with what came nearest")
    assert found.caveats[-1] in found.outcome.text
    assert found.differing is not None and found.to_dict()["differing"] == {
        "alone": pytest.approx(0.0, abs=0.01), "together": pytest.approx(0.15, abs=0.01), "needed": True}
    assert answer_sentence(found).startswith("The model lacks a heat path between a and sink.")


def test_a_difference_between_days_is_no_step_of_a_conductance() -> None:
    """A step of 8 % at the end of the first day took 0.27 to 0.19 K and was named."""
    found = rt.diagnose(SYSTEM, [day(seed, 0.0) for seed in (1, 2, 3)], effects=["sensor_offset", "conductance_step"])
    assert found.verdict == "unexplained" and not found.effects
    assert found.provisional and "No name, because no record by itself needs it." in found.nearest
    assert "names nothing that predicts the others" in found.outcome.text
    assert found.differing is not None and not found.differing.needed and str(found.differing) in found.outcome.text
    assert answer_sentence(found).startswith("Numbers of the machine differ from record to record: without any effect "
                                             "each by itself leaves ")
    assert json.loads(json.dumps(found.to_dict()))["differing"]["together"] == pytest.approx(found.differing.together)


def test_the_same_days_with_the_same_numbers_are_consistent() -> None:
    same = [rt.thermal.simulate(SYSTEM, day(seed)) for seed in (1, 2)]
    rng = np.random.default_rng(1)
    records = [one.with_outputs(one.outputs + 0.02 * rng.standard_normal(one.outputs.shape)) for one in same]
    found = rt.diagnose(SYSTEM, records, effects=FEW)
    assert found.verdict == "consistent" and found.differing is None and "differing" not in found.to_dict()


def test_a_contact_that_came_loose_between_two_records_keeps_its_name() -> None:
    """Each of them by itself needs no step, but with it all together leave no more than noise."""
    rng = np.random.default_rng(1)
    records = []
    for seed, factor in ((1, 1.0), (2, 0.7)):
        worn = SYSTEM.with_parameters({"links.b-sink.conductance": 1.1 * factor})
        run = rt.thermal.simulate(worn, day(seed))
        records.append(run.with_outputs(run.outputs + 0.02 * rng.standard_normal(run.outputs.shape)))
    found = rt.diagnose(SYSTEM, records, effects=["conductance_step", "sensor_offset"])
    assert [one.key for one in found.effects] == [("conductance_step", ("b-sink",))]


def test_what_a_single_record_cannot_be_fitted_with_says_nothing() -> None:
    found = rt.diagnose(SYSTEM, [day(1, 0.0), day(2, 0.0)], effects=["sensor_offset"])
    found = replace(found, provisional=())

    def away(system: rt.System, parameters: object) -> list[rt.diagnosis.Refit]:
        raise rt.Diverged("it runs away", time=1.0)

    assert differing(found, SYSTEM, None, away) is None
    assert differing(found, SYSTEM, None, lambda *given: [found.fit, found.fit]) is None
    drift = rt.diagnosis.Found("ambient_drift", ("room",), {"difference": (2.0, 0.1, "K")}, 1e-9, 50.0)
    assert differing(replace(found, provisional=(drift,)), SYSTEM, None, lambda *given: [found.fit]) is None
    alone = [rt.diagnosis.refit(SYSTEM, day(seed, 0.0)) for seed in (1, 2)]
    answer = differing(found, SYSTEM, None, lambda *given: alone)
    assert answer is not None and not answer.needed


def test_a_first_record_that_cannot_be_diagnosed_by_itself_is_no_error() -> None:
    """The same record twice: what tests the names of the first would be the first."""
    found = rt.diagnose(SYSTEM, [day(1, 0.0), day(1, 0.0), day(2, 0.0)], effects=["sensor_offset"])
    assert found.verdict == "unexplained" and found.differing is not None
    assert "names nothing that predicts the others" in found.outcome.text
