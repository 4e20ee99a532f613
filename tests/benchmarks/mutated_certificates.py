"""Ten thousand mutated certificates of all kinds: how many are rejected, and that none is accepted which is false.

Run: python tests/benchmarks/mutated_certificates.py [count] [seed]
"""

from __future__ import annotations

import sys
import time
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
from _timing import header

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "verification"))
import mutant_ellipsoid  # noqa: E402 - beside the tests, not on the path before
import mutant_feedback  # noqa: E402 - the same
import mutant_linear  # noqa: E402 - the same
import mutant_scheduled  # noqa: E402 - beside the tests, not on the path before
import mutant_thermal  # noqa: E402
from mutants import ALARMS, run  # noqa: E402

SUBJECTS = (*mutant_thermal.SUBJECTS, *mutant_linear.SUBJECTS, *mutant_feedback.SUBJECTS,
            *mutant_ellipsoid.SUBJECTS, *mutant_scheduled.SUBJECTS)


def main(count: int, seed: int) -> int:
    """Run and print the tables; the exit status says whether a false certificate was accepted."""
    header(f"{count} mutated certificates, seed {seed}")
    warnings.simplefilter("ignore")  # mutants overflow the floats of the falsifiers
    everything: Counter[str] = Counter()
    shares = sum(subject.share for subject in SUBJECTS)
    for subject in SUBJECTS:
        start = time.perf_counter()
        table = run(subject, np.random.default_rng(seed), round(count * subject.share / shares))
        everything += table
        rejected = sum(number for what, number in table.items() if not what.lower().startswith("accepted"))
        wrong = sum(table[alarm] for alarm in ALARMS)
        print(f"{subject.kind:>12}: {sum(table.values()):5} judged, {rejected:5} rejected, {wrong} wrongly accepted, "
              f"{time.perf_counter() - start:.0f} s", flush=True)
    for what, number in sorted(everything.items()):
        print(f"{number:>7}  {what}")
    wrong = sum(everything[alarm] for alarm in ALARMS)
    print(f"{wrong:>7}  wrongly accepted")
    return 1 if wrong else 0


if __name__ == "__main__":
    numbers = [int(value) for value in sys.argv[1:3]]
    sys.exit(main(*(numbers + [10_000, 0][len(numbers):])))
