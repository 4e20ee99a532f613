"""What changed between two days, where the truth is finer than the network.

Run: python tests/benchmarks/bench_foreign_changes.py [--seeds 1 2 3] [--machines bar ...] [--kinds ambient ...]
[--augment] [--jobs 2]. Fields of 150 cells and more, integrated by the code beside this file; every number of every
day is off by 3 %; three healthy days, one new. Wilson intervals of 95 %.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
import warnings
from pathlib import Path
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is loaded: one core a case

from _timing import header  # noqa: E402
from foreign.days import CHANGES, HEALTHY, OUTSIDE, Change, days  # noqa: E402
from foreign.judge import NAMED, rate  # noqa: E402
from joblib import Parallel, delayed  # noqa: E402

import robthermal as rt  # noqa: E402


def compared(change: Change, augment: bool) -> dict[str, Any]:
    """Verdict, what is named, and whether the truth is among it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        one = days(change)
        start = time.process_time()
        found = rt.diagnose(one.system, one.new, reference=one.healthy, augment=augment)
        seconds = time.process_time() - start
    sets = [[(effect.effect, effect.where), *others]
            for effect, others in zip(found.effects, found.alternatives, strict=True)]
    holds = [any(tuple(where) in one.truth for _, where in names) for names in sets]
    return {"key": change.key, "kind": change.kind, "verdict": found.verdict, "truth": one.truth, "size": one.size,
            "names": [[f"{name}({', '.join(where)})" for name, where in names] for names in sets],
            "right": bool(sets) and all(holds), "alone": bool(sets) and all(len(names) == 1 for names in sets),
            "gap": found.to_dict()["gap"]["train"], "text": found.outcome.text, "seconds": seconds, "path": one.path,
            "added": found.to_dict()["reference"].get("augmented")}


def added(row: dict[str, Any]) -> str:
    """Whether the path that no network has was added to the model of the comparison."""
    names = [(one["effect"], set(one["where"])) for one in row["added"]["effects"]]
    if not names:
        return "nothing added"
    return "the path alone" if names == [("missing_link", set(row["path"]))] else "something else"


ANSWERS = ("healthy", "refused", "unique", "in the set", "set without", "WRONG")


def answer(row: dict[str, Any]) -> str:
    """One of `ANSWERS`."""
    if row["verdict"] not in NAMED:
        return "healthy" if row["verdict"] == "consistent" else "refused"
    if not row["right"]:
        return "WRONG" if row["alone"] else "set without"
    return "unique" if row["alone"] else "in the set"


def main() -> None:
    """Run the cases asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs="*", type=int, default=[1, 2, 3])
    parser.add_argument("--machines", nargs="*", default=["bar", "plate", "stack", "housing"])
    parser.add_argument("--kinds", nargs="*", default=[*HEALTHY, *CHANGES, *OUTSIDE])
    parser.add_argument("--augment", action="store_true", help="with what the healthy days name by themselves")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, help="rows as JSON")
    chosen = parser.parse_args()
    header("what changed, finer truth: three healthy days of 900 samples, scatter 3 %")
    rows = list(Parallel(n_jobs=chosen.jobs)(delayed(compared)(Change(machine, kind, seed), chosen.augment)
                for kind in chosen.kinds for seed in chosen.seeds for machine in chosen.machines))
    if chosen.out:
        chosen.out.write_text(json.dumps(rows, indent=1))
    for kind in chosen.kinds:
        answers = [answer(row) for row in rows if row["kind"] == kind]
        print(f"{kind}: " + "; ".join(f"{said} {answers.count(said)}" for said in ANSWERS) + f" of {len(answers)}")
    for title, kinds, said in (("changes named alone", CHANGES, ("unique",)),
                               ("  alone or among others", CHANGES, ("unique", "in the set")),
                               ("  without the truth", CHANGES, ("WRONG", "set without")),
                               ("healthy days called changed", HEALTHY, ANSWERS[1:]),
                               ("outside: a name", OUTSIDE, ("WRONG", "set without"))):
        print(f"{title:<28} {rate([row for row in rows if row['kind'] in kinds], lambda r: answer(r) in said)}")  # noqa: B023
    paths = [added(row) for row in rows if row["path"] and row["added"]]
    if paths:
        print(f"{'hidden path, added before':<28} " + "; ".join(
            f"{said} {paths.count(said)}" for said in ("the path alone", "nothing added", "something else")))
    for row in rows:
        if answer(row) != ("healthy" if row["kind"] in HEALTHY else "refused" if row["kind"] in OUTSIDE else "unique"):
            names = "; ".join(" or ".join(names) for names in row["names"]) or row["text"][:250]
            print(f"  {row['key']} {row['truth'][:1]} {row['size']:.2f}: {answer(row)}, {row['gap']['before']:.3g} to "
                  f"{row['gap']['after']:.3g} K: {names}")
    seconds = sorted(row["seconds"] for row in rows)
    print(f"CPU seconds: median {seconds[len(seconds) // 2]:.1f}, worst {seconds[-1]:.1f}")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
