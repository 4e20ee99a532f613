"""The readable cvxpy programs and the fast methods agree to 1e-4."""

from __future__ import annotations

import sys

import control
import numpy as np
import pytest
from plants import generalized, hard, scherer

import robthermal as rt
from robthermal.linear import Plant, read_plant
from robthermal.synthesis._anti_windup import _loop, _solved
from robthermal.synthesis._attraction import _sector
from robthermal.synthesis._ellipsoid_program import Driven, _program
from robthermal.synthesis._formulations import h2_level, hinf_level, margin_step
from robthermal.synthesis._formulations_limits import (
    anti_windup_gain,
    attraction_size,
    mixed_level,
    reached_size,
    terminal_size,
)
from robthermal.synthesis._frf_data import read_discs
from robthermal.synthesis._frf_pid import _bins
from robthermal.synthesis._frf_program import _step
from robthermal.synthesis._inequalities import Aims, _optimum, coordinates, moved
from robthermal.synthesis._mpc_limits import read_limits
from robthermal.synthesis._mpc_terminal import DEARER, largest_level, optimal
from robthermal.synthesis._mpc_terminal import _program as terminal_program
from robthermal.synthesis._plant import read_generalized, split
from robthermal.synthesis._structure import read_structure


def random_regular(seed, n=4):
    """Two controls, two measurements, no direct path from w to z."""
    rng = np.random.default_rng(seed)
    zero, one = np.zeros((2, 2)), np.eye(2)
    return generalized(rng.standard_normal((n, n)), np.hstack([rng.standard_normal((n, 2)), np.zeros((n, 2))]),
                       rng.standard_normal((n, 2)), np.vstack([rng.standard_normal((2, n)), np.zeros((2, n))]),
                       rng.standard_normal((2, n)), np.zeros((4, 4)), np.vstack([zero, one]), np.hstack([zero, one]))


@pytest.mark.parametrize(("P", "n"), [(scherer(), 1), (hard(), 1), (random_regular(0), 2), (random_regular(1), 2)])
def test_hinf_riccati_and_inequalities_agree(P, n):
    exact = rt.design.hinf(P, n, n, tolerance=1e-4)
    assert exact.lower == pytest.approx(hinf_level(read_generalized(P, n, n)), rel=1e-4)
    assert exact.holds and exact.value <= 1.002 * exact.lower


def test_reference_method_of_hinf():
    d = rt.design.hinf(scherer(), 1, 1, method="reference")
    assert d.holds and d.lower == pytest.approx(9.508085, rel=1e-4) and d.value <= 1.005 * d.lower
    assert rt.verify(d.certificates[0]).valid and "inequalities" in d.method


def test_reference_method_without_cvxpy_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    monkeypatch.delitem(sys.modules, "robthermal.synthesis._formulations", raising=False)
    with pytest.raises(rt.InputError, match=r"cvxpy is not there.*pip install 'robthermal\[reference\]'"):
        rt.design.hinf(scherer(), 1, 1, method="reference")


@pytest.mark.parametrize("seed", range(3))
def test_h2_riccati_and_inequalities_agree(seed):
    P = random_regular(seed)
    d = rt.design.h2(P, 2, 2)
    assert d.lower == pytest.approx(h2_level(read_generalized(P, 2, 2)), rel=1e-4)


@pytest.mark.exhaustive
def test_one_step_of_the_margin_program_agrees():
    G = control.tf([1], [1, 3, 3, 1])
    discs = read_discs(G, 0.99)
    for structure in ("pi", "pid"):
        own = read_structure(structure, discs[0].omega, None, 0.0)
        bins = _bins(discs, own, 0.5, None, {"S": 0.6})
        at, objective = np.array([0.3, 0.1, 0.0][:len(own.names)]), np.eye(len(own.names))[1]
        fast = _step(bins, at, objective, 0.5, 1.0)
        assert fast is not None and fast[0] == pytest.approx(margin_step(bins, at, objective, 0.5), rel=1e-4, abs=1e-5)


@pytest.mark.parametrize(("seed", "limit"), [(0, 17.0), (2, 6.3), (2, 7.9), (3, 2.6)])
def test_mixed_inequalities_agree(seed, limit):
    """In the coordinates of a known controller, where the free scale of X and Y does no harm."""
    P = random_regular(seed, 2 if seed else 3)
    plant, known = read_generalized(P, 2, 2), read_plant(rt.design.h2(P, 2, 2).controller)
    own = moved(plant, coordinates(plant, known))
    point = _optimum(own, Aims(own, own, limit, {}))[3]
    assert np.sqrt(point.value) == pytest.approx(mixed_level(own, limit), rel=1e-4)


@pytest.mark.parametrize("P", [scherer(), hard()])
def test_the_lower_bound_of_fixed_structure_is_the_full_order_optimum(P):
    d = rt.design.output_feedback(P, 1, 1)
    assert d.lower == pytest.approx(hinf_level(read_generalized(P, 1, 1)), rel=3e-4) and d.value > d.lower


def limited_loop(pole):
    plant = control.ss([[pole, 0.4], [0.0, -1.0]], [[0.1, 0.2], [0.3, 1.0]], [[1.0, 0.0], [-1.0, 0.0]],
                       np.zeros((2, 2)))
    K = control.ss([[-0.01]], [[1.0]], [[0.2]], [[2.0]])
    parts = split(read_plant(plant), 1, 1)
    return _loop(parts, read_plant(K))


def test_anti_windup_inequalities_agree():
    loop = limited_loop(-0.2)
    fast = _solved(loop, 1, 1)
    assert fast is not None and fast[2] == pytest.approx(anti_windup_gain(loop, 1, 1), rel=1e-4)


def test_regions_of_attraction_agree():
    loop, limits, rate = limited_loop(0.1), np.array([1.5]), 0.01
    m = loop.B.shape[1] - 2
    found = _sector(loop.A, loop.B[:, m:m + 1], loop.B[:, m + 1:], loop.C[-1:], limits, 2, rate, 0.0)
    assert found is not None
    radius = 1 / np.sqrt(np.linalg.eigvalsh(np.linalg.inv(found[1])[:2, :2])[-1])
    assert radius == pytest.approx(attraction_size(loop, limits, 2, 1, rate), rel=1e-4)


@pytest.mark.parametrize(("dt", "joint"), [(0.0, True), (0.0, False), (0.5, True), (0.5, False)])
def test_ellipsoids_of_disturbances_agree(dt, joint):
    A = np.array([[[0.0, 1.0], [-1.0, -1.0]], [[0.0, 1.0], [-1.5, -1.0]]])
    A = np.eye(2) + 0.3 * A if dt else A
    B = np.repeat(np.array([[[0.2, 0.0], [1.0, 0.5]]]), 2, axis=0) * (0.3 if dt else 1.0)
    driven = Driven(A, B, dt, np.array([0.7]) if joint else np.array([0.7, 0.3]), joint, np.array([[1.0, 1.0]]),
                    np.array([4.0]))
    decay = 0.4 * driven.longest
    fast = _program(driven, decay, np.eye(2))
    assert fast is not None and np.trace(fast[0]) == pytest.approx(reached_size(driven, decay), rel=1e-4)


def test_terminal_sets_agree():
    """x+ = double integrator: the largest ball, in the coordinates of the linear-quadratic law."""
    plant = Plant(np.array([[1.0, 0.2], [0.0, 1.0]]), np.array([[0.02], [0.2]]), np.eye(2), np.zeros((2, 1)), 0.2)
    Q, R = np.diag([1.0, 0.1]), np.array([[0.1]])
    limits = read_limits({"control": (-1.0, 1.0), "state": ([-5.0, -1.2], [5.0, 1.2])}, 2, 1)
    least, _ = best = optimal(plant, Q, R)
    P, K = terminal_program(plant, Q, R, limits, best)
    fast = largest_level(P, K, limits) / np.linalg.eigvals(np.linalg.solve(least, P)).real.max()
    assert fast == pytest.approx(terminal_size(plant, Q, R, limits, DEARER, least), rel=1e-3)
