"""Write docs/benchmarks.md from docs/benchmarks.json: what every benchmark printed, a column per processor.

    python docs/table_of_benchmarks.py

`make bench` does it after every benchmark. Lines of two processors that say the same, but for their numbers, share a
row.
"""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
KEPT, PAGE = ROOT / "docs" / "benchmarks.json", ROOT / "docs" / "benchmarks.md"
SCRIPTS = ROOT / "tests" / "benchmarks"
HEAD = """# What the benchmarks printed

`make bench` runs the benchmarks, keeps what they print in `docs/benchmarks.json` under the name of the processor, and
writes this page. Run on another machine it adds a column. Seconds belong to their processor and to what else it did
(load); between columns compare what is a ratio within one run: per cent, "times", a peer beside it. Numbers among words
are replaced by "…" there and given in the column. What was measured with another version of robthermal, or before the
last change of the script, is marked *old*. {count}
"""
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")
_UNSURE = " A name without family and model is of earlier runs, and may stand for the same processor as one with them."


def _no_model(name: str) -> bool:
    """Whether a name was written before family and model were part of it."""
    return "(family" not in name


def text(kept: dict[str, dict[str, Any]], version: str, sources: dict[str, str]) -> str:
    """The page.

    `version` is that of robthermal now, `sources` the hash of every script now.
    """
    names = sorted(kept)
    count = (f"Measured by us so far: one processor, {names[0]}." if len(names) == 1
             else f"Measured so far: {len(names)} processors." + (_UNSURE if any(map(_no_model, names)) else ""))
    page = [HEAD.format(count=count)]
    for script in sorted({script for of in kept.values() for script in of}):
        found = {name: kept[name][script] for name in names if script in kept[name]}
        old = {name: one["versions"]["robthermal"] != version or one.get("script") != sources.get(script)
               for name, one in found.items()}
        page += [f"## {script}", "", *(_run(name, one, old[name]) for name, one in found.items()), "",
                 *_table(found, old), ""]
    return "\n".join(page)


def _run(name: str, one: dict[str, Any], old: bool) -> str:
    versions = ", ".join(f"{package} {number}" for package, number in sorted(one["versions"].items()))
    return (f"- {_plain(name)}: {one['day']}, {one['processor_seconds']} s of processor time, load "
            f"{one['load_of_the_machine']}, {versions}{'; *old*' if old else ''}")


def _table(found: dict[str, dict[str, Any]], old: dict[str, bool]) -> list[str]:
    rows: dict[tuple[str, int], dict[str, str]] = {}
    for name, one in found.items():
        seen: Counter[str] = Counter()
        for line in one["printed"]:
            if not line.startswith(("---", "Python ")):  # rules, and the machine, which the head of a column names
                label, value = _row(line)
                rows.setdefault((label, seen[label]), {})[name] = value
                seen[label] += 1
    heads = [_plain(name) + (" (*old*)" if old[name] else "") for name in found]
    return [f"| | {' | '.join(heads)} |", "|---" * (len(found) + 1) + "|",
            *(f"| {_plain(label)} | {' | '.join(_plain(values.get(name, '–')) for name in found)} |"
              for (label, _), values in rows.items())]


def _row(line: str) -> tuple[str, str]:
    """What a line is about and what it says: cells lie two blanks apart; a sentence is told from its numbers."""
    first, *others = re.split(r"\s{2,}", line.strip())
    if others:
        return first, " · ".join(others)
    return NUMBER.sub("…", first), " · ".join(NUMBER.findall(first))


def _plain(words: str) -> str:
    """Text that Markdown leaves as it is."""
    return re.sub(r"([\\`*_{}\[\]<>|$#~^])", r"\\\1", words)


def digest(script: Path) -> str:
    """Hash of a script, by which a change is noticed."""
    return hashlib.sha256(script.read_bytes()).hexdigest()[:16]


def now() -> str:
    """The page of what is kept now."""
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    return text(json.loads(KEPT.read_text(encoding="utf-8")), version,
                {script.name: digest(script) for script in SCRIPTS.glob("bench_*.py")})


if __name__ == "__main__":
    PAGE.write_text(now(), encoding="utf-8")
