"""Words of reports: every heading of a table is everyday language, or `explain` knows it."""

from __future__ import annotations

import ast
import re
import runpy
from pathlib import Path

import robthermal as rt
from robthermal.jobs.explanations import GLOSSARY

ROOT = Path(__file__).resolve().parents[2]
EVERYDAY = {
    "accepted", "after", "answer", "before", "better", "calibrated model", "candidate", "claim", "column", "columns",
    "condition", "direction", "effect", "error", "estimate", "file", "filter", "highest", "loop", "lower limit",
    "lowest", "mean", "method", "name", "noise", "nominal model", "number", "parameter", "plant", "quantity", "record",
    "records", "size", "stable", "unit", "upper limit", "value", "where", "why", "files", "said", "smaller by", "what",
    "inputs", "outputs", "use", "used for", "test", "what was found", "with coupling", "without coupling",
    "new records"}



def headings(path: Path) -> set[str]:
    """Keys of the rows that a source file makes tables of: dictionaries in `rows = …` and `DataFrame(…)`; no units."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    made = [node.value for node in ast.walk(tree) if isinstance(node, ast.Assign | ast.AugAssign) and "rows" in
            {inner.id for inner in ast.walk(node) if isinstance(inner, ast.Name) and isinstance(inner.ctx, ast.Store)}]
    made += [argument for node in ast.walk(tree) if isinstance(node, ast.Call)
             and isinstance(node.func, ast.Attribute) and node.func.attr == "DataFrame"
             for argument in (*node.args, *(keyword.value for keyword in node.keywords))]
    keys = [key.value for value in made for inner in ast.walk(value) if isinstance(inner, ast.Dict)
            for key in inner.keys if isinstance(key, ast.Constant) and isinstance(key.value, str)]
    return {re.sub(r"\s*\[.*?\]", "", key).strip() for key in keys}


def test_every_heading_is_everyday_language_or_explained() -> None:
    """Read from the sources of everything that writes a report, so that no report has to be made."""
    found = {path: headings(path) for path in sorted((ROOT / "robthermal" / "jobs").rglob("_*.py"))
             if "report import" in (text := path.read_text(encoding="utf-8")) and "Table(" in text}
    together = set().union(*found.values())
    assert {"beyond noise", "contraction limit", "I*", "ΔBIC", "MSD before", "set-point"} <= together
    assert sorted(together - EVERYDAY - set(GLOSSARY)) == []
    assert not EVERYDAY & set(GLOSSARY)
    for heading in together & set(GLOSSARY):
        assert any(one.what == "word" and one.meaning[0] for one in rt.jobs.explain(heading))


def test_words_on_the_first_screen_are_explained() -> None:
    for word in ("Usable current", "cooling", "Box", "Margin", "Proof", "Evidence", "lump", "I*", "contraction"):
        assert [one.what for one in rt.jobs.explain(word)][-1] == "word", word


def test_the_page_of_words_is_the_table() -> None:
    script = runpy.run_path(str(ROOT / "docs" / "table_of_words.py"))
    assert script["PAGE"].read_text(encoding="utf-8") == script["text"](), "run python docs/table_of_words.py"


def test_meanings_are_sentences() -> None:
    for word, (meaning, page) in GLOSSARY.items():
        assert meaning[0].isupper() or meaning[0].isdigit() or meaning.startswith("I*"), word
        assert meaning.endswith((".", "]")) and (ROOT / "docs" / "explanations" / f"{page}.md").is_file(), word
