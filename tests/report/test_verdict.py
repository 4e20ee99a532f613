"""The verdict: the worst reason decides, its color, and what is never said above a model that the data contradict."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from robthermal.errors import InputError
from robthermal.report import (
    Bound,
    Claim,
    Reason,
    Report,
    UsableRange,
    is_unchanged,
    read_content,
    write_content,
    write_html,
    write_json,
    write_junit,
)

GOOD = Claim("Contraction", "Temperatures approach each other.", True, True, "m1: 0 to 1 A", "0.01 1/s", "energy",
             file="certificates/contraction.json", parameters="nominal")
ROBUST = replace(GOOD, parameters="ranges", file="certificates/contraction_ranges.json")
REMARK = Reason("remark", "no_validation", "calibrate", "records", "No record was held out.", "Hold one out.")
MISFIT = Reason("fail", "validation_misfit", "calibrate", "T1", "T1 is off by 0.5 K.", "Mend the model.", 0.5, 0.06)
BARE = Report("Set-up", "1 lump", "", (GOOD,), (), {}, (), "today")


@pytest.mark.parametrize(("claims", "gate", "verdict", "color"), [
    ((GOOD,), (), "PASS", "yes"), ((GOOD,), (REMARK,), "PASS WITH REMARKS", "remarks"),
    ((GOOD,), (REMARK, MISFIT), "FAIL", "no"), ((replace(GOOD, verified=False),), (REMARK,), "FAIL", "no"),
    ((GOOD, replace(ROBUST, holds=False)), (), "FAIL", "no"), ((), (), "FAIL", "no")])
def test_the_worst_reason_decides(claims: tuple[Claim, ...], gate: tuple[Reason, ...], verdict: str, color: str,
                                  tmp_path: Path) -> None:
    report = replace(BARE, claims=claims, gate=gate)
    assert (report.verdict, report.holds) == (verdict, verdict != "FAIL")
    summary = json.loads(write_json(report, tmp_path / "s.json").read_text())
    assert (summary["verdict"], summary["holds"]) == (verdict, verdict != "FAIL")
    page = write_html(report, tmp_path / "r.html").read_text(encoding="utf-8")
    assert re.findall(r'class="verdict (\w+)"', page) == [color]
    assert [one["level"] for one in summary["reasons"]] == sorted(
        (one["level"] for one in summary["reasons"]), key=lambda level: level != "fail"), "failures first"


def test_reasons_of_claims_have_the_codes_of_the_contract() -> None:
    def codes(*claims: Claim) -> list[str]:
        return [one.code for one in replace(BARE, claims=claims).reasons]

    assert codes(replace(GOOD, holds=False)) == ["not_certified"]
    assert codes(replace(GOOD, verified=False)) == ["not_verified"]
    assert codes(GOOD, replace(ROBUST, holds=False)) == ["not_robust"]
    assert codes(replace(GOOD, holds=False), replace(ROBUST, holds=False)) == ["not_certified"], "said once"


def test_summary_has_the_keys_of_a_reason(tmp_path: Path) -> None:
    summary = json.loads(write_json(replace(BARE, gate=(MISFIT,)), tmp_path / "s.json").read_text())
    assert summary["reasons"] == [{"level": "fail", "code": "validation_misfit", "stage": "calibrate", "about": "T1",
                                   "value": 0.5, "limit": 0.06, "text": "T1 is off by 0.5 K.",
                                   "remedy": "Mend the model."}]


def test_nothing_is_called_proven_above_a_model_that_fails(tmp_path: Path) -> None:
    usable = (UsableRange("cooling", "nominal", ("m1",), (Bound("contraction", 5.2, "proven", "Norm."),)),)
    page = write_html(replace(BARE, gate=(MISFIT,), usable=usable), tmp_path / "r.html").read_text(encoding="utf-8")
    above, _, below = page.partition('id="contents"')
    assert "about the model, which the data contradict" in above
    assert "roven" not in re.sub(r"<style>.*</style>", "", above, flags=re.S)
    assert "certified for the model" in below and ">proven</td>" not in below
    page = write_html(replace(BARE, gate=(REMARK,), usable=usable), tmp_path / "r.html").read_text(encoding="utf-8")
    assert "Proven and verified" in page and "contradict" not in page and ">proven</td>" in page


def test_junit_has_one_case_per_claim_and_per_gate(tmp_path: Path) -> None:
    report = replace(BARE, claims=(GOOD, ROBUST), gate=(REMARK, MISFIT),
                     gates=("no_validation", "validation_misfit", "constant_input"))
    root = ElementTree.parse(write_junit(report, tmp_path / "j.xml")).getroot()
    cases = {case.get("name"): case for case in root.iter("testcase")}
    assert set(cases) == {"Contraction", "Contraction, for the parameter ranges", *report.gates}
    assert [name for name, case in cases.items() if case.find("failure") is not None] == ["validation_misfit"]
    assert "held out" in (cases["no_validation"].findtext("system-out") or "")
    assert (root.get("tests"), root.get("failures")) == ("5", "1")


def usable() -> tuple[UsableRange, ...]:
    four = [Bound("contraction", 5.2671, "proven", file="certificates/c.json"), Bound("invariance", 1.2349, "proven"),
            Bound("runaway", 1.43, "computed"), Bound("rating", None, "declared")]
    robust = [replace(four[0], current=5.1), replace(four[1], current=1.2119), *four[2:]]
    return (UsableRange("cooling", "nominal", ("m1", "m2"), four),
            UsableRange("cooling", "ranges", ("m1", "m2"), robust),
            UsableRange("heating", "nominal", ("m1", "m2"), [Bound("contraction", 0.0, "proven")]))


def test_usable_current_is_the_smallest_bound_rounded_down(tmp_path: Path) -> None:
    nominal, robust, heating = usable()
    assert (nominal.current, nominal.limited_by, nominal.range) == (1.2349, "invariance", "0 to 1.234 A")
    assert robust.range == "0 to 1.211 A" and heating.range == "nothing is certified"
    summary = json.loads(write_json(replace(BARE, usable=usable()), tmp_path / "s.json").read_text())
    assert summary["currents"]["m2"]["cooling"] == {
        "contraction": 5.1, "invariance": 1.2119, "runaway": 1.43, "rating": None, "headline": 1.2119,
        "limited_by": "invariance",
        "nominal": {"contraction": 5.2671, "invariance": 1.2349, "runaway": 1.43, "rating": None, "headline": 1.2349}}
    page = write_html(replace(BARE, usable=usable()), tmp_path / "r.html").read_text(encoding="utf-8")
    first, _, rest = page.partition('id="contents"')
    assert "0 to 1.211\u00a0A" in first and "5.267" not in first and "not a limit for use" in rest


def test_the_first_screen_says_what_of_the_usable_current_is_proven(tmp_path: Path) -> None:
    runaway, box = Bound("runaway", 1.4, "computed"), Bound("invariance", 1.2, "proven", file="certificates/box.json")
    kept = "Certified for this model: no lump leaves its range in the box"
    rows = {f"{kept}; the limit itself is computed, not proven.": ([runaway], 1.4),
            f"{kept}; the limit itself is declared.": ([Bound("rating", 1.1, "declared"), box], 1.1),
            f"{kept}.": ([box, runaway], 1.2), "The limit itself is computed, not proven.": ([runaway], None),
            "": ([box], 0.0)}
    for said, (bounds, certified) in rows.items():
        row = UsableRange("cooling", "nominal", ("m1",), bounds, certified)
        assert row.how_sure == said
        page = write_html(replace(BARE, usable=(row,)), tmp_path / "r.html").read_text(encoding="utf-8")
        assert (f'<p class="sure">{said}</p>' in page.partition('id="contents"')[0]) == bool(said)


@pytest.mark.parametrize("bad", [{"name": "luck"}, {"current": -1.0}, {"current": float("nan")},
                                 {"current": float("inf")}])
def test_bounds_are_checked(bad: dict[str, object]) -> None:
    with pytest.raises(InputError, match="bound"):
        replace(Bound("rating", 1.0, "declared"), **bad)


@pytest.mark.parametrize("bad", [{"level": "maybe"}, {"value": float("inf")}])
def test_reasons_are_checked(bad: dict[str, object]) -> None:
    with pytest.raises(InputError, match="reason"):
        replace(REMARK, **bad)


def test_a_stored_report_keeps_all_of_it_and_shows_that_it_was_edited(tmp_path: Path) -> None:
    report = replace(BARE, gate=(REMARK, MISFIT), gates=("no_validation",), usable=usable(),
                     data={"certify": {"confidence": 0.95}})
    path = write_content(report, tmp_path / "report.json")
    again = read_content(path)
    assert list(again.gate) == list(report.gate) and again.verdict == "FAIL" and again.data == report.data
    assert [row.current for row in again.usable] == [row.current for row in report.usable]
    assert is_unchanged(path)
    path.write_text(path.read_text(encoding="utf-8").replace("1.2119", "9.9"), encoding="utf-8")
    assert not is_unchanged(path)


def test_reasons_of_one_kind_are_told_once() -> None:
    """The worst of them, with what the others are about; all of them in the files for programs."""
    off = [Reason("fail", "training_misfit", "calibrate", f"run: T{k}", f"T{k} is off.", "Look.", 0.1 * k, 0.1)
           for k in (1, 4, 2)]
    open_ = [Reason("remark", "undetermined_parameter", "calibrate", f"p{k}", f"p{k} is open.") for k in range(12)]
    two = [Reason("remark", "resampled", "calibrate", f"file{k}", f"file{k} is uneven.") for k in (1, 2)]
    claims = [Reason("fail", "not_certified", "certify", f"claim{k}", f"claim{k} does not hold.") for k in range(3)]
    report = replace(BARE, gate=(*off, *open_, *two, *claims))
    said = [(one.level, one.text) for one in report.told if one.stage == "calibrate"]
    assert said == [("fail", "T4 is off. Likewise: run: T1, run: T2."),
                    ("remark", "p0 is open. Likewise: p1, p2, p3, p4, p5, p6, p7, p8 and 3 more."),
                    ("remark", "file1 is uneven."), ("remark", "file2 is uneven.")]
    assert [one.text for one in report.told if one.about.startswith("claim")] == [one.text for one in claims]
    assert len(report.reasons) == len(report._of_claims()) + 20
