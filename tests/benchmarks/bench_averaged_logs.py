"""What is said of logs whose values are means over a step, undeclared and declared, and of logs of samples.

Run: python tests/benchmarks/bench_averaged_logs.py [--first 10] [--seeds 1]. Three machines, seven effects, whole
catalog; steps of 10, 30 and 60 s.
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from itertools import product
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is loaded
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from time import process_time  # noqa: E402

from _timing import header  # noqa: E402
from averaged_logs import EFFECTS, KINDS, LOGS, log, true_name  # noqa: E402

import robthermal as rt  # noqa: E402

STEPS = (10, 30, 60)


def cases(first: int, seeds: int) -> Iterator[tuple[str, str, int, int, str]]:
    """Every machine with every effect in every kind of log, at one step each."""
    for seed in range(first, first + seeds):
        for (i, kind), (j, effect), (k, how) in product(enumerate(KINDS), enumerate(EFFECTS), enumerate(LOGS)):
            yield kind, effect, seed, STEPS[(i + j + k + seed) % 3], how


def answer(found: rt.diagnosis.Diagnosis, kind: str, effect: str) -> str:
    """Verdict, whether its names are right, and whether means are mentioned."""
    said = found.verdict
    if found.effects:
        name, where = true_name(kind, effect)
        right = [any(key == name and set(place) == where for key, place in ((one.effect, one.where), *others))
                 for one, others in zip(found.effects, found.alternatives, strict=True)]
        said += " right" if all(right) else " in part" if any(right) else " wrong"
    return said + (", means" if found.means else "")


def main() -> None:
    """Print how often every answer was given, by log and declaration."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=10)
    parser.add_argument("--seeds", type=int, default=1)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    header("Logs that average")
    said: dict[str, Counter[str]] = {}
    spent: Counter[str] = Counter()
    for kind, effect, seed, h, how in cases(asked.first, asked.seeds):
        system, record = log(kind, effect, seed, h, how)
        means = {} if how == "sampled" else {
            f"{how}, declared": rt.signals.as_means(record, "readings" if how == "readings" else "after")}
        for label, one in ({how: record} | means).items():
            begin = process_time()
            found = rt.diagnose(system, one)
            spent[label] += process_time() - begin
            result = answer(found, kind, effect)
            said.setdefault(label, Counter())[("healthy: " if effect == "none" else "hidden: ") + result] += 1
            print(f"{kind:7}{effect:19}{seed:4}{h:4} s  {label:20} {result}", flush=True)
    for label, counts in said.items():
        print(f"\n{label}, {sum(counts.values())} logs, {spent[label]:.0f} s of processor time")
        for result, n in sorted(counts.items()):
            print(f"  {n:3} {result}")


if __name__ == "__main__":
    main()
