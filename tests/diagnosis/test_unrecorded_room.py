"""A room that no record holds, and that swings or drifts, is a rival of every heat that comes and goes."""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from unrecorded_room import ROOM, STEP, TIME, N, model, names, records

import robthermal as rt
from robthermal.diagnosis.data._record_data import record_data
from robthermal.diagnosis.effects import AMBIENT_DRIFT
from robthermal.diagnosis.effects._ambient_drift import ambient_drift, conductances
from robthermal.diagnosis.fit import found_ambients, too_warm
from robthermal.diagnosis.search._implausible import implausible

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


def two_heaters(*, room: float = 293.55) -> tuple[rt.System, rt.Record]:
    """A board from rest: a path between its heaters that the model lacks, a late sensor, 200 samples, own integrator.

    As a measured board whose diagnosis put the room 6 K above every first reading and lost the path.
    """
    rng, step, n = np.random.default_rng(5), 3.0, 201
    heaters = np.zeros((n, 2))
    heaters[:, 0] = np.repeat([70.0, 97.0, 41.0, 92.0, 30.0, 96.0, 1.0, 96.0, 1.5, 72.0, 85.0], 20)[:n]
    heaters[50:, 1] = np.repeat([76.0, 49.0, 77.0, 53.0, 15.0, 0.0, 0.0, 0.0], 20)[:n - 50]
    loss, path, gain = np.array([0.011, 0.0075]), 0.0028, np.array([0.0071, 0.0028])
    T, sensor, readings = np.full(2, room), np.full(2, room), []
    for u in heaters:
        readings.append(sensor)
        for _ in range(30):
            heat = gain * u - loss * (T - room) + path * (T[::-1] - T)
            T, sensor = T + step / 30 * heat / 2.0, sensor + step / 30 * (T - sensor) / np.array([18.7, 0.5])
    names_of = ("heater_1", "heater_2")
    fit = {f"links.{one}-room.conductance": {"lower": 1e-4, "upper": 0.05} for one in names_of}
    board = rt.System(
        ambients={"room": {"temperature": 293.15}}, lumps={one: {"capacity": 2.0} for one in names_of},
        links=[{"between": (one, "room"), "conductance": 8e-3} for one in names_of],
        inputs={f"q{i}": {"lump": one, "gain": g} for i, one, g in zip("12", names_of, (0.0123, 0.0062), strict=True)},
        sensors={f"T{i}": {"lump": one, "noise": 0.1} for i, one in zip("12", names_of, strict=True)},
        fit=fit | {f"inputs.q{i}.gain": {"lower": 1e-3, "upper": 0.1} for i in "12"})
    noisy = np.array(readings) + 0.1 * rng.standard_normal((n, 2))
    return board, rt.Record(sample_time=step, inputs=heaters, outputs=noisy, input_names=["q1", "q2"],
                            output_names=["T1", "T2"])


def test_a_machine_that_is_only_heated_is_not_colder_than_its_room() -> None:
    """Left free the room swallows most of the path; an error of the model at T1 keeps "named" from deciding it."""
    board, record = two_heaters()
    k = np.arange(len(record))
    wrong = record.with_outputs(record.outputs + np.column_stack([np.sin(2 * np.pi * k / 67) * k / k[-1], 0 * k]))
    found = rt.diagnose(board, wrong, effects=["missing_link", "sensor_lag", "heat_source", "hidden_mass"])
    (room,) = found.ambients
    assert room.value <= room.warmest < np.percentile(record.outputs, 5, axis=0).min() + 1.001
    assert any(("missing_link", ("heater_1", "heater_2")) in one for one in names(found))
    assert not found.nominal.structure.only_heated  # beside the path the room is cool enough
    found = rt.diagnose(board, wrong, effects=["sensor_lag", "heat_source", "hidden_mass"])
    (room,) = found.ambients
    assert room.value <= room.warmest + 1e-6
    assert any(one.startswith("Left free, room came out warmer than the machine's coolest readings")
               for one in found.caveats)
    free = rt.diagnosis.refit(board, wrong)
    assert too_warm(free) and found_ambients(free)[0].value > room.warmest + 1.0
    assert DRIFT not in [one.key for one in found.scores.candidates]


def test_a_machine_brought_in_from_the_cold_is_consistent_with_a_warm_room() -> None:
    """Nothing is missing: then nobody asks how warm the room can have been."""
    board, _ = two_heaters()
    warm = board.with_parameters({"ambients.room.temperature": 303.15, "lumps.heater_1.initial": 293.0,
                                  "lumps.heater_2.initial": 293.0})
    drive = rt.Record(sample_time=3.0, inputs=10.0 * np.random.default_rng(2).integers(0, 3, (300, 2)).astype(float),
                      outputs=np.zeros((300, 0)), input_names=["q1", "q2"], output_names=[])
    run = rt.thermal.simulate(warm, drive)
    noisy = run.with_outputs(run.outputs + 0.1 * np.random.default_rng(3).standard_normal(run.outputs.shape))
    found = rt.diagnose(board, noisy, effects=["missing_link", "sensor_lag", "heat_source"])
    assert found.verdict == "consistent" and not found.nominal.structure.only_heated
    assert found.ambients[0].value > found.ambients[0].warmest + 3.0


@pytest.mark.parametrize("changed", ["cooled", "module", "two ambients", "no thermometer"])
def test_nothing_is_said_of_the_room_of_a_machine_that_may_be_colder(changed: str) -> None:
    board, record = two_heaters()
    if changed == "cooled":
        record = replace(record, inputs=record.inputs - 5.0)
    tables = board.model_dump(exclude_unset=True)
    if changed == "module":
        tables["modules"] = {"m": {"cold": "heater_1", "hot": "heater_2", "seebeck": 0.05, "resistance": 2.0,
                                   "conductance": 0.5}}
    if changed == "two ambients":
        tables["ambients"]["base"] = {"temperature": 290.0}
        tables["links"] = [*tables["links"], {"between": ("heater_1", "base"), "conductance": 1e-3}]
    (one,) = record_data(board, [record], "records")
    if changed == "no thermometer":
        one = replace(one, sensors=("other", "another"))
    assert one.warmest_room(rt.System(**tables)) == np.inf


@pytest.mark.parametrize(("period", "difference", "refused"), [(400.0, 1.0, False), (400.0, 3.6, True),
                                                              (60000.0, 40.0, False)])
def test_a_room_does_not_change_faster_than_rooms_do(period: float, difference: float, refused: bool) -> None:
    fit = diagnosed("nothing", both=True).nominal
    drift = next(one for one in diagnosed("nothing", both=True).scores.candidates if one.key == DRIFT)
    why = implausible(drift, fit, {"period": period, "difference": difference, "phase": 0.0}, ())
    assert bool(why) is refused and ("K per minute" in why) is refused


def test_what_is_longer_than_the_record_is_not_seen_to_be_periodic() -> None:
    fit = diagnosed("nothing", both=True).nominal
    heat = next(one for one in diagnosed("nothing", both=True).scores.candidates if one.key == HEAT)
    assert "longer than the record" in implausible(heat, fit, {"period": 2000.0, "heat": 1.0, "phase": 0.0}, ())
    assert not implausible(heat, fit, {"period": 1000.0, "heat": 1.0, "phase": 0.0}, ())


def heated_at_once(n: int, step: float, rest: int, noise: float, seed: int = 0) -> rt.Record:
    """The board at rest for a few samples in a room of 20 °C, then 15 K above it."""
    rng = np.random.default_rng(seed)
    heaters = np.where(np.arange(n)[:, None] < rest, 0.0, 80.0) * np.ones(2)
    warm = 293.15 + 15.0 * (np.arange(n) >= rest + 4)[:, None] + noise * rng.standard_normal((n, 2))
    return rt.Record(sample_time=step, inputs=heaters, outputs=warm, input_names=["q1", "q2"],
                     output_names=["T1", "T2"])


def test_a_few_samples_at_rest_say_how_warm_a_room_can_have_been() -> None:
    """A fifth percentile alone put it 15 K above the readings before the heaters came on (a measured board: 7 K)."""
    board, _ = two_heaters()
    (one,) = record_data(board, [heated_at_once(240, 5.0, 3, 0.1)], "records")
    assert 293.15 + 0.9 < one.warmest_room(board) < 293.15 + 1.0 + 1.0 / 3.0


def test_over_a_day_a_room_may_have_warmed_up_since() -> None:
    board, _ = two_heaters()
    (one,) = record_data(board, [heated_at_once(1440, 60.0, 3, 0.1)], "records")
    assert one.warmest_room(board) == pytest.approx(293.15 + 15.0 + 1.0, abs=0.2)


def test_noise_and_single_cold_readings_do_not_put_the_bound_below_the_room() -> None:
    board, _ = two_heaters()
    for seed in range(50):
        record = heated_at_once(3000, 1.0, 3000, 0.5, seed)
        read = record.outputs.copy()
        read[::200] -= 30.0
        (one,) = record_data(board, [record.with_outputs(read)], "records")
        assert one.warmest_room(board) > 293.15
