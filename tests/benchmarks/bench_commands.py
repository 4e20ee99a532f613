"""Processor time of the commands, and the part of it that goes into imports: what a user waits for at the prompt.

Run as a script; `--all` adds `map` with 90 conditions. The folder of compiled modules is its own, filled first, as
an installation fills it. The part of the imports is of the wall time of the same run.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from _timing import header

import robthermal as rt

MACHINE = str(Path(rt.__file__).parent / "systems" / "two_module.toml")
BENCH = ["bench/setup.toml", "bench/train.csv"]
COLD = ["--setpoint", "m1=15", "--setpoint", "m2=15"]
COMMANDS = (
    ["--help"],
    ["explain", "contraction"],
    ["new", "bench"],
    ["check", *BENCH],
    ["simulate", *BENCH, "--out", "simulated.csv"],
    ["frf", BENCH[1], "--system", BENCH[0], "--method", "lrmp", "--out", "frf.json"],
    ["excitation", "m1", "m2", "--period", "7200", "--sample-time", "1", "--band", "0.0005", "0.1", "--amplitude",
     "0.5"],
    ["calibrate", *BENCH, "--validation", "bench/validation.csv", "--out", "calibrated.toml"],
    ["diagnose", *BENCH, "--validation", "bench/validation.csv", "--out", "diagnosed"],
    ["certify", MACHINE, "--current", "m1=0:1", "--current", "m2=0:1", *COLD, "--out", "certified"],
    ["verify", "certified"],
    ["report", "certified"],
    ["design", MACHINE, *COLD, "--bandwidth", "0.02", "--out", "design"],
)
MAP = ["map", MACHINE, "--ambient", "15,35,5", "--load", "0,5,6", "--setpoint", "5,15,3", "--out", "map"]
WARM = "import robthermal.jobs.chain, robthermal.jobs.explanations, matplotlib.pyplot, pandas, scipy.stats, control"


def environment(folder: Path) -> dict[str, str]:
    """Of the commands: one thread, and compiled modules kept in the folder."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    kept["PYTHONPATH"] = os.pathsep.join([str(Path(rt.__file__).parents[1]), *filter(None, sys.path)])
    return {**kept, "PYTHONPYCACHEPREFIX": str(folder / "compiled"), "OMP_NUM_THREADS": "1"}


def measured(command: list[str], folder: Path, env: dict[str, str]) -> tuple[float, float, float]:
    """Wall and processor time [s] of one command, and the part of the wall time in imports."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    run = subprocess.run([sys.executable, "-X", "importtime", "-m", "robthermal", *command], cwd=folder, env=env,
                         capture_output=True, text=True, check=False)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if run.returncode not in (0, 1):
        raise SystemExit(f"{' '.join(command)} ended with status {run.returncode}:\n{run.stderr[-500:]}")
    imports = sum(int(one) for one in re.findall(r"^import time:\s+(\d+) \|", run.stderr, re.M)) / 1e6
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, imports / wall


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--all", action="store_true")
    header(f"Commands, one process; load of the machine {os.getloadavg()[0]:.1f}")
    print(f"{'command':<12} {'wall [s]':>9} {'processor [s]':>14} {'imports':>8}")
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        subprocess.run([sys.executable, "-c", WARM], cwd=place, env=environment(place), check=True)
        for command in (*COMMANDS, *([MAP] if arguments.parse_args().all else [])):
            wall, spent, imports = measured(command, place, environment(place))
            print(f"{command[0]:<12} {wall:9.1f} {spent:14.2f} {imports:8.0%}", flush=True)
