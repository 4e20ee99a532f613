"""The documentation builds without a warning, names every public object, and its examples are read."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import commands
import numpy as np
import pytest
from axe import needs_axe, violations
from browser import browser
from sphinx.util.inventory import InventoryFile

import robthermal as rt

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
SHOWN = "gallery"  # the only notebook that docs/conf.py runs for tests; tests/test_notebooks.py runs them all

# The kernel of the notebook must find this checkout, and draw into the page.
SETTINGS = {"PYTHONPATH": str(ROOT), "MPLBACKEND": "module://matplotlib_inline.backend_inline"}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("docs")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    command += ["-t", "tests", "-D", f"nb_execution_cache_path={target / 'notebooks'}"]
    command += ["-d", str(target / "doctrees"), str(DOCS), str(target / "html")]
    run = subprocess.run(command, capture_output=True, text=True, env=os.environ | SETTINGS)
    assert run.returncode == 0, run.stderr
    return target / "html"


@pytest.mark.exhaustive
def test_every_public_name_is_on_a_page(built: Path) -> None:
    inventory = InventoryFile.loads((built / "objects.inv").read_bytes(), uri="")
    on_a_page = {name for kind, entries in inventory.data.items() if kind.startswith("py:") for name in entries}
    public = {
        f"robthermal.{package}.{name}"
        for package in rt._PACKAGES
        for name in getattr(import_module(f"robthermal.{package}"), "__all__", ["InputError", "Diverged", "Outcome"])
    }
    assert not public - on_a_page


@pytest.mark.exhaustive
@needs_axe
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (1280, True), (390, False)])
def test_axe_finds_nothing_on_any_kind_of_page(built: Path, width: int, dark: bool) -> None:
    kinds = ("index", "start", "command_line", "comparison", "genindex", "search", "api/index", "api/thermal",
             "tutorials/index", f"tutorials/{SHOWN}", "explanations/limits", "explanations/steady_state",
             "explanations/structured_singular_value", "reference/certificate_format",
             "_modules/robthermal/thermal/_datasheet")
    with browser() as page:
        found = {}
        for kind in kinds:
            page.show(built / f"{kind}.html", width=width, dark=dark)
            page.evaluate("new Promise(done => setTimeout(done, 400))")  # colors of the theme fade into the dark ones
            found[kind] = violations(page)
    assert found == dict.fromkeys(kinds, [])


@pytest.mark.exhaustive
def test_pages_fetch_nothing(built: Path) -> None:
    fetched = re.compile(r"<(?:script|img|iframe|link|source)\b[^>]*\s(?:src|href)=\"((?:https?:)?//[^\"]+)")
    styled = re.compile(r"(?:url\(|@import)\s*[\"']?((?:https?:)?//[^\"')]+)")
    pages, sheets = list(built.rglob("*.html")), list(built.rglob("*.css"))
    assert pages and sheets
    assert {address for page in pages for address in fetched.findall(page.read_text(encoding="utf-8"))} == set()
    assert {address for sheet in sheets for address in styled.findall(sheet.read_text(encoding="utf-8"))} == set()


@pytest.mark.exhaustive
def test_formulas_are_in_the_pages(built: Path) -> None:
    page = (built / "explanations" / "calibration.html").read_text(encoding="utf-8")
    assert page.count("<math ") > 50 and "\\frac" not in page and "MathJax" not in page


@pytest.mark.exhaustive
def test_the_gallery_shows_twelve_pictures_with_their_lines(built: Path) -> None:
    page = (built / "tutorials" / f"{SHOWN}.html").read_text(encoding="utf-8")
    pictures = re.findall(r'<img alt="([^"]{40,})"[^>]*src="../_images/([^"]+\.png)"', page)
    assert len(pictures) == 12
    assert all((built / "_images" / name).stat().st_size > 5_000 for _, name in pictures)
    assert page.count("Show code cell source") >= 12 and "law = " in re.sub("<[^>]+>", "", page)


@pytest.mark.exhaustive
def test_every_picture_has_an_alternative_text(built: Path) -> None:
    pictures = [(page.name, tag) for page in built.rglob("*.html")
                for tag in re.findall(r"<img\b[^>]*>", page.read_text(encoding="utf-8")) if "_static/" not in tag]
    assert len(pictures) > 40
    assert [one for one in pictures if not re.search(r'alt="(?![^"]*_images/)[^"]{15,}"', one[1])] == []


@pytest.mark.exhaustive
@pytest.mark.parametrize(("words", "page"), [
    (["timestamp"], "measured_files"), (["peltier"], "from_tec_tool"), (["peltier"], "api/index"),
    (["thermistor"], "measured_files"), (["safe", "current"], "explanations/limits"),
    (["maximum", "current"], "explanations/limits"), (["matlab"], "from_matlab"), (["simscap"], "from_simscape")])
def test_search_finds(built: Path, words: list[str], page: str) -> None:
    """In the index that the search page loads; its terms are stems."""
    stored = (built / "searchindex.js").read_text(encoding="utf-8")
    index = json.loads(stored[stored.index("(") + 1:stored.rindex(")")])
    found = []
    for word in words:
        places = [index[kind].get(word, []) for kind in ("terms", "titleterms")]
        found.append({number for one in places for number in (one if isinstance(one, list) else [one])})
    assert page in {index["docnames"][number] for number in set.intersection(*found)}


def code_block(page: Path, language: str) -> str:
    found = re.search(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)
    assert found, f"{page.name} has no {language} block"
    return found.group(1)


def test_the_system_and_record_of_the_start_page_are_read(tmp_path: Path) -> None:
    (tmp_path / "bench.toml").write_text(code_block(DOCS / "start.md", "toml"), encoding="utf-8")
    (tmp_path / "run.csv").write_text(code_block(DOCS / "start.md", "text"), encoding="utf-8")
    system = rt.read_system(tmp_path / "bench.toml")
    record = rt.read_record(tmp_path / "run.csv", system)
    assert record.sample_time == 1.0
    np.testing.assert_allclose(record["T_plate"], [22.10 + 273.15, 22.11 + 273.15])
    np.testing.assert_allclose(record["m1"], [0.0, 0.8])


def run_blocks(page: str) -> dict[str, Any]:
    """The names that the Python blocks of a page leave, run from top to bottom."""
    names: dict[str, Any] = {}
    for block in re.findall(r"^```python\n(.*?)^```", (DOCS / page).read_text(encoding="utf-8"), re.M | re.S):
        exec(compile(block, page, "exec"), names)  # noqa: S102  (our own documentation)
    return names


def test_the_script_of_the_start_page_runs_on_the_starter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The gain of the loop with integral action is 1 at rest: not below it, and not above 1.1 without a resonance."""
    monkeypatch.chdir(tmp_path)
    commands.command("new", "mine")
    names = run_blocks("start.md")
    assert 1.0 <= rt.certify.hinf(names["loop"]).upper < 1.1 and names["stage"].dcgain() < 0


@pytest.mark.parametrize("page", ["from_matlab.md", "from_simscape.md", "from_tec_tool.md"])
def test_pages_for_those_who_come_from_other_tools_run(page: str, tmp_path: Path,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (DOCS / page).read_text(encoding="utf-8")
    assert "\nassert " in text and re.search(r"^```(matlab|text|sh)\n", text, re.M)
    assert run_blocks(page)["rt"] is rt


def test_every_name_of_the_tables_of_the_reference_exists() -> None:
    named = re.findall(r"\{(?:func|class)\}`~robthermal\.(\w+)\.(\w+)`", (DOCS / "api" / "index.md").read_text("utf-8"))
    assert len(named) > 100
    assert [f"{package}.{name}" for package, name in named if not hasattr(getattr(rt, package), name)] == []


def test_the_recipes_run_from_top_to_bottom(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names = run_blocks("how_to.md")
    found, proof, usable, possible = (names[name] for name in ("found", "proof", "usable", "possible"))
    assert found.verdict == "named" and found.effects[0].effect == "sensor_lag"
    assert names["verdict"].valid and proof.holds and possible.outcome.ok
    assert usable.current == pytest.approx(1.47, abs=0.01) and usable.outcome.ok
    assert 500 not in rt.signals.find_glitches(names["record"]).get("T", ())


def test_pictures_are_small_and_shown() -> None:
    """Every picture of the folder is on a page, or on the README, and none is too large for a slow line."""
    pictures = [one for one in (DOCS / "images").iterdir() if one.is_file()]
    assert len(pictures) > 8
    pages = "".join(page.read_text(encoding="utf-8") for page in [*DOCS.rglob("*.md"), ROOT / "README.md"])
    assert [one.name for one in pictures if f"images/{one.name}" not in pages] == []
    assert [one.name for one in pictures if one.stat().st_size >= 120_000] == []
