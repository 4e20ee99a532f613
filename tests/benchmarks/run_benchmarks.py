"""Run benchmarks and keep what they print in docs/benchmarks.json, one entry per processor; write docs/benchmarks.md.

python tests/benchmarks/run_benchmarks.py [SCRIPT ...]; by default every bench_*.py. What was there of other scripts and
of other processors stays; so does what was there of a script that fails. The others go on; the end has status 1 then.
"""

from __future__ import annotations

import json
import os
import resource
import runpy
import subprocess
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from _timing import processor

HERE = Path(__file__).parent
TABLE = runpy.run_path(str(HERE.parents[1] / "docs" / "table_of_benchmarks.py"))


def run(script: Path) -> dict[str, object] | None:
    """Run one script; what it printed, its processor time with all its children [s], versions and the day.

    None if it failed.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, str(script)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, encoding="utf-8") as process:
        lines = []
        for line in process.stdout or ():
            print(line, end="", flush=True)
            lines.append(line.rstrip())
    if process.returncode:
        return None
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"processor_seconds": round(spent, 1), "day": datetime.now(UTC).date().isoformat(),
            "script": TABLE["digest"](script),
            "versions": {name: version(name) for name in ("robthermal", "numpy", "scipy")},
            "load_of_the_machine": round(os.getloadavg()[0], 1), "printed": [line for line in lines if line]}


def main(names: list[str]) -> None:
    """Run them one after the other, and write after each."""
    scripts = [HERE / name for name in names] or sorted(HERE.glob("bench_*.py"))
    kept, page, failed = TABLE["KEPT"], TABLE["PAGE"], []
    for script in scripts:
        found = run(script)
        if found is None:
            failed.append(script.name)
            continue
        results = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
        results.setdefault(processor(), {})[script.name] = found
        kept.write_text(json.dumps(results, indent=1, sort_keys=True, ensure_ascii=False) + "\n", encoding="utf-8")
        page.write_text(TABLE["now"](), encoding="utf-8")
    if failed:
        raise SystemExit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main(sys.argv[1:])
