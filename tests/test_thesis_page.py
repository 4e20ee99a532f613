"""The list at the end of docs/thesis.md: no number of the thesis is missing, and what a row names exists."""

from __future__ import annotations

import ast
import re
from functools import reduce
from pathlib import Path

import pytest

import robthermal as rt

ROOT = Path(__file__).resolve().parents[1]
STATUS = {"reproduced", "corrected", "simulated", "impossible", "drawing", "answered", "open"}
EQUATIONS = {2: 14, 3: 29, 4: 34, 5: 47, 6: 41}  # how many each chapter has
FIGURES = {1: 8, 2: 12, 3: 8, 4: 9, 5: 16, 6: 17}
OTHERS = ("definitions 2.1, 4.4", "procedure 4.3", "theorem 4.1", "theorem 4.2", "algorithm 1", "algorithm 2",
          "definition 6.2", "theorem 6.3", "theorem 6.4", "example 6.5", "theorem 6.6", "theorem 6.7", "theorem 6.8",
          "table 6.1")


def rows() -> list[list[str]]:
    listed = (ROOT / "docs" / "thesis.md").read_text(encoding="utf-8").split("## Every numbered equation")[1]
    lines = [line for line in listed.splitlines() if line.startswith("| ")]
    cells = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines]
    return [row for row in cells if row[0] not in ("number", "section")]


def numbers(text: str) -> list[tuple[int, int]]:
    """Numbers such as 2.4 in a text without parentheses, "2.2 to 2.4" written out."""
    found: list[tuple[int, int]] = []
    for first, last in re.findall(r"(\d\.\d+)(?: to (\d\.\d+))?", text):
        chapter, start = map(int, first.split("."))
        found += [(chapter, k) for k in range(start, (int(last.split(".")[1]) if last else start) + 1)]
    return found


def split(head: str) -> tuple[str, str]:
    """The equations and the figures that the first cell of a row names."""
    equations = " ".join(re.findall(r"\(\d\.\d+\)(?: to \(\d\.\d+\))?", head)).replace("(", "").replace(")", "")
    return equations, head if head.startswith("figure") else ""


def test_every_equation_and_figure_has_one_row() -> None:
    heads = [row[0] for row in rows()]
    equations = sorted(n for head in heads for n in numbers(split(head)[0]))
    figures = sorted(n for head in heads for n in numbers(split(head)[1]))
    assert equations == [(chapter, k) for chapter, last in EQUATIONS.items() for k in range(1, last + 1)]
    assert figures == [(chapter, k) for chapter, last in FIGURES.items() for k in range(1, last + 1)]


def test_theorems_examples_and_the_table_have_rows() -> None:
    heads = " ; ".join(row[0] for row in rows())
    assert [name for name in OTHERS if name not in heads] == []


def test_every_row_has_a_status() -> None:
    assert len(rows()) > 90
    assert {row[-1] for row in rows()} - STATUS == set()


@pytest.mark.parametrize("status", ["reproduced", "corrected", "simulated", "answered"])
def test_what_is_done_names_its_code_and_its_evidence(status: str) -> None:
    done = [row for row in rows() if row[-1] == status]
    assert done
    assert [row[0] for row in done if not re.search("`rt\\.|by hand", " ".join(row))] == []
    evidence = re.compile("`tests/|notebook|by hand|`rt\\." if status == "answered" else "`tests/|notebook|by hand")
    assert [row[0] for row in done if not evidence.search(" ".join(row))] == []


def exists(name: str) -> bool:
    try:
        reduce(getattr, name.split("."), rt)
    except AttributeError:
        return False
    return True


def test_names_exist() -> None:
    names = {name for row in rows() for name in re.findall(r"`rt\.([\w.]+)`", " ".join(row))}
    assert len(names) > 40
    assert sorted(name for name in names if not exists(name)) == []


def test_tests_and_notebooks_exist() -> None:
    text = "\n".join(" ".join(row) for row in rows())
    cited = set(re.findall(r"`(tests/[\w/.]+)::(\w+)`", text))
    assert len(cited) > 40
    defined = {path: {node.name for node in ast.parse((ROOT / path).read_text(encoding="utf-8")).body
                      if isinstance(node, ast.FunctionDef)} for path in {path for path, _ in cited}}
    assert sorted(f"{path}::{name}" for path, name in cited if name not in defined[path]) == []
    books = {name for several in re.findall(r"notebooks? ((?:`\w+`(?:, )?)+)", text)
             for name in re.findall(r"`(\w+)`", several)}
    assert len(books) > 5
    assert sorted(name for name in books if not (ROOT / "docs" / "tutorials" / f"{name}.ipynb").exists()) == []
