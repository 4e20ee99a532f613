"""Fleets on a local Dask cluster of two workers: efficiency, killed workers and schedulers, many small tasks, Parquet.

Run as a script; `--tasks n` sets how many small tasks, 100 000 by default. Needs `distributed` and `pyarrow`.
Efficiency is counted twice: wall time, which other work on the machine spoils, and processor time, which it does not:
the part of the time of all processes that was spent inside the cases.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np  # noqa: E402  (after the thread count is set)
from _timing import header  # noqa: E402
from joblib import Parallel, delayed, parallel_config  # noqa: E402

import robthermal as rt  # noqa: E402

CASES, WORKERS = 40, 2
PEER = 2000  # small tasks of joblib alone
ROWS = 10_000  # results in a row group of the Parquet file


def wait(seconds: float, case: int) -> dict[str, float]:
    """A case that takes a known time [s] and no processor."""
    time.sleep(seconds)
    return {"case": case, "cpu": 0.0, "square": float(case) ** 2}


def simulate(case: int) -> dict[str, float]:
    """A case with work in it, about a second: one simulated day of the two-module machine at 1 s."""
    start = time.process_time()
    system = rt.systems.two_module()
    currents = 0.3 * np.random.default_rng(case).standard_normal((86_400, 2))
    record = rt.Record(sample_time=1.0, inputs=currents, outputs=np.zeros((86_400, 0)),
                       input_names=list(system.modules), output_names=[])
    coldest = float(rt.thermal.simulate(system, record).outputs.min())
    return {"case": case, "cpu": time.process_time() - start, "square": coldest}


def small(case: int) -> float:
    """Next to nothing: what is left is the cost of a task."""
    return case * 0.5


@contextmanager
def cluster(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and two workers in processes of their own; the file that tells their address, and the processes."""
    address = folder / f"scheduler-{time.monotonic_ns()}.json"
    file = ["--scheduler-file", str(address)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *filter(None, sys.path)])}
    start = partial(subprocess.Popen, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                    cwd=folder)
    worker = ["worker", *file, "--nthreads", "1", "--no-dashboard", "--no-nanny", "--death-timeout", "30"]
    command = [sys.executable, "-m", "dask"]
    processes = [start([*command, "scheduler", *file, "--port", "0", "--no-dashboard"]),
                 *(start([*command, *worker]) for _ in range(WORKERS))]
    try:
        yield str(address), processes
    finally:
        for process in processes:
            process.kill()
            process.wait()


@contextmanager
def on_dask(address: str) -> Iterator[None]:
    """The two documented lines."""
    from distributed import Client  # the package does not depend on it

    while not Path(address).exists():
        time.sleep(0.1)
    with Client(scheduler_file=address) as client:
        client.wait_for_workers(WORKERS, timeout=120)
        with parallel_config(backend="dask"):
            yield


def processor_time(processes: list[subprocess.Popen[bytes]]) -> float:
    """Of the processes and of this one so far [s]."""
    tick = os.sysconf("SC_CLK_TCK")
    fields = [Path(f"/proc/{p.pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split() for p in processes]
    return sum(int(one[11]) + int(one[12]) for one in fields) / tick + time.process_time()


def efficiency(folder: Path) -> None:
    header(f"{CASES} cases on {WORKERS} Dask workers; load of the machine {os.getloadavg()[0]:.1f}")
    with cluster(folder) as (address, processes), on_dask(address):
        rt.fleet(simulate, range(-WORKERS, 0))  # the imports
        for name, work in (("waiting 0.5 s", partial(wait, 0.5)), ("a simulated day", simulate)):
            before, start = processor_time(processes), time.perf_counter()
            results = rt.fleet(work, range(CASES), store=folder / f"{name}.jsonl").results
            wall, spent = time.perf_counter() - start, processor_time(processes) - before
            inside = sum(one["cpu"] for one in results)
            if inside:
                print(f"{name:<18} {wall:6.1f} s wall, {inside:6.1f} s in the cases of {spent:6.1f} s of processor "
                      f"time: {inside / spent:.1%}", flush=True)
            else:
                print(f"{name:<18} {wall:6.1f} s wall, ideal {CASES * 0.5 / WORKERS:.1f} s: "
                      f"{CASES * 0.5 / WORKERS / wall:.1%}", flush=True)


def run_waiting(address: str, store: str) -> None:
    """What the child process does: it may be left without a scheduler."""
    with on_dask(address):
        run = rt.fleet(partial(wait, 0.5), range(CASES), store=store)
    print(run.computed, sum(one["square"] for one in run.results), flush=True)


def kill(folder: Path, who: str) -> None:
    """Kill a worker or the scheduler when a quarter is done; start again with the same store where that is needed."""
    store = folder / f"{who}.jsonl"
    command = [sys.executable, __file__, "--child"]
    with cluster(folder) as (address, processes):
        child = subprocess.Popen([*command, address, str(store)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                 text=True)
        while not store.exists() or store.read_bytes().count(b"\n") <= CASES // 4:
            time.sleep(0.05)
        os.kill(processes[who == "worker"].pid, signal.SIGKILL)
        try:
            printed, ended = child.communicate(timeout=90)[0], f"ended with status {child.returncode}"
        except subprocess.TimeoutExpired:
            child.kill()
            printed, ended = child.communicate()[0], "waited for it and was stopped after 90 s"
    kept = store.read_bytes().count(b"\n") - 1
    if not printed:
        with cluster(folder) as (address, _):
            printed = subprocess.run([*command, address, str(store)], stdout=subprocess.PIPE,
                                     stderr=subprocess.DEVNULL, text=True, check=True).stdout
    computed, total = printed.split()
    right = float(total) == sum(case**2 for case in range(CASES))
    print(f"{who} killed: the run {ended}; {kept} of {CASES} results in the store; the last run computed {computed}; "
          f"{'all results right' if right else 'WRONG'}", flush=True)


def small_tasks(folder: Path, count: int) -> None:
    """Memory of this process, of the scheduler and of the workers along the way, and a Parquet file from the store."""
    header(f"{count} small tasks on {WORKERS} Dask workers, then Parquet")
    store = folder / "small.jsonl"
    with cluster(folder) as (address, processes), on_dask(address):
        def watch(done: int, total: int) -> None:
            if done in (10**3, 10**4, total):
                own, scheduler, *workers = (memory(pid) for pid in (os.getpid(), *(p.pid for p in processes)))
                print(f"{done:>8} done: client {own:.0f} MB, scheduler {scheduler:.0f} MB, workers "
                      f"{', '.join(f'{one:.0f}' for one in workers)} MB", flush=True)

        start = time.perf_counter()
        before = processor_time(processes)
        rt.fleet(small, range(count), store=store, progress=watch)
        spent = processor_time(processes) - before
        print(f"{time.perf_counter() - start:.0f} s wall, {spent:.0f} s of processor time of all processes: "
              f"{1e3 * spent / count:.2f} ms per task")
        for batch_size in (1, "auto"):
            before, start = processor_time(processes), time.perf_counter()
            deque(Parallel(return_as="generator_unordered", batch_size=batch_size)(
                delayed(small)(case) for case in range(PEER)), maxlen=0)
            spent = processor_time(processes) - before
            print(f"peer, joblib alone with batch_size={batch_size!r}, {PEER} tasks: {time.perf_counter() - start:.1f} "
                  f"s wall, {1e3 * spent / PEER:.2f} ms of processor time per task", flush=True)
    before = memory(os.getpid())
    rows = to_parquet(store, folder / "small.parquet")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
    print(f"{rows} rows in Parquet, {(folder / 'small.parquet').stat().st_size / 1e6:.2f} MB; memory {before:.0f} MB "
          f"before, {memory(os.getpid()):.0f} after, peak {peak:.0f}")


def to_parquet(store: Path, out: Path) -> int:
    """Results of a store as Parquet, `ROWS` lines in memory at a time; rows written."""
    import pyarrow
    from pyarrow.parquet import ParquetWriter

    schema, rows = pyarrow.schema([("key", pyarrow.string()), ("result", pyarrow.float64())]), 0
    with store.open(encoding="utf-8") as lines, ParquetWriter(out, schema) as writer:
        next(lines)
        while batch := [json.loads(line) for _, line in zip(range(ROWS), lines, strict=False)]:
            writer.write_table(pyarrow.Table.from_pylist(batch, schema))
            rows += len(batch)
    return rows


def memory(pid: int) -> float:
    """Memory in use [MB]."""
    return int(Path(f"/proc/{pid}/statm").read_text(encoding="utf-8").split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--tasks", type=int, default=100_000)
    arguments.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    options = arguments.parse_args()
    if options.child:
        run_waiting(*options.child)
    else:
        with tempfile.TemporaryDirectory() as place:
            efficiency(Path(place))
            kill(Path(place), "worker")
            kill(Path(place), "scheduler")
            small_tasks(Path(place), options.tasks)
