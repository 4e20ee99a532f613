"""Batches of cases: how large they become, what a slow case gives back, what an interrupt costs."""

from __future__ import annotations

from collections import Counter

import pytest
from joblib import parallel_config

import robthermal as rt
from robthermal._fleet import _batches, _run
from robthermal._fleet._batches import Batch, Batches, answer_batch
from robthermal._fleet._store import Answer


class Clock:
    """Stands still but for what is told: a busy machine changes nothing."""

    def __init__(self, monkeypatch):
        self.now = 0.0
        monkeypatch.setattr(_batches, "time", self)

    def perf_counter(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


def test_size_follows_the_time_of_a_case():
    batches, sizes, seen = Batches(range(10_000), workers=2), [], []
    for (number, keys), seconds in zip(batches, [1e-5] * 12 + [0.05] * 5 + [2.0] * 5, strict=False):
        sizes.append(len(keys))
        seen += [key for key, _ in batches.back(Batch(number, [Answer(None)] * len(keys), seconds))]
    assert sizes == [1, 2, 4, 8, 16, 32, 64, 128, 256, 500, 500, 500, 500, 10, 10, 10, 10, 10, 1, 1, 1, 1]
    assert seen == list(range(sum(sizes)))


def test_towards_the_end_every_worker_has_work():
    batches, sizes = Batches(range(1000), workers=4), []
    for number, keys in batches:
        sizes.append(len(keys))
        batches.back(Batch(number, [Answer(None)] * len(keys), 0.0))
    assert sum(sizes) == 1000 and max(sizes) > 50
    left = 0
    for size in reversed(sizes):
        left += size
        assert size <= -(-left // 8)


def test_a_slow_case_gives_back_the_others(monkeypatch):
    clock = Clock(monkeypatch)
    batch = answer_batch(lambda x: clock.sleep(x) or x, 7, [0.1, 0.6, 0.0, 0.0])
    assert [answer.result for answer in batch.answers] == [0.1, 0.6] and batch.number == 7
    assert batch.seconds == pytest.approx(0.35)


def test_what_comes_back_after_the_last_batch_waits_for_another_round():
    """In any order: the batch that was handed out first comes back last and undone but for one case."""
    batches = Batches("abcdefg", workers=1)
    out = iter(batches)
    number, keys = next(out)
    batches.back(Batch(number, [Answer(0)], 0.0))
    first, *others = out
    assert (keys, first[1], [keys for _, keys in others]) == (["a"], ["b", "c"], [["d", "e"], ["f"], ["g"]])
    assert not batches
    for number, keys in others:
        batches.back(Batch(number, [Answer(key) for key in keys], 0.0))
    assert batches.back(Batch(first[0], [Answer("B")], 0.0)) == [("b", Answer("B"))]
    assert batches and [keys for _, keys in batches] == [["c"]]


@pytest.mark.parametrize("jobs", [1, 2, None])
def test_slow_cases_among_quick_ones_are_all_done_once(jobs, monkeypatch):
    """Also when the largest batch comes back last, when all others have been handed out."""
    clock, rounds, done, told = Clock(monkeypatch), [], [], []

    def largest_last(**_):
        def run(tasks):
            rounds.append(1)
            held = []
            for task in tasks:
                held = sorted([*held, task], key=lambda one: len(one[1][2]))
                if len(held) == 4:
                    yield held[0][0](*held.pop(0)[1])
            yield from (function(*arguments) for function, arguments, _ in held)
        return run

    def work(x: int) -> int:
        done.append(x)
        clock.sleep(0.6 if x % 8 == 0 else 0.0)
        return x * x

    if jobs is None:
        monkeypatch.setattr(_run.joblib, "Parallel", largest_last)
    with parallel_config(backend="threading"):
        run = rt.fleet(work, range(200), jobs=jobs, progress=lambda now, total: told.append(now))
    assert run.results == [x * x for x in range(200)] and run.computed == 200
    assert set(Counter(done).values()) == {1} and told == list(range(201))
    assert len(rounds) > 1 or jobs


def test_an_interrupt_costs_one_batch(tmp_path, monkeypatch):
    clock, store, stopped = Clock(monkeypatch), tmp_path / "runs.jsonl", [30]

    def work(x: int) -> int:
        if x in stopped:
            raise KeyboardInterrupt
        clock.sleep(0.125)
        return x

    with pytest.raises(KeyboardInterrupt):
        rt.fleet(work, range(60), store=store)
    kept = store.read_text().count("\n") - 1
    assert 30 - 4 < kept <= 30  # four cases a batch at most
    stopped.clear()
    run = rt.fleet(work, range(60), store=store)
    assert run.results == list(range(60)) and run.computed == 60 - kept
