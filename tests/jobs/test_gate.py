"""The verdict of a job: what the data, the parameters and the requested currents do to it."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from heated_bar import NOISE, PROJECT, ROOM, SYSTEM, closed_form, write_project
from scipy.signal import lfilter

import robthermal as rt
from robthermal import cli
from robthermal._digits import inward, outward
from robthermal.jobs.certify import current_reasons
from robthermal.jobs.run._misfit import misfit

pytestmark = pytest.mark.usefixtures("sketched")


def bar(folder: Path, *, off: float = 0.0, project: str = PROJECT, system: str = SYSTEM) -> rt.jobs.run.JobResult:
    """The main job on a bar in a room, in closed form; the validation record is `off` kelvin too warm [K]."""
    noise, time, records = np.random.default_rng(1), np.arange(600.0), {}
    for name, share, shift in (("train", 1.0, 0.0), ("validation", 0.3, off)):
        heater = np.where(time < 300, 100 * share, 100 * share + 1e-9)
        records[name] = heater, ROOM + closed_form(time, share) + shift + noise.normal(0, NOISE, time.size)
    return rt.jobs.run_job(rt.jobs.read_project(write_project(folder, records, system=system, project=project)))


def codes(result: rt.jobs.run.JobResult, level: str) -> set[str]:
    return {one.code for one in result.reasons if one.level == level}


# Validation: the row "green CERTIFIED & VERIFIED, exit 0; model misses the validation data by 0.549 K rms"


def test_a_model_that_misses_the_validation_data_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = bar(tmp_path, off=0.5)
    (reason,) = [one for one in result.reasons if one.code == "validation_misfit"]
    assert (reason.level, result.verdict, result.holds) == ("fail", "FAIL", False)
    assert reason.value == pytest.approx(0.5, rel=0.02) and reason.limit == pytest.approx(3 * NOISE)
    (row,) = [one for one in result.misfits if one.kind == "validation"]
    assert row.mean == pytest.approx(0.5, rel=0.02), "measured − modelled: the machine is warmer than its model"
    monkeypatch.setattr(sys, "argv", ["robthermal", "run", str(tmp_path / "project.toml"), "--out",
                                      str(tmp_path / "out")])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 1
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    above, _, _ = page.partition('id="contents"')
    assert 'class="verdict no"' in above and "about the model, which the data contradict" in above
    assert "roven" not in above.partition("</style>")[2] and "class=\"claim yes" not in above
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["verdict"] == "FAIL" and all(claim["valid"] for claim in summary["claims"])
    found = summary["residuals"]["validation"]["validation.csv"]["T"]
    assert found["mean"] == pytest.approx(0.5, rel=0.02) and found["tolerance"] == pytest.approx(0.06)
    failed = [case.get("name") for case in ElementTree.parse(tmp_path / "out" / "junit.xml").iter("testcase")
              if case.find("failure") is not None]
    assert failed == ["validation_misfit"]


@pytest.mark.parametrize(("gate", "verdict", "level"), [
    ("tolerance = 0.6", "PASS WITH REMARKS", "remark"), ("tolerance = { T = 0.6 }", "PASS WITH REMARKS", "remark"),
    ("tolerance = { default = 0.4 }", "FAIL", "fail"), ('tolerance = 0.6\nremarks = "fail"', "FAIL", "fail")])
def test_the_stated_tolerance_counts(gate: str, verdict: str, level: str, tmp_path: Path) -> None:
    result = bar(tmp_path, off=0.5, project=f"{PROJECT}[gate]\n{gate}\n")
    assert result.verdict == verdict
    assert [one.level for one in result.reasons if one.code == "validation_misfit"] == [level]


def test_a_model_that_predicts_passes_with_what_a_reader_has_to_know(tmp_path: Path) -> None:
    result = bar(tmp_path)
    assert result.verdict == "PASS WITH REMARKS" and codes(result, "fail") == set()
    assert codes(result, "remark") == {"not_diagnosed", "ambient_not_recorded"}


def test_remarks_about_the_data(tmp_path: Path) -> None:
    project = PROJECT.replace('validation = ["validation.csv"]\n', 'label = "Simulated for a test"\n').replace(
        "[19.0, 21.0]", "[0.0, 21.0]") + 'parameters = "none"\n'
    result = bar(tmp_path, project=project, system=SYSTEM.replace("noise = 0.02\n", ""))
    assert codes(result, "remark") == {"no_validation", "not_diagnosed", "simulated_data", "no_noise_stated",
                                       "outside_data", "nominal_only", "ambient_not_recorded"}
    (row,) = result.misfits
    assert row.noise == pytest.approx(NOISE, rel=0.1), "from second differences"
    constant = bar(tmp_path, project=project.replace('["train.csv"]', '["still.csv"]')) if _still(tmp_path) else result
    assert "constant_input" in codes(constant, "remark")
    held_out = project.replace('["train.csv"]', '["still.csv"]\nvalidation = ["validation.csv"]')
    assert "constant_input" in codes(bar(tmp_path, project=held_out), "remark"), "a record held out is no help"


def _still(folder: Path) -> bool:
    """A record whose heater is on all the time."""
    time, noise = np.arange(600.0), np.random.default_rng(2)
    readings = ROOM + closed_form(time, 1.0) + noise.normal(0, NOISE, 600)
    rows = [f"{t:g},100,{T:.4f}" for t, T in zip(time, readings, strict=True)]
    return bool((folder / "still.csv").write_text("\n".join(["time,Q,T", *rows])))


@pytest.mark.parametrize(("stated", "codes_of"), [
    ("heat = { bar = [0.0, 8.0] }", set()), ("", set()),
    ("heat = { bar = [0.0, 5.0] }", {("heater_beyond_claim", "bar"), ("records_beyond_claim", "Q")})])
def test_claims_about_less_heat_than_heaters_give_are_remarked(stated: str, codes_of: set[tuple[str, str]],
                                                               tmp_path: Path) -> None:
    """8 W by its limits and in the records: a claim about 5 W was a pass without a word."""
    result = bar(tmp_path, project=PROJECT.replace("heat = { bar = [0.0, 8.0] }", stated))
    said = [one for one in result.reasons if one.code in ("heater_beyond_claim", "records_beyond_claim")]
    assert {(one.code, one.about) for one in said} == codes_of and all(one.level == "remark" for one in said)
    assert all("8 W" in one.text and "0 to 5 W into bar" in one.text for one in said)


def test_a_heater_of_another_lump_than_the_stated_one_counts(tmp_path: Path) -> None:
    more = SYSTEM.replace("[sensors.T]", """
[lumps.lid]
capacity = 20.0
initial = 20.0
[[links]]
between = ["lid", "bar"]
conductance = 0.3
[sensors.T]""")
    result = bar(tmp_path, system=more, project=PROJECT.replace("heat = { bar =", "heat = { lid ="))
    box = next(one.certificate for one in result.certification.checked if one.key == "box")
    assert {name: float(high) for name, (_, high) in box.region["heat"].items()} == {"lid": 8.0, "bar": 8.0}


def test_a_room_outside_of_what_is_claimed_is_remarked(tmp_path: Path) -> None:
    time, records = np.arange(600.0), {}
    for name, share in (("train", 1.0), ("validation", 0.3)):
        records[name] = np.full(600, 100 * share), ROOM + closed_form(time, share)
    file = write_project(tmp_path, records, project=PROJECT.replace("ambient = { room = [19.0, 21.0] }", ""))
    for csv in ("train.csv", "validation.csv"):
        head, *rows = (tmp_path / csv).read_text(encoding="utf-8").splitlines()
        warm = [f"{row},{20.0 + 3.0 * k / (len(rows) - 1):.3f}" for k, row in enumerate(rows)]
        (tmp_path / csv).write_text("\n".join([f"{head},room", *warm]) + "\n", encoding="utf-8")
    result = rt.jobs.run_job(rt.jobs.read_project(file))
    (said,) = [one for one in result.reasons if one.code == "records_beyond_claim"]
    assert said.text == "The claims are about room at exactly 20 °C; the records hold 20 to 23 °C."


def test_what_the_data_leave_open_is_said_and_decides_where_a_claim_depends_on_it(tmp_path: Path) -> None:
    open_ = SYSTEM + '"inputs.Q.gain" = { lower = 0.01, upper = 1.0 }\n'  # only ratios are determined
    result = bar(tmp_path, system=open_)
    found = {one.about: one.level for one in result.reasons if one.code == "undetermined_parameter"}
    assert set(found) == {"lumps.bar.capacity", "links.bar-room.conductance", "inputs.Q.gain"}
    assert found["links.bar-room.conductance"] == found["lumps.bar.capacity"] == "remark", "claims hold on [fit]"


# Misfit: the test against noise, by simulation


@pytest.mark.parametrize(("correlation", "n"), [(0.0, 300), (0.8, 600), (0.95, 2000)])
def test_noise_is_seldom_called_a_misfit_and_an_offset_always(correlation: float, n: int) -> None:
    rng = np.random.default_rng(5)
    hits = 0
    for _ in range(1000):
        drive = rng.standard_normal(n + 400)
        e = NOISE * lfilter([np.sqrt(1 - correlation**2)], [1.0, -correlation], drive)[400:]
        hits += misfit("train", "r", "T", e, NOISE, 0.0).significant
        assert misfit("train", "r", "T", e + 6 * NOISE, NOISE, 0.0).significant
    assert hits <= 6, "1 in 1000 expected, at most 6 with 99.99 % confidence"


def test_misfit_is_the_excess_beyond_the_noise() -> None:
    e = np.random.default_rng(3).permutation(np.tile([0.3, -0.1], 500))  # mean 0.1, mean square 0.05
    one = misfit("train", "r", "T", e, 0.1, 0.15)
    assert (one.mean, one.rms) == (pytest.approx(0.1), pytest.approx(0.05**0.5))
    assert one.excess == pytest.approx(0.2) and one.beyond


# Currents and parameters


def stage(**changes: object) -> rt.System:
    return rt.System(ambients={"room": {"temperature": 295.15}},
                     lumps={"sink": {"capacity": 120.0}, "stage": {"capacity": 35.0}},
                     links=[{"between": ("sink", "room"), "conductance": 0.9},
                            {"between": ("stage", "room"), "conductance": 0.05}],
                     modules={"m1": rt.systems.surrogate_module("sink", "stage")})


BOXES = rt.jobs.Boxes(setpoint={"m1": 288.15})


@pytest.fixture(scope="module")
def limit() -> float:
    found = rt.certify.usable_current(stage(), temperature=BOXES.temperature, setpoint=BOXES.setpoint,
                                      lower="reported")
    return found.current


def certified(current: float, tmp_path: Path, **boxes: object) -> tuple[rt.report.Report, str]:
    wanted = rt.jobs.Boxes(setpoint={"m1": 288.15}, current={"m1": (0.0, current)}, **boxes)
    report = rt.jobs.write_certify(rt.jobs.certify_system(stage(), wanted), (), tmp_path / "out")
    return report, (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_currents_above_the_usable_one_fail_with_the_number_that_binds(limit: float, tmp_path: Path) -> None:
    """The rows "no thermal runaway at 1.5 A" beside I* = 1.46 A, and "5.267 A, proven … may be used"."""
    report, page = certified(1.05 * limit, tmp_path)
    failures = [one for one in report.reasons if one.level == "fail"]
    assert failures and {one.code for one in failures} <= {"current_beyond_runaway", "current_beyond_invariance"}
    assert all(one.about == "m1" and one.value == pytest.approx(1.05 * limit) and one.limit < 1.05 * limit
               for one in failures)
    assert "no thermal runaway" not in page and report.verdict == "FAIL"
    said = {float(re.findall(r"at most ([\d.]+) A", one.remedy)[0]) for one in failures}
    assert all(limit - 1e-3 * limit < one <= limit for one in said), "what is advised is never above what is usable"
    assert "claims below are proven" not in page
    assert "may be used" not in page and "largest certified current" not in page.lower()


def test_currents_within_the_usable_one_pass(limit: float, tmp_path: Path) -> None:
    report, page = certified(0.9 * limit, tmp_path)
    assert report.verdict == "PASS WITH REMARKS" and {one.code for one in report.reasons} == {"nominal_only"}
    assert "no thermal runaway" in page
    first, _, rest = page.partition('id="contents"')
    row = next(row for row in report.usable if row.direction == "cooling")
    assert row.current == pytest.approx(limit) and row.range in first.replace("\u00a0", " ")
    contraction = row.bound("contraction")
    assert contraction is not None and contraction.current is not None and contraction.current >= row.current
    assert f"{contraction.current:.4g}"[:4] not in first and "not a limit for use" in rest


def test_a_claim_that_fails_for_the_ranges_names_the_parameter(limit: float, tmp_path: Path) -> None:
    """The row "invariance fails at 0.1 σ of the calibration's own uncertainty"."""
    ranges = {"links.sink-room.conductance": (0.1, 1.0), "lumps.stage.capacity": (34.9, 35.1)}
    report, page = certified(0.9 * limit, tmp_path, parameters=ranges)
    broken = [one for one in report.reasons if one.code == "not_robust"]
    assert broken and report.verdict == "FAIL"
    assert any("links.sink-room.conductance" in one.text and "lumps.stage.capacity" not in one.text for one in broken)
    nominal = {claim.title: claim.good for claim in report.claims if claim.parameters == "nominal"}
    assert len(nominal) == 3 and all(nominal.values()), "side by side: the nominal claims hold"
    assert "For the parameters as they stand" in page and "For all parameters in their ranges" in page


@pytest.mark.exhaustive
def test_usable_currents_of_every_direction_are_found_for_the_ranges_too(limit: float, tmp_path: Path) -> None:
    """Cooling is asked for only; what is certified for the ranges is certified for the parameters as they stand."""
    value = stage().parameter("modules.m1.resistance.value")
    ranges = {"links.sink-room.conductance": (0.88, 0.92), "modules.m1.resistance.value": (0.98 * value, 1.02 * value)}
    report, page = certified(0.5 * limit, tmp_path, parameters=ranges)
    rows = {(row.direction, row.parameters): row for row in report.usable}
    assert set(rows) == {(d, p) for d in ("cooling", "heating") for p in ("nominal", "ranges")}
    for direction in ("cooling", "heating"):
        nominal, robust = rows[direction, "nominal"], rows[direction, "ranges"]
        assert 0.8 * nominal.current < robust.current <= nominal.current
        for one in robust.bounds:
            other = nominal.bound(one.name)
            assert one.current is None or (other is not None and one.current <= other.current)
    first = page.partition('id="contents"')[0]
    assert first.count("for the parameter ranges (parameters as they stand:") == 2


# Report built again


def test_an_edited_report_is_not_believed(limit: float, tmp_path: Path) -> None:
    """The row "`robthermal report` after editing `report.json`: shows "any current up to 15 A" as verified"."""
    certified(0.5 * limit, tmp_path)
    file = tmp_path / "out" / "report.json"
    for place, words in (("sentence", "Any current up to 15 A."), ("box", "m1: 0 to 15 A"), ("title", "15 A allowed"),
                         ("margin", "15 A")):
        data = json.loads(file.read_text(encoding="utf-8"))
        data["claims"][0][place] = words
        file.write_text(json.dumps(data), encoding="utf-8")
    data = json.loads(file.read_text(encoding="utf-8"))
    data |= {"headline": "15 A proven.", "numbers": [["usable", "15 A", ""]], "identity": {"revision": "15 A"}}
    file.write_text(json.dumps(data), encoding="utf-8")
    again = rt.jobs.rebuild_report(tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "15 A" not in page.replace("\u00a0", " ")
    assert "report.json was changed" in page, "the reason is on the page, whatever headline was written into the file"
    assert again.verdict == "FAIL" and {one.code for one in again.reasons} == {"report_changed"}
    assert all(claim.good for claim in again.claims), "the certificates are as good as they were"


def test_claims_are_rebuilt_even_where_the_digest_was_computed_again(limit: float, tmp_path: Path) -> None:
    certified(0.5 * limit, tmp_path)
    file = tmp_path / "out" / "report.json"
    stored = rt.report.read_content(file)
    data = json.loads(file.read_text(encoding="utf-8"))
    for key in ("sentence", "box", "title", "margin"):
        data["claims"][0][key] = "15 A"
    data["usable"][0]["bounds"][0]["current"] = data["usable"][0]["bounds"][1]["current"] = 15.0
    data["usable"][0]["certified"] = 15.0
    file.write_text(json.dumps(data), encoding="utf-8")
    rt.report.write_content(rt.report.read_content(file), file)
    assert rt.report.is_unchanged(file)
    again = rt.jobs.rebuild_report(tmp_path / "out")
    assert again.usable[0].current == stored.usable[0].current and again.verdict == "PASS WITH REMARKS"
    assert "15 A" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")


def test_a_certificate_of_another_machine_is_no_evidence(limit: float, tmp_path: Path) -> None:
    certified(0.5 * limit, tmp_path)
    other = stage().with_parameters({"lumps.sink.capacity": 121.0})
    rt.certify.contraction(other, current={"m1": (0.0, 0.1)}, temperature=BOXES.temperature).save(
        tmp_path / "out" / "certificates" / "box_contraction.json")
    file = tmp_path / "out" / "report.json"
    data = json.loads(file.read_text(encoding="utf-8"))
    for one in data["evidence"]:
        if one["file"] == "certificates/box_contraction.json":
            one["sha256"] = rt.report.file_hash(tmp_path / "out" / one["file"])
    file.write_text(json.dumps(data), encoding="utf-8")
    rt.report.write_content(rt.report.read_content(file), file)
    again = rt.jobs.rebuild_report(tmp_path / "out")
    bad = [one for one in again.evidence if not one.good]
    assert [one.file for one in bad] == ["certificates/box_contraction.json"] and "another machine" in bad[0].reason
    assert again.verdict == "FAIL"


# Words


@pytest.mark.parametrize(("low", "high", "narrower", "wider"), [
    (0.0, 1.23456789, "0 to 1.234", "0 to 1.235"), (-1.23456, -0.5, "-1.234 to -0.5", "-1.235 to -0.5"),
    (278.15 - 273.15, 358.15 - 273.15, "5 to 85", "5 to 85")])
def test_ranges_are_rounded_to_their_safe_side(low: float, high: float, narrower: str, wider: str) -> None:
    assert inward(low, high, 4) == narrower and outward(low, high, 4) == wider


def test_every_code_has_a_meaning_and_a_remedy_and_is_documented() -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "explanations" / "report.md").read_text(encoding="utf-8")
    assert len(rt.jobs.claims.GateCode) > 1
    for one in rt.jobs.claims.GateCode:
        assert one.meaning.endswith(".") and one.remedy.endswith(".") and f"`{one.code}`" in page


@pytest.mark.parametrize(("modules", "words"), [
    (("m1",), "m1 is to have cooling currents up to 2 A; the declared rating is 1.2 A."),
    (("m1", "m2"), "m1 is to have cooling currents up to 2 A; the smallest declared rating, which bounds the usable "
                   "current of all modules, is 1.2 A.")])
def test_a_rating_of_another_module_is_not_said_to_be_its_own(modules: tuple[str, ...], words: str) -> None:
    """Two stages of a cooler, of 2 A and 1.2 A: the usable current is one for both."""
    row = rt.report.UsableRange("cooling", "nominal", modules, [rt.report.Bound("rating", 1.2, "declared", "")], None)
    asked = {name: (0.0, size) for name, size in zip(modules, (2.0, 1.2), strict=False)}
    found = current_reasons(asked, {}, [row], True)
    assert [one.text for one in found] == [words]
