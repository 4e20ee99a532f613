"""The diagnosis package stays readable: what is counted here is what docs/contributing.md states."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import robthermal

HOME = Path(robthermal.__file__).parent
PACKAGES = ("diagnosis", "thermal/effects")
FILES = [path for package in PACKAGES for path in sorted((HOME / package).rglob("*.py"))]
DIALECT = re.compile(r"told_apart|[Uu]nseen|surprise|flail|hopeful|\bSeen\b|NoiseFloor|\bpayers\b|\bbent\b|lately|"
                     r"told apart|tells? apart|refused in words")


def name(path: Path) -> str:
    return str(path.relative_to(HOME))


def functions(tree: ast.AST) -> Iterator[ast.FunctionDef]:
    return (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))


def complexity(function: ast.FunctionDef) -> int:
    """McCabe's number with comprehensions, conditions and boolean operators counted, as radon does."""
    count = 1
    for node in ast.walk(function):
        if isinstance(node, ast.If | ast.IfExp | ast.For | ast.While | ast.ExceptHandler | ast.Assert):
            count += 1
        elif isinstance(node, ast.comprehension):
            count += 1 + len(node.ifs)
        elif isinstance(node, ast.BoolOp):
            count += len(node.values) - 1
    return count


def short_texts(tree: ast.AST) -> Iterator[str]:
    """Documented parameters whose text has fewer than three words."""
    for node in ast.walk(tree):
        text = ast.get_docstring(node) if isinstance(node, ast.FunctionDef | ast.ClassDef) else None
        section = re.search(r"Parameters\n-+\n(.*?)(?=\n\n[A-Z][a-z]+\n-+|\Z)", text or "", re.S)
        entries = re.findall(r"^(\S[^\n]*)\n((?:[ ]+[^\n]*\n?)+)", section.group(1), re.M) if section else ()
        for parameter, body in entries:
            if len(body.split()) < 3:
                yield f"{parameter}: {body.strip()}"


def test_there_is_something_to_count() -> None:
    assert len(FILES) > 60 and sum(1 for path in FILES for _ in functions(ast.parse(path.read_text()))) > 400
    assert complexity(next(functions(ast.parse("def f(x):\n    return [y for y in x if y and x] if x else 0")))) == 5
    text = 'def f(a):\n    """F.\n\n    Parameters\n    ----------\n    a : int\n        Which.\n    """'
    assert list(short_texts(ast.parse(text))) == ["a : int: Which."]


@pytest.mark.parametrize("path", FILES, ids=name)
def test_functions_are_short_and_parameters_are_described(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert [f"{f.name}: {complexity(f)}" for f in functions(tree) if complexity(f) > 15] == []
    assert list(short_texts(tree)) == []
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


@pytest.mark.parametrize("path", FILES, ids=name)
def test_standard_terms_only(path: Path) -> None:
    assert sorted(set(DIALECT.findall(path.read_text(encoding="utf-8")))) == []


def test_kinds_of_data_are_asked_for_in_one_place_each() -> None:
    """Records and frequency responses share a protocol; only what sorts them asks which one a data set is."""
    kinds = re.compile(r"isinstance\([^)]*\b(RecordData|ResponseData|LinearizedRecord|LinearizedResponse)\b")
    lines = [(name(path), line) for path in FILES for line in path.read_text(encoding="utf-8").splitlines()]
    found = [path for path, line in lines if kinds.search(line)]
    assert set(found) == {"diagnosis/data/_measured.py", "diagnosis/path/_linearize.py"} and len(found) <= 5


def test_no_private_module_is_imported_across_packages() -> None:
    crossing = []
    for path in FILES:
        imports = (node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
                   if isinstance(node, ast.ImportFrom) and node.level > 1)
        for node in imports:
            first, *others = (node.module or "").split(".")
            inside_thermal = "thermal" in path.parts and node.level == 2  # a part of the package thermal itself
            shared = (HOME / f"{first}.py").exists()  # a file beside the packages, for all of them
            own = first in ("_judge", "_file", "_outcomes")  # of the diagnosis itself
            private = first.startswith("_") and not (own or shared or inside_thermal)
            if private or any(other.startswith("_") for other in others):
                crossing.append(f"{name(path)}: {node.module}")
    assert crossing == []
