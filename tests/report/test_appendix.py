"""The reviewer's appendix: every assumption of every claim, once, and who rests on it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from robthermal.report import Claim, Evidence, Report, write_html, write_json
from robthermal.report._appendix import numbered_assumptions, resting


def evidence(title: str, *assumptions: str, valid: bool = True, reason: str = "") -> Evidence:
    return Evidence(title, f"certificates/{title}.json", "00", "contraction", f"{title} claims.", True, valid, reason,
                    {"rate": 0.25}, 0.0, assumptions)


BARE = Report("r", "", "", (), (), {}, ("one", "two"), "today")
FULL = replace(BARE, evidence=(evidence("a", "three"), evidence("b", "four", "three"), evidence("c", "five")),
               claims=(Claim("a", "s", True, True, "", "", "", file="certificates/a.json"),
                       Claim("tested", "s", True, None, "", "", "", tested=True)))


def test_every_assumption_stands_once() -> None:
    assert numbered_assumptions(FULL) == ["one", "two", "three", "four", "five"]


def test_every_claim_names_all_its_assumptions() -> None:
    rows = {row.title: row.numbers for row in resting(FULL)}
    assert rows == {"a": [(1, 3)], "b": [(1, 4)], "c": [(1, 2), (5, 5)], "tested": [(1, 2)]}


def test_the_page_shows_them_with_margins_and_hashes(tmp_path: Path) -> None:
    page = write_html(FULL, tmp_path / "r.html").read_text(encoding="utf-8")
    for words in ('<li id="assumption-5">five</li>', '<a href="#assumption-1">1</a>–<a href="#assumption-4">4</a>',
                  '<a href="#assumption-5">5</a>', "rate 0.25", "SHA-256 of certificates/b.json",
                  "a claims.", "passed"):
        assert words in page
    assert "b claims." not in page, "exact claims are those of the first screen"


def test_a_certificate_that_is_not_valid_is_said_there_and_in_the_summary(tmp_path: Path) -> None:
    bad = replace(FULL, evidence=(evidence("a", valid=False, reason="rate is 0.1 too large"),))
    page = write_html(bad, tmp_path / "r.html").read_text(encoding="utf-8")
    assert "NOT VERIFIED: rate is 0.1 too large" in page
    summary = write_json(bad, tmp_path / "s.json").read_text(encoding="utf-8")
    assert '"valid": false' in summary and "rate is 0.1 too large" in summary
