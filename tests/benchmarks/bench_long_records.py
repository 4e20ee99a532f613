"""Time and memory of a diagnosis of 10 000 samples: a plant of the blind suite, a bar and a stack of foreign truth.

Run: python tests/benchmarks/bench_long_records.py [--samples 10000] [--cases blind/B/hidden/missing_link/101 ...].
Without --cases then also the longest catalog, two modules and nine lumps, on records of 1 500 samples.
Every case runs in a process of its own, whose peak memory is the case's.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
from collections.abc import Callable, Sequence
from time import process_time

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is loaded

import blind.cases  # noqa: E402
import foreign.cases  # noqa: E402
from _timing import header  # noqa: E402

import robthermal as rt  # noqa: E402

Data = tuple[rt.System, rt.Record, rt.Record]
CASES = ("blind/B/hidden/missing_link/101", "foreign/bar/hidden/missing_link/2", "foreign/stack/hidden/missing_link/2")

LONGEST_CATALOG = ("foreign/pair/hidden/missing_link/25", "foreign/pair/hidden/missing_link/27")


def of_blind_suite(key: str, samples: int) -> Data:
    """A data set of the blind suite with a longer training record."""
    blind.cases.N_TRAIN, blind.cases.VALIDATION_START = samples, samples * blind.cases.H + 600.0
    topology, group, effect, seed = key.split("/")
    given, _ = blind.cases.made(blind.cases.Case(topology, group, effect, int(seed)))
    return given.system, given.train, given.validation


def of_foreign_truth(key: str, samples: int) -> Data:
    """A data set of foreign truth with a longer training record."""
    foreign.cases.N_TRAIN, foreign.cases.PAUSE = samples, samples * foreign.cases.H + 1800.0
    machine, group, effect, seed = key.split("/")
    made = foreign.cases.made(foreign.cases.Case(machine, group, effect, int(seed)))
    return made.system, made.train, made.unseen


SUITES: dict[str, Callable[[str, int], Data]] = {"blind": of_blind_suite, "foreign": of_foreign_truth}


def row(name: str, samples: int) -> str:
    """Diagnose a case, and say what it took."""
    suite, _, key = name.partition("/")
    system, train, unseen = SUITES[suite](key, samples)
    start = process_time()
    found = rt.diagnose(system, train, validation=unseen)
    seconds, peak = process_time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    named = "; ".join(" or ".join([effect.label, *(f"{other}({', '.join(where)})" for other, where in others)])
                      for effect, others in zip(found.effects, found.alternatives, strict=True))
    return (f"{name:<40} {len(system.lumps)} lumps, {len(found.scores.candidates)} candidates: {seconds:.0f} CPU s, "
            f"{peak:.0f} MB at most, {found.verdict}: {named}")


def rows(samples: int, cases: Sequence[str]) -> None:
    """Diagnose every case and print a row of it."""
    header(f"diagnosis of {samples} samples")
    for name in cases:
        with multiprocessing.get_context("spawn").Pool(1) as own:
            print(own.apply(row, (name, samples)), flush=True)


def main() -> None:
    """Long records; then the longest catalog, unless cases are given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--cases", nargs="*")
    chosen = parser.parse_args()
    rows(chosen.samples, chosen.cases or CASES)
    if not chosen.cases:
        rows(1_500, LONGEST_CATALOG)


if __name__ == "__main__":
    main()
