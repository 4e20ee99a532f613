"""calibrated.json from one command to the next, options of the gate, and a diagnosis inside the main job."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from commands import Run
from heated_bar import PROJECT, SYSTEM, write_bar

import robthermal as rt

pytestmark = pytest.mark.usefixtures("sketched")


def test_ranges_of_a_calibration_reach_certify_through_its_file(tmp_path: Path, run: Run) -> None:
    write_bar(tmp_path)
    system, out = tmp_path / "calibrated.toml", tmp_path / "out"
    assert run("calibrate", tmp_path / "bar.toml", tmp_path / "train.csv", "--out", system).status == 0
    file = tmp_path / "calibrated.json"
    content = json.loads(file.read_text())
    assert content["format"] == "robthermal-calibration/1"
    assert set(content["data"]) == {"bar.toml", "train.csv"}
    fit = rt.calibrate(rt.read_system(tmp_path / "bar.toml"),
                       rt.read_record(tmp_path / "train.csv", rt.read_system(tmp_path / "bar.toml")))
    stored = rt.jobs.request.read_calibrated(file, rt.read_system(system))
    for confidence in (0.9, 0.99):
        for name, pair in fit.ranges(confidence).items():
            assert stored.ranges(confidence)[name] == pytest.approx(pair, rel=1e-9)
    options = ("--temperature", 15, 45, "--ambient", "room=19:21", "--out", out)
    assert run("certify", system, *options, "--parameters", file, "--confidence", 0.99).status == 0
    done = json.loads((out / "summary.json").read_text())["certify"]
    assert {name: pytest.approx(pair, rel=1e-6) for name, pair in fit.ranges(0.99).items()} == {
        name: tuple(pair) for name, pair in done["parameters"].items()}
    assert done["confidence"] == 0.99 and all(done["robust"].values()) and done["robust"]
    wide = ("--parameters", file, "--parameters", "lumps.bar.capacity=20:150")
    assert run("certify", system, *options[:-1], tmp_path / "wide", *wide).status == 0
    done = json.loads((tmp_path / "wide" / "summary.json").read_text())["certify"]["parameters"]
    assert done["lumps.bar.capacity"] == [20.0, 150.0] and set(done) == set(fit.ranges())
    assert run("certify", tmp_path / "bar.toml", *options[:-1], tmp_path / "no", "--parameters", file).status == 2
    assert not (tmp_path / "no").exists()


@pytest.mark.parametrize(("change", "message"), [
    ({"format": "robthermal-certificate/1"}, "format"),
    ({"covariance": [[1.0]]}, "another size"),
    ({"covariance": [[1.0, 2.0], [0.0, 1.0]]}, "not symmetric"),
    ({"covariance": None}, "no covariance"),
    ({"parameters": {}}, "another size"),
    ({"logarithmic": {"other": True}}, "do not name the parameters"),
])
def test_files_that_are_no_calibration_are_refused(change: dict[str, object], message: str, tmp_path: Path) -> None:
    write_bar(tmp_path)
    system = rt.read_system(tmp_path / "bar.toml")
    fit = rt.calibrate(system, rt.read_record(tmp_path / "train.csv", system))
    file = tmp_path / "calibrated.json"
    rt.jobs.request.write_calibrated(fit, (), file)
    file.write_text(json.dumps({**json.loads(file.read_text()), **change}))
    with pytest.raises(rt.InputError, match=message):
        rt.jobs.request.boxes_from_text(fit.system, parameters=[str(file)])
    other = rt.systems.two_module()
    rt.jobs.request.write_calibrated(fit, (), file)
    with pytest.raises(rt.InputError, match="is no parameter of"):
        rt.jobs.request.read_calibrated(file, other)


@pytest.mark.parametrize(("options", "words"), [
    (("--confidence", 0.4), "--confidence: 0.4"),
    (("--tolerance", "T9=0.1"), "--tolerance: T9=0.1"),
    (("--tolerance", "T=-1"), "--tolerance: T=-1"),
])
def test_options_of_the_gate_are_checked(options: tuple[object, ...], words: str, tmp_path: Path,
                                         run: Run) -> None:
    said = run("run", write_bar(tmp_path), "--out", tmp_path / "out", *options)
    assert said.status == 2
    assert words in said.err and not (tmp_path / "out").exists()


def test_what_the_diagnosis_finds_decides_the_verdict_of_the_main_job(tmp_path: Path, run: Run) -> None:
    """A room 3 K warmer than stated has other explanations, all said; --tolerance makes it a remark."""
    project = write_bar(tmp_path, project=PROJECT + "[diagnose]\n")
    (tmp_path / "bar.toml").write_text(SYSTEM.replace("temperature = 20.0", "temperature = 17.0"))
    assert run("run", project, "--out", tmp_path / "strict", "--tolerance", "T=0.01").status == 1
    summary = json.loads((tmp_path / "strict" / "summary.json").read_text())
    failed = {one["code"] for one in summary["reasons"] if one["level"] == "fail"}
    assert summary["verdict"] == "FAIL" and "diagnosis_ambiguous" in failed
    assert "not_diagnosed" not in str(summary["reasons"])
    said = next(one["text"] for one in summary["reasons"] if one["code"] == "diagnosis_ambiguous")
    assert "ask for a room 3 K warmer" in said and "A constant heat into bar, or an offset of the sensors" in said
    assert (tmp_path / "strict" / "calibrated.json").is_file()
    assert run("run", project, "--out", tmp_path / "loose", "--tolerance", "default=5", "--confidence", 0.9).status == 0
    summary = json.loads((tmp_path / "loose" / "summary.json").read_text())
    assert summary["verdict"] == "PASS WITH REMARKS" and summary["certify"]["confidence"] == 0.9
    assert "diagnosis_ambiguous" in {one["code"] for one in summary["reasons"] if one["level"] == "remark"}


def test_a_calibration_that_did_not_converge_fails(tmp_path: Path, run: Run) -> None:
    """Its ends are no estimates: no ranges, nominal claims, FAIL; with the iterations it asks for."""
    project = write_bar(tmp_path, project=PROJECT.replace("[calibrate]", "[calibrate]\nmax_iterations = 1"))
    assert run("run", project, "--out", tmp_path / "out").status == 1
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    (reason,) = [one for one in summary["reasons"] if one["code"] == "not_converged"]
    assert summary["verdict"] == "FAIL" and summary["calibrate"]["outcome"] == "not_converged"
    assert reason["level"] == "fail" and reason["stage"] == "calibrate" and "max_iterations" in reason["remedy"]
    assert "after 1 iterations" in reason["text"]
    assert not summary["certify"]["parameters"] and all(row["range"] is None for row
                                                        in summary["calibrate"]["parameters"].values())
    assert "nominal_only" in {one["code"] for one in summary["reasons"]}
    assert "they are no estimates" in (tmp_path / "out" / "report.html").read_text()
    project.write_text(project.read_text().replace("max_iterations = 1", "max_iterations = 40"))
    assert run("run", project, "--out", tmp_path / "out").status == 0
    assert run("calibrate", tmp_path / "bar.toml", tmp_path / "train.csv", "--max-iterations", 1, "--out",
               tmp_path / "c.toml").status == 1
