"""Kind "loop" with matrices for the start of a sample: proven from digits, against an own integration, and mutants."""

from __future__ import annotations

import copy
from itertools import product

import certificate_truth as truth
import loop_truth
import numpy as np
import pytest
import small_loop
from flint import fmpq

import robthermal as rt
from robthermal.errors import InputError
from robthermal.verification import establish, verify
from robthermal.verification._flow import control_points
from robthermal.verification._system import read_system


@pytest.fixture(scope="module")
def found():
    """The pair of `small_loop`, as the search finds it; the checker proves it from the digits alone."""
    pair = small_loop.PAIR
    system = rt.System(ambients={"room": {"temperature": 298.15}}, lumps=pair["lumps"], links=pair["links"],
                       modules=pair["modules"])
    cert = rt.certify.loop(system, current=small_loop.BOX["current"], temperature=tuple(small_loop.BOX["temperature"]),
                           sample_time=1.0, controller=pair["controller"])
    assert cert.holds and verify(cert).valid
    return {"system": cert.system, "region": cert.region, "evidence": cert.evidence}


def changed(parts, path, change):
    parts = copy.deepcopy(parts)
    place = parts
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = change(place[path[-1]])
    return parts


def holds(parts):
    return establish("loop", **parts, made_by={}, margin={}).holds


def test_pairs_shrink_as_claimed(found):
    assert loop_truth.violation({**found, "system": {**found["system"], "links": small_loop.PAIR["links"]}},
                                np.random.default_rng(3), count=8) <= 1e-6


def test_what_is_false_is_never_proven(found):
    """Other machines, controllers and boxes with the same matrices: whenever a simulated pair grows, it is refused."""
    rng, false = np.random.default_rng(4), 0
    mutants = [changed(found, ("evidence", "contraction"), lambda c, k=k: 1 - (1 - c) * k) for k in (3.0, 6.0, 30.0)]
    for key, k in product("AD", (-1.0, 0.5, 3.0, 10.0)):
        mutants.append(changed(found, ("system", "controller", key),
                               lambda rows, k=k: [[k * value for value in row] for row in rows]))
    mutants += [changed(found, ("region", "sample_time"), lambda _, T=T: T) for T in (5.0, 60.0, 200.0)]
    mutants += [changed(found, ("region", "current", "m"), lambda _, c=c: [-c, c]) for c in (1.0, 3.0, 6.0)]
    for mutant in mutants:
        worst = loop_truth.violation(mutant, rng, count=4)
        if worst > 1e-6:
            false += 1
            assert not holds(mutant)
    assert false >= 8


def test_matrices_that_prove_nothing_are_refused(found):
    """The start of a sample is evidence: smaller it may grow until the end, larger it was not below what was."""
    count = len(found["evidence"]["start"])
    for k, factor in product(range(count), (0.3, 0.99, 1.01, 3.0, -1.0)):
        mutant = changed(found, ("evidence", "start", k), lambda S, f=factor: (f * np.array(S)).tolist())
        if factor in (0.3, -1.0, 3.0):
            assert not holds(mutant)
    flipped = changed(found, ("evidence", "start"), lambda starts: starts[::-1])
    assert not holds(flipped)
    fewer = changed(found, ("evidence", "start"), lambda starts: starts[:-1])
    assert "are needed" in establish("loop", **fewer, made_by={}).reason
    nonlinear = changed(found, ("evidence", "start", 0, 0), lambda row: [row[0], row[1] + 1e-3, *row[2:]])
    assert "not symmetric" in establish("loop", **nonlinear, made_by={}).reason


@pytest.mark.parametrize(("path", "value", "message"), [
    (("evidence", "start"), [[[1.0]]], "rows"), (("region", "drift"), 2.0, "without a drift"),
    (("region", "plant"), "held", "only for plant"), (("system", "gain"), [[0.1], [0.1]], "sensors"),
    (("evidence", "start"), "none", "start")])
def test_malformed_files_are_refused(found, path, value, message):
    parts = copy.deepcopy(found)
    place = parts
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(InputError, match=message):
        establish("loop", **parts, made_by={})


def test_control_points_enclose_the_slopes():
    """J and ∂(heats)/∂I of random points lie in the hull of the control points, in random directions."""
    system = read_system(small_loop.PAIR)
    box = (fmpq(285), fmpq(310)), (fmpq(270), fmpq(300)), (fmpq(-1), fmpq(2))
    points = np.array([[float(value) for value in point] for point in control_points(system.modules[0], box)])
    alone, rng = {**small_loop.PAIR, "links": []}, np.random.default_rng(8)
    reached = 0.0
    for _ in range(60):
        x = np.array([rng.choice([285.0, 297.0, 310.0]), rng.choice([270.0, 280.0, 300.0])])
        current = rng.choice([-1.0, 0.4, 2.0])
        J = truth.jacobian(alone, x, {"m": current})
        b = [(p - q) / 2e-4 for p, q in zip(*(truth.heat(alone, x, {"m": current + d}, {}) for d in (1e-4, -1e-4)),
                                            strict=True)]
        slopes = np.array([*J.ravel(), *b])
        for direction in rng.standard_normal((20, 6)) / np.ptp(points, axis=0):
            most = (points @ direction).max()
            assert slopes @ direction <= most + 1e-5 * np.abs(direction * slopes).sum()
            reached = max(reached, (slopes @ direction - (points @ direction).min()) / np.ptp(points @ direction))
    assert reached > 0.99
