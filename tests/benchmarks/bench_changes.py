"""What changed between two days: how often a healthy day is called changed, and how often a change is named.

Run: python tests/benchmarks/bench_changes.py [--cases 100] [--first 1] [--kinds fan ...] [--jobs 1]. Truth from scipy
alone (tests/two_days.py): every parameter of every day is off by 3 %, one of them is in no fit table. Wilson intervals
of 95 %.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is loaded: one core a case
sys.path.insert(0, str(Path(__file__).parents[1]))

from time import process_time  # noqa: E402

import numpy as np  # noqa: E402
from _timing import header  # noqa: E402
from joblib import Parallel, delayed  # noqa: E402
from two_days import HEALTHY, SYSTEM, Day, record  # noqa: E402

import robthermal as rt  # noqa: E402
from robthermal.thermal import parse_system  # noqa: E402

FAN, CONTACT = "links.sink-room.conductance", "links.block-plate.conductance"
KINDS: dict[str, tuple[Day, set[str]]] = {
    "healthy": (HEALTHY, set()),
    "healthy, room not recorded": (Day(room=4.0), set()),
    "healthy, a path missing": (Day(loss=0.15), set()),
    "fan, a path missing": (Day({"fan": 0.5}, loss=0.15), {FAN}),
    "contact, a path missing": (Day({"contact": 0.6}, loss=0.15), {CONTACT}),
    "fan": (Day({"fan": 0.5}), {FAN}),
    "fan, room not recorded": (Day({"fan": 0.5}, room=4.0), {FAN}),
    "contact": (Day({"contact": 0.6}), {CONTACT}),
    "fouling": (Day({"fan": 0.8}), {FAN}),
    "offset": (Day(offset=2.0), {"T_block"}),
    "room": (Day(room=4.0), {"sink"}),
    "heater 10 % weak": (Day({"power": 0.9}), {"heater"}),
    "heater 15 % weak": (Day({"power": 0.85}), {"heater"}),
    "heater 20 % weak": (Day({"power": 0.8}), {"heater"}),
    "outside: gusts": (Day(draught=4.0), set()),
    "outside: weak gusts": (Day(draught=1.0), set()),
    "outside: drift": (Day(drift=2.0), {"T_block"}),
}


def one(kind: str, seed: int, n_reference: int) -> tuple[str, str, float]:
    """Verdict, whether the true place is named, alone or among others, and the processor time [s]."""
    day, truth = KINDS[kind]
    room = "not recorded" not in kind
    before = Day(loss=day.loss)  # what is missing in the model is missing on healthy days too
    old = [record(1000 * seed + i, before, room=room) for i in range(n_reference)]
    start = process_time()
    found = rt.diagnose(parse_system(SYSTEM), record(1000 * seed + 999, day, room=room), reference=old)
    time = process_time() - start
    named = [{(one.effect, one.where), *others} for one, others in zip(found.effects, found.alternatives, strict=True)]
    places = [place for names in named for _, where in names for place in where]
    right = "no name" if not named else "right" if truth & set(places) else "wrong"
    return found.verdict, right, time


def wilson(count: int, n: int) -> tuple[float, float]:
    """Interval of 95 % of a rate."""
    z, p = 1.96, count / n
    middle, half = p + z * z / (2 * n), z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)


def main() -> None:
    """Run the cases asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--kinds", nargs="*", default=list(KINDS))
    parser.add_argument("--references", type=int, default=4)
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args()
    header(f"what changed: {chosen.cases} cases each, {chosen.references} reference records, scatter 3 %")
    for kind in chosen.kinds:
        seeds = range(chosen.first, chosen.first + chosen.cases)
        rows = Parallel(n_jobs=chosen.jobs)(delayed(one)(kind, seed, chosen.references) for seed in seeds)
        verdicts = Counter(f"{verdict} ({right})" for verdict, right, _ in rows)
        changed = sum(verdict != "consistent" for verdict, _, _ in rows)
        low, high = wilson(changed, len(rows))
        print(f"{kind}: changed {changed}/{len(rows)} [{low:.3f}, {high:.3f}], "
              f"{np.mean([time for _, _, time in rows]):.1f} s each; " +
              ", ".join(f"{name} {n}" for name, n in verdicts.most_common()))


if __name__ == "__main__":
    main()
