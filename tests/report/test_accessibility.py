"""The page under axe-core, light and dark, on a screen and on a phone; and what axe does not ask, without it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from axe import needs_axe, needs_chromium, violations
from browser import Page, browser

from robthermal.report import Bound, Reason, Report, UsableRange, write_html

pytestmark = needs_chromium
LOOKS = ("proven", "failed", "answer")  # of the head


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def files(report: Report, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Reports with every look of the head: proven, failed, and an answer of tests."""
    folder = tmp_path_factory.mktemp("axe")
    failed = replace(report, claims=[replace(one, verified=False) for one in report.claims])
    answer = replace(report, answer="NAMED", headline="The model lacks a mass.", evidence=(),
                     numbers=(("error", "1 → 0.1 K", "noise alone 0.1 K"),),
                     claims=[replace(one, verified=None, tested=True, file="") for one in report.claims])
    return {name: write_html(one, folder / f"{name}.html")
            for name, one in zip(LOOKS, (report, failed, answer), strict=True)}


@pytest.mark.exhaustive
@needs_axe
@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_axe_finds_nothing(page: Page, files: dict[str, Path], width: int, dark: bool) -> None:
    for name in LOOKS:
        page.show(files[name], width=width, dark=dark)
        assert page.console == []
        assert violations(page) == []


@needs_axe
def test_axe_is_really_asked(page: Page, tmp_path: Path) -> None:
    bad = tmp_path / "bad.html"
    bad.write_text('<!DOCTYPE html><html><body style="color: #aaa">pale<img src="data:,"></body></html>',
                   encoding="utf-8")
    page.show(bad)
    assert {"color-contrast", "html-has-lang", "image-alt"} <= {rule for rule, _ in violations(page)}


def test_what_has_the_focus_is_seen(page: Page, files: dict[str, Path]) -> None:
    """WCAG 2.1, 2.4.7: every link and every box that scrolls has an outline while it has the focus."""
    page.show(files["proven"])
    outlines = page.evaluate("""(() => {
        const all = [...document.querySelectorAll("a[href], [tabindex]")];
        return all.map(one => { one.focus({focusVisible: true}); return getComputedStyle(one).outlineStyle; });
    })()""")
    assert len(outlines) > 10 and set(outlines) == {"solid"}


@pytest.mark.parametrize("width", [1280, 390])
def test_nothing_has_to_be_moved_sideways(page: Page, files: dict[str, Path], width: int) -> None:
    beyond = "Math.max(...[...document.querySelectorAll('.scroll')].map(box => box.scrollWidth - box.clientWidth))"
    for name in LOOKS:
        page.show(files[name], width=width)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page.evaluate(beyond) <= 0


def test_a_phone_shows_the_usable_current_on_its_first_screen(page: Page, report: Report, tmp_path: Path) -> None:
    """Whatever the remarks are; a wide screen has it below the verdict, and there alone."""
    bound = Bound("rating", 3.3, "declared", "as the file says")
    current = UsableRange("cooling", "nominal", ("m1",), (bound,))
    remarks = [Reason("remark", "outside_data", "certify", f"m{k}", "a long remark " * 12) for k in range(6)]
    file = write_html(replace(report, usable=(current,), gate=tuple(remarks)), tmp_path / "remarks.html")
    for width, shown in ((390, True), (1280, False)):
        page.show(file, width=width)
        box = page.evaluate("JSON.stringify(document.querySelector('.short').getBoundingClientRect())")
        assert (0 < json.loads(box)["bottom"] < 700) == shown
    assert "3.3 A" in page.evaluate("document.querySelector('.short').textContent").replace("\u00a0", " ")
