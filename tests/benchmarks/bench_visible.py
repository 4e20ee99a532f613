"""How large a change of a day would have been seen: is what `diagnose --reference` states seen nine times in ten?

Run: python tests/benchmarks/bench_visible.py [--machines rig column] [--cases 2] [--first 1]. A healthy day is
compared with three others; then the same day again, each parameter changed by what was stated to be visible, and by a
third of it. "rig": tests/two_days.py, a network of the file's kind. "column": a column of 60 cells, integrated by
scipy alone, which the file has as three lumps, with a strong heater and one of 3 W: a large remainder. Intervals of
Wilson, 95 %.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections import defaultdict
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is loaded: one core a case
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np  # noqa: E402
from _timing import header  # noqa: E402
from bench_changes import wilson  # noqa: E402
from scipy.linalg import expm  # noqa: E402
from two_days import SYSTEM, Day, record  # noqa: E402

import robthermal as rt  # noqa: E402
from robthermal.thermal import parse_system  # noqa: E402

PARTS, CELLS, STEP, LENGTH, NOISE, ZERO = (1.0, 1 / 3), 60, 20.0, 400, 0.03, 273.15
FEW = ["sensor_offset", "missing_ambient_link", "input_gain", "heat_source"]
THIRDS = ("base", "middle", "head")
LINKS = (("base", "middle", 1.5), ("middle", "head", 1.5), *((part, "hall", 1.0) for part in THIRDS))
COLUMN = "\n".join([
    '[system]\nname = "column"\ntemperature_unit = "degC"\n[ambients.hall]\ntemperature = 20.0',
    *(f"[lumps.{part}]\ncapacity = 2000.0" for part in THIRDS),
    *(f'[[links]]\nbetween = ["{a}", "{b}"]\nconductance = {g}' for a, b, g in LINKS),
    '[inputs.bearing]\nlump = "base"\n[inputs.motor]\nlump = "head"',
    *(f'[sensors.T_{part}]\nlump = "{part}"\nnoise = {NOISE}' for part in THIRDS), "[fit]",
    *(f'"lumps.{part}.capacity" = {{ lower = 200.0, upper = 20000.0 }}' for part in THIRDS),
    *(f'"links.{a}-{b}.conductance" = {{ lower = 0.05, upper = 15.0 }}' for a, b, _ in LINKS)])
CHANGES = {
    "rig": {"lumps.block.capacity": "block", "lumps.sink.capacity": "sink", "links.block-plate.conductance": "contact",
            "links.plate-sink.conductance": "middle", "links.sink-room.conductance": "fan",
            "inputs.heater.gain": "power"},
    "column": {name: name for name in (*(f"lumps.{part}.capacity" for part in THIRDS),
                                       *(f"links.{a}-{b}.conductance" for a, b, _ in LINKS),
                                       "inputs.bearing.gain", "inputs.motor.gain")}}


def of_column(seed: int, change: dict[str, float]) -> rt.Record:
    """One day of the column: every number of it off by 3 %, times the factors of the change."""
    rng = np.random.default_rng(seed)
    names = list(CHANGES["column"])
    off = dict(zip(names, [*np.exp(0.03 * rng.standard_normal(8)), 1.0, 1.0], strict=True))
    off = {name: value * change.get(name, 1.0) for name, value in off.items()}
    part, edge, i = np.arange(CELLS) // 20, np.arange(CELLS - 1) < CELLS // 2, np.arange(CELLS - 1)
    capacity = 100.0 * np.array([off[name] for name in names[:3]])[part]
    along = 30.0 * np.where(edge, off[names[3]], off[names[4]])
    film = 0.05 * np.array([off[name] for name in names[5:8]])[part]
    flows = np.diag(-film)
    np.add.at(flows, (np.r_[i, i + 1, i, i + 1], np.r_[i, i + 1, i + 1, i]), np.r_[-along, -along, along, along])
    drive = np.zeros((CELLS, 3))
    drive[2:5, 0], drive[53:56, 1], drive[:, 2] = off[names[8]] / 3, off[names[9]] / 3, film
    rate = np.zeros((CELLS + 3, CELLS + 3))
    rate[:CELLS] = np.column_stack([flows, drive]) / capacity[:, None]
    step = expm(rate * STEP)[:CELLS]  # exact for held inputs
    hall = np.full(LENGTH, 20.0 + 2.0 * rng.standard_normal())
    u = np.column_stack([np.repeat(rng.choice(levels, 10), LENGTH // 10) for levels in ([0.0, 20.0, 40.0, 60.0],
                                                                                       [0.0, 1.0, 2.0, 3.0])] + [hall])
    T, rows = hall[0] + np.full(CELLS, rng.uniform(0.0, 1.0)), []
    for k in range(LENGTH):
        rows.append(T[[10, 30, 50]])
        T = step @ np.r_[T, u[k]]
    readings = np.array(rows) + NOISE * rng.standard_normal((LENGTH, 3))
    u[:, 2] += ZERO
    return rt.Record(sample_time=STEP, inputs=u, outputs=readings + ZERO, input_names=["bearing", "motor", "hall"],
                     output_names=[f"T_{part}" for part in THIRDS])


def of_rig(seed: int, change: dict[str, float]) -> rt.Record:
    """One day of the machine of two_days.py."""
    return record(seed, Day({CHANGES["rig"][name]: factor for name, factor in change.items()}), length=300)


def run(machine: str, cases: int, first: int) -> None:
    """Print the sizes stated and how often each was seen."""
    day, system = {"rig": (of_rig, SYSTEM), "column": (of_column, COLUMN)}[machine]
    plant = parse_system(system)
    stated = defaultdict[tuple[str, str], list[float]](list)
    seen = defaultdict[tuple[str, str, float], list[bool]](list)
    healthy = 0
    for seed in range(first, first + cases):
        old = [day(1000 * seed + i, {}) for i in range(1, 4)]
        found = rt.diagnose(plant, day(1000 * seed + 999, {}), reference=old, effects=FEW)
        healthy += found.verdict == "consistent"
        for name, sizes in (found.reference.visible if found.reference else {}).items():
            for way, size in sizes.items():
                stated[name, way].append(size)
                for part in PARTS if math.isfinite(size) else ():
                    factor = 1.0 + part * size * (-1.0 if way == "lower" else 1.0)
                    again = rt.diagnose(plant, day(1000 * seed + 999, {name: factor}), reference=old, effects=FEW)
                    seen[name, way, part].append(again.verdict != "consistent")
    print(f"{machine}: {healthy} of {cases} healthy days consistent")
    for (name, way), sizes in stated.items():
        counts = (f"{sum(seen[name, way, part])}/{len(seen[name, way, part])}" for part in PARTS)
        print(f"  {name} {way} by {np.median(sizes):.2f} ({min(sizes):.2f} to {max(sizes):.2f}): seen {next(counts)}, "
              f"at a third {next(counts)}")
    for part in PARTS:
        every = [one for (_, _, size), some in seen.items() if size == part for one in some]
        low, high = wilson(sum(every), len(every))
        print(f"  all at {part:.2f}: seen {sum(every)}/{len(every)} [{low:.3f}, {high:.3f}]")


def main() -> None:
    """Run the machines asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", nargs="*", default=["rig", "column"])
    parser.add_argument("--cases", type=int, default=2)
    parser.add_argument("--first", type=int, default=1, help="first seed")
    chosen = parser.parse_args()
    header(f"changes that are stated to be visible: {chosen.cases} cases each, three reference records")
    for machine in chosen.machines:
        run(machine, chosen.cases, chosen.first)


if __name__ == "__main__":
    main()
