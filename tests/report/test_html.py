"""The page: well formed, self-contained, escaped, and never green for what is not verified."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from robthermal.errors import InputError
from robthermal.report import (
    Claim,
    Figure,
    Report,
    Section,
    Table,
    _table,
    measured_against_model,
    write_content,
    write_html,
)

VOID = {"meta", "link", "br"}
LOADING = {"src", "srcset", "action", "data", "poster", "background"}


class Page(HTMLParser):
    """Tags and text of a page; refuses one that is not well formed."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.texts: list[tuple[str, str]] = []
        self.feed(path.read_text(encoding="utf-8"))
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert len(attrs) == len({key for key, _ in attrs}), f"attribute given twice in <{tag}>"
        self.tags.append((tag, {key: value or "" for key, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {key: value or "" for key, value in attrs}))

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-1:]}"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        self.texts.append((self.open[-1] if self.open else "", data))

    def all(self, tag: str) -> list[dict[str, str]]:
        return [attributes for name, attributes in self.tags if name == tag]

    @property
    def text(self) -> str:
        return " ".join(data for tag, data in self.texts if tag != "style")


def badge(page: Page) -> str:
    """What the badge says."""
    after = page.text.partition("10 lumps")[2].split()
    return " ".join(after[:2])


def verdict_colors(page: Page) -> set[str]:
    """Classes of the head that say its color."""
    heads = [words for _, attributes in page.tags if "verdict" in (words := attributes.get("class", "").split())]
    assert len(heads) == 1
    return set(heads[0]) - {"verdict"}


@pytest.fixture(scope="module")
def path(report: Report, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_html(report, tmp_path_factory.mktemp("page") / "report.html")


@pytest.fixture(scope="module")
def page(path: Path) -> Page:
    return Page(path)


def test_page_is_one_file_that_loads_nothing(page: Page, path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert "http:" not in text and "https:" not in text and "@import" not in text
    assert re.findall(r"url\((?!#)", text) == []
    assert not page.all("script") and not page.all("iframe")
    for tag, attributes in page.tags:
        assert not LOADING & set(attributes), f"<{tag}> loads {attributes}"
        assert not any(key.startswith("on") for key in attributes)
        assert attributes.get("href", "#").startswith(("#", "data:,")), attributes


def test_all_text_is_escaped_and_printable(page: Page, path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]", text)
    # title, h1, claim, section, paragraph, caption, cell, provenance, assumption: shown as typed, half pairs marked
    assert page.text.count('<script>alert("&\ufffd\ufffd\ufffd")</script> Æ €') >= 14
    assert {a["aria-label"] for a in page.all("svg")} >= {'Time plot <script>alert("&\ufffd\ufffd\ufffd")</script> Æ €'}


def test_ids_are_unique_and_every_reference_leads_somewhere(page: Page, path: Path) -> None:
    ids = Counter(attributes["id"] for _, attributes in page.tags if "id" in attributes)
    assert [name for name, n in ids.items() if n > 1] == []
    text = path.read_text(encoding="utf-8")
    wanted = set(re.findall(r"url\(#([^)]+)\)", text))
    wanted |= {a["href"][1:] for _, a in page.tags if a.get("href", "").startswith("#")}
    wanted |= {a["aria-labeledby"] for _, a in page.tags if "aria-labeledby" in a}
    assert len(wanted) > 20 and wanted <= set(ids)


def test_headings_do_not_skip_a_level(page: Page) -> None:
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after <= before + 1 for before, after in zip(levels, levels[1:], strict=False))


def test_page_is_accessible(page: Page) -> None:
    assert page.all("html")[0]["lang"] == "en"
    assert len(page.all("svg")) == 4
    assert all(svg["role"] == "img" and svg["aria-label"] for svg in page.all("svg"))
    assert page.all("th") and all(th["scope"] in {"col", "row"} for th in page.all("th"))
    assert len(page.all("caption")) == len(page.all("table")) == 5
    assert [a["href"] for a in page.all("a")][0] == "#claims", "skip link comes first"


def luminance(color: str) -> float:
    parts = np.array([int(color[i:i + 2], 16) / 255 for i in (1, 3, 5)])
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def test_contrast_of_every_text_color(path: Path) -> None:
    # WCAG 2.1, 1.4.3: at least 4.5:1. Blocks in their order: light, dark, print.
    blocks = re.findall(r":root \{(.*?)\}", path.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 3
    light = dict(re.findall(r"--([\w-]+): (#\w{6})", blocks[0]))
    for block in blocks:
        colors = light | dict(re.findall(r"--([\w-]+): (#\w{6})", block))
        inks = ("ink", "quiet", "link", "yes-text", "no-text", "remarks-text")
        pairs = [(ink, ground) for ink in inks for ground in ("paper", "card")]
        values = [(colors[a], colors[b]) for a, b in [*pairs, ("banner-ink", "banner")]]
        for a, b in [*values, *(("#ffffff", colors[name]) for name in ("yes", "no", "remarks"))]:
            low, high = sorted((luminance(a), luminance(b)))
            assert (high + 0.05) / (low + 0.05) >= 4.5, (a, b)


@pytest.mark.parametrize(("holds", "verified", "why"), [
    (True, None, "was not run"), (True, False, "did not confirm"), (False, None, "no proof was found"),
    (False, True, "no proof was found"), (np.False_, np.True_, "no proof was found"),
])
def test_badge_is_never_green_without_proof_and_check(holds: bool, verified: bool | None, why: str, tmp_path: Path,
                                                      with_claim: Callable[..., Report]) -> None:
    report = with_claim(holds=holds, verified=verified)
    page = Page(write_html(report, tmp_path / "r.html"))
    assert not report.holds
    assert badge(page) == "✗ FAIL" and "is proven, and an independent" not in page.text and why in page.text
    assert not any("yes" in attributes.get("class", "").split() for _, attributes in page.tags)


def test_one_bad_claim_among_good_ones_is_named(report: Report, claim: Claim, tmp_path: Path) -> None:
    bad = replace(claim, title="The odd one", verified=False, reason="margin is -0.02 W/K")
    page = Page(write_html(replace(report, claims=(claim, bad)), tmp_path / "r.html"))
    assert badge(page) == "✗ FAIL" and "The odd one: margin is -0.02\u00a0W/K" in page.text


def test_badge_is_green_when_everything_is_proven_and_checked(page: Page, report: Report) -> None:
    assert report.holds and report.reasons == [] and report.verdict == "PASS"
    assert badge(page) == "✓ PASS" and verdict_colors(page) == {"yes"}


def test_nothing_claimed_is_not_certified(report: Report, tmp_path: Path) -> None:
    page = Page(write_html(replace(report, claims=()), tmp_path / "r.html"))
    assert badge(page) == "✗ FAIL" and "Nothing is claimed" in page.text


def test_first_screen_comes_before_contents_and_appendix_last(page: Page) -> None:
    text = page.text
    words = ("SIMULATED DATA", "PASS", "What is claimed", "m1: 0 to 1.2\u00a0A",
             "rate 0.00123\u00a01/s", "Contents", "Two ", "Assumptions", "What each claim rests on",
             "Exact claims", "Provenance")
    order = [text.index(word) for word in words]
    assert order == sorted(order)


@pytest.mark.parametrize("bad", [{"holds": "no"}, {"holds": None}, {"verified": "yes"}, {"seconds": float("nan")},
                                 {"seconds": -1.0}])
def test_claims_with_other_than_truth_values_are_refused(bad: dict[str, object], claim: Claim) -> None:
    with pytest.raises(InputError, match=next(iter(bad))):
        replace(claim, **bad)


def test_place_that_cannot_be_written_is_said(report: Report, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="missing.*cannot be written.*Check the folder"):
        write_html(report, tmp_path / "missing" / "report.html")


def test_long_records_and_tables_stay_under_three_megabytes(report: Report, tmp_path: Path) -> None:
    time = np.arange(172_800.0)
    noise = np.random.default_rng(3).standard_normal((4, time.size))
    model = {f"s{i}": 300.0 + i + 0 * time for i in range(4)}
    measured = {f"s{i}": model[f"s{i}"] + noise[i] for i in range(4)}
    figures = [Figure.draw(measured_against_model(time, measured, model), alt="Traces.", caption="Two days.")] * 6
    table = Table(pd.DataFrame({"lump": [f"x{i}" for i in range(100_000)], "low [K]": np.arange(1e5)}), "Box.")
    big = replace(report, sections=(Section("All", "", figures=figures, tables=(table,)),))
    path = write_html(big, tmp_path / "r.html")
    assert path.stat().st_size < 3e6
    assert "99800 more are not shown" in Page(path).text


def test_a_cell_is_written_once(report: Report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """For page and file together, however often the page asks whether a column holds numbers."""
    written: list[object] = []
    cell = _table._cell
    monkeypatch.setattr(_table, "_cell", lambda value, digits: written.append(value) or cell(value, digits))
    table = Table(pd.DataFrame({"lump": ["sink", "stage", "cold"], "C [J/K]": [120.0, 35.0, 8.0]}), "Lumps.")
    section = Section("Lumps", "Three of them.", tables=(table,))
    page = write_html(replace(report, sections=(section,)), tmp_path / "report.html").read_text(encoding="utf-8")
    write_content(replace(report, sections=(section,)), tmp_path / "report.json")
    assert written == ["sink", "stage", "cold", 120.0, 35.0, 8.0]
    assert '<th scope="row">stage</th><td class="number">35</td>' in page


def test_of_many_claims_the_first_and_the_failing_have_cards(tmp_path: Path) -> None:
    one = Claim("c", "It holds.", True, True, "box", "none", "proof", "", "certificates/c.json", "network", 0.1)
    good = [replace(one, title=f"Good {k}", file=f"certificates/{k}.json") for k in range(60)]
    bad = replace(one, title="Bad", holds=False, verified=None, file="certificates/bad.json")
    report = Report("Many", "", "", [*good, bad], (), {}, (), "today")
    page = write_html(report, tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count('<article class="claim') == 5 and ">Bad<" in page
    assert "56 more claims" in page


def test_only_the_answer_is_bold_and_nothing_of_the_headline_is_lost(report: Report, tmp_path: Path) -> None:
    said = "The model lacks a mass.", "With it the error falls from 9.6 to 0.73 K.", "Record the room.", "Take care."
    for n in (1, 2, 4):
        page = write_html(replace(report, answer="NAMED", headline=" ".join(said[:n])), tmp_path / f"{n}.html"
                          ).read_text(encoding="utf-8").replace("\u00a0", " ")
        assert f'<p class="lead">{" ".join(said[:min(n, 2)])}</p>' in page
        assert ("<p>Record the room. Take care.</p>" in page) is (n == 4)
