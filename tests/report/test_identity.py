"""Which machine and which document: head of the report, page to sign, what stands on every printed page."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from robthermal.errors import InputError
from robthermal.jobs import demo_project, read_project
from robthermal.report import Report, read_content, write_content, write_html, write_json
from robthermal.report._html import css_text

IDENTITY = {"serial number": "SN <42>", "operator": "M. Muster", "revision": "B", "date": "2026-11-23"}
Written = Callable[[str], Path]


def page_of(report: Report, folder: Path) -> str:
    return write_html(report, folder / "report.html").read_text(encoding="utf-8")


def test_head_and_page_to_sign_name_the_machine(report: Report, tmp_path: Path) -> None:
    page = page_of(replace(report, identity=IDENTITY), tmp_path)
    head, _, sign = page.partition('<h2 id="sign">')
    assert "<span>serial number <strong>SN &lt;42&gt;</strong></span>" in head
    cells = re.findall(r'<tr><th scope="row">([a-z ]+)</th><td>(.*?)</td>', sign)
    assert cells == [("serial number", "SN &lt;42&gt;"), ("revision", "B"), ("operator", "M. Muster"),
                     ("date", "2026-11-23"), ("measured by", ""), ("checked by", ""), ("released by", "")]
    assert "PASS. SIMULATED DATA." in sign, "the banner is on the page to sign"


def test_what_is_not_stated_is_a_line_to_fill_in(report: Report, tmp_path: Path) -> None:
    page = page_of(report, tmp_path)
    assert 'class="identity"' not in page
    assert '<th scope="row">serial number</th><td></td>' in page


def test_banner_and_machine_stand_on_every_printed_page(report: Report, tmp_path: Path) -> None:
    page = page_of(replace(report, title="Stage", identity=IDENTITY, label='}</style>"\\'), tmp_path)
    boxes = dict(re.findall(r"@(top-center|bottom-left) \{ content: (\"[^\"]*\")", page))
    assert boxes["bottom-left"] == r'"Stage, SN \00003c42\00003e, B"'
    assert boxes["top-center"] == r'"\00007d\00003c\00002fstyle\00003e\000022\00005c"'
    assert page.count("</style>") == 1, "a label cannot end the style sheet"


def test_css_text_is_cut_and_has_no_other_letters() -> None:
    text = css_text("ä" * 50 + "\n\"'" + "x" * 100, 60)
    assert text.startswith(r"\0000e4" * 50 + r"\00000a\000022\000027") and text.endswith(r"xxxxxx\002026")
    assert re.fullmatch(r"(?:[A-Za-z0-9 .,:;()_-]|\\[0-9a-f]{6})*", text)


def test_it_is_kept_and_summarized(report: Report, tmp_path: Path) -> None:
    named = replace(report, identity=IDENTITY)
    assert read_content(write_content(named, tmp_path / "report.json")).identity == IDENTITY
    assert json.loads(write_json(named, tmp_path / "summary.json").read_text("utf-8"))["identity"] == IDENTITY


@pytest.fixture
def project(tmp_path: Path) -> Written:
    """The demo's project file with further keys of [project], beside its own."""
    demo = demo_project()
    text = demo.read_text(encoding="utf-8").replace('"../', f'"{demo.parents[1].as_posix()}/')
    text = re.sub(r'"(\w+\.csv)"', rf'"{demo.parent.as_posix()}/\1"', text)

    def write(keys: str) -> Path:
        path = tmp_path / "project.toml"
        path.write_text(text.replace("[project]\n", f"[project]\n{keys}\n"), encoding="utf-8")
        return path

    return write


def test_the_project_file_states_it(project: Written) -> None:
    path = project('serial = "SN 42"\noperator = " M. Muster "\nrevision = ""\ndate = 2026-11-23')
    assert read_project(path).identity == {"serial number": "SN 42", "operator": "M. Muster", "date": "2026-11-23"}


@pytest.mark.parametrize("key", ['serial = 42', 'operator = "two\\nlines"', f'revision = "{"x" * 101}"', 'date = 7'])
def test_other_than_a_line_of_text_is_refused(key: str, project: Written) -> None:
    with pytest.raises(InputError, match=key.split()[0]):
        read_project(project(key))
