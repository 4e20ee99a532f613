"""A room that no record holds, and that swings or drifts, is a rival of every heat that comes and goes."""

from __future__ import annotations

import pickle
from functools import cache

import numpy as np
import pytest
from unrecorded_room import ROOM, STEP, TIME, N, model, names, records

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


def test_every_record_has_a_room_of_its_own() -> None:
    """4 K warmer on one day, 6 K colder on another, 3 K warmer on the one held out; the file says 295 K on all."""
    days = [records(room=room, seed=seed)[0] for seed, room in ((1, ROOM + 4.0), (2, ROOM - 6.0), (3, ROOM + 3.0))]
    assert max(days[0].outputs.min() - ROOM, ROOM - days[1].outputs.min()) > 3.0
    found = rt.diagnose(model(), [replaced(one, f"day {i}") for i, one in enumerate(days[:2])], validation=days[2],
                        effects=FEW)
    assert found.verdict == "consistent" and found.effects == ()
    assert [(one.ambient, one.record, one.declared) for one in found.ambients] == [
        ("room", "day 0", ROOM), ("room", "day 1", ROOM)]
    for one, room in zip(found.ambients, (ROOM + 4.0, ROOM - 6.0), strict=True):
        assert abs(one.value - room) < 4 * one.std < 0.4
    assert found.gap["validation"].after < 1.1 * found.gap["validation"].noise  # its own room is estimated
    assert found.system.ambients["room"].temperature == ROOM
    assert [entry["ambient"] for entry in found.to_dict()["ambients"]] == ["room", "room"]
    assert found.caveats[0].startswith("The readings ask for a room 6 K colder than the system says. A constant heat "
                                       "into plate, or an offset of the sensors, may be the cause as well")
    assert " K in 'day 0', 289." in found.outcome.text or " K in 'day 0', 288." in found.outcome.text


def replaced(one: rt.Record, name: str) -> rt.Record:
    return rt.Record(sample_time=one.sample_time, inputs=one.inputs, outputs=one.outputs, input_names=one.input_names,
                     output_names=one.output_names, start_time=one.start_time, name=name)


def test_a_room_in_the_fit_table_is_one_number_of_all_records() -> None:
    days = [records(room=ROOM + 2.0, seed=seed)[0] for seed in (1, 2)]
    own = rt.diagnosis.refit(model(), days)
    assert own.structure.sessions.n_free == 1 and own.structure.n_own == 2 * (2 + 1)
    system = model().model_copy(update={"fit": {**model().fit, **rt.System(
        ambients={"room": {"temperature": ROOM}}, lumps={"block": {"capacity": 1.0}},
        links=[{"between": ("block", "room"), "conductance": 1.0}],
        fit={"ambients.room.temperature": {"lower": 280.0, "upper": 310.0, "sigma": 5.0}}).fit}})
    common = rt.diagnosis.refit(system, days)
    assert common.structure.sessions.n_free == 0 and common.structure.n_own == 2 * 2
    assert abs(common.system.ambients["room"].temperature - ROOM - 2.0) < 0.1


@pytest.mark.parametrize(("heat", "offset", "warmer"), [(3.4, 0.0, 4.0), (0.0, 3.0, 3.0)])
def test_what_a_room_of_another_temperature_imitates_gets_no_name(heat: float, offset: float, warmer: float) -> None:
    """3.4 W into the plate, which loses 0.85 W/K, is a room 4 K warmer; so are two sensors that read 3 K too much."""
    train, unseen = (one.with_outputs(one.outputs + offset) for one in records(heat=heat))
    found = rt.diagnose(model(), train, validation=unseen, effects=["heat_source", "ambient_gradient", "sensor_offset"])
    assert found.verdict == "consistent" and found.effects == ()
    room, = found.ambients
    assert abs(room.value - ROOM - warmer) < 4 * room.std < 0.5
    assert found.caveats[0].startswith(f"The readings ask for a room {room.value - ROOM:.2g} K warmer")
    if heat:
        assert ("heat_source", ("plate",)) in found.not_testable


def test_an_offset_of_one_sensor_is_one_of_the_other_in_another_room() -> None:
    """Or a constant heat that flows from block to plate, in another room."""
    train, unseen = (one.with_outputs(one.outputs + np.array([3.0, 0.0])) for one in records())
    found = rt.diagnose(model(), train, validation=unseen, effects=["heat_source", "ambient_gradient", "sensor_offset"])
    assert found.verdict == "ambiguous"
    assert names(found) == [{("sensor_offset", ("T_block",)), ("sensor_offset", ("T_plate",)),
                             ("heat_source", ("block",))}]


def test_a_ramp_is_taken_where_half_a_period_explains_no_more() -> None:
    """Seed 0: a sine of 3100 s left 299.5 of one record, one of 17 000 s 301.4; the next record asks for the ramp."""
    train, unseen = records(room=ROOM + 2.0 * TIME / TIME[-1], seed=0)
    found = rt.diagnose(model(), train, validation=unseen, effects=["periodic_load"])
    assert found.verdict == "ambiguous" and names(found) == [{HEAT, DRIFT}]
    assert found.effects[0].values["period"][0] > 3 * STEP * N
    half = rt.diagnose(model(), records(room=ROOM + 2.0 * np.sin(2 * np.pi * TIME / 3000.0))[0],
                       effects=["periodic_load"])  # what the record can tell stays
    assert 2000.0 < half.effects[0].values["period"][0] < 4500.0


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
