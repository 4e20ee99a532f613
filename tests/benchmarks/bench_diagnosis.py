"""Blind suite of the diagnosis: effects hidden by another integrator, and how often the workflow names them.

Run: python tests/benchmarks/bench_diagnosis.py [--seeds 20] [--first 0] [--topologies ABC] [--effects NAME ...]
[--jobs 2] [--candidates N] [--out FILE]. Results are appended to FILE as they come; started again, finished data sets
are skipped.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is loaded, here and in the workers: one core a data set

from _timing import header  # noqa: E402
from blind.cases import all_cases  # noqa: E402
from blind.rates import print_matrix, print_rates  # noqa: E402
from blind.run import run  # noqa: E402


def main() -> None:
    """Run what is asked for and print the rates and the matrix."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="of every hidden effect; other groups in proportion")
    parser.add_argument("--first", type=int, default=0, help="number of the first seed: 80 is fresh to the authors")
    parser.add_argument("--topologies", default="ABC")
    parser.add_argument("--effects", nargs="*", help="also nothing, two, and names of noises and of outside effects")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--peers", type=int, default=2, help="compare with peers on every nth seed")
    parser.add_argument("--candidates", type=int, help="try at most so many: for the time only")
    parser.add_argument("--out", type=Path, default=Path(tempfile.gettempdir()) / "blind_diagnosis.jsonl")
    chosen = parser.parse_args()
    cases = all_cases(chosen.seeds, list(chosen.topologies), chosen.effects, chosen.first)
    header(f"blind suite of the diagnosis, {chosen.seeds} seeds from {chosen.first} on, results in {chosen.out}")
    rows = run(cases, chosen.out, chosen.jobs, chosen.peers, chosen.candidates)
    rows.sort(key=lambda row: row["key"])
    print_rates(rows)
    print_matrix(rows)


if __name__ == "__main__":
    main()
