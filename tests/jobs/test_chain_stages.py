"""What the stages of the chain hand to each other: responses, adopted effects, designs, couplings."""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import Run
from heated_bar import CAPACITY, CONDUCTANCE, NOISE, POWER, PROJECT, ROOM, SYSTEM, closed_form, write_bar
from scipy.signal import lfilter

import robthermal as rt

pytestmark = pytest.mark.usefixtures("sketched")
LAG = 12.0  # s, of the sensor, which the system file does not have
A, B = 0.99, 0.01  # plant of the coupling, y = B/(z - A) u, sampled every 0.01 s
COUPLE = f"""
[identify.one]
records = ["one.csv"]
inputs = ["u"]
outputs = ["y"]
method = "lpm"
use = "none"
[couple]
name = "pair"
sample_time = 0.01
frf_1 = ["identify.one"]
frf_2 = ["identify.one"]
[couple.subsystems.1]
plant = {{ num = [{B}], den = [1.0, -{A}] }}
controller = 20.0
[couple.subsystems.2]
plant = {{ num = [{B}], den = [1.0, -{A}] }}
controller = 20.0
[couple.design]
X_hat = -0.9
"""


def go(project: Path, out: Path, **options: object) -> tuple[rt.report.Report, dict[str, object]]:
    report = rt.jobs.run_project(rt.jobs.read_project(project), out, **options)  # type: ignore[arg-type]
    return report, json.loads((out / "summary.json").read_text())


def statuses(report: rt.report.Report) -> list[str]:
    return [stage.status for stage in report.stages]


def write_lagging(folder: Path, project: str) -> Path:
    """Project of the bar with two sensors, steps in closed form; T lags by 12 s, S does not."""
    file = write_bar(folder, project=project)
    noise, time = np.random.default_rng(1), np.arange(900.0)
    for name, share in (("train", 1.0), ("validation", 0.5)):
        steps = ((0.0, share), (300.0, -share), (500.0, 0.6 * share))
        heater = 100 * share * np.select([time < 300, time < 500], [1.0, 0.0], 0.6)
        late, prompt = (ROOM + sum(closed_form(time, step, start, lag) for start, step in steps)
                        + noise.normal(0, NOISE, time.size) for lag in (LAG, 0.0))
        rows = [f"{t:g},{q:g},{T:.4f},{S:.4f}" for t, q, T, S in zip(time, heater, late, prompt, strict=True)]
        (folder / f"{name}.csv").write_text("\n".join(["time,Q,T,S", *rows]))
    (folder / "bar.toml").write_text(f'{SYSTEM}\n[sensors.S]\nlump = "bar"\nnoise = {NOISE}\n')
    return file


def test_a_named_effect_is_adopted(tmp_path: Path) -> None:
    """The truth has a sensor that lags by 12 s; with it the model fails, with the effect adopted it predicts."""
    project = write_lagging(tmp_path, f"{PROJECT}[diagnose]\n")
    report, before = go(project, tmp_path / "out")
    codes = {one.code: one.level for one in report.reasons}
    assert report.verdict == "FAIL" and codes["diagnosis_named"] == codes["validation_misfit"] == "fail"
    project.write_text(f"{PROJECT}[diagnose]\nadopt = true\n")
    report, after = go(project, tmp_path / "out")
    assert statuses(report) == ["skipped", "cached", "done", "done", "skipped", "skipped"]
    assert {one.code: one.level for one in report.reasons} == {"diagnosis_named": "remark",
                                                                    "ambient_not_recorded": "remark"}
    assert report.verdict == "PASS WITH REMARKS" and after["diagnose"] == {
        "verdict": "named", "adopted": True, "effects": ["sensor_lag(T)"]}
    row = after["calibrate"]["parameters"]["sensors.T.time_constant"]  # type: ignore[index]
    assert row["range"][0] < LAG < row["range"][1] and row["value"] == pytest.approx(LAG, rel=0.05)
    residual = after["residuals"]["validation"]["validation.csv"]["T"]  # type: ignore[index]
    assert residual["rms"] == pytest.approx(NOISE, rel=0.1)
    assert before["residuals"]["validation"]["validation.csv"]["T"]["rms"] > 3 * NOISE  # type: ignore[index]
    augmented = rt.read_system(tmp_path / "out" / "augmented.toml")
    assert augmented.sensors["T"].time_constant == pytest.approx(row["value"], rel=1e-9)
    ranges = after["certify"]["parameters"]  # type: ignore[index]
    for name, truth in (("lumps.bar.capacity", CAPACITY), ("links.bar-room.conductance", CONDUCTANCE)):
        assert ranges[name][0] < truth < ranges[name][1], "the truth is within the ranges that are certified"
    assert after["certify"]["robust"] and all(after["certify"]["robust"].values())  # type: ignore[index]
    assert statuses(go(project, tmp_path / "out")[0])[1:4] == ["cached"] * 3


def test_what_is_ambiguous_is_not_adopted(tmp_path: Path) -> None:
    """The system says that the room is 3 K colder than it is: a constant heat explains the records as well."""
    project = write_bar(tmp_path, project=f"{PROJECT}[diagnose]\nadopt = true\n")
    (tmp_path / "bar.toml").write_text(SYSTEM.replace("temperature = 20.0", "temperature = 17.0"))
    report, summary = go(project, tmp_path / "out")
    assert report.verdict == "FAIL" and summary["diagnose"]["adopted"] is False  # type: ignore[index]
    assert {"diagnosis_ambiguous", "validation_misfit"} <= {one.code for one in report.reasons if one.level == "fail"}
    (misfit, *_) = [one for one in report.reasons if one.code == "validation_misfit"]
    assert misfit.remedy.startswith("See what the diagnosis says") and "robthermal diagnose" not in misfit.remedy
    assert "lumps.bar.heat" not in summary["certify"]["parameters"]  # type: ignore[index]


def test_an_effect_beside_a_remainder_is_not_adopted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same effect, named while something else is left: a person has to judge it."""
    room = importlib.import_module("robthermal.jobs.chain._diagnose")
    found = room.diagnose_records

    def with_remainder(*inputs: Any, **options: Any) -> Any:
        result = found(*inputs, **options)
        return replace(result, diagnosis=replace(result.diagnosis, verdict="named_with_remainder"))

    monkeypatch.setattr(room, "diagnose_records", with_remainder)
    _, summary = go(write_lagging(tmp_path, f"{PROJECT}[diagnose]\nadopt = true\n"), tmp_path / "out")
    assert summary["diagnose"] == {"verdict": "named_with_remainder", "adopted": False,
                                   "effects": ["sensor_lag(T)"]}
    assert "sensors.T.time_constant" not in summary["certify"]["parameters"]  # type: ignore[index]


def test_a_box_above_the_stated_temperatures_is_a_remark(tmp_path: Path) -> None:
    """8 W through 0.4 W/K warm the bar by 20 K: with 30 degrees stated, the machine gets hotter than stated."""
    project = PROJECT.replace("temperature = [15.0, 45.0]", "temperature = [15.0, 30.0]")
    report, _ = go(write_bar(tmp_path, project=project), tmp_path / "out")
    found = {one.code: one for one in report.reasons}["box_beyond_temperature"]
    assert found.level == "remark" and report.verdict == "PASS WITH REMARKS"
    assert found.value is not None and found.value > 273.15 + 21.0 + POWER / CONDUCTANCE
    inside, _ = go(write_bar(tmp_path), tmp_path / "inside")
    assert "box_beyond_temperature" not in {one.code for one in inside.reasons}


def write_multisine(folder: Path, project: str, seed: int = 3) -> Path:
    """Project of the bar with a multisine record in closed form (held heat, exact between samples)."""
    file = write_bar(folder, project=project)
    drive = rt.signals.multisine(500, sample_time=2.0, seed=1, band=(0.0, 0.05), rms=12.0, periods=4) + 50.0
    decay = np.exp(-2.0 * CONDUCTANCE / CAPACITY)
    heat = drive / 100 * POWER / CONDUCTANCE
    rise = lfilter([0.0, 1 - decay], [1.0, -decay], heat)
    readings = ROOM + rise + np.random.default_rng(seed).normal(0, NOISE, drive.size)
    rows = [f"{2 * t},{q:.9g},{T:.5f}" for t, (q, T) in enumerate(zip(drive, readings, strict=True))]
    (folder / "multisine.csv").write_text("\n".join(["time,Q,T", *rows]))
    return file


IDENTIFY = '[identify.bar]\nrecords = ["multisine.csv"]\nmethod = "lpm"\n'


def test_a_response_is_calibrated_with_records_and_alone(tmp_path: Path) -> None:
    """Covariance of both kinds of data reaches the certificates: the truth is in all ranges (99.9 %), fixed seeds."""
    ranges = {}
    lines = {"records": PROJECT, "both": PROJECT + IDENTIFY,
             "response": PROJECT.replace('train = ["train.csv"]\n', "").replace(
                 'validation = ["validation.csv"]\n', "").replace('initial = "system"\n', "") + IDENTIFY}
    for name, text in lines.items():
        project = write_multisine(tmp_path, f"{text}[gate]\nconfidence = 0.999\n")
        report, summary = go(project, tmp_path / name)
        assert not [one for one in report.reasons if one.level == "fail"], report.reasons
        assert report.stages[0].status == ("skipped" if name == "records" else "done")
        ranges[name] = summary["certify"]["parameters"]  # type: ignore[index]
        assert all(summary["certify"]["robust"].values())  # type: ignore[index]
    for parameter, truth in (("lumps.bar.capacity", CAPACITY), ("links.bar-room.conductance", CONDUCTANCE)):
        width = {name: found[parameter][1] - found[parameter][0] for name, found in ranges.items()}
        assert 0.8 * width["records"] < width["both"] < min(1.2 * width["records"], 0.5 * width["response"]), width
        for found in ranges.values():
            assert found[parameter][0] < truth < found[parameter][1]
    assert (tmp_path / "both" / "responses" / "bar.json").is_file()
    page = (tmp_path / "both" / "report.html").read_text(encoding="utf-8")
    assert "Frequency response bar" in page
    lines["both"] += "[gate]\nconfidence = 0.999\n"
    assert statuses(go(write_multisine(tmp_path, lines["both"]), tmp_path / "both")[0])[:2] == ["cached", "cached"]
    again = write_multisine(tmp_path, lines["both"].replace('"lpm"', '"lrm"'))
    assert statuses(go(again, tmp_path / "both")[0])[:4] == ["done", "done", "skipped", "done"]


def write_pair(folder: Path, noise: float = 1e-4) -> Path:
    """Project of the bar with a coupling whose plant was measured: one multisine record with little noise."""
    file = write_bar(folder, project=PROJECT + COUPLE)
    drive = rt.signals.multisine(1000, sample_time=0.01, seed=1, band=(0.0, 49.9), rms=1.0, periods=5)
    steady = lfilter([0.0, B], [1.0, -A], np.tile(drive, 2))[drive.size:]  # without its transient
    readings = steady + noise * np.random.default_rng(0).standard_normal(drive.size)
    rows = [f"{t / 100:.2f},{u:.9g},{y:.9g}" for t, (u, y) in enumerate(zip(drive, readings, strict=True))]
    (folder / "one.csv").write_text("\n".join(["time,u,y", *rows]))
    return file


def test_a_coupling_takes_identified_responses(tmp_path: Path, run: Run) -> None:
    project, out = write_pair(tmp_path), tmp_path / "out"
    said = run("run", project, "--out", out, "--json")
    assert said.status == 0, said.err
    summary = json.loads((out / "summary.json").read_text())
    robust = [one for one in summary["claims"] if one["file"] == "coupling/certificates/robust.json"]
    assert len(robust) == 1 and robust[0]["valid"] and robust[0]["stage"] == "couple"
    assert summary["identify"]["one"]["use"] == "none" and not [
        one for one in summary["reasons"] if one["code"] == "frf_without_covariance"]
    assert run("verify", out).status == 0
    assert json.loads(run("run", project, "--out", out, "--json").out)["stages"]["couple"] == "cached"
    text = project.read_text()
    project.write_text(text.replace('frf_2 = ["identify.one"]', 'frf_2 = ["identify.two"]'))
    said = run("run", project, "--out", out)
    assert said.status == 2 and "there is no response 'identify.two'" in said.err and "identify.one" in said.err


@pytest.fixture(scope="module", autouse=True)
def without_linearity() -> Iterator[None]:
    """The steps that show how linear a loop is take half of a small design; tests/test_design_commands.py has them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robthermal.jobs.design._design._collapse", lambda *given: None)
        yield


@pytest.fixture(scope="module")
def designed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The starter project with a table [design], run once."""
    folder = tmp_path_factory.mktemp("designed")
    project = rt.jobs.new_project(folder / "bench")
    project.write_text(project.read_text() + '\n[design]\nregulate = { m1 = "T_stage" }\nsetpoint = { m1 = 12.0 }\n'
                       'export = ["c", "json"]\n')
    rt.jobs.run_project(rt.jobs.read_project(project), folder / "out")
    return folder


@pytest.mark.exhaustive
def test_a_design_is_of_the_certified_system(designed: Path) -> None:
    summary = json.loads((designed / "out" / "summary.json").read_text())
    numbers = json.loads((designed / "out" / "design" / "design.json").read_text())
    assert summary["stages"]["design"]["status"] == "done" and numbers["holds"]
    assert {"law.c", "controller.c", "observer.c", "law.json"} <= {path.name for path in (designed / "out" / "design"
                                                                                         ).iterdir()}
    assert {"gain", "phase", "modulus", "delay", "worst"} <= set(summary["design"]["margins"]["m1"])
    assert numbers["setpoint"]["value"]["m1"] == pytest.approx(285.15)
    calibrated = json.loads((designed / "out" / "calibrated.json").read_text())["parameters"]
    assert numbers["law"]["modules"]["m1"]["conductance"]["value"] == pytest.approx(
        calibrated["modules.m1.conductance.value"]["value"], rel=1e-9)
    named = [one for one in summary["claims"] if one["stage"] == "design"]
    assert named and all(one["valid"] and one["file"].startswith("design/certificates/") for one in named)
    certified = json.loads((designed / "out" / "design" / "certificates" / "box.json").read_text())
    assert certified["system"] == json.loads((designed / "out" / "certificates" / "box.json").read_text())["system"]


@pytest.mark.exhaustive
def test_a_changed_design_computes_the_design_alone(designed: Path) -> None:
    project = designed / "bench" / "project.toml"
    project.write_text(project.read_text().replace("setpoint = { m1 = 12.0 }", "setpoint = { m1 = 13.0 }"))
    report, _ = go(project, designed / "out")
    assert statuses(report) == ["skipped", "cached", "skipped", "cached", "done", "skipped"]
    project.write_text(project.read_text().replace("setpoint = { m1 = 13.0 }", "setpoint = { m1 = -60.0 }"))
    before = (designed / "out" / "summary.json").read_text()
    with pytest.raises(rt.InputError, match=r"project.toml \[design\] setpoint: m1 at -60 °C is outside"):
        rt.jobs.run_project(rt.jobs.read_project(project), designed / "out")
    assert (designed / "out" / "summary.json").read_text() == before, "refused before anything is computed or written"
    assert (designed / "out" / "design" / "design.json").is_file(), "the last design that could be computed stays"
