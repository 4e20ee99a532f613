"""The page for contributors: its picture is drawn from today's imports, and what it names exists."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "contributing.md").read_text(encoding="utf-8")
MAKE = (ROOT / "Makefile").read_text(encoding="utf-8")


def test_picture_shows_the_imports_of_today() -> None:
    spec = importlib.util.spec_from_file_location("pictures_of_packages", ROOT / "docs" / "pictures_of_packages.py")
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    drawn = (ROOT / "docs" / "images" / "packages.svg").read_text(encoding="utf-8")
    today = script.description()
    assert "jobs imports report" in today
    assert today in drawn, "run docs/pictures_of_packages.py again"
    assert all(f">{name}<" in drawn for row in script.layers() for name in row)
    assert "images/packages.svg" in PAGE


def test_files_that_the_page_names_exist() -> None:
    named = re.findall(r"`((?:robthermal|tests|docs|recheck)/[\w/.]+\.\w+)`", PAGE)
    assert len(set(named)) > 20
    assert [path for path in sorted(set(named)) if not (ROOT / path).exists()] == []


def test_files_of_the_quick_tests_exist() -> None:
    quick = re.search(r"^QUICK := ((?:.*\\\n)*.*)", MAKE, re.M)
    assert quick is not None
    files = quick.group(1).replace("\\\n", " ").split()
    assert len(files) > 10 and [path for path in files if not (ROOT / path).exists()] == []
