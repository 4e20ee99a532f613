"""A room that no record holds, and that swings or drifts, is a rival of every heat that comes and goes."""

from __future__ import annotations

import pickle
from functools import cache

import numpy as np
import pytest
from unrecorded_room import ROOM, TIME, model, names, records

import robthermal as rt
from robthermal.diagnosis.effects import AMBIENT_DRIFT
from robthermal.diagnosis.effects._ambient_drift import ambient_drift, conductances

HEAT, DRIFT = ("periodic_load", ("plate",)), ("ambient_drift", ("room",))
FEW = ["periodic_load", "heat_source", "hidden_mass", "sensor_lag", "conductance_step", "missing_ambient_link"]
TRUTHS = {"swing": {"room": ROOM + np.sin(2 * np.pi * TIME / 400)},
          "part of a swing": {"room": ROOM + 3.0 * np.sin(TIME / 400)},
          "drift": {"room": ROOM + 2.0 * TIME / 1500}, "nothing": {}, "heat": {"heat": np.sin(2 * np.pi * TIME / 400)},
          "slow heat": {"heat": 2.0 * np.sin(TIME / 400)}}


@cache
def diagnosed(truth: str, both: bool = False, recorded: bool = False) -> rt.diagnosis.Diagnosis:
    train, unseen = records(both=both, recorded=recorded, **TRUTHS[truth])
    return rt.diagnose(model(both=both), train, validation=unseen, effects=FEW)


@pytest.mark.parametrize("truth", [name for name in TRUTHS if name != "nothing"])
def test_into_the_only_lump_at_the_room_both_are_one_answer(truth: str) -> None:
    """Before, a swing was named `periodic_load(plate)` and a drift `heat_source(plate)` with `hidden_mass(plate)`."""
    found = diagnosed(truth)
    assert found.verdict == "ambiguous" and names(found) == [{HEAT, DRIFT}]
    assert "record room" in str(found.next_experiment) and found.caveats == ()


@pytest.mark.parametrize("truth", ["swing", "part of a swing", "drift"])
def test_at_two_lumps_the_room_alone_explains_both(truth: str) -> None:
    """Before, a swing was named `periodic_load(plate)`, a drift two masses and a heat."""
    found = diagnosed(truth, both=True)
    assert found.verdict == "named" and names(found) == [{DRIFT}]
    assert found.caveats == ("That room drifts is read off other temperatures: record it.",)
    if truth == "swing":
        values = found.effects[0].values
        assert abs(values["difference"][0] - 1.0) < 4 * values["difference"][1] < 0.1
        assert abs(values["period"][0] - 400.0) < 4 * values["period"][1] < 10.0


def test_at_two_lumps_a_heat_into_one_is_no_room() -> None:
    found = diagnosed("heat", both=True)
    assert found.verdict == "named" and names(found) == [{HEAT}] and found.caveats == ()


@pytest.mark.parametrize("both", [False, True])
def test_a_room_that_stands_still_is_no_finding(both: bool) -> None:
    found = diagnosed("nothing", both)
    assert found.verdict == "consistent" and found.effects == ()
    assert DRIFT in [one.key for one in found.scores.candidates]  # it was tried


def test_a_recorded_room_is_no_rival() -> None:
    found = diagnosed("heat", recorded=True)
    assert found.verdict == "named" and names(found) == [{HEAT}]
    assert DRIFT not in [one.key for one in found.scores.candidates]


def test_it_is_tried_where_a_periodic_heat_is() -> None:
    fit = rt.diagnosis.refit(model(), records()[0])
    assert fit.unrecorded == ("room",)
    for effects, tried in ((["heat_source"], False), (["periodic_load"], True)):
        assert (DRIFT in [one.key for one in rt.diagnosis.score(fit, effects).candidates]) is tried


def test_added_it_is_the_room_that_swings() -> None:
    """Against the simulation with the swing in the column of the room: held over a sample there, a sine here."""
    train, _ = records(both=True, recorded=True)
    swing = 2.0 * np.sin(2 * np.pi * (train.time + train.sample_time / 2) / 600 + 0.3)
    other = rt.Record(sample_time=train.sample_time, inputs=np.column_stack([train["q"], train["room"] + swing]),
                      outputs=train.outputs, input_names=["q", "room"], output_names=train.output_names)
    added = ambient_drift().add(model(both=True), ("room",), {"difference": 2.0, "period": 600.0, "phase": 0.3})
    exact, found = (rt.thermal.trajectory(system, run).readings for system, run in ((model(both=True), other),
                                                                                     (added, train)))
    plain = rt.thermal.trajectory(model(both=True), train).readings
    assert np.abs(exact - plain).max() > 0.5 and np.abs(found - exact).max() < 2e-3


def test_heat_per_kelvin_is_the_slope_of_the_links() -> None:
    """By differences of the law of heat; natural convection 10 K from the room."""
    system = model().model_copy(update={"links": (
        *model().links, rt.thermal.Link(between=("room", "block"), radiation=2e-9),
        rt.thermal.Link(between=("block", "room"), natural={"gain": 0.1, "exponent": 0.25}))})
    h = 1e-3
    radiated = 2e-9 * ((ROOM + h) ** 4 - (ROOM - h) ** 4) / (2 * h)
    convected = 0.1 * ((10 + h) ** 1.25 - (10 - h) ** 1.25) / (2 * h)
    assert conductances(system, "room") == pytest.approx({"block": radiated + convected, "plate": 0.8}, rel=1e-6)


def test_no_second_sine_into_a_lump_that_has_one() -> None:
    loaded = model().with_parameters({"lumps.plate.periodic.heat": 1.0, "lumps.plate.periodic.period": 300.0})
    assert ambient_drift().places(loaded) == [] and ambient_drift().places(model()) == [("room",)]


def test_the_answer_says_it_in_words_and_can_be_pickled() -> None:
    found = diagnosed("swing", both=True)
    assert pickle.loads(pickle.dumps(found)).effects == found.effects
    assert rt.jobs.explain(AMBIENT_DRIFT)[0].details["Confused with"] == ("periodic_load",)
    said = found.to_dict()["effects"][0]
    assert (said["effect"], said["where"]) == ("ambient_drift", ["room"])
