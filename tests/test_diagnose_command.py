"""robthermal diagnose: exit status, files, refusals; data from scipy, so that nothing of the package makes them."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from commands import Run
from scipy.integrate import solve_ivp

import robthermal as rt
from robthermal.jobs.diagnose._answer import accepted_in_words

pytestmark = pytest.mark.usefixtures("sketched")
H, DWELL = 5.0, 20
FILES = ["augmented.toml", "diagnosis.json", "junit.xml", "report.html", "report.json", "summary.json"]
SYSTEM = """
[system]
name = "block on a plate"
temperature_unit = "degC"

[ambients.room]
temperature = 25.0

[lumps.plate]
capacity = 120.0

[lumps.block]
capacity = 40.0

[[links]]
between = ["plate", "room"]
conductance = 0.6

[[links]]
between = ["plate", "block"]
conductance = 1.5

[inputs.heater]
lump = "block"
limits = [0.0, 12.0]

[sensors.Tp]
lump = "plate"
noise = 0.01

[sensors.Tb]
lump = "block"
noise = 0.01

[fit]
"lumps.plate.capacity" = { lower = 30.0, upper = 480.0, sigma = 12.0 }
"links.plate-room.conductance" = { lower = 0.15, upper = 2.4, sigma = 0.06 }
"""


def nothing(t: float, T: np.ndarray) -> np.ndarray:
    return np.zeros(2)


def across(t: float, T: np.ndarray) -> np.ndarray:
    """A heat path from block to room that the system file does not have."""
    return np.array([0.0, -0.12 * (T[1] - 25.0)])


def constant(t: float, T: np.ndarray) -> np.ndarray:
    """One heat with several names: source, gradient of the ambient, self-heating of the sensor."""
    return np.array([0.4, 0.0])


def measure(path: Path, hidden: Callable[[float, np.ndarray], np.ndarray], seed: int, n: int, room: bool) -> Path:
    rng = np.random.default_rng(seed)
    heater = rng.choice([0.0, 3.0, 7.0, 11.0], n // DWELL)
    T, rows = np.array([25.0, 25.0]), []
    for k, q in enumerate(heater):
        def rate(t: float, T: np.ndarray, q: float = q) -> np.ndarray:
            flow = 1.5 * (T[1] - T[0])
            heat = np.array([flow - 0.62 * (T[0] - 25.0), q - flow]) + hidden(t, T)
            return heat / np.array([123.0, 40.0])

        t = H * np.arange(k * DWELL, (k + 1) * DWELL + 1)
        run = solve_ivp(rate, (t[0], t[-1]), T, t_eval=t, max_step=5.0, rtol=1e-8, atol=1e-8)
        T = run.y[:, -1]
        rows += [(time, q, *y) for time, y in zip(t[:-1], run.y.T[:-1], strict=True)]
    table = np.array(rows)
    table[:, 2:] += 0.01 * rng.standard_normal((n, 2))
    table, names = np.insert(table, 2, 25.0, axis=1), "time,heater,room,Tp,Tb"
    if not room:
        table, names = np.delete(table, 2, axis=1), "time,heater,Tp,Tb"
    np.savetxt(path, table, delimiter=",", header=names, comments="", fmt="%.9g")
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., tuple[Path, Path, Path]]:
    folder = tmp_path_factory.mktemp("records")
    (folder / "setup.toml").write_text(SYSTEM, encoding="utf-8")

    def made(hidden: Callable[[float, np.ndarray], np.ndarray], room: bool = False) -> tuple[Path, Path, Path]:
        name = f"{hidden.__name__}{'_room' * room}"
        train, validation = (folder / f"{name}_{kind}.csv" for kind in ("train", "validation"))
        if not train.exists():
            measure(train, hidden, 1, 400, room)
            measure(validation, hidden, 2, 200, room)
        return folder / "setup.toml", train, validation

    return made


def free_run(system: Path, record: Path) -> np.ndarray:
    """Residual of a file from outside: simulated from the true start, 25 °C everywhere."""
    found = rt.read_system(system)
    measured = rt.read_record(record, found)
    model = rt.thermal.simulate(found, measured, initial=dict.fromkeys(found.lumps, 298.15))
    return measured.outputs - np.column_stack([model[name] for name in measured.output_names])


@pytest.fixture(scope="module")
def out(files: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    system, train, validation = files(across)
    found = rt.read_system(system)
    result = rt.jobs.diagnose_records(found, (system, train, validation), [rt.read_record(train, found)],
                                      [rt.read_record(validation, found)])
    folder = tmp_path_factory.mktemp("named") / "out"
    rt.jobs.write_diagnosis(result, folder)
    return folder


class TestNamed:
    def test_diagnosis_json_has_the_keys_of_its_contract(self, out: Path) -> None:
        found = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
        assert {"format", "verdict", "effects", "alternatives", "located", "gap", "not_testable",
                "next_experiment"} <= set(found)
        assert (found["format"], found["verdict"]) == ("robthermal-diagnosis/2", "named")
        assert [(e["effect"], e["where"]) for e in found["effects"]] == [("missing_ambient_link", ["block", "room"])]
        size = found["effects"][0]["parameters"]["conductance"]
        assert abs(size["value"] - 0.12) < 4 * size["std"] and size["unit"] == "W/K"

    def test_augmented_toml_closes_the_gap_on_validation_data(self, out: Path, files: Any) -> None:
        """The files alone, free runs by another way than the diagnosis's own."""
        system, _, validation = files(across)
        gap = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))["gap"]["validation"]
        before, after = (np.sqrt(np.mean(free_run(file, validation) ** 2)) for file in (system, out / "augmented.toml"))
        assert before > 0.2 and after == pytest.approx(gap["after"], rel=0.1) and after < 0.012

    def test_junit_and_summary_are_tests_not_proofs(self, out: Path) -> None:
        cases = ElementTree.parse(out / "junit.xml").getroot().findall(".//testcase")
        assert [case.get("name") for case in cases] == [
            "Verdict: named", "Nothing is left in the training records", "Unseen records are predicted"]
        assert not any(case.findall("failure") for case in cases)
        summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
        assert summary["holds"] and all(c["tested"] and c["verified"] is None for c in summary["claims"])

    def test_the_report_says_what_was_found_and_never_that_it_is_certified(self, out: Path) -> None:
        page = (out / "report.html").read_text(encoding="utf-8")
        for words in ("Diagnosis report", "✓</span> NAMED", "missing_ambient_link(block, room)", "accepted, ΔBIC",
                      "which it resembles", "no more than noise", "Residual before and after", "train: across_train",
                      "validation: across_validation", "Where the misfit sits", "What could not have been seen",
                      "Next experiment", "SHA-256 of across_validation.csv", "nothing here is proven"):
            assert words in page, words
        assert "ertified" not in page and "CERTIFIED" not in page and "robthermal verify" not in page


@pytest.mark.usefixtures("drawn")
def test_consistent_is_yes(run: Run, files: Any, tmp_path: Path) -> None:
    system, train, validation = files(nothing)
    out = tmp_path / "out"
    status, said, warned = run("diagnose", system, train, "--validation", validation, "--out", out, "--json")
    assert (status, warned) == (0, "")
    found = json.loads(said)
    assert found["verdict"] == "consistent" and found["effects"] == [] and found["out"] == str(out)
    assert sorted(path.name for path in out.iterdir()) == FILES
    assert set(found) == set(json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))) | {"out", "report"}


def test_without_validation_the_report_says_so(run: Run, files: Any, tmp_path: Path) -> None:
    system, train, _ = files(nothing)
    status, said, _ = run("diagnose", system, train, "--out", tmp_path / "out")
    assert status == 0 and "verdict: consistent" in said
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "No validation record was given" in page and "Unseen records are predicted" not in page


def test_ambiguous_is_no_and_lists_the_others(run: Run, files: Any, tmp_path: Path) -> None:
    system, train, validation = files(constant, room=True)
    out = tmp_path / "out"
    status, said, _ = run("diagnose", system, train, "--validation", validation, "--out", out, "--json")
    found = json.loads(said)
    assert (status, found["verdict"]) == (1, "ambiguous")
    names = {found["effects"][0]["effect"], *(other["effect"] for other in found["alternatives"][0])}
    assert {"heat_source", "ambient_gradient", "sensor_self_heating"} <= names
    page = (out / "report.html").read_text(encoding="utf-8")
    assert sorted(path.name for path in out.iterdir()) == sorted([*FILES, "next_experiment.csv"])
    assert (out / "next_experiment.csv").read_text(encoding="utf-8").splitlines()[0] == "time,heater,room"
    assert run("simulate", system, out / "next_experiment.csv", "--out", tmp_path / "predicted.csv")[0] == 0
    assert "✗</span> AMBIGUOUS" in page and "these records cannot tell it from" in page


def test_a_constant_heat_where_the_room_is_not_recorded_may_be_the_room(run: Run, files: Any, tmp_path: Path,
                                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    """0.4 W into the plate, which loses 0.62 W/K: as a room that is 0.65 K warmer."""
    few = partial(rt.diagnose, effects=["heat_source", "sensor_offset"])
    monkeypatch.setattr("robthermal.jobs.diagnose._diagnose.diagnose", few)
    system, train, validation = files(constant)
    status, said, _ = run("diagnose", system, train, "--validation", validation, "--out", tmp_path / "out", "--json")
    found = json.loads(said)
    assert (status, found["verdict"]) == (0, "consistent")
    room, = found["ambients"]
    assert (room["ambient"], room["record"], room["unit"], room["declared"]) == ("room", train.name, "K", 298.15)
    assert abs(room["value"] - 298.15 - 0.4 / 0.62) < 4 * room["std"] < 0.4
    assert "room was not recorded, and is an unknown of every record: 25." in found["outcome"]["text"]


def test_what_does_not_hold_on_validation_records_has_no_name(run: Run, files: Any, tmp_path: Path) -> None:
    system, train, _ = files(nothing)
    out = tmp_path / "out"
    status, said, _ = run("diagnose", system, train, "--validation", files(across)[2], "--out", out)
    assert status == 1 and "verdict: unexplained" in said
    assert json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))["effects"] == []
    failed = [case.get("name") for case in ElementTree.parse(out / "junit.xml").iter("testcase") if len(
        case.findall("failure"))]
    assert failed == ["Verdict: unexplained", "Unseen records are predicted"]
    assert "✗</span> UNEXPLAINED" in (out / "report.html").read_text(encoding="utf-8")


class TestBadInput:
    def refused(self, run: Run, out: Path, *words: object) -> str:
        status, said, message = run("diagnose", *words, "--out", out)
        assert (status, said, message.count("\n")) == (2, "", 1)
        assert not out.exists() and not list(out.parent.glob(".*"))
        return message

    def test_validation_on_training_data(self, run: Run, files: Any, tmp_path: Path) -> None:
        system, train, _ = files(nothing)
        message = self.refused(run, tmp_path / "out", system, train, "--validation", train)
        assert "--validation" in message and "is the training record" in message and "argument" not in message

    def test_missing_record(self, run: Run, files: Any, tmp_path: Path) -> None:
        assert "no.csv" in self.refused(run, tmp_path / "out", files(nothing)[0], tmp_path / "no.csv")

    def test_record_too_short(self, run: Run, files: Any, tmp_path: Path) -> None:
        system, train, _ = files(nothing)
        short = tmp_path / "short.csv"
        short.write_text("\n".join(train.read_text(encoding="utf-8").splitlines()[:4]) + "\n", encoding="utf-8")
        assert "training records" in self.refused(run, tmp_path / "out", system, short)

    def test_a_folder_with_other_things_is_kept(self, run: Run, files: Any, tmp_path: Path) -> None:
        (tmp_path / "mine").mkdir()
        (tmp_path / "mine" / "thesis.txt").write_text("years", encoding="utf-8")
        status, _, message = run("diagnose", *files(nothing)[:2], "--out", tmp_path / "mine")
        assert status == 2 and "other things" in message
        assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.txt"]


def test_a_frequency_response_and_its_operating_point(files: Any, run: Run, tmp_path: Path) -> None:
    """Estimated by `robthermal frf`; hidden: a path to the room, which a response cannot tell from convection."""
    system, train, validation = files(across)
    assert run("frf", train, "--system", system, "--out", tmp_path / "frf.json")[0] == 0
    words = ("diagnose", system, tmp_path / "frf.json", "--operating-point", "heater=5.25", "--operating-point",
             "room=25", "--out", tmp_path / "found", "--json")
    status, _, warned = run(*words, "--validation", validation)
    assert status == 2 and "a frequency response" in warned
    status, said, _ = run(*words)
    found = json.loads(said)
    named = [(e["effect"], tuple(e["where"])) for e in found["effects"]]
    named += [(e["effect"], tuple(e["where"])) for others in found["alternatives"] for e in others]
    assert status in (0, 1) and ("missing_ambient_link", ("block", "room")) in named
    page = (tmp_path / "found" / "report.html").read_text(encoding="utf-8")
    assert "Measured − model, response (lpm" in page


def test_days_with_a_gain_of_their_own(files: Any, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two effects are tried: without gains nothing must be consistent, with them nothing has to be tried at all."""
    few = partial(rt.diagnose, effects=["sensor_lag", "heat_source"])
    monkeypatch.setattr("robthermal.jobs.diagnose._diagnose.diagnose", few)
    system, train, validation = files(nothing)
    table = np.loadtxt(validation, delimiter=",", skiprows=1)
    table[:, 1] /= 1.05  # on this day the heater gave 5 % more than recorded
    other = tmp_path / "day2.csv"
    np.savetxt(other, table, delimiter=",", header="time,heater,Tp,Tb", comments="", fmt="%.9g")
    without = run("diagnose", system, train, other, "--out", tmp_path / "a", "--json")
    with_gain = run("diagnose", system, train, other, "--session-gain", "--out", tmp_path / "b", "--json")
    assert json.loads(without[1])["verdict"] != "consistent"
    assert (with_gain[0], json.loads(with_gain[1])["verdict"]) == (0, "consistent")


def test_what_healthy_days_name_is_added_before_days_are_compared(files: Any, run: Run, tmp_path: Path,
                                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    few = partial(rt.diagnose, effects=["missing_ambient_link", "sensor_lag"])
    monkeypatch.setattr("robthermal.jobs.diagnose._diagnose.diagnose", few)
    system, healthy, _ = files(across)
    other, new = (measure(tmp_path / f"day{seed}.csv", across, seed, 400, False) for seed in (3, 4))
    words = ("diagnose", system, new, "--reference", healthy, other, "--out")
    assert run(*words, tmp_path / "plain", "--json")[0] in (0, 1)
    status, said, _ = run(*words, tmp_path / "more", "--augment", "--json")
    found = json.loads(said)
    assert (status, found["verdict"]) == (0, "consistent")
    added = found["reference"]["augmented"]
    assert [(one["effect"], one["where"]) for one in added["effects"]] == [("missing_ambient_link", ["block", "room"])]
    augmented = rt.read_system(tmp_path / "more" / "augmented.toml")
    assert any(set(link.between) == {"block", "room"} for link in augmented.links)
    assert "a heat path from block to room" in (tmp_path / "more" / "report.html").read_text(encoding="utf-8")
    plain = json.loads((tmp_path / "plain" / "diagnosis.json").read_text(encoding="utf-8"))["reference"]
    assert "augmented" not in plain and plain["rms"] > 2.0 * found["reference"]["rms"]


def test_augment_without_reference_is_refused_in_the_words_of_the_command(files: Any, run: Run, tmp_path: Path
                                                                          ) -> None:
    system, train, _ = files(nothing)
    status, _, said = run("diagnose", system, train, "--augment", "--out", tmp_path / "out")
    assert status == 2 and "--augment" in said and "reference" in said and not (tmp_path / "out").exists()


def test_a_bad_operating_point_is_refused(files: Any, run: Run, tmp_path: Path) -> None:
    system, train, _ = files(nothing)
    status, _, said = run("diagnose", system, train, "--operating-point", "room=298.15 K", "--out", tmp_path / "out")
    assert status == 2 and "NAME=VALUE" in said and not (tmp_path / "out").exists()


def test_sets_of_several_effects_are_read_apart() -> None:
    """Commas within a set, a semicolon between sets."""
    def found(*names: tuple[tuple[str, tuple[str, ...]], ...]) -> Any:
        effects = [SimpleNamespace(effect=one[0][0], where=one[0][1]) for one in names]
        return SimpleNamespace(reference=None, effects=effects, alternatives=[one[1:] for one in names],
                               nominal=SimpleNamespace(system=SimpleNamespace(inputs={})))

    path, other, gain = ("missing_link", ("a", "b")), ("missing_link", ("a", "c")), ("sensor_gain", ("T",))
    mass = ("hidden_mass", ("b",))
    assert accepted_in_words(found((path, other, gain), (mass,))) == (
        "a heat path between a and b, a heat path between a and c or a gain error of sensor T; "
        "and a mass that hangs on b")
    assert accepted_in_words(found((path, other), (mass,))) == (
        "a heat path between a and b or a heat path between a and c, and a mass that hangs on b")
    assert accepted_in_words(found((mass,))) == "a mass that hangs on b"
