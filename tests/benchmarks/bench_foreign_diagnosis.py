"""Blind suite with foreign truth: machines of 150 cells and more against a user's network of 4 to 8 lumps.

Run: python tests/benchmarks/bench_foreign_diagnosis.py [--seeds 1 3] [--only TEXT] [--jobs 1] [--peers] [--out FILE].
Even seeds served for development, odd ones judge; --peers lets two other methods choose on the same data. Results are
appended to FILE; started again, finished data sets are skipped.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is loaded: one core a data set

from _timing import header  # noqa: E402
from foreign.cases import all_cases  # noqa: E402
from foreign.judge import judged, print_tables  # noqa: E402
from joblib import Parallel, delayed  # noqa: E402


def main() -> None:
    """Run what is asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="*", default=[1])
    parser.add_argument("--only", default="", help="part of the keys to run, such as bar/hidden")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--peers", action="store_true")
    parser.add_argument("--out", type=Path, default=Path(tempfile.gettempdir()) / "foreign_diagnosis.jsonl")
    chosen = parser.parse_args()
    header(f"diagnosis with foreign truth, seeds {chosen.seeds}, results in {chosen.out}")
    keys = {case.key: case for case in all_cases(chosen.seeds) if chosen.only in case.key}
    lines = chosen.out.read_text(encoding="utf-8").splitlines() if chosen.out.exists() else []
    rows = {row["key"]: row for row in map(json.loads, lines) if row["key"] in keys}
    left = [case for key, case in keys.items() if key not in rows]
    with chosen.out.open("a", encoding="utf-8") as file:
        for row in Parallel(n_jobs=chosen.jobs, return_as="generator_unordered")(delayed(judged)(one, chosen.peers)
                                                                                  for one in left):
            rows[row["key"]] = row
            file.write(json.dumps(row, default=float) + "\n")
            file.flush()
    print_tables([rows[key] for key in sorted(rows)])


if __name__ == "__main__":
    main()
