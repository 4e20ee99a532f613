"""Closed loops with uncertain links, a drift or held heat: against simulated samples, and what must be refused."""

from __future__ import annotations

import loop_truth
import numpy as np
import pytest
from small_loop import made

from robthermal.errors import InputError


@pytest.mark.parametrize("name", loop_truth.VARIANTS)
def test_no_sampled_pair_violates_what_is_proven_and_more_is_refused(name):
    parts = loop_truth.variant(name)
    assert made(parts).holds
    assert -0.05 < loop_truth.violation(parts, np.random.default_rng(1), 4) < 0
    parts["evidence"]["contraction"] -= 0.02
    assert loop_truth.violation(parts, np.random.default_rng(1), 4) > 0
    assert not made(parts).holds


@pytest.mark.parametrize(("link", "span"), [("sink", [0.01, 2.1]), ("sink", [1.0, 2.1]), ("leak", [0.0, 0.11])])
def test_ranges_with_a_machine_that_is_slower_are_refused(link, span):
    parts = loop_truth.variant("uncertain")
    parts["region"]["parameters"][f"links.{link}.conductance"] = span
    level = made(parts)
    worst = loop_truth.violation(parts, np.random.default_rng(2), 8)
    assert not (level.holds and worst > 0)
    if link == "sink":
        assert not level.holds
    if span[0] == 0.01:
        assert worst > 0


def test_the_claim_names_the_ranges_and_a_point_range_is_the_link_itself():
    parts = loop_truth.variant("uncertain")
    assert "'links.sink.conductance' in [1.9, 2.1]" in made(parts).claim
    parts["region"]["parameters"] = {"links.sink.conductance": [2.0, 2.0]}
    assert made(parts).holds


@pytest.mark.parametrize(("change", "words"), [
    ({"parameters": {"modules.m.seebeck.value": [0.05, 0.06]}}, "only conductances"),
    ({"parameters": {"lumps.hot.capacity": [40.0, 60.0]}}, "only conductances"),
    ({"parameters": {"links.hot-room.conductance": [1.0, 2.0]}}, "no such number"),
    ({"parameters": {"links.sink.conductance": [-0.1, 2.0]}}, "negative"),
    ({"plant": "held"}, "continuous time")])
def test_ranges_that_the_proof_does_not_cover_are_refused(change, words):
    parts = loop_truth.variant("uncertain")
    parts["region"] |= change
    with pytest.raises(InputError, match=words):
        made(parts)
