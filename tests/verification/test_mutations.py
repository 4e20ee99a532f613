"""A few mutated certificates of every kind; tests/benchmarks/mutated_certificates.py judges ten thousand."""

from __future__ import annotations

import mutant_ellipsoid
import mutant_feedback
import mutant_linear
import mutant_scheduled
import mutant_thermal
import numpy as np
import pytest
from mutants import ALARMS, FALSE, Subject, judge, run

from robthermal.verification._kinds import KINDS

SUBJECTS = {subject.kind: subject for subject in (*mutant_thermal.SUBJECTS, *mutant_linear.SUBJECTS,
                                                  *mutant_feedback.SUBJECTS, *mutant_ellipsoid.SUBJECTS,
                                                  *mutant_scheduled.SUBJECTS)}


def test_every_kind_has_a_falsifier():
    assert set(SUBJECTS) == set(KINDS)


@pytest.mark.parametrize("kind", sorted(SUBJECTS))
def test_no_mutant_is_accepted_though_false(kind):
    count = 6 if kind == "loop" else 30
    slow = kind in ("loop", "observer", "regulated")  # seconds to push one of them to the edge
    table = run(SUBJECTS[kind], np.random.default_rng(3), count, per_document=15, edges=() if slow else None)
    assert not any(table[alarm] for alarm in ALARMS), table
    assert table["accepted, no sample violates it"] >= 1, table
    assert kind == "loop" or sum(number for what, number in table.items() if "accepted" not in what) > 3, table


@pytest.mark.parametrize("kind", sorted(SUBJECTS))
def test_falsifiers_find_what_is_false(kind):
    """A claim of twice the rate, half the bound or a quarter of the interval is caught by the samples."""
    rng = np.random.default_rng(5)
    document = {"margin": {}, **SUBJECTS[kind].make(rng)}
    region, evidence = document["region"], document["evidence"]
    if kind == "stability":
        region["rate"] = 0.9 * (1 if document["system"]["sample_time"] else 1e6)
    elif kind == "polytope":
        region.update({key: value / 4 if key in ("bound", "radius") else 4 * value + 0.1
                       for key, value in region.items() if key in ("rate", "bound", "decay", "radius")})
        if document["system"]["sample_time"] and "rate" in region:
            region["rate"] = 0.999
    elif kind == "scheduled":
        region["level"] = 4 * region["level"]
    elif kind == "ellipsoid":
        region.update({"rate": 0.999 if document["system"]["sample_time"] else 1e3} if "rate" in region else
                      {"bound": region["bound"] / 4} if "bound" in region else {"level": region["level"] / 100})
    elif kind == "closed_loop":
        region["rate" if region["measure"] == "stability" else "bound"] = (
            (0.999 if document["system"]["sample_time"] else 1e6) if region["measure"] == "stability"
            else region["bound"] / 4)
    elif kind in ("hinf", "peak", "network_peak"):
        region["bound"] /= 4
    elif kind == "frequency":
        region.update({"bounds": [value / 2 for value in region["bounds"]]} if region["form"] == "norm" else
                      {"bound": region["bound"] / 2})
    elif kind == "invariance":
        region["heat"] = {name: [100 * low, 100 * high] for name, (low, high) in region["heat"].items()}
    elif kind == "runaway":
        evidence["load"] = [value + 1 for value in evidence["load"]]
    elif kind in ("observer", "loop"):
        evidence["contraction"] *= 0.8
    elif kind == "gain":
        evidence["gains"] = {source: {name: [0.5 * value for value in values] for name, values in part.items()}
                             for source, part in evidence["gains"].items()}
    else:
        evidence["rate"] = 2 * evidence["rate"] + 1e-3
    assert SUBJECTS[kind].violation(document, rng) > SUBJECTS[kind].tolerance
    blind = Subject(kind, SUBJECTS[kind].make, lambda document, rng: 1.0)  # one that calls everything false
    assert judge(blind, {"margin": {}, **SUBJECTS[kind].make(rng)}, rng) == FALSE
