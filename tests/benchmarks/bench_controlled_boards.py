"""Boards with two heaters under two-point control that lack a path and lags, and logs with commands a row off.

Run: python tests/benchmarks/bench_controlled_boards.py [--first 0] [--boards 20]. Gains, losses, path, lags and room
are drawn for every board; one of the three effects may not be there. Of five logs three are right, in one commands are
logged a row late, in one a row early. Whole catalog, another day held out, room not recorded.
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
from controlled_board import ROOM, Board, day, model  # noqa: E402

import robthermal as rt  # noqa: E402

ROWS = (0, 0, 0, 1, -1)  # that commands are logged late


def drawn(seed: int) -> tuple[Board, int]:
    """A board, and by how many rows its commands are logged late."""
    rng = np.random.default_rng([seed, 22])
    gain, loss = np.array([0.010, 0.0064]) * rng.uniform(0.7, 1.4, 2), rng.uniform(0.007, 0.016, 2)
    path = rng.uniform(0.002, 0.009) * (rng.random() < 0.8)
    lags = np.where(rng.random(2) < 0.75, rng.uniform(10.0, 40.0, 2), 0.0)
    return Board(tuple(gain), tuple(loss), float(path), tuple(lags), ROOM + 1.5 * rng.normal()), int(rng.choice(ROWS))


def missing(board: Board) -> list[set[tuple[str, tuple[str, ...]]]]:
    """What the model lacks; a lag of a sensor and one of its heater are one."""
    path = [{("missing_link", ("heater_1", "heater_2"))}] if board.path else []
    return path + [{("sensor_lag", (f"T{i}",)), ("input_lag", (f"q{i}",))} for i, lag in enumerate(board.lags, start=1)
                   if lag]


def answer(found: rt.diagnosis.Diagnosis, board: Board, rows: int) -> str:
    """Whether all that is missing is listed and nothing else; late heaters are right beside commands logged early."""
    listed = [{one.key, *others} for one, others in zip(found.effects, found.alternatives, strict=True)]
    true = missing(board)
    late = {("input_delay", ("q1",)), ("input_delay", ("q2",))} if rows < 0 else set()
    false = [one for one in listed if not any(one & each for each in [*true, late])]
    if any(len(one) == 1 for one in false):
        return "a wrong unique name"
    if not listed:
        return "nothing listed" if true else "nothing missing, nothing listed"
    return "all that is missing, nothing else" if not false and all(any(one & each for one in listed) for each in true
                                                                   ) else "in part"


def main() -> None:
    """Print the answer for every board, and how often each was given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--boards", type=int, default=20)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    header("Boards under control")
    said: dict[str, Counter[str]] = {"rows right": Counter(), "a row off": Counter()}
    spent = []
    for seed in range(asked.first, asked.first + asked.boards):
        board, rows = drawn(seed)
        train, unseen = (rt.signals.shift_inputs(day(2 * seed + i, board=board), rows) for i in (0, 1))
        begin = process_time()
        found = rt.diagnose(model(), train, validation=unseen)
        spent.append(process_time() - begin)
        result = answer(found, board, rows)
        log = f"input_shift = {-rows}" if rows else "input_shift"
        right = (log in found.outcome.text) is bool(rows)
        counts = said["a row off" if rows else "rows right"]
        counts[result] += 1
        counts["the log taken for what it is"] += right
        gap = found.gap["validation"]
        print(f"{seed:4} {rows:3} {len(missing(board))} missing  {found.verdict:22} {result:34} "
              f"{'' if right else 'log not ' if rows else 'log wrongly '}{'' if right else 'doubted'} "
              f"{gap.before:.2f} to {gap.after:.2f} K  {spent[-1]:.0f} s", flush=True)
    for log, counts in said.items():
        n = sum(counts.values()) - counts["the log taken for what it is"]
        print(f"\n{log}, {n} boards")
        for result, times in sorted(counts.items()):
            print(f"  {times:3} {result}")
    print(f"\nprocessor time: median {np.median(spent):.0f} s, worst {max(spent):.0f} s")


if __name__ == "__main__":
    main()
