"""Processor time of the commands: start, whole, and its shares of imports, of figures and files, and of mathematics.

Run as a script; `--all` adds `map` with 90 conditions. The package is copied first, for a merge into its tree would
break a command halfway. The folder of compiled modules is its own, filled first, as an installation fills it. A start
is the answer to `--help`, to an input that is missing, and to one that is damaged: then the reader is loaded, and the
command's own work would begin. Shares are those of `_shares.py`, in a run of its own beside the timed one.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from _shares import FILES, IMPORTS, MATHEMATICS
from _timing import header

import robthermal as rt

MACHINE = str(Path(rt.__file__).parent / "systems" / "two_module.toml")
BENCH = ["bench/setup.toml", "bench/train.csv"]
COLD = ["--setpoint", "m1=15", "--setpoint", "m2=15"]
COMMANDS = (
    ["--help"],
    ["explain", "contraction"],
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
MISSING = {  # what each command is given that does not exist, beside what does
    "run": ["lost.toml"], "check": ["lost.toml"], "simulate": ["lost.toml", BENCH[1], "--out", "simulated.csv"],
    "calibrate": ["lost.toml", BENCH[1]], "diagnose": ["lost.toml", BENCH[1]],
    "frf": [BENCH[1], "--system", "lost.toml"], "certify": ["lost.toml"], "design": ["lost.toml"],
    "map": ["lost.toml"], "couple": ["lost.toml"], "report": ["lost"], "verify": ["lost.json"],
    "datasheet": ["lost.csv"], "explain": ["lost"],
    "excitation": ["m1", "--period", "100", "--sample-time", "1", "--band", "0.01", "0.1", "--amplitude", "1",
                   "--system", "lost.toml"]}
REPEATS = 5  # of a start; the middle one is shown
WARM = ("import robthermal.jobs.chain, robthermal.jobs.explanations, robthermal.jobs.rebuild, matplotlib.pyplot, "
        "pandas, scipy.stats, control, joblib")


def environment(folder: Path) -> dict[str, str]:
    """Of the commands: one thread, and compiled modules kept in the folder."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    kept["PYTHONPATH"] = os.pathsep.join([str(folder / "copy"), *filter(None, sys.path)])
    return {**kept, "PYTHONPYCACHEPREFIX": str(folder / "compiled"), "OMP_NUM_THREADS": "1"}


def spent(command: list[str], folder: Path, allowed: tuple[int, ...]) -> float:
    """Processor time [s] of one command, its children included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run = subprocess.run([sys.executable, "-m", "robthermal", *command], cwd=folder, env=environment(folder),
                         capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if run.returncode not in allowed:
        raise SystemExit(f"{' '.join(command)} ended with status {run.returncode}:\n{run.stderr[-500:]}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def shares(command: list[str], folder: Path) -> dict[str, float]:
    """Parts of the processor time of one command, in the order of the columns."""
    subprocess.run([sys.executable, str(Path(__file__).with_name("_shares.py")), "shares.json", *command], cwd=folder,
                   env=environment(folder), capture_output=True, check=False)
    found = json.loads((folder / "shares.json").read_text(encoding="utf-8"))
    return {name: found[name] / sum(found.values()) for name in (IMPORTS, FILES, MATHEMATICS)}


def print_starts(folder: Path) -> None:
    """Every command's answer to --help, to a missing input and to a damaged one."""
    print(f"{'start of':<12} {'--help [s]':>11} {'missing input [s]':>18} {'damaged input [s]':>18}")
    for name, words in MISSING.items():
        damaged = [word.replace("lost", "damaged") for word in words]
        times = [median(spent([name, *line], folder, (status,)) for _ in range(REPEATS))
                 for line, status in ((["--help"], 0), (words, 2), (damaged, 2))]
        print(f"{name:<12} {times[0]:11.2f} {times[1]:18.2f} {times[2]:18.2f}", flush=True)


def print_commands(folder: Path, commands: list[list[str]]) -> None:
    """Every command with its shares, and the part of mathematics in what is not imports."""
    print(f"\n{'command':<12} {'processor [s]':>14} {IMPORTS:>8} {FILES:>18} {MATHEMATICS:>12} {'without imports':>16}")
    for command in commands:
        time = spent(command, folder, (0, 1))
        part = shares(command, folder)
        without = part[MATHEMATICS] / max(part[FILES] + part[MATHEMATICS], 1e-9)
        print(f"{command[0]:<12} {time:14.2f} {part[IMPORTS]:8.0%} {part[FILES]:18.0%} {part[MATHEMATICS]:12.0%} "
              f"{without:16.0%}", flush=True)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--all", action="store_true")
    header(f"Commands, one process; load of the machine {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        shutil.copytree(Path(rt.__file__).parent, place / "copy" / "robthermal",
                        ignore=shutil.ignore_patterns("__pycache__"))
        subprocess.run([sys.executable, "-c", WARM], cwd=place, env=environment(place), check=True)
        spent(["new", "bench"], place, (0,))
        (place / "damaged").mkdir()
        for ending in ("toml", "json", "csv"):
            (place / f"damaged.{ending}").write_text("[lumps\n", encoding="utf-8")
        print_starts(place)
        print_commands(place, [*COMMANDS, *([MAP] if arguments.parse_args().all else [])])
