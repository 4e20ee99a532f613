"""Fleets: order, errors, stores, restarts; and a real local Dask cluster."""

from __future__ import annotations

import json
import os
import signal
from functools import partial
from pathlib import Path

import pytest
from fleet_work import coldest, fragile, gap, recorded, slow_square
from joblib import parallel_config

import robthermal as rt

ONE_MODULE = """
[system]
temperature_unit = "degC"
[ambients.room]
temperature = 25.0
[lumps.hot]
capacity = 40.0
[lumps.cold]
capacity = 4.0
[[links]]
between = ["hot", "room"]
conductance = 3.0
[[links]]
between = ["cold", "room"]
conductance = 0.05
[modules.tem]
hot = "hot"
cold = "cold"
seebeck = 0.053
resistance = 4.6
conductance = 0.3
"""
CASES = [{"seed": seed, "load": load} for seed in range(4) for load in (0.0, 2.5)]


def test_results_stand_in_the_order_of_the_cases():
    seen = []
    run = rt.fleet(coldest, CASES, progress=lambda done, total: seen.append((done, total)))
    assert run.results == [coldest(case) for case in CASES]
    assert run.computed == 8 and run.outcome.code == "done"
    assert seen == [(done, 8) for done in range(9)]


def test_two_processes_give_the_same(tmp_path):
    work = partial(slow_square, 0.01, str(tmp_path / "pids"))
    assert rt.fleet(work, range(12), jobs=2).results == [x * x for x in range(12)]
    assert str(os.getpid()) not in (tmp_path / "pids").read_text().split()


def test_errors_stay_with_their_case(tmp_path):
    store = tmp_path / "runs.jsonl"
    run = rt.fleet(fragile, [0, 1, 2, 3], store=store)
    assert run.done == {0: 0, 3: 9} and sorted(run.errors) == [1, 2]
    assert str(run.errors[1]) == "case 1, argument x: x is 1. Expected another number. Change it."
    assert str(run.errors[2]) == "case 2: ZeroDivisionError: division by zero."
    assert not run.outcome and run.outcome.text == f"2 of 4 cases failed. The first: {run.errors[1]}"
    assert "division by zero" in str(run)
    with pytest.raises(rt.InputError, match="x is 1"):
        _ = run.results
    again = rt.fleet(fragile, [0, 1, 2, 3], store=store)  # an InputError is an answer, any other is tried again
    assert again.computed == 1 and sorted(again.errors) == [1, 2]


def test_restart_computes_what_is_missing_only(tmp_path):
    store, trace = tmp_path / "runs.jsonl", tmp_path / "trace"
    work = partial(recorded, str(trace))
    first = rt.fleet(work, [3, 1, 3], store=store)
    assert first.results == [9, 1, 9] and trace.read_text() == "3\n1\n"
    lines = store.read_text().splitlines()
    assert [sorted(json.loads(line)) for line in lines] == [["format", "title"], *[["key", "result"]] * 2]
    progress = []
    second = rt.fleet(work, [1, 2, 3], store=store, progress=lambda *now: progress.append(now))
    assert second.results == [1, 4, 9] and second.computed == 1 and trace.read_text() == "3\n1\n2\n"
    assert progress == [(2, 3), (3, 3)]


@pytest.mark.parametrize("cut", [1, 30, 60, 100, 150])
def test_torn_last_line_costs_one_case(cut, tmp_path):
    """A store cut at any byte, as by a crash, is read and continued."""
    store, trace = tmp_path / "runs.jsonl", tmp_path / "trace"
    work = partial(recorded, str(trace))
    rt.fleet(work, [1, 2, 3], store=store)
    whole = store.read_bytes()
    store.write_bytes(whole[:-cut])
    left = max(whole[:-cut].count(b"\n") - 1, 0)
    for computed in (3 - left, 0):
        run = rt.fleet(work, [1, 2, 3], store=store)
        assert run.results == [1, 4, 9] and run.computed == computed


def test_results_are_the_same_floats_with_and_without_a_store(tmp_path):
    store = tmp_path / "runs.jsonl"
    fresh = rt.fleet(coldest, CASES, store=store)
    stored = rt.fleet(coldest, CASES, store=store)
    assert rt.fleet(coldest, CASES).results == fresh.results == stored.results and stored.computed == 0


def test_refusals(tmp_path):
    store = tmp_path / "runs.jsonl"
    rt.fleet(fragile, [0], store=store, setting="a")
    for function, setting in ((coldest, "a"), (fragile, "b")):
        with pytest.raises(rt.InputError, match="another function or setting"):
            rt.fleet(function, CASES, store=store, setting=setting)
    with pytest.raises(rt.InputError, match="a case cannot be stored"):
        rt.fleet(fragile, [object()], store=store, setting="a")
    with pytest.raises(rt.InputError, match="a result cannot be stored"):
        rt.fleet(bytes, [3], store=tmp_path / "bytes.jsonl")
    with pytest.raises(rt.InputError, match="jobs = 0"):
        rt.fleet(fragile, [0], jobs=0)
    with pytest.raises(rt.InputError, match="cannot be written"):
        rt.fleet(fragile, [0], store=tmp_path / "none" / "runs.jsonl")
    for text in ("hello\n", "[]\n", '{"format": "other"}\n', "\n", "all that the file holds, without an end of line"):
        (tmp_path / "other").write_text(text)
        with pytest.raises(rt.InputError, match="line 1 is not of a store"):
            rt.fleet(fragile, [0], store=tmp_path / "other")
        assert (tmp_path / "other").read_text() == text


def test_limit_map_continues(tmp_path):
    system, store = rt.thermal.parse_system(ONE_MODULE), tmp_path / "map.jsonl"
    options = {"ambient": [293.15], "setpoint": [283.15], "load": [1.0], "temperature": (273.15, 358.15), "jobs": 1}
    counts = []
    fresh = rt.certify.limit_map(system, store=store, **options)
    found = rt.certify.limit_map(system, store=store, progress=lambda *now: counts.append(now), **options)
    assert counts == [(1, 1)] and found.data.equals(fresh.data) and fresh.data["needed [A]"][0] > 0
    other = system.with_parameters({"lumps.cold.capacity": 5.0})
    with pytest.raises(rt.InputError, match="another function or setting"):
        rt.certify.limit_map(other, store=store, **options)


def test_documented_lines_write_parquet(tmp_path, monkeypatch):
    """What failed, what was cut short by a crash, and the title are no rows."""
    parquet = pytest.importorskip("pyarrow.parquet", reason="the package pyarrow is not installed")
    page = (Path(__file__).parents[2] / "docs" / "more_machines.md").read_text(encoding="utf-8")
    lines = next(block.partition("```")[0] for block in page.split("```python\n") if "ParquetWriter" in block)
    monkeypatch.chdir(tmp_path)
    assert rt.fleet(gap, [4.0, 0.0, 2.0], store="gaps.jsonl").computed == 3  # the second fails
    with Path("gaps.jsonl").open("a") as file:
        file.write('{"key": "0123", "resu\n')
    rt.fleet(gap, [8.0], store="gaps.jsonl")
    exec(lines, {})
    assert parquet.read_table("gaps.parquet").to_pylist() == [
        {"path": "4.0", "gap": 0.25}, {"path": "2.0", "gap": 0.5}, {"path": "8.0", "gap": 0.125}]


@pytest.mark.exhaustive
def test_dask_cluster(tmp_path):
    """A scheduler and two worker processes: same numbers, live progress; a killed worker loses nothing; restart."""
    distributed = pytest.importorskip("distributed", reason="the package distributed (Dask) is not installed")
    store, pids = tmp_path / "runs.jsonl", tmp_path / "pids"
    cases, killed, seen = list(range(24)), [], []
    serial = rt.fleet(partial(slow_square, 0.0, str(tmp_path / "serial")), cases)

    def watch(done: int, total: int) -> None:
        seen.append((done, sum(1 for _ in store.open()) - 1 if store.exists() else 0))
        if done == 8:  # half-way through its work
            killed.append(int(pids.read_text().split()[-1]))
            os.kill(killed[0], signal.SIGKILL)

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None,
                                  local_directory=str(tmp_path)) as cluster, distributed.Client(cluster):
        with parallel_config(backend="dask"):
            run = rt.fleet(partial(slow_square, 0.1, str(pids)), cases, store=store, progress=watch)
            workers = set(map(int, pids.read_text().split()))
            again = rt.fleet(partial(slow_square, 0.1, str(pids)), [*cases, 24], store=store)
    assert run.results == serial.results and run.outcome.code == "done"
    assert len(killed) == 1 and len(workers) >= 2 and os.getpid() not in workers
    assert [done for done, _ in seen] == list(range(25))  # one call per case, while the others still run
    assert all(written >= done for done, written in seen)  # every result is in the file before it is told
    assert again.computed == 1 and again.results == [*serial.results, 576]
