"""What is said of a machine whose room is not in the record: standing still, swinging, drifting, wandering, opened.

Run: python tests/benchmarks/bench_unrecorded_room.py [--first 0] [--seeds 5]. A block on a plate, whole catalog.
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections import Counter
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is loaded
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from time import process_time  # noqa: E402

import numpy as np  # noqa: E402
from _timing import header  # noqa: E402
from unrecorded_room import ROOM, TIME, model, names, records  # noqa: E402

import robthermal as rt  # noqa: E402


def truths(rng: np.random.Generator) -> dict[str, dict[str, np.ndarray]]:
    """Rooms, and a heat that comes and goes."""
    sine = np.sin(2 * np.pi * TIME / np.exp(rng.uniform(*np.log([150.0, 4000.0]))) + rng.uniform(0, 6))
    walk = np.cumsum(rng.standard_normal(TIME.size)) * 2.0 / np.sqrt(TIME.size)
    opened = np.where(TIME > rng.uniform(0.2, 0.8) * TIME[TIME.size // 2], -2.0, 0.0)
    return {"still": {}, "swings": {"room": ROOM + sine}, "drifts": {"room": ROOM + 2.0 * TIME / TIME[-1]},
            "wanders": {"room": ROOM + walk}, "2 K colder from one moment on": {"room": ROOM + opened},
            "still, with a periodic heat": {"heat": sine}}


def main() -> None:
    """Print how often every answer was given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=5)
    chosen = parser.parse_args()
    header(f"rooms that are not recorded, seeds {chosen.first} to {chosen.first + chosen.seeds - 1}")
    warnings.simplefilter("ignore")
    counts: dict[tuple[str, str], Counter[str]] = {}
    seconds = []
    for seed in range(chosen.first, chosen.first + chosen.seeds):
        for both, where in ((False, "plate"), (True, "plate and block")):
            for truth, values in truths(np.random.default_rng(seed)).items():
                train, unseen = records(both=both, seed=seed, **values)
                start = process_time()
                found = rt.diagnose(model(both=both), train, validation=unseen)
                seconds.append(process_time() - start)
                sets = [" | ".join(sorted(f"{name}({', '.join(at)})" for name, at in one)) for one in names(found)]
                counts.setdefault((where, truth), Counter())["; ".join([found.verdict, *sets])] += 1
    for (where, truth), counted in counts.items():
        print(f"room joined to {where}; {truth}:")
        for answer, n in counted.most_common():
            print(f"  {n} of {chosen.seeds}  {answer}")
    print(f"CPU seconds: median {np.median(seconds):.1f}, worst {max(seconds):.1f}")


if __name__ == "__main__":
    main()
