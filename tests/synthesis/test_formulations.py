"""The readable cvxpy programs and the fast methods agree to 1e-4."""

from __future__ import annotations

import control
import numpy as np
import pytest
from plants import generalized, hard, scherer

import robthermal as rt
from robthermal.synthesis._formulations import h2_level, hinf_level, margin_step
from robthermal.synthesis._frf_data import read_discs
from robthermal.synthesis._frf_pid import _bins
from robthermal.synthesis._frf_program import _step
from robthermal.synthesis._plant import read_generalized
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


@pytest.mark.parametrize("seed", range(3))
def test_h2_riccati_and_inequalities_agree(seed):
    P = random_regular(seed)
    d = rt.design.h2(P, 2, 2)
    assert d.lower == pytest.approx(h2_level(read_generalized(P, 2, 2)), rel=1e-4)


def test_one_step_of_the_margin_program_agrees():
    G = control.tf([1], [1, 3, 3, 1])
    discs = read_discs(G, 0.99)
    for structure in ("pi", "pid"):
        own = read_structure(structure, discs[0].omega, None, 0.0)
        bins = _bins(discs, own, 0.5, None, {"S": 0.6})
        at, objective = np.array([0.3, 0.1, 0.0][:len(own.names)]), np.eye(len(own.names))[1]
        fast = _step(bins, at, objective, 0.5, 1.0)
        assert fast is not None and fast[0] == pytest.approx(margin_step(bins, at, objective, 0.5), rel=1e-4, abs=1e-5)
