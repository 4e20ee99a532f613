"""Derivatives of the matrices of a step: against block exponentials (Van Loan 1978) and differences."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from robthermal.thermal._augmented import Augmented
from robthermal.thermal._collocation import NODES, step_matrices, step_slopes

PORTS = np.array([0, 2], np.intp)


def parts(rng: np.random.Generator, rate: float) -> Augmented:
    """A stable network of four states; the last is a lag with this rate [1/s]."""
    F = -np.diag(rng.uniform(0.1, 1.0, 4)) + 0.1 * rng.uniform(0.0, 1.0, (4, 4))
    F[3] = [rate, 0.0, 0.0, -rate]
    return Augmented(F, rng.standard_normal((4, 2)), rng.standard_normal((4, 3)), PORTS)


def change(rng: np.random.Generator, lag: bool) -> Augmented:
    """A change of the network, or of the lag alone."""
    F, B, N = rng.standard_normal((4, 4)), rng.standard_normal((4, 2)), rng.standard_normal((4, 3))
    F[3] = 0.0
    if lag:
        F, B, N = np.zeros((4, 4)), np.zeros((4, 2)), np.zeros((4, 3))
        F[3] = [1.0, 0.0, 0.0, -1.0]
    return Augmented(F, B, N, PORTS)


@pytest.mark.parametrize(("rate", "h"), [(0.5, 0.1), (0.5, 2.0), (3.0, 20.0), (2000.0, 2.0)])
def test_by_state_and_inputs_they_are_blocks_of_an_exponential(rate: float, h: float) -> None:
    rng = np.random.default_rng(1)
    own, changes = parts(rng, rate), [change(rng, lag) for lag in (False, True, False)]
    found = step_slopes(own, changes, h)
    expected = []
    for one in changes:
        A, E = (np.block([[of.F, of.B], [np.zeros((2, 6))]]) for of in (own, one))
        both = np.block([[A, E], [np.zeros_like(A), A]])
        at_nodes = [scipy.linalg.expm(both * h * c)[:4, 6:] for c in NODES[1:]]
        expected.append(np.concatenate([*(block[PORTS] for block in at_nodes), at_nodes[-1]]).T)
    wanted = np.stack(expected, axis=2)
    assert found.shape == (4 + 2 + 6 * 3, 5 * 2 + 4, 3)
    assert found[:6] == pytest.approx(wanted, rel=1e-8, abs=1e-8 * np.abs(wanted).max(axis=(0, 1)).min())


@pytest.mark.parametrize("ports", [[], [1], [0, 3]])
def test_by_the_heats_they_are_differences(ports: list[int]) -> None:
    rng, h, little = np.random.default_rng(2), 3.0, 1e-5
    own, one = parts(rng, 1.0), change(rng, False)
    own, one = (Augmented(of.F, of.B, of.N, np.array(ports, np.intp)) for of in (own, one))

    def moved(by: float) -> np.ndarray:
        step = step_matrices(Augmented(own.F + by * one.F, own.B + by * one.B, own.N + by * one.N, own.ports), h)
        return np.concatenate([step.K, step.Ku, step.M], axis=1).T

    differences = (moved(little) - moved(-little)) / (2.0 * little)
    assert step_slopes(own, [one], h)[..., 0] == pytest.approx(differences, abs=1e-6 * np.abs(differences).max())


def test_a_linear_network_has_its_end_alone() -> None:
    rng = np.random.default_rng(3)
    own, one = parts(rng, 1.0), change(rng, False)
    plain = [Augmented(of.F, of.B, np.zeros((4, 0)), np.zeros(0, np.intp)) for of in (own, one)]
    whole = step_slopes(own, [one], 1.5)
    assert step_slopes(plain[0], plain[1:], 1.5) == pytest.approx(whole[:6, -4:], rel=1e-10, abs=1e-12)
