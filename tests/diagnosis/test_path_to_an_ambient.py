"""A heat path to an ambient, or to the lump that this ambient cools: beside a coarse network both are listed.

The truth is a bar of 60 cells whose end is cooled by water, by scipy's matrix exponential, against five lumps.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.linalg import expm

import robthermal as rt
from robthermal.diagnosis.effects import Candidate, candidates
from robthermal.diagnosis.fit import coarsened
from robthermal.diagnosis.search import Accepted, decide, refit_short_list, with_neighbors
from robthermal.diagnosis.search._neighbors import beside_an_ambient

H, N, CELLS, LUMPS, ROOM = 10.0, 400, 60, 5, 296.0
PATHS = ["missing_link", "missing_ambient_link"]


def bar() -> rt.System:
    """Lumps of 30 J/K, 0.8 W/K between them, 0.05 W/K to the room; 8 W/K from the last one to water."""
    links = [{"between": (f"x{i}", f"x{i + 1}"), "conductance": 0.8} for i in range(1, LUMPS)]
    links += [{"between": (f"x{i}", "room"), "conductance": 0.05} for i in range(1, LUMPS + 1)]
    links.append({"between": ("x5", "water"), "conductance": 8.0})
    values = {f"links.{'-'.join(one['between'])}.conductance": one["conductance"] for one in links}
    return rt.System(ambients={name: {"temperature": ROOM} for name in ("room", "water")}, links=links,
                     lumps={f"x{i}": {"capacity": 30.0} for i in range(1, LUMPS + 1)}, inputs={"q": {"lump": "x1"}},
                     sensors={f"T{i}": {"lump": f"x{i}", "noise": 0.005} for i in (1, 2, 4)},
                     fit={name: {"lower": G / 5, "upper": 5 * G, "sigma": 0.2 * G} for name, G in values.items()})


@cache
def measured(path: float) -> rt.Record:
    """With a path from the middle of the first lump to the water."""
    C, K = 30.0 * LUMPS / CELLS, np.zeros((CELLS, CELLS))
    for i in range(CELLS - 1):
        G = 0.8 * CELLS / LUMPS
        K[[i, i + 1], [i, i + 1]] -= G
        K[[i, i + 1], [i + 1, i]] += G
    K -= np.eye(CELLS) * 0.05 * LUMPS / CELLS
    K[48:, 48:] -= np.eye(12) * 8.0 / 12
    K[6, 6] -= path
    heated = np.zeros((CELLS, 1))
    heated[:12] = 1.0 / 12
    M = expm(H / C * np.block([[K, heated], [np.zeros((1, CELLS + 1))]]))
    rng = np.random.default_rng(1)
    q = np.repeat(rng.uniform(0.0, 6.0, N // 20), 20)
    T, rows = np.zeros(CELLS), []
    for k in range(N):
        rows.append([T[12 * i - 7:12 * i - 5].mean() for i in (1, 2, 4)])
        T = M[:CELLS, :CELLS] @ T + M[:CELLS, CELLS] * q[k]
    inputs = np.column_stack([q, np.full((N, 2), ROOM)])
    return rt.Record(sample_time=H, inputs=inputs, outputs=ROOM + np.array(rows) + 0.005 * rng.standard_normal((N, 3)),
                     input_names=["q", "room", "water"], output_names=["T1", "T2", "T4"])


@cache
def found(path: float = 0.2) -> Accepted:
    before = coarsened(rt.diagnosis.refit(bar(), measured(path)))
    decision = decide(refit_short_list(before, rt.diagnosis.score(before, PATHS)))
    assert isinstance(decision, Accepted)
    return decision


def listed(round_: Accepted) -> set[tuple[str, frozenset[str]]]:
    return {(entry.candidate.effect.name, frozenset(entry.candidate.where)) for entry in
            (round_.best, *round_.contenders)}


TWO = {("missing_link", frozenset({"x1", "x5"})), ("missing_ambient_link", frozenset({"x1", "water"}))}


def test_the_water_and_the_lump_that_it_cools_are_both_listed() -> None:
    assert TWO <= listed(with_neighbors(found()))


@pytest.mark.parametrize("names", [["missing_link"], ["missing_ambient_link", "radiation"]])
def test_only_effects_that_may_be_named_are_listed(names: list[str]) -> None:
    before = listed(found())
    added = listed(with_neighbors(found(), names)) - before
    assert {name for name, _ in added} <= {found().best.candidate.effect.name}


def one(effect: str, *where: str) -> Candidate:
    (candidate,) = [each for each in candidates(bar(), [effect]) if set(each.where) == set(where)]
    return candidate


def test_which_paths_are_beside_an_ambient() -> None:
    water = one("missing_ambient_link", "x1", "water")
    assert beside_an_ambient(bar(), one("missing_link", "x1", "x5"), water)
    assert beside_an_ambient(bar(), water, one("missing_link", "x1", "x5"))
    assert not beside_an_ambient(bar(), one("missing_link", "x1", "x4"), water)  # water cools x5 alone
    assert not beside_an_ambient(bar(), one("missing_link", "x2", "x5"), water)  # from another lump
    assert not beside_an_ambient(bar(), one("missing_link", "x1", "x4"), one("missing_link", "x1", "x5"))
