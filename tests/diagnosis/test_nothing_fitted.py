"""A system without a fit table: all its numbers are taken as right, and every answer says so."""

import numpy as np
import pytest
from scipy.linalg import expm

import robthermal as rt
from robthermal.jobs.diagnose._answer import answer_sentence
from robthermal.jobs.diagnose._effect_words import labels_in_words

H = 10.0
FIT = {"links.plate-room.conductance": (0.05, 5.0), "lumps.plate.capacity": (20.0, 300.0)}


def plate(**more):
    return rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"plate": {"capacity": 100.0}},
                     links=[{"between": ("plate", "room"), "conductance": 0.8}], inputs={"q": {"lump": "plate"}},
                     sensors={"T": {"lump": "plate", "noise": 0.03}}, **more)


def measured(seed, conductance, n=400):
    """Its own integrator: exact for held inputs."""
    rng = np.random.default_rng(seed)
    q, room = np.repeat(rng.uniform(0.0, 10.0, n // 20), 20), 295.0 + np.cumsum(rng.normal(0.0, 0.02, n))
    a = float(expm(np.array([[-conductance * H / 100.0]]))[0, 0])
    T = np.empty(n)
    T[0] = room[0]
    for k in range(n - 1):
        T[k + 1] = a * T[k] + (1 - a) * (room[k] + q[k] / conductance)
    return rt.Record(sample_time=H, inputs=np.column_stack([q, room]), input_names=["q", "room"],
                     outputs=T + rng.normal(0.0, 0.03, n), output_names=["T"])


def test_the_answer_says_that_every_number_was_taken_as_right():
    found = rt.diagnose(plate(), measured(1, 0.6), validation=measured(2, 0.6))
    assert found.verdict != "consistent"
    assert "no fit table" in found.outcome.text and any("no fit table" in one for one in found.caveats)


def test_nothing_is_said_where_the_model_is_right_or_its_numbers_are_fitted():
    for given in (rt.diagnose(plate(), measured(1, 0.8), validation=measured(2, 0.8)),
                  rt.diagnose(plate(), measured(1, 0.6), validation=measured(2, 0.6), parameters=FIT)):
        assert given.verdict == "consistent"
        assert "fit table" not in given.outcome.text


def test_between_two_days_no_change_of_a_parameter_is_claimed_to_have_been_tried():
    found = rt.diagnose(plate(), measured(4, 0.3), reference=[measured(1, 0.8), measured(2, 0.8)],
                        effects=["sensor_offset"])
    assert found.verdict == "unexplained"
    assert "no change of a parameter was tried" in found.outcome.text and "under [fit]" in found.outcome.text


@pytest.mark.parametrize("truth", [0.3, 1.6])
def test_with_parameters_the_change_is_found_and_what_is_left_is_of_the_new_records(truth):
    found = rt.diagnose(plate(), measured(4, truth), reference=[measured(1, 0.8), measured(2, 0.8)], parameters=FIT)
    assert [one.key for one in found.effects] == [("parameter_change", ("links.plate-room.conductance",))]
    value, std, _ = found.effects[0].values["relative"]
    assert abs(value - (truth / 0.8 - 1.0)) < max(4.0 * std, 0.02)
    assert "training records" not in found.outcome.text and "train: rms" not in str(found)
    assert "new: rms" in str(found) and "p 0" not in str(found)


def test_the_remainder_between_two_days_is_of_the_new_records():
    found = rt.diagnose(plate(), measured(4, 0.3), reference=[measured(1, 0.8), measured(2, 0.8)],
                        effects=["sensor_offset"])
    assert "of the error on the new records is not explained" in found.outcome.text


@pytest.mark.parametrize("old", [None, [measured(1, 0.8), measured(2, 0.8)]])
def test_the_first_sentence_of_the_report_says_so_too(old):
    found = rt.diagnose(plate(), measured(4, 0.3), reference=old, effects=["sensor_lag"])
    assert found.verdict == "unexplained"
    said = answer_sentence(found)
    assert "under [fit]" in said and "no parameter and" not in said


def test_labels_of_changes_are_written_out():
    said = labels_in_words("parameter_change(links.plate-room.conductance) would, sensor_lag(T) too.")
    assert said.startswith("a change of the conductance of link plate-room would, ") and "sensor_lag(" not in said
