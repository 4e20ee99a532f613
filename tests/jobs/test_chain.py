"""The chain of a project: which stages run again, what an interrupt and a failure leave, and what is refused."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest
from commands import Run
from heated_bar import NOISE, PROJECT, write_bar

import robthermal as rt
from robthermal.jobs.chain import _cache
from robthermal.jobs.chain import _run as chain
from robthermal.jobs.chain._cache import staging

pytestmark = pytest.mark.usefixtures("sketched")
STAGES = ("identify", "calibrate", "diagnose", "certify", "design", "couple")
COUPLE = """
[couple]
name = "pair"
sample_time = 0.01
[couple.subsystems.1]
plant = { num = [0.01], den = [1.0, -0.99] }
controller = 20.0
[couple.subsystems.2]
plant = { num = [0.01], den = [1.0, -0.99] }
controller = 20.0
[couple.design]
X_hat = -0.9
"""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project that has run once, to be copied."""
    folder = tmp_path_factory.mktemp("chain")
    rt.jobs.run_project(rt.jobs.read_project(write_bar(folder, project=PROJECT + COUPLE)), folder / "out")
    return folder


@pytest.fixture
def folder(finished: Path, tmp_path: Path) -> Path:
    shutil.copytree(finished, tmp_path / "work")
    return tmp_path / "work"


def status(report: rt.report.Report) -> dict[str, str]:
    return {stage.name: stage.status for stage in report.stages}


def again(folder: Path, **options: object) -> dict[str, str]:
    project = rt.jobs.read_project(folder / "project.toml")
    return status(rt.jobs.run_project(project, folder / "out", **options))  # type: ignore[arg-type]


def those(*done: str, **others: str) -> dict[str, str]:
    """Statuses where these stages were computed and the others of this project are as before."""
    kept = {"identify": "skipped", "calibrate": "cached", "diagnose": "skipped", "certify": "cached",
            "design": "skipped", "couple": "cached"}
    return kept | dict.fromkeys(done, "done") | others


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_the_first_run_computes_what_the_project_asks_for(finished: Path) -> None:
    summary = json.loads((finished / "out" / "summary.json").read_text())
    assert {name: one["status"] for name, one in summary["stages"].items()} == those("calibrate", "certify", "couple")
    assert list(summary["stages"]) == list(STAGES)
    assert summary["design"] is None and summary["calibrate"] is not None and summary["couple"] is not None
    for name in ("calibrate", "certify", "couple"):
        assert summary["stages"][name]["seconds"] > 0.0 and len(summary["stages"][name]["hash"]) == 64
    names = {path.relative_to(finished / "out").as_posix() for path in (finished / "out").rglob("*") if path.is_file()}
    assert {"report.html", "report.json", "summary.json", "junit.xml", "calibrated.toml", "calibrated.json",
            "parameters.csv", "coupling/coupling.json", "coupling/certificates/stability.json",
            "certificates/box_ranges.json", ".cache/certify.json"} <= names
    assert not [name for name in names if "part-" in name], "nothing of a stage's own folder stays"


def test_nothing_changed_and_files_that_were_only_touched(folder: Path) -> None:
    before = json.loads((folder / "out" / "summary.json").read_text())
    for name in ("train.csv", "bar.toml", "project.toml"):
        os.utime(folder / name, (1, 1))
    assert again(folder) == those()
    after = json.loads((folder / "out" / "summary.json").read_text())
    for key in ("verdict", "reasons", "claims", "residuals", "calibrate", "currents", "certificates", "assumptions"):
        assert after[key] == before[key], key


@pytest.mark.parametrize(("file", "old", "new", "done"), [
    ("train.csv", "20.0", "20.1", ("calibrate", "certify")),  # one digit of one reading
    ("validation.csv", "20.0", "20.1", ("calibrate", "certify")),
    ("project.toml", "[certify]", "[gate]\ntolerance = 0.5\n[certify]", ()),  # decides the verdict only
    ("project.toml", "[certify]", "[gate]\nconfidence = 0.9\n[certify]", ("certify", "couple")),
    ("project.toml", "X_hat = -0.9", "X_hat = -0.8", ("couple",)),
    ("project.toml", "[15.0, 45.0]", "[14.0, 45.0]", ("certify",)),
    ("project.toml", 'initial = "system"', 'initial = "free"', ("calibrate", "certify")),
    ("bar.toml", "noise = 0.02", "noise = 0.021", ("calibrate", "certify", "couple")),
])
def test_a_change_computes_what_depends_on_it(file: str, old: str, new: str, done: tuple[str, ...], folder: Path
                                              ) -> None:
    edit(folder / file, old, new)
    assert again(folder) == those(*done)
    assert again(folder) == those()


def test_another_version_computes_everything(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chain, "versions", lambda: {"robthermal": "another"})
    assert again(folder) == those("calibrate", "certify", "couple")


@pytest.mark.parametrize(("file", "done"), [
    ("calibrated.json", ("calibrate",)), ("parameters.csv", ("calibrate",)), ("certificates/box.json", ("certify",)),
    ("coupling/coupling.json", ("couple",)), (".cache/certify.json", ("certify",))])
@pytest.mark.parametrize("removed", [True, False])
def test_a_changed_result_is_computed_again(file: str, done: tuple[str, ...], removed: bool, folder: Path) -> None:
    whole = (folder / "out" / file).read_bytes()
    (folder / "out" / file).write_bytes(whole + b" x")
    if removed:
        (folder / "out" / file).unlink()
    assert again(folder) == those(*done)
    if not file.startswith(".cache"):
        assert (folder / "out" / file).read_bytes()[:200] == whole[:200]


def test_a_kept_certificate_is_verified_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[str] = []
    verify = rt.jobs.rebuild.verify

    def counted(certificate: rt.Certificate) -> object:
        seen.append(certificate.kind)
        return verify(certificate)

    monkeypatch.setattr("robthermal.jobs.rebuild.verify", counted)
    assert again(folder) == those()
    valid = [one for one in json.loads((folder / "out" / "summary.json").read_text())["certificates"] if one["valid"]]
    assert len(seen) == len(valid) > 5


def test_a_cache_whose_words_were_changed_is_none(folder: Path) -> None:
    edit(folder / "out" / ".cache" / "certify.json", '"holds": true', '"holds": false')
    assert again(folder) == those("certify")


@pytest.mark.parametrize(("options", "done"), [
    ({"force": True}, ("calibrate", "certify", "couple")), ({"start": "certify"}, ("certify", "couple")),
    ({"start": "design"}, ("couple",)), ({"only": ("certify",)}, ()),
    ({"only": ("certify",), "force": True}, ("certify",))])
def test_what_is_computed_anew(options: dict[str, object], done: tuple[str, ...], folder: Path) -> None:
    assert again(folder, **options) == those(*done)


def test_only_one_stage_needs_those_before_it(folder: Path, run: Run) -> None:
    edit(folder / "train.csv", "20.0", "20.1")
    said = run("run", folder / "project.toml", "--out", folder / "out", "--only", "certify")
    assert said.status == 2 and "certify needs calibrate" in said.err and "--only calibrate,certify" in said.err
    assert again(folder, only=("couple",))["calibrate"] == "skipped", "its earlier result is of other inputs"
    assert again(folder, only=("calibrate", "certify")) == those("calibrate", "certify")
    said = run("run", folder / "project.toml", "--out", folder / "new", "--only", "certify")
    assert said.status == 2 and not (folder / "new").exists()
    said = run("run", folder / "project.toml", "--out", folder / "out", "--only", "cook")
    assert said.status == 2 and "there is no stage 'cook'" in said.err and "identify, calibrate" in said.err


def test_a_stage_that_is_not_asked_for_any_more_leaves_nothing(folder: Path) -> None:
    edit(folder / "project.toml", COUPLE, "")
    assert again(folder) == those(couple="skipped")
    assert not (folder / "out" / "coupling").exists() and not (folder / "out" / ".cache" / "couple.json").exists()


def interrupt(*arguments: object, **options: object) -> object:
    raise KeyboardInterrupt


def test_an_interrupt_while_a_folder_is_removed_leaves_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    removed, interrupts = shutil.rmtree, [True]

    def interrupted(folder: Path, **options: bool) -> None:
        if interrupts:
            raise KeyboardInterrupt(interrupts.pop())
        removed(folder, **options)

    monkeypatch.setattr("robthermal.jobs.chain._cache.shutil.rmtree", interrupted)
    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt), staging(out) as folder:
        (folder / "half.json").write_text("{")
    assert not interrupts and not out.exists()


def test_an_interrupt_keeps_the_finished_stages(tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    project, out = write_bar(tmp_path), tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr("robthermal.jobs.chain._certify.certify_system", interrupt)
        said = run("run", project, "--out", out)
    assert said.status == 130 and "finished stages are kept" in said.err
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["verdict"], summary["holds"]) == (None, False)
    assert [one["status"] for one in summary["stages"].values()] == ["skipped", "done", "skipped", "failed", "skipped",
                                                                     "skipped"]
    assert not (out / "certificates").exists() and (out / "calibrated.json").is_file()
    said = run("run", project, "--out", out, "--json")
    assert said.status == 0 and json.loads(said.out)["stages"]["calibrate"] == "cached"


def test_an_interrupt_of_the_first_stage_leaves_nothing(tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
                                                        ) -> None:
    project = write_bar(tmp_path)
    monkeypatch.setattr("robthermal.jobs.chain._calibrate.calibrated", interrupt)
    assert run("run", project, "--out", tmp_path / "out").status == 130
    assert not (tmp_path / "out").exists()


def test_no_claim_is_called_failed_where_certify_was_not_reached() -> None:
    report = rt.report.Report(title="bar", subtitle="", label="", claims=(), sections=(), provenance={}, assumptions=(),
                              generated="now", stages=(rt.report.Stage("calibrate", "failed", text="bad file"),))
    assert report.verdict == "NO VERDICT" and report.reasons == [] and not report.holds


def test_a_stage_that_fails_leaves_the_earlier_ones(folder: Path, run: Run) -> None:
    edit(folder / "project.toml", "controller = 20.0", "controller = -5000.0")  # this loop is not stable
    said = run("run", folder / "project.toml", "--out", folder / "out")
    assert said.status == 2 and "[couple]" in said.err or "project.toml" in said.err
    assert said.err.endswith(f"The stages before it are done: {folder / 'out' / 'report.html'}\n")
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert summary["verdict"] is None and summary["stages"]["couple"]["status"] == "failed"
    assert not [one for one in summary["reasons"] if one["code"] == "not_certified"], "the claims that are there hold"
    assert summary["stages"]["certify"]["status"] == "cached" and summary["certificates"]
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    assert "NO VERDICT" in page and 'class="verdict no"' in page and "Stage couple could not be computed" in page
    failed = [(suite.get("name"), case.get("name")) for suite in
              ElementTree.parse(folder / "out" / "junit.xml").iter("testsuite") for case in suite.iter("testcase")
              if case.find("failure") is not None]
    assert failed == [("couple", "stage is computed")]
    edit(folder / "project.toml", "controller = -5000.0", "controller = 20.0")
    assert again(folder) == those(), "the earlier result of the stage is still there"


def test_bad_input_of_the_first_stage_writes_nothing(folder: Path, run: Run) -> None:
    before = (folder / "out" / "summary.json").read_bytes()
    edit(folder / "train.csv", "time,Q,T", "time,Q,S")
    said = run("run", folder / "project.toml", "--out", folder / "out")
    assert said.status == 2 and "train.csv" in said.err
    assert (folder / "out" / "summary.json").read_bytes() == before
    assert run("run", folder / "project.toml", "--out", folder / "new").status == 2
    assert not (folder / "new").exists()


def test_a_folder_with_other_things_is_refused(folder: Path, run: Run) -> None:
    (folder / "mine").mkdir()
    (folder / "mine" / "thesis.txt").write_text("mine")
    said = run("run", folder / "project.toml", "--out", folder / "mine")
    assert said.status == 2 and "other things in it" in said.err
    assert (folder / "mine" / "thesis.txt").read_text() == "mine"


def test_results_of_another_command_are_replaced(folder: Path) -> None:
    shutil.rmtree(folder / "out")
    system = rt.read_system(folder / "bar.toml")
    rt.jobs.write_certify(rt.jobs.certify_system(system, rt.jobs.Boxes()), (), folder / "out")
    (folder / "out" / "certificates" / "older.json").write_text("{}")
    assert again(folder) == those("calibrate", "certify", "couple")
    assert not (folder / "out" / "certificates" / "older.json").exists()


def test_junit_has_a_suite_per_stage_and_a_case_per_claim_and_gate(finished: Path) -> None:
    suites = {suite.get("name"): {case.get("name"): case for case in suite.iter("testcase")}
              for suite in ElementTree.parse(finished / "out" / "junit.xml").iter("testsuite")}
    summary = json.loads((finished / "out" / "summary.json").read_text())
    assert tuple(suites) == STAGES
    for stage in STAGES:
        claims = [claim["name"] for claim in summary["claims"] if claim["stage"] == stage]
        assert set(claims) <= set(suites[stage])
    assert {"validation_misfit", "training_misfit", "no_validation"} <= set(suites["calibrate"])
    assert {"current_beyond_runaway", "outside_data"} <= set(suites["certify"])
    assert not suites["design"] and list(suites["diagnose"]) == ["not_diagnosed"]
    said = suites["diagnose"]["not_diagnosed"].find("system-out")
    assert said is not None and said.text and said.text.startswith("remark: ")
    assert not [case for cases in suites.values() for case in cases.values() if case.find("failure") is not None]


def test_notes_of_a_project_stand_below_the_verdict(folder: Path) -> None:
    notes = '[project]\nnotes = """Nobody knows <the paste>.\n\nThe fan is new."""\n'
    edit(folder / "project.toml", "[project]\n", notes)
    assert again(folder) == those()  # nothing is computed again for a text
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    assert page.index("Nobody knows &lt;the paste&gt;.") < page.index("Model against data") < page.index("Input files")


def test_the_report_has_every_stage_in_its_order(finished: Path) -> None:
    page = (finished / "out" / "report.html").read_text(encoding="utf-8")
    places = [page.index(f'<h2 class="chapter" id="stage-{name}">')
              for name in ("inputs", "identify", "calibrate", "diagnose", "certify", "design", "couple")]
    assert places == sorted(places) and places[-1] < page.index('id="appendix"') < page.index('id="provenance"')
    assert page.count("Not run") >= 3 and "The project file has no table [design]." in page
    assert page.index('class="badge"') < places[0]


def test_the_folder_can_be_verified_and_its_report_built_again(folder: Path, run: Run) -> None:
    before = json.loads((folder / "out" / "summary.json").read_text())
    assert run("verify", folder / "out").status == 0
    assert run("report", folder / "out").status == 0
    after = json.loads((folder / "out" / "summary.json").read_text())
    for key in ("verdict", "reasons", "certify", "currents", "stages", "assumptions"):
        assert after[key] == before[key], key
    assert [(one["file"], one["valid"]) for one in after["claims"]] == [(one["file"], one["valid"])
                                                                        for one in before["claims"]]
    (folder / "out" / "coupling" / "certificates" / "stability.json").unlink()
    assert run("report", folder / "out").status == 1
    (reason,) = [one for one in json.loads((folder / "out" / "summary.json").read_text())["reasons"]
                 if one["level"] == "fail"]
    assert reason["stage"] == "couple"


def test_the_verdict_follows_the_gate_without_computing_anything(tmp_path: Path) -> None:
    project = write_bar(tmp_path, lag=12.0)
    verdicts = []
    for gate in ("tolerance = 5.0", f"tolerance = {NOISE / 10}", 'tolerance = 5.0\nremarks = "fail"'):
        project.write_text(f"{PROJECT}[gate]\n{gate}\n")
        report = rt.jobs.run_project(rt.jobs.read_project(project), tmp_path / "out")
        verdicts.append(report.verdict)
    assert verdicts == ["PASS WITH REMARKS", "FAIL", "FAIL"]
    assert status(report)["certify"] == "cached"


def test_the_chain_says_what_the_job_says(tmp_path: Path) -> None:
    project = rt.jobs.read_project(write_bar(tmp_path))
    chain_report = rt.jobs.run_project(project, tmp_path / "out")
    job = rt.jobs.write_job(rt.jobs.run_job(project), tmp_path / "job")
    assert chain_report.verdict == job.verdict
    assert [(one.code, one.level) for one in chain_report.reasons] == [(one.code, one.level) for one in job.reasons]
    for path in sorted((tmp_path / "job" / "certificates").iterdir()):
        ours = rt.Certificate.load(tmp_path / "out" / "certificates" / path.name)
        assert ours.claim == rt.Certificate.load(path).claim
    summaries = [json.loads((tmp_path / name / "summary.json").read_text()) for name in ("out", "job")]
    for key in ("residuals", "calibrate", "currents"):
        assert summaries[0][key] == summaries[1][key], key


def test_ctrl_c_as_soon_as_the_folder_of_a_stage_is_there_leaves_nothing(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make = _cache._make

    def interrupted(folder: Path, out: Path) -> None:
        make(folder, out)
        raise KeyboardInterrupt

    monkeypatch.setattr(_cache, "_make", interrupted)
    with pytest.raises(KeyboardInterrupt), _cache.staging(tmp_path / "out"):
        pass
    assert not (tmp_path / "out").exists()
