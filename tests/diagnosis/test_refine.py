"""Splitting the lump in which the remainder sits: machines from a matrix exponential."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import Run
from scipy.linalg import expm

import robthermal as rt
from robthermal.diagnosis.plan import resolving
from robthermal.jobs.diagnose import Diagnosed
from robthermal.jobs.diagnose._answer import answer_sentence

pytestmark = pytest.mark.usefixtures("sketched")
ROOM, STEP, NOISE = 295.0, 5.0, 0.02
FEW = ["heat_source"]
OVEN = rt.System(
    name="oven", ambients={"room": {"temperature": ROOM}},
    lumps={"block": {"capacity": 200.0}, "plate": {"capacity": 150.0}},
    links=[{"between": ("block", "plate"), "conductance": 1.5}, {"between": ("plate", "room"), "conductance": 0.8},
           {"between": ("block", "room"), "conductance": 0.2}],
    inputs={"q": {"lump": "block", "limits": (0.0, 20.0)}, "p": {"lump": "plate", "limits": (0.0, 20.0)}},
    sensors={"T_block": {"lump": "block", "noise": NOISE}, "T_plate": {"lump": "plate", "noise": NOISE}},
    fit={"lumps.block.capacity": {"lower": 50.0, "upper": 800.0}, "lumps.plate.capacity": {"lower": 50.0,
         "upper": 800.0}, "links.block-plate.conductance": {"lower": 0.2, "upper": 10.0},
         "links.plate-room.conductance": {"lower": 0.1, "upper": 5.0},
         "links.block-room.conductance": {"lower": 0.02, "upper": 2.0}})


def measured(seed: int, *, between: float = 1.0, gusts: float = 0.0, n: int = 300, spot: float = 0.0) -> rt.Record:
    """The block as two halves joined by a conductance: the heater is on one, sensor and plate are at the other.

    Or as a spot of so many J/K with heater and sensor, and the rest.
    """
    rng = np.random.default_rng(seed)
    u = np.column_stack([np.repeat(rng.choice([0.0, 5.0, 10.0, 20.0], n // 20), 20),
                         np.repeat(rng.choice([0.0, 5.0, 10.0, 20.0], n // 25), 25)])
    C = np.array([spot or 100.0, 200.0 - (spot or 100.0), 150.0])[:, None]
    A = np.array([[-between - 0.1, between, 0.0], [between, -between - 0.1 - 1.5, 1.5], [0.0, 1.5, -1.5 - 0.8]]) / C
    B = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]) / C
    M = expm(np.block([[A, B], [np.zeros((2, 5))]]) * STEP)[:3]
    blown = gusts * (np.cumsum(rng.random(n) < 0.05) % 2)  # W into the plate, on and off
    T, out = np.zeros(3), []
    for k in range(n):
        out.append(ROOM + T[[0 if spot else 1, 2]])
        T = M @ np.array([*T, u[k, 0], u[k, 1] + blown[k]])
    return rt.Record(sample_time=STEP, inputs=u, outputs=np.array(out) + NOISE * rng.standard_normal((n, 2)),
                     input_names=["q", "p"], output_names=["T_block", "T_plate"])


def test_a_spot_under_the_heater_is_found_with_a_capacity_of_its_own() -> None:
    answer = rt.diagnose(OVEN, measured(1, between=0.4, spot=8.0), validation=measured(2, between=0.4, spot=8.0),
                         effects=FEW, refine=True)
    one = answer.refinement
    assert one is not None and one.outcome.ok and one.lump == "block"
    parts = sorted(one.system.parameter(f"lumps.{name}.capacity") for name in ("block", "block_2"))
    assert parts == pytest.approx([8.0, 192.0], rel=0.1) and one.conductance[0] == pytest.approx(0.4, rel=0.05)
    assert one.after["validation"] < 0.2 * one.before["validation"]
    assert all(f"{value:.3g}" in one.outcome.text for value in parts)
    for name in ("block", "block_2"):
        bounds = one.system.fit[f"lumps.{name}.capacity"]
        assert bounds.lower <= one.system.parameter(f"lumps.{name}.capacity") <= bounds.upper


def test_parts_of_a_lump_whose_capacity_has_a_prior_are_halves() -> None:
    prior = {**OVEN.fit, "lumps.block.capacity": {"lower": 50.0, "upper": 800.0, "sigma": 30.0}}
    known = OVEN.model_copy(update={"fit": rt.System(**{**OVEN.model_dump(), "fit": prior}).fit})
    one = rt.diagnose(known, measured(1), validation=measured(2), effects=FEW, refine=True).refinement
    assert one is not None and one.outcome.ok
    assert one.system.parameter("lumps.block.capacity") == one.system.parameter("lumps.block_2.capacity")


@pytest.fixture(scope="module")
def halves() -> rt.diagnosis.Diagnosis:
    return rt.diagnose(OVEN, measured(1), validation=measured(2), effects=FEW, refine=True)


def test_the_split_machine_is_found_again(halves: rt.diagnosis.Diagnosis) -> None:
    one = halves.refinement
    assert halves.verdict == "unexplained" and one is not None and one.outcome.ok
    assert (one.lump, one.best.moved) == ("block", ("inputs.q",))
    value, std = one.conductance
    assert abs(value - 1.0) < 4 * std < 0.05
    assert one.verdict == "consistent" and one.effects == ()
    assert one.before["validation"] > 0.1 and max(one.after.values()) < 0.01
    assert [split.rms for split in one.tried] == sorted(split.rms for split in one.tried)
    assert pickle.loads(pickle.dumps(one)).to_dict() == one.to_dict()


def test_the_refined_system_predicts_a_third_day(halves: rt.diagnosis.Diagnosis) -> None:
    assert halves.refinement is not None
    unseen = measured(3)
    errors = []
    for system in (halves.system, halves.refinement.system):
        run = rt.thermal.simulate(system, unseen, initial=dict.fromkeys(system.lumps, ROOM))
        errors.append(float(np.sqrt(np.mean((unseen.outputs - run.outputs) ** 2))))
    assert errors[0] > 5 * NOISE and errors[1] < 1.2 * NOISE


def test_the_answer_itself_is_not_changed(halves: rt.diagnosis.Diagnosis) -> None:
    assert set(halves.system.lumps) == {"block", "plate"} and halves.effects == ()
    answer = halves.to_dict()
    assert answer["refinement"]["lump"] == "block" and answer["refinement"]["verdict"] == "consistent"
    assert set(answer["refinement"]["before"]) == set(answer["refinement"]["after"]) == {"train", "validation"}
    assert answer["refinement"]["helps"] is True
    json.dumps(answer)


def test_what_would_resolve_it(halves: rt.diagnosis.Diagnosis) -> None:
    what = halves.resolving
    assert what is not None and (what.lump, what.input, what.sensor) == ("block", "q", "")
    assert 2 * STEP <= what.shortest < what.longest <= 600 * STEP
    assert str(what) in halves.outcome.text


def test_a_lump_without_a_sensor_is_where_one_belongs() -> None:
    system = rt.systems.two_module()
    bare = system.model_copy(update={"sensors": {name: one for name, one in system.sensors.items()
                                                 if one.lump != "x3"}})
    rest = rt.diagnosis.Remainder({}, {"T6": 0.1}, (("x6", 0.8), ("x3", 0.75), ("x1", 0.2)), 1e-3, 1e-2, 0.8, 0.5)
    what = resolving(rest, bare)
    assert what is not None and (what.lump, what.sensor, what.others) == ("x6", "x3", ("x3",))
    assert (what.shortest, what.longest) == (pytest.approx(100.0), pytest.approx(1000.0))


def test_gusts_are_no_matter_of_the_network() -> None:
    """Random heat that nobody declared, on a machine whose lumps are right: no split takes it away."""
    train, unseen = (measured(seed, between=1e4, gusts=5.0) for seed in (4, 5))
    found = rt.diagnose(OVEN, train, validation=unseen, effects=FEW, refine=True)
    assert found.verdict == "unexplained" and found.refinement is not None
    one = found.refinement
    assert not one.outcome.ok and "does not remove the remainder" in one.outcome.text
    assert "the remainder falls" not in answer_sentence(found)
    assert one.after["validation"] > 0.7 * one.before["validation"]


def test_nothing_left_is_nothing_to_split() -> None:
    found = rt.diagnose(OVEN, measured(6, between=1e4), effects=FEW, refine=True)
    assert found.verdict == "consistent" and found.refinement is None and found.resolving is None


@pytest.mark.exhaustive
def test_a_name_that_stands_for_the_split_is_said_to_do_so() -> None:
    """With the lag of a sensor as the only effect to try, that is named beside a remainder: wrongly."""
    found = rt.diagnose(OVEN, measured(9, n=200), validation=measured(10, n=200), effects=["sensor_lag"],
                        refine=True)
    assert found.verdict == "named_with_remainder" and found.refinement is not None
    assert found.refinement.verdict == "consistent"
    assert " and without any effect, the remainder falls from " in answer_sentence(found)
    other = replace(found, refinement=replace(found.refinement, effects=("heat_source(block)",)))
    assert " and a constant heat into block, the remainder falls from " in answer_sentence(other)
    assert "Without any effect: sensor_lag(T_" in found.refinement.outcome.text
    assert "may stand for the split only" in found.refinement.outcome.text


def test_the_folder_holds_the_split_network(halves: rt.diagnosis.Diagnosis, tmp_path: Path) -> None:
    out = tmp_path / "out"
    report = rt.jobs.write_diagnosis(Diagnosed(halves, (), (), ()), out)
    assert "With block in two parts, q at the other one, the remainder falls from " in report.headline
    split = rt.read_system(out / "refined.toml")
    assert split.inputs["q"].lump == "block_2"
    assert split.parameter("links.block-block_2.conductance") == pytest.approx(1.0, rel=0.05)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "A finer network" in page and "Ways to split" in page
    assert json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))["refinement"]["verdict"] == "consistent"


def test_the_command_asks_for_it(run: Run, tmp_path: Path) -> None:
    """On records of the user's own network: nothing is left, nothing is split, and it says so."""
    rt.thermal.write_system(OVEN, tmp_path / "oven.toml")
    rt.signals.save_records([measured(6, between=1e4)], tmp_path / "train.csv", temperature_unit="K",
                            temperatures=["T_block", "T_plate"])
    status, text, _ = run("diagnose", tmp_path / "oven.toml", tmp_path / "train.csv", "--refine", "--out",
                          tmp_path / "out")
    assert status == 0 and "no lump was split, nothing is left beyond the noise" in " ".join(text.split())
    assert not (tmp_path / "out" / "refined.toml").exists()


def test_a_comparison_of_days_is_not_refined() -> None:
    with pytest.raises(rt.InputError, match="refine is given with reference"):
        rt.diagnose(OVEN, measured(1), reference=measured(2), refine=True)
