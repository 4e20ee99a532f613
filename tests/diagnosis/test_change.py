"""What changed between two days: truth from scipy alone (two_days.py), every parameter of every day off by 3 %."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
import scipy
from two_days import SYSTEM, Day, record

import robthermal as rt
from robthermal.diagnosis.change import effective_number, parameter_changes, random_effects, reference_of
from robthermal.fitting import chosen_ranges

SIZES: dict[str, Any] = {"length": 300}
FEW = ["sensor_offset", "missing_ambient_link", "input_gain", "heat_source"]
FAN, CONTACT = "links.sink-room.conductance", "links.block-plate.conductance"


@pytest.fixture(scope="module")
def rig() -> rt.System:
    return rt.thermal.parse_system(SYSTEM)


@pytest.fixture(scope="module")
def old() -> list[rt.Record]:
    return [record(seed, **SIZES) for seed in (1, 2, 3)]


@pytest.fixture(scope="module")
def fan(rig: rt.System, old: list[rt.Record]) -> rt.diagnosis.Diagnosis:
    """The fan stands still: half the conductance to the room; held out is another record of that day."""
    new, unseen = (record(seed, Day({"fan": 0.5}), **SIZES) for seed in (11, 12))
    return rt.diagnose(rig, new, reference=old, validation=unseen, effects=FEW)


def test_a_fan_that_stands_still_is_named(fan: rt.diagnosis.Diagnosis) -> None:
    assert fan.verdict in ("named", "named_with_remainder") and fan.outcome.ok
    assert (fan.remainder is None) == (fan.verdict == "named")
    assert fan.gap["train"].noise == pytest.approx(0.05, rel=0.02)  # what the scatter allows for is not in it
    (found,) = fan.effects
    value, std, unit = found.values["relative"]
    assert (found.effect, found.where, unit) == ("parameter_change", (FAN,), "")
    assert abs(value + 0.5) < 3 * std and 0.01 < std < 0.05  # the scatter of 3 % of half the conductance is in it
    assert fan.system.parameter(FAN) == pytest.approx(0.4, rel=0.1)
    assert found.evidence is not None and found.evidence.stability.spread < 0.01  # the same in every part of the record
    assert fan.gap["validation"].after < 0.4 * fan.gap["validation"].before


def test_results_are_pickled(fan: rt.diagnosis.Diagnosis) -> None:
    again = pickle.loads(pickle.dumps(fan))
    assert again.to_dict() == fan.to_dict() and again.reference == fan.reference


def test_the_reference_is_in_the_file(fan: rt.diagnosis.Diagnosis) -> None:
    block = fan.to_dict()["reference"]
    assert set(block) >= {"records", "rms", "remainder", "scatter"} and block["records"] == 3
    assert list(block["scatter"]) == list(rt.thermal.parse_system(SYSTEM).fit)
    assert all(0.01 < scatter < 0.08 for scatter in block["scatter"].values())
    assert block["deviation"][FAN] == pytest.approx(-0.5, abs=0.1) and block["remainder"] <= block["rms"]


def test_a_range_that_begins_at_zero_changes_no_deviation(old: list[rt.Record], fan: rt.diagnosis.Diagnosis) -> None:
    """Its coordinate is no logarithm: a fan at half its conductance was said to deviate by thousands of per cent."""
    loose = rt.thermal.parse_system(SYSTEM.replace('sink-room.conductance" = { lower = 0.05, upper = 8.0',
                                                   'sink-room.conductance" = { lower = 0.0, upper = 8.0'))
    found = rt.diagnose(loose, record(21, Day({"fan": 0.5}), **SIZES), reference=old, effects=FEW)
    assert found.reference is not None and fan.reference is not None
    assert [one.where for one in found.effects] == [(FAN,)]
    assert found.reference.deviation[FAN] == pytest.approx(fan.reference.deviation[FAN], abs=0.05)
    assert found.reference.scatter[FAN] < 0.1


def test_a_healthy_day_is_consistent(rig: rt.System, old: list[rt.Record]) -> None:
    found = rt.diagnose(rig, record(22, **SIZES), reference=old)  # with the whole catalog
    assert found.verdict == "consistent" and found.effects == () and found.outcome.ok
    assert found.remainder is None and "Nothing has changed" in found.outcome.text


def test_a_loose_contact_is_named(rig: rt.System, old: list[rt.Record]) -> None:
    found = rt.diagnose(rig, record(31, Day({"contact": 0.6}), **SIZES), reference=old, effects=FEW)
    assert [one.where for one in found.effects] == [("links.block-plate.conductance",)]
    value, std, _ = found.effects[0].values["relative"]
    assert abs(value + 0.4) < 3 * std
    assert (found.remainder is None) == (found.verdict == "named")


def test_a_sensor_that_has_drifted_is_named(rig: rt.System, old: list[rt.Record]) -> None:
    found = rt.diagnose(rig, record(41, Day(offset=1.5), **SIZES), reference=old, effects=FEW)
    (one,) = found.effects
    assert (one.effect, one.where) == ("sensor_offset", ("T_block",))
    assert one.values["offset"][0] == pytest.approx(1.5, abs=0.15)


def test_a_room_that_is_not_recorded_is_no_change(rig: rt.System) -> None:
    """Four kelvins warmer than the file says, and seven than on the first day: refitted, record by record."""
    rooms = {1: -3.0, 2: 0.0, 3: 2.0, 51: 4.0}
    days = [record(seed, Day(room=room), room=False, **SIZES) for seed, room in rooms.items()]
    found = rt.diagnose(rig, days[3], reference=days[:3], effects=FEW)
    assert found.verdict == "consistent"
    sessions = found.fit.structure.sessions
    assert sessions.inputs == ("room",)
    assert float(sessions.sigma[0] * found.fit.structure.gains(found.fit.v)[0][0]) == pytest.approx(4.0, abs=0.5)


def test_a_room_warmer_than_recorded_is_no_change_of_a_parameter(rig: rt.System, old: list[rt.Record]) -> None:
    found = rt.diagnose(rig, record(61, Day(room=5.0), **SIZES), reference=old, effects=["ambient_gradient", *FEW])
    names = {(one.effect, one.where) for one in found.effects}
    names |= {name for others in found.alternatives for name in others}
    assert ("ambient_gradient", ("sink",)) in names and "parameter_change" not in {effect for effect, _ in names}


@pytest.mark.exhaustive
def test_several_new_records_scatter_as_healthy_ones_do(rig: rt.System, old: list[rt.Record]) -> None:
    new = [record(seed, Day({"fan": 0.5}), **SIZES) for seed in (11, 13)]
    found = rt.diagnose(rig, new, reference=old, effects=FEW)
    assert [one.where for one in found.effects] == [(FAN,)]
    assert rt.diagnose(rig, [record(seed, **SIZES) for seed in (21, 23)], reference=old, effects=FEW
                       ).verdict == "consistent"


@pytest.mark.exhaustive
@pytest.mark.parametrize("day", [Day(draught=3.0), Day(drift=2.0)], ids=["gusts", "drifting sensor"])
def test_what_is_in_no_catalog_is_unexplained(rig: rt.System, old: list[rt.Record], day: Day) -> None:
    found = rt.diagnose(rig, record(71, day, **SIZES), reference=old, effects=[*FEW, "periodic_load", "hidden_mass"])
    assert found.verdict == "unexplained" and found.effects == () and not found.outcome.ok
    assert "Something has changed" in found.outcome.text


@pytest.mark.parametrize(("seed", "drift"), [(210, 1.0), pytest.param(203, 1.0, marks=pytest.mark.exhaustive),
                                             pytest.param(202, 2.0, marks=pytest.mark.exhaustive)])
def test_what_moves_within_the_record_is_no_name(rig: rt.System, seed: int, drift: float) -> None:
    """A drifting sensor: a gain, a hidden mass or a step would do, with another size in every part of the record."""
    old = [record(1000 * seed + i, **SIZES) for i in (1, 2, 3)]
    found = rt.diagnose(rig, record(1000 * seed + 999, Day(drift=drift), **SIZES), reference=old)
    assert found.verdict == "unexplained" and found.effects == ()
    assert "something drifts or comes and goes" in found.outcome.text


def test_a_heater_ten_percent_weak_is_named(rig: rt.System) -> None:
    """Three healthy days; nobody lists its gain, and the plate's capacity scatters without being listed."""
    old = [record(602_000 + i) for i in range(3)]
    found = rt.diagnose(rig, record(602_999, Day({"power": 0.9})), reference=old, effects=[*FEW, "hidden_mass"])
    (one,) = found.effects
    assert (one.effect, one.where, found.alternatives) == ("input_gain", ("heater",), ((),))
    value, std, _ = one.values["gain"]
    assert abs(value + 0.1) < 3 * std < 0.2
    assert found.reference is not None and list(found.reference.scatter) == list(rig.fit)  # the listed ones


def test_numbers_that_the_fit_table_leaves_out_scatter_too(rig: rt.System, old: list[rt.Record]) -> None:
    healthy = reference_of(rig, old, [old[0]])
    assert healthy.fit.structure.ranges.names == (*rig.fit, "lumps.plate.capacity")
    assert healthy.listed.names == tuple(rig.fit)
    bare = reference_of(rig.model_copy(update={"fit": {}}), old, [old[0]])
    assert bare.fit.structure.ranges.names == ()  # without a table every number is taken to be right


@pytest.mark.parametrize("kind", ["independent", "alike", "from one mass"])
def test_the_effective_number_bounds_the_chance_of_any(kind: str) -> None:
    """Against drawn t variates: the chance that the largest is beyond a high threshold, and beyond a low one."""
    rng = np.random.default_rng(5)
    draws = rng.standard_normal((60, 8))
    seen = {"independent": np.linalg.qr(draws)[0], "alike": np.repeat(draws[:, :1], 8, axis=1),
            "from one mass": draws[:, :1] + 0.3 * draws}[kind]
    unit = seen / np.linalg.norm(seen, axis=0)
    number = effective_number(np.column_stack([unit, np.zeros(60)]), 3)
    t2 = (rng.standard_normal((40_000, 60)) @ unit) ** 2 / (rng.chisquare(6, (40_000, 1)) / 6)
    for alpha in (0.05, 0.01):
        found = float(np.mean(np.max(t2, axis=1) > scipy.stats.f.isf(alpha / number, 1, 6)))
        assert 0.6 * alpha < found < 1.15 * alpha  # 0.01: standard deviation 5 % of it
    least, most = {"independent": (5.0, 8.0), "alike": (0.95, 1.05), "from one mass": (1.0, 4.0)}[kind]
    assert least < number < most


def test_what_comes_nearest_is_said_and_no_name(rig: rt.System) -> None:
    """Gusts, which no effect describes: a weak heater comes nearest, and is too little for three reference records."""
    old = [record(502_000 + i, **SIZES) for i in (1, 2, 3)]
    found = rt.diagnose(rig, record(502_999, Day(draught=1.0), **SIZES), reference=old, effects=["input_gain"])
    assert found.verdict == "unexplained" and found.effects == ()
    said = found.outcome.text
    assert "Nearest to an answer, and no name: input_gain(heater) (gain 0.0" in said
    assert "chance 0.0" in said and "more reference records sharpen it" in said
    assert found.remainder is not None and dict(found.remainder.where)["plate"] > dict(found.remainder.where)["block"]


def test_what_was_missing_on_all_days_is_no_change(rig: rt.System) -> None:
    """A path that no file has makes every fit worse; it is a remainder of the reference, not a change."""
    lossy = Day(loss=0.15)
    found = rt.diagnose(rig, record(84, lossy, **SIZES), reference=[record(s, lossy, **SIZES) for s in (81, 82, 83)],
                        effects=FEW)
    assert found.verdict == "consistent" and found.reference is not None
    assert found.reference.remainder > 0.05


@pytest.fixture(scope="module")
def lossy(rig: rt.System) -> list[rt.Record]:
    """Healthy days of a machine with a path that no file has: a remainder of half a kelvin on every day."""
    return [record(seed, Day(loss=0.15), **SIZES) for seed in (1000, 1001, 1002, 1003)]


@pytest.mark.parametrize(("factors", "where"), [({"fan": 0.5}, FAN), ({"contact": 0.6}, CONTACT)])
def test_a_change_beside_a_remainder_is_named(rig: rt.System, lossy: list[rt.Record], factors: dict[str, float],
                                              where: str) -> None:
    """The remainder grows with the temperatures that the change raises: it is the old one still, not a new fault.

    All heat goes through the chain of the model, only a share s of it through that of the machine, beside the path that
    no file has: a conductance G of the model stands for G/s, and s is another one after the change.
    """
    found = rt.diagnose(rig, record(1999, Day(factors, loss=0.15), **SIZES), reference=lossy, effects=FEW)
    (one,) = found.effects
    assert found.verdict == "named_with_remainder" and (one.effect, one.where) == ("parameter_change", (where,))
    (factor,) = factors.values()
    true = factor * through_the_chain({}) / through_the_chain(factors) - 1.0
    value, std, _ = one.values["relative"]
    assert abs(value - true) < 3 * std and std < 0.2
    assert found.remainder is not None and found.remainder.gaps["train"].rms > 0.1


def through_the_chain(factors: dict[str, float], loss: float = 0.15) -> float:
    """Share of a steady heat into the block that goes through plate, sink and fan."""
    contact, middle, fan = (G * factors.get(name, 1.0) for G, name in
                            ((1.2, "contact"), (2.0, "middle"), (0.8, "fan")))
    chain = 1.0 / (1.0 / contact + 1.0 / middle + 1.0 / fan)
    return chain / (chain + loss)


@pytest.mark.exhaustive
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_the_standard_deviation_of_a_change_is_that_of_its_errors(rig: rt.System, factor: float) -> None:
    """Healthy numbers scatter by 3 % from day to day: so does what a change is relative to."""
    z = []
    for seed in range(700, 712):
        old = [record(10 * seed + i, **SIZES) for i in range(3)]
        found = rt.diagnose(rig, record(10 * seed + 9, Day({"fan": factor}), **SIZES), reference=old, effects=FEW)
        own = [one for one in found.effects if one.where == (FAN,)]
        if own:
            value, std, _ = own[0].values["relative"]
            z.append((value - (factor - 1.0)) / std)
    assert len(z) >= 10 and 0.5 < np.sqrt(np.mean(np.square(z))) < 1.7


def test_a_hotter_healthy_day_is_no_change(rig: rt.System, lossy: list[rt.Record]) -> None:
    """Three times the heat, three times the remainder."""
    found = rt.diagnose(rig, record(1998, Day(loss=0.15, power=3.0), **SIZES), reference=lossy, effects=FEW)
    assert found.verdict == "consistent" and found.reference is not None


@pytest.mark.exhaustive
def test_gusts_beside_a_remainder_are_not_named(rig: rt.System, lossy: list[rt.Record]) -> None:
    found = rt.diagnose(rig, record(1997, Day(loss=0.15, draught=6.0), **SIZES), reference=lossy,
                        effects=[*FEW, "periodic_load"])
    assert found.verdict == "unexplained" and found.effects == ()


def test_random_effects_are_those_of_exact_records() -> None:
    """With records that tell everything the scatter is the sample variance, with the prior as four more records."""
    rng = np.random.default_rng(0)
    shifts = rng.normal([0.2, -0.1], [0.05, 0.2], (9, 2))
    M = [np.array([[1e8, 2e7], [2e7, 3e8]])] * 9
    std, mean, covariance = random_effects(M, [one @ shift for one, shift in zip(M, shifts, strict=True)],
                                           np.array([0.03, 0.03]), np.array([1e3, 1e3]))
    expected = (4 * 0.03**2 + np.sum((shifts - shifts.mean(axis=0)) ** 2, axis=0)) / (4 + 8)
    assert std**2 == pytest.approx(expected, rel=1e-2) and mean == pytest.approx(shifts.mean(axis=0), abs=1e-4)
    assert np.diag(covariance) == pytest.approx(expected / 9, rel=1e-2)


def test_random_effects_of_records_that_tell_nothing_are_the_assumption() -> None:
    std, mean, _ = random_effects([np.zeros((1, 1))] * 5, [np.zeros(1)] * 5, np.array([0.03]), np.array([2.0]))
    assert (std[0], mean[0]) == (pytest.approx(0.03, rel=1e-2), 0.0)


def test_tied_parameters_change_together(rig: rt.System) -> None:
    key = ("links.block-plate.conductance", "links.plate-sink.conductance")
    tied = rig.with_parameters(dict.fromkeys(key, 1.5))
    (candidate,) = parameter_changes(tied, chosen_ranges(tied, {key: (0.1, 10.0)}))
    after = candidate.add(tied, float(np.log(0.5)))
    assert [after.parameter(name) for name in key] == [pytest.approx(0.75)] * 2


@pytest.mark.parametrize(("what", "message"), [
    ("seen", "among the reference records"), ("response", "Expected records"),
    ("operating point", "operating_point is given")])
def test_bad_input(rig: rt.System, old: list[rt.Record], what: str, message: str) -> None:
    new: Any = record(91, **SIZES)
    more: dict[str, Any] = {"reference": [*old, new]} if what == "seen" else {"reference": old}
    if what == "operating point":
        more["operating_point"] = {"heater": 10.0}
    if what == "response":
        more["reference"] = rt.identify.lpm(record(92, room=False, **SIZES))
    with pytest.raises(rt.InputError, match=message):
        rt.diagnose(rig, new, **more)


@pytest.fixture(scope="module")
def unchanged(rig: rt.System, old: list[rt.Record]) -> rt.diagnosis.Diagnosis:
    return rt.diagnose(rig, record(22, **SIZES), reference=old, effects=FEW)


def test_how_large_a_change_would_have_been_seen_is_said(rig: rt.System, unchanged: rt.diagnosis.Diagnosis) -> None:
    assert unchanged.verdict == "consistent" and unchanged.reference is not None
    visible = unchanged.reference.visible
    assert list(visible) == [*rig.fit, "inputs.heater.gain"]
    assert all(0.05 < size < 0.8 for sizes in visible.values() for size in sizes.values())
    assert unchanged.to_dict()["reference"]["visible"] == visible
    least = max(visible, key=lambda name: max(visible[name].values()))
    assert rt.thermal.parameter_in_words(least) in unchanged.caveats[-1].partition(";")[0]
    assert unchanged.outcome.text.endswith(unchanged.caveats[-1]) and "may not be visible" in unchanged.caveats[-1]


def test_a_change_that_is_said_to_be_visible_is_seen(rig: rt.System, unchanged: rt.diagnosis.Diagnosis,
                                                     old: list[rt.Record]) -> None:
    """Changed by what is stated, the same day is called changed most of the time, and never at a third of it."""
    assert unchanged.reference is not None
    seen = {1.0: 0, 1 / 3: 0}
    for name, factor in ((CONTACT, "contact"), ("links.plate-sink.conductance", "middle"),
                         ("inputs.heater.gain", "power")):
        for part in seen:
            day = Day({factor: 1.0 - part * unchanged.reference.visible[name]["lower"]})
            found = rt.diagnose(rig, record(22, day, **SIZES), reference=old, effects=FEW)
            seen[part] += found.verdict != "consistent"
    assert seen[1.0] >= 2 and seen[1 / 3] == 0


def test_a_heater_too_weak_to_be_seen_is_said(rig: rt.System) -> None:
    """Half a watt beside a path that no file has: it may fail altogether, and nobody would know."""
    lossy = [record(seed, Day(loss=0.15), **SIZES) for seed in (81, 82, 83, 84)]
    text = SYSTEM.replace("[sensors.T_block]", '[inputs.spare]\nlump = "plate"\n\n[sensors.T_block]')
    on = np.repeat(np.tile([0.0, 0.5], 15), 20)[:SIZES["length"]]
    days = [rt.Record(sample_time=one.sample_time, inputs=np.column_stack([one.inputs, on]), outputs=one.outputs,
                      input_names=[*one.input_names, "spare"], output_names=one.output_names) for one in lossy]
    found = rt.diagnose(rt.thermal.parse_system(text), days[3], reference=days[:3], effects=["input_gain"])
    assert found.verdict == "consistent" and found.reference is not None
    assert found.to_dict()["reference"]["visible"]["inputs.spare.gain"] == {"lower": None, "higher": pytest.approx(
        found.reference.visible["inputs.spare.gain"]["higher"])}
    assert any("the gain of spare could be 90 % lower" in text.lower() for text in found.caveats)


def test_a_column_that_heats_nothing_and_a_module_change_by_their_drive() -> None:
    """A fan that a link follows: its own gain is 0, what may change is what the drive makes of the column."""
    text = SYSTEM.replace("conductance = 0.8", 'conductance = 0.4\nfollow = { column = "fan", relative = 0.5 }')
    text = text.replace("[inputs.heater]", '[inputs.fan]\nlump = "sink"\ngain = 0.0\n\n[inputs.heater]')
    turns = np.repeat(np.tile([1.0, 3.0], 3), 50)
    days = [rt.Record(sample_time=one.sample_time, inputs=np.column_stack([one.inputs, turns]), outputs=one.outputs,
                      input_names=[*one.input_names, "fan"], output_names=one.output_names)
            for one in (record(seed, **SIZES) for seed in (1, 2, 22))]
    found = rt.diagnose(rt.thermal.parse_system(text), days[2], reference=days[:2], effects=["input_gain"])
    assert found.verdict == "consistent" and found.reference is not None  # the same misfit on all days
    names = [name for name in found.reference.visible if "gain" in name]
    assert sorted(names) == ["inputs.fan.drive.gain", "inputs.heater.gain"]


@pytest.mark.parametrize(("turns", "said"), [(3.0, True), (6.0, False)])
def test_a_column_that_was_elsewhere_on_the_days_of_reference_is_said(turns: float, said: bool, old: list[rt.Record]
                                                                      ) -> None:
    """A recorded flow at half of what it was: the answer named a conductance, and not the flow."""
    text = SYSTEM.replace("[inputs.heater]", '[inputs.flow]\nlump = "sink"\ngain = 0.0\n\n[inputs.heater]')

    def with_flow(one: rt.Record, level: float) -> rt.Record:
        return rt.Record(sample_time=one.sample_time, inputs=np.column_stack([one.inputs, np.full(len(one), level)]),
                         outputs=one.outputs, input_names=[*one.input_names, "flow"], output_names=one.output_names)

    slow = record(21, Day({"fan": 0.5}), **SIZES)
    found = rt.diagnose(rt.thermal.parse_system(text), with_flow(slow, turns),
                        reference=[with_flow(one, 6.0) for one in old], effects=["sensor_offset"])
    assert [one.where for one in found.effects] == [(FAN,)]
    sentences = [one for one in found.caveats if "nothing in the model follows it" in one]
    assert len(sentences) == said and all(one in found.outcome.text for one in sentences)
    assert all(one.startswith("flow is 3 in the new records and 6 in the reference records") for one in sentences)


def test_a_fan_beside_a_path_that_no_file_has_is_named(rig: rt.System) -> None:
    """What is left without bending other parameters is what a change has to explain: 6.3 K fall to 0.5 K."""
    old = [record(1_101_000 + i, Day(loss=0.15)) for i in range(3)]
    found = rt.diagnose(rig, record(1_101_999, Day({"fan": 0.5}, loss=0.15)), reference=old)
    assert [(one.effect, one.where) for one in found.effects] == [("parameter_change", (FAN,))]
    assert found.gap["train"].before > 5.0 > 1.0 > found.gap["train"].after


def test_what_was_added_first_is_no_part_of_the_reference_records(rig: rt.System) -> None:
    """Natural convection came first and its gain was to change next, on records that have none: bad input, exit 2."""
    old = [record(1_120_000 + i) for i in range(3)]
    found = rt.diagnose(rig, record(1_120_999, Day(draught=1.0)), reference=old)
    assert found.verdict == "unexplained" and not found.effects
