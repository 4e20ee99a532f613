"""Both checkers on ten thousand certificates and mutants: what each says, that they never disagree, how long it takes.

Run: python tests/benchmarks/two_checkers.py [count] [seed]
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
from _timing import header

_ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(_ROOT / "tests" / "verification"), str(_ROOT / "tests" / "second"), str(_ROOT / "recheck")]
import mutant_ellipsoid  # noqa: E402 - beside the tests, not on the path before
import mutant_feedback  # noqa: E402 - the same
import mutant_linear  # noqa: E402 - the same
import mutant_scheduled  # noqa: E402 - beside the tests, not on the path before
import mutant_thermal  # noqa: E402
from agreement import both, cases  # noqa: E402

COVERED = ("contraction", "invariance", "runaway", "network", "stability", "gain", "observer", "polytope", "ellipsoid",
           "scheduled", "network_peak")
SUBJECTS = [subject for subject in (*mutant_thermal.SUBJECTS, *mutant_linear.SUBJECTS, *mutant_feedback.SUBJECTS,
            *mutant_ellipsoid.SUBJECTS, *mutant_scheduled.SUBJECTS)
            if subject.kind in COVERED]


def main(count: int, seed: int) -> int:
    """Print one line per kind; the exit status says whether the checkers disagree."""
    header(f"{count} certificates and mutants, two checkers, seed {seed}")
    warnings.simplefilter("ignore")  # mutants overflow floats while certificates are made
    print(f"{'kind':>12} {'judged':>7} {'valid':>6} {'not valid':>10} {'not covered':>12} {'of these valid':>15} "
          f"{'disagree':>9} {'first':>8} {'second':>8} {'slowest':>8}")
    wrong = 0
    for subject in SUBJECTS:
        table: Counter[str] = Counter()
        seconds = np.zeros(2)
        slowest = 0.0
        for document in cases(subject, np.random.default_rng(seed), round(count / len(SUBJECTS))):
            pair = both(subject.kind, document)
            table[pair.second] += 1
            table["missed"] += pair.first and pair.second == "not covered"
            table["disagree"] += pair.disagree
            seconds += pair.seconds
            slowest = max(slowest, pair.seconds[1])
            if pair.disagree:
                print(f"DISAGREEMENT {subject.kind}: {pair.first}, {pair.second}: {pair.reasons}")
        wrong += table["disagree"]
        judged = table["valid"] + table["not valid"] + table["not covered"]
        counts = f"{judged:>7} {table['valid']:>6} {table['not valid']:>10} {table['not covered']:>12}"
        print(f"{subject.kind:>12} {counts} {table['missed']:>15} {table['disagree']:>9} {seconds[0]:>6.0f} s "
              f"{seconds[1]:>6.0f} s {slowest:>6.2f} s", flush=True)
    print(f"{wrong} disagreements")
    return 1 if wrong else 0


if __name__ == "__main__":
    numbers = [int(value) for value in sys.argv[1:3]]
    sys.exit(main(*(numbers + [10_000, 0][len(numbers):])))
