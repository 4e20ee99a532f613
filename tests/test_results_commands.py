"""`report`, `verify`, `new`, `explain`, and what a script gets: built again, checked again, said in JSON."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from commands import Run

import robthermal as rt
from robthermal.jobs.claims._assumptions import KIND_ASSUMPTIONS
from robthermal.verification._kinds import KINDS

pytestmark = pytest.mark.usefixtures("sketched")
ROOT = Path(__file__).resolve().parents[1]
MADE_AGAIN = ("report.html", "junit.xml", "summary.json")
DATE = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d UTC")


@pytest.fixture(scope="module")
def starter(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rt.jobs.new_project(tmp_path_factory.mktemp("new") / "bench")


@pytest.fixture(scope="module")
def done(starter: Path) -> Path:
    """Results of the starter project, as `run` writes them."""
    out = starter.parent / "results"
    rt.jobs.write_job(rt.jobs.run_job(rt.jobs.read_project(starter)), out)
    return out


@pytest.fixture
def results(done: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(done, tmp_path / "results"))


def edit(file: Path, **evidence: object) -> None:
    """Change the evidence of a certificate file."""
    data = json.loads(file.read_text(encoding="utf-8"))
    data["evidence"] |= evidence
    file.write_text(json.dumps(data), encoding="utf-8")


# report


def undated(folder: Path) -> list[str]:
    return [DATE.sub("DATE", (folder / name).read_text(encoding="utf-8")) for name in MADE_AGAIN]


def test_a_report_built_again_is_the_same_but_for_its_date(run: Run, results: Path, done: Path) -> None:
    for name in MADE_AGAIN:
        (results / name).unlink()
    again = run("report", results)
    assert again.status == 0 and "certified, verified" in again.out and str(results / "report.html") in again.out
    assert undated(results) == undated(done)
    assert {path.name for path in results.iterdir()} == {path.name for path in done.iterdir()}
    assert not DATE.findall("".join(undated(results))) and undated(results)[0].count("DATE") == 1


def test_a_tampered_certificate_shows_as_not_valid(run: Run, results: Path) -> None:
    edit(results / "certificates" / "contraction.json", rate=1.0)
    again = run("report", results, "--json")
    assert again.status == 1
    answer = json.loads(again.out)
    assert not answer["holds"]
    assert [c["verified"] for c in answer["claims"]] == [False, True, True, True, True, True]
    page = (results / "report.html").read_text(encoding="utf-8")
    assert 'class="verdict no"' in page and "NOT VERIFIED" in page
    summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    assert [c["file"] for c in summary["certificates"] if not c["valid"]] == ["certificates/contraction.json"]
    assert not summary["holds"] and not summary["claims"][0]["valid"] and summary["claims"][0]["margin"] == "none"
    assert len(list(ElementTree.parse(results / "junit.xml").iter("failure"))) == 1


def test_another_valid_certificate_in_its_place_is_not_taken(run: Run, results: Path) -> None:
    """A true but weaker claim, under the name of the stronger one."""
    folder = results / "certificates"
    shutil.copy(folder / "usable_heating_contraction.json", folder / "contraction.json")
    assert run("verify", folder / "contraction.json").status == 0
    assert run("report", results).status == 1
    assert "valid by itself, but not the file of this report" in (results / "summary.json").read_text(encoding="utf-8")


def test_a_good_certificate_put_back_is_good_again(run: Run, results: Path, done: Path) -> None:
    shutil.rmtree(results / "certificates")
    assert run("report", results).status == 1
    assert "No such file" in (results / "summary.json").read_text(encoding="utf-8")
    shutil.copytree(done / "certificates", results / "certificates")
    assert run("report", results).status == 0
    assert undated(results) == undated(done)


@pytest.mark.parametrize("evidence", [
    [], [{"file": "../outside.json"}], [{"file": "certificates/../../outside.json"}], [{"file": "summary.json"}]])
def test_a_claim_without_a_certificate_in_the_folder_is_not_verified(run: Run, results: Path,
                                                                     evidence: list[dict[str, str]]) -> None:
    shutil.copy(results / "certificates" / "contraction.json", results.parent / "outside.json")
    data = json.loads((results / "report.json").read_text(encoding="utf-8"))
    data["evidence"] = [data["evidence"][0] | one for one in evidence]
    data["claims"] = [data["claims"][0] | one for one in evidence or [{}]]
    (results / "report.json").write_text(json.dumps(data), encoding="utf-8")
    assert run("report", results).status == 1
    assert not json.loads((results / "summary.json").read_text(encoding="utf-8"))["claims"][0]["verified"]


def test_an_honest_no_stays_no(run: Run, tmp_path: Path) -> None:
    """Nothing that a certificate says later turns a claim that was never proven into a proof."""
    system = rt.systems.two_module()
    boxes = rt.jobs.Boxes(current={"m1": (-20.0, 20.0), "m2": (0.0, 1.0)})
    rt.jobs.write_certify(rt.jobs.certify_system(system, boxes), (), tmp_path / "out")
    before = undated(tmp_path / "out")
    assert run("report", tmp_path / "out").status == 1
    assert undated(tmp_path / "out") == before


@pytest.mark.parametrize("content", [None, b"{}", b"\x00"])
def test_report_of_something_else_is_refused(run: Run, tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / "report.json").write_bytes(content)
    again = run("report", tmp_path)
    assert again.status == 2 and again.out == "" and str(tmp_path) in again.err
    assert len(again.err.splitlines()) == 1
    assert {path.name for path in tmp_path.iterdir()} <= {"report.json"}


# verify


def test_verify_finds_every_certificate_below_a_folder(run: Run, results: Path) -> None:
    shutil.copytree(results / "certificates", results.parent / "deep" / "down" / "certificates")
    count = len(list((results / "certificates").iterdir()))
    said = run("verify", results.parent)
    assert said.status == 0 and said.out.count("valid  ") == 2 * count


def test_verify_writes_junit_with_one_case_per_file(run: Run, results: Path, tmp_path: Path) -> None:
    folder = results / "certificates"
    edit(folder / "contraction.json", rate=1.0)
    (folder / "broken.json").write_text("{}")
    said = run("verify", results, "--junit", tmp_path / "j.xml")
    assert said.status == 2
    cases = {case.get("name"): case.find("failure") for case in ElementTree.parse(tmp_path / "j.xml").iter("testcase")}
    assert set(cases) == {str(path) for path in folder.iterdir()}
    failed = {Path(str(name)).name: failure for name, failure in cases.items() if failure is not None}
    assert set(failed) == {"contraction.json", "broken.json"}
    assert failed["broken.json"].get("type") == "not certified"
    assert run("verify", results, "--junit", tmp_path / "none" / "j.xml").status == 2


def test_verify_json_has_margins_and_claims(run: Run, results: Path) -> None:
    rows = json.loads(run("verify", results / "certificates" / "contraction.json", "--json").out)
    assert rows[0]["valid"] and rows[0]["kind"] == "contraction" and rows[0]["margins"]["rate"] > 0
    assert rows[0]["claim"].startswith("The thermal network")


def test_verify_prints_the_claim_that_it_has_proven_and_no_other(run: Run, results: Path, tmp_path: Path) -> None:
    file = results / "certificates" / "contraction.json"
    claim = json.loads(file.read_text(encoding="utf-8"))["claim"]
    assert "machine " in claim and "nominal parameters" in claim
    assert claim in " ".join(run("verify", file).out.split())
    edited = tmp_path / "edited.json"
    edited.write_text(file.read_text(encoding="utf-8").replace('"claim": "The thermal', '"claim": "Any thermal'))
    answer = run("verify", edited)
    assert answer.status == 1 and "Any thermal network" not in answer.out and "not the one the data give" in answer.out


# new


def test_the_starter_project_finds_what_its_records_were_made_with(done: Path) -> None:
    found = rt.read_system(done / "calibrated.toml")
    assert found.parameter("links.sink-room.conductance") == pytest.approx(0.92, rel=2e-3)
    assert found.parameter("links.stage-room.conductance") == pytest.approx(0.05, rel=1e-2)
    assert found.modules["m1"].conductance.value == pytest.approx(0.31, rel=2e-3)
    assert json.loads((done / "summary.json").read_text(encoding="utf-8"))["holds"] is True
    assert "SIMULATED DATA" in (done / "report.html").read_text(encoding="utf-8")


def test_new_writes_a_project_that_reads_at_once(run: Run, tmp_path: Path) -> None:
    made = run("new", tmp_path / "bench", "--json")
    answer = json.loads(made.out)
    assert made.status == 0 and {Path(file).name for file in answer["files"]} == {
        "project.toml", "setup.toml", "train.csv", "validation.csv"}
    assert run("check", tmp_path / "bench" / "setup.toml", tmp_path / "bench" / "train.csv").status == 0
    assert rt.jobs.read_project(answer["project"]).system.fit
    for name in ("project.toml", "setup.toml"):
        lines = (tmp_path / "bench" / name).read_text(encoding="utf-8").splitlines()
        assert sum("#" in line for line in lines) > 0.4 * len([line for line in lines if line.strip()]), "comments"


def test_new_overwrites_nothing(run: Run, starter: Path, results: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    for taken in (starter.parent, results, tmp_path / "file"):
        before = {path: path.read_bytes() for path in taken.rglob("*") if path.is_file()}
        made = run("new", taken)
        assert made.status == 2 and "is there already" in made.err and made.out == ""
        assert {path: path.read_bytes() for path in taken.rglob("*") if path.is_file()} == before
    assert (tmp_path / "file").read_text() == "mine"
    (tmp_path / "empty").mkdir()
    assert run("new", tmp_path / "empty").status == 0


# explain


def test_every_effect_kind_and_code_is_explained(run: Run) -> None:
    known = rt.jobs.explainable()
    assert set(known["effect"]) == {*rt.thermal.effects(), "parameter_change", "ambient_drift"}
    assert len(known["effect"]) == 36
    assert set(known["certificate"]) == set(KINDS) == set(KIND_ASSUMPTIONS)
    assert set(known["reason"]) == {code.code for code in rt.jobs.claims.GateCode}
    assert {"named", "ambiguous", "consistent", "unexplained", "not_certified", "converged"} <= set(known["outcome"])
    listed = run("explain").out
    for names in known.values():
        for name in names:
            assert name in listed
            for one in rt.jobs.explain(name):
                assert one.name == name and all(one.meaning) and str(one)


def test_every_page_that_is_named_exists_and_names_the_effect_or_kind() -> None:
    known = rt.jobs.explainable()
    explained = [one for names in known.values() for name in names for one in rt.jobs.explain(name)]
    assert len(explained) >= sum(map(len, known.values())) > 50
    for one in explained:
        pages = [(ROOT / page).read_text(encoding="utf-8") for page in one.page.split()]
        assert pages and (one.what == "error" or one.name in pages[0]), one.name


def test_explain_says_what_an_engineer_asks(run: Run) -> None:
    said = run("explain", "sensor_lag")
    assert said.status == 0
    for words in ("first-order lag", "time_constant [s]", "hidden_mass", "input_delay", "frequencies above",
                  "docs/explanations/effects.md"):
        assert words in said.out
    said = run("explain", "contraction")
    for words in ("over a box of temperatures and currents", "Assumed, not proven", "stay in the box"):
        assert words in said.out
    said = run("explain", "ambiguous")
    assert "the answer is no" in said.out and "next experiment" in said.out


def test_an_unknown_name_gets_the_nearest_ones(run: Run) -> None:
    said = run("explain", "sensorlag")
    assert said.status == 2 and said.out == "" and "sensor_lag" in said.err
    assert run("explain", "xyzzy").status == 2
    data = json.loads(run("explain", "radiation", "--json").out)
    assert data[0]["details"]["Confused with"] == ["natural_convection", "missing_ambient_link"]


# JSON for scripts


def test_errors_are_json_too_where_json_was_asked_for(run: Run, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("[system]\nname = 3\n")
    said = run("check", tmp_path / "bad.toml", "--json")
    error = json.loads(said.out)["error"]
    assert said.status == error["status"] == 2
    assert said.err == f"robthermal: {error['message']}\n" and "bad.toml" in error["where"] and error["what"]
    assert json.loads(run("demo", "--nonsense", "--json").out)["error"]["status"] == 2
    assert run("check", tmp_path / "bad.toml").out == ""


def test_every_command_has_json(run: Run) -> None:
    commands = re.findall(r"^  ([a-z]+) ", run("--help").out.partition("Commands:")[2], re.M)
    assert len(commands) >= 16
    assert [name for name in commands if "--json" not in run(name, "--help").out] == []


def test_colors_stay_out_of_a_pipe_and_units_in_the_table(run: Run, results: Path, monkeypatch: pytest.MonkeyPatch,
                                                           ) -> None:
    (results / "certificates" / "contraction.json").write_text("{}")
    monkeypatch.setenv("TERM", "xterm-256color")
    said = run("report", results)
    assert said.status == 1 and "\x1b" not in said.out and "NOT CERTIFIED" in said.out


# Progress


def test_a_diagnosis_says_its_stages() -> None:
    bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
                    sensors={"T": {"lump": "bar", "noise": 0.05}})
    drive = rt.Record(sample_time=10.0, inputs=np.repeat([4.0, 0.0, 6.0, 2.0], 50), outputs=np.zeros((200, 0)),
                      input_names=["heater"], output_names=[])
    run = rt.thermal.simulate(bar.with_parameters({"sensors.T.time_constant": 30.0}), drive)
    noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    said: list[str] = []
    rt.jobs.diagnose_records(bar, (), [noisy], progress=said.append)
    order = ["refitting the nominal system", "trying every effect of the catalog at every place",
             "refitting the best candidates", "testing whether anything is left", "running both models freely"]
    assert [said.index(stage) for stage in order] == sorted(said.index(stage) for stage in order)
    assert "predicting the validation data" not in said
