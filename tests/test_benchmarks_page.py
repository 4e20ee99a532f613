"""The page of the benchmarks: as docs/benchmarks.json says, a column per processor, old figures marked."""

from __future__ import annotations

import json
import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPT = runpy.run_path(str(ROOT / "docs" / "table_of_benchmarks.py"))
PRINTED = ["Reading 1000 rows; load 3.5", "-----------", "Python 3.11.7, Made Up One, OMP_NUM_THREADS 1",
           "pandas             0.100 s", "robthermal         0.250 s   2.5 times pandas", "pandas             9.000 s",
           "worker killed: 40 of 40 kept, 98.9%, bound |X|"]


def entry(printed: list[str], version: str = "0.1.0", script: str = "aa") -> dict[str, object]:
    return {"day": "2000-01-01", "load_of_the_machine": 0.5, "printed": printed, "processor_seconds": 1.5,
            "script": script, "versions": {"robthermal": version, "numpy": "2.0"}}


def rows(page: str) -> list[list[str]]:
    """Cells of the lines of tables."""
    escaped = page.replace("\\|", "\0")
    return [[cell.strip().replace("\0", "|") for cell in line.strip("|").split("|")]
            for line in escaped.splitlines() if line.startswith("|") and not line.startswith("|---")]


def test_page_is_that_of_the_figures_kept():
    """But for the marks: a change of a script alone makes its figures old, and is marked when they are next written."""
    written, now = (re.sub(r"; \*old\*| \(\*old\*\)", "", text)
                    for text in (SCRIPT["PAGE"].read_text(encoding="utf-8"), SCRIPT["now"]()))
    assert written == now, "run python docs/table_of_benchmarks.py"
    kept = json.loads(SCRIPT["KEPT"].read_text(encoding="utf-8"))
    assert f"one processor, {next(iter(kept))}." in SCRIPT["now"]() or len(kept) > 1


def test_a_second_machine_becomes_a_column():
    """The same lines in one row each, whatever their numbers; a line that only one printed stands alone."""
    other = [line.replace("Made Up One", "Made Up Two").replace("0.250 s   2.5 times", "0.120 s   3.0 times")
             .replace("load 3.5", "load 0.1").replace("0.100", "0.040") for line in PRINTED] + ["new line 7"]
    page = SCRIPT["text"]({"Made Up One": {"bench_a.py": entry(PRINTED)}, "Made Up Two": {"bench_a.py": entry(other)}},
                          "0.1.0", {"bench_a.py": "aa"})
    assert rows(page) == [
        ["", "Made Up One", "Made Up Two"],
        ["Reading … rows; load …", "1000 · 3.5", "1000 · 0.1"],
        ["pandas", "0.100 s", "0.040 s"],
        ["robthermal", "0.250 s · 2.5 times pandas", "0.120 s · 3.0 times pandas"],
        ["pandas", "9.000 s", "9.000 s"],
        ["worker killed: … of … kept, …%, bound |X|", "40 · 40 · 98.9", "40 · 40 · 98.9"],
        ["new line …", "–", "7"]]
    assert "2 processors" in page and "*old*\n" not in page


@pytest.mark.parametrize("other", [{"version": "0.0.9"}, {"script": "bb"}])
def test_what_was_measured_before_a_change_is_marked(other):
    kept = {"Made Up One": {"bench_a.py": entry(PRINTED)}, "Made Up Two": {"bench_a.py": entry(PRINTED, **other)}}
    page = SCRIPT["text"](kept, "0.1.0", {"bench_a.py": "aa"})
    assert rows(page)[0] == ["", "Made Up One", "Made Up Two (*old*)"]
    assert [line.endswith("; *old*") for line in page.splitlines() if line.startswith("- ")] == [False, True]


def test_a_benchmark_that_one_machine_did_not_run_has_one_column():
    kept = {"Made Up One": {"bench_a.py": entry(PRINTED)}, "Made Up Two": {"bench_b.py": entry(PRINTED)}}
    heads = [row for row in rows(SCRIPT["text"](kept, "0.1.0", {})) if not row[0]]
    assert heads == [["", "Made Up One (*old*)"], ["", "Made Up Two (*old*)"]]


def test_a_script_that_fails_stops_no_other(tmp_path, monkeypatch):
    """The others are kept under this processor; the end says which failed."""
    folder = ROOT / "tests" / "benchmarks"
    monkeypatch.syspath_prepend(str(folder))
    run = runpy.run_path(str(folder / "run_benchmarks.py"))
    bad, good = tmp_path / "bench_bad.py", tmp_path / "bench_good.py"
    bad.write_text("print('half')\nraise SystemExit(3)\n")
    good.write_text("print('peer   2.0 s')\n")
    kept, page = tmp_path / "kept.json", tmp_path / "page.md"
    run["TABLE"].update(KEPT=kept, PAGE=page, now=lambda: "the page")
    with pytest.raises(SystemExit, match="failed: bench_bad.py"):
        run["main"]([str(bad), str(good)])
    [(name, found)] = json.loads(kept.read_text()).items()
    assert "cores" in name and list(found) == ["bench_good.py"] and page.read_text() == "the page"
    assert found["bench_good.py"]["printed"] == ["peer   2.0 s"]
    assert found["bench_good.py"]["script"] == SCRIPT["digest"](good)
