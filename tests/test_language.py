"""Rules of the language that a machine can check: what parameters are, and whose names are private."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1] / "robthermal"
LEAST = 3  # words that say what a parameter is; its unit in brackets does not count
PACKAGES = sorted(path.parent.name for path in ROOT.glob("*/__init__.py"))
# Words that the field does not use, and what it says instead: package, nonlinear, regulated modules, energy supply,
# rejected with a message, not certified.
DIALECT = re.compile(r"\b(bent|grips?|payers?|flails|unseen|hopeful|sureness|told_apart)\b|refused in words|honest no\b"
                     r"|formulas do not hold")


def entries(section: list[str]) -> Iterator[tuple[str, str]]:
    """Name and description of every entry of a numpydoc section that has types."""
    name, words = "", []
    for line in section:
        if line and not line[0].isspace():
            if name:
                yield name, " ".join(words)
            name, words = line, []
        else:
            words.append(line.strip())
    if name:
        yield name, " ".join(words)


def parameters(doc: str) -> Iterator[tuple[str, str]]:
    """Documented parameters: lines between the heading and the next one."""
    lines = doc.splitlines()
    starts = [i for i in range(len(lines) - 1) if lines[i] == "Parameters" and set(lines[i + 1]) == {"-"}]
    for start in starts:
        after = range(start + 2, len(lines))
        end = next((i - 1 for i in after if lines[i] and set(lines[i]) == {"-"}), len(lines))
        yield from entries(lines[start + 2:end])


def short(source: str) -> Iterator[str]:
    """Parameters of a file that are described in fewer than `LEAST` words."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            for name, text in parameters(ast.get_docstring(node) or ""):
                if len(re.findall(r"\w[\w'’-]*", re.sub(r"\[[^]]*\]", "", text))) < LEAST:
                    yield f"{node.name}: {name}: {text}"


def crossing(path: Path, root: Path = ROOT.parent) -> Iterator[str]:
    """Imports of modules that are private to a package the file is not in."""
    here = list(path.relative_to(root).with_suffix("").parts)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom):
            continue
        base = here[:len(here) - node.level] if node.level else []
        target = [*base, *(node.module or "").split(".")] if node.module else base
        if target[:1] != ["robthermal"]:
            continue
        for depth, part in enumerate(target):
            if part.startswith("_") and target[:depth] != here[:depth] and depth > 1:
                yield f"{'.'.join(here)} imports {'.'.join(target)}"


def files(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


@pytest.mark.parametrize("package", PACKAGES)
def test_every_parameter_says_what_it_is(package: str) -> None:
    found = [f"{path.name}: {one}" for path in files(package) for one in short(path.read_text(encoding="utf-8"))]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("package", PACKAGES)
def test_no_private_name_crosses_a_package(package: str) -> None:
    found = [one for path in files(package) for one in crossing(path)]
    assert not found, "\n".join(found)


def dialect(text: str) -> list[str]:
    """Lines with a word that only we would use."""
    return [line.strip() for line in text.splitlines() if DIALECT.search(line)]


@pytest.mark.parametrize("package", PACKAGES)
def test_standard_terms_are_used(package: str) -> None:
    assert [f"{path.name}: {one}" for path in files(package) for one in dialect(path.read_text(encoding="utf-8"))] == []


def test_pages_use_standard_terms() -> None:
    pages = sorted((ROOT.parent / "docs").rglob("*.md"))
    found = [f"{path.name}: {one}" for path in pages for one in dialect(path.read_text(encoding="utf-8"))]
    assert pages and found == []


def test_dialect_is_found() -> None:
    assert dialect("a bent link\na nonlinear link\nthe honest no") == ["a bent link", "the honest no"]


def test_short_descriptions_are_found() -> None:
    bad = '"""."""\ndef f(x):\n    """F.\n\n    Parameters\n    ----------\n    x : int\n        On it [K].\n    """\n'
    assert Counter(short(bad)) == {"f: x : int: On it [K].": 1}
    assert not list(short(bad.replace("On it", "Temperature of the lump")))


def test_a_private_import_is_found(tmp_path: Path) -> None:
    folder = tmp_path / "robthermal" / "design"
    (folder / "parts").mkdir(parents=True)
    lines = {"_one.py": "from ..fitting._data import Data\nfrom ._two import x\nfrom .parts._three import y\n",
             "parts/_three.py": "from ..parts._four import z\nfrom ..._checks import quoted\n"
                                "from robthermal.thermal._terms import T\n"}
    for name, text in lines.items():
        (folder / name).write_text(text, encoding="utf-8")
    assert list(crossing(folder / "_one.py", tmp_path)) == [
        "robthermal.design._one imports robthermal.fitting._data",
        "robthermal.design._one imports robthermal.design.parts._three"]
    assert list(crossing(folder / "parts" / "_three.py", tmp_path)) == [
        "robthermal.design.parts._three imports robthermal.thermal._terms"]
