"""The structured singular value at every frequency: published peaks, dense grids, proofs that fail when they should."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from distillation import distillation

import robthermal as rt

SCALARS = [("full", 1, 1)]
PERFORMANCE = [*SCALARS * 2, ("full", 2, 2)]


def at(system: control.StateSpace, omega: np.ndarray) -> np.ndarray:
    """Response (p, m, n_f), straight from the definition."""
    points = np.exp(1j * omega * system.dt) if system.dt else 1j * omega
    identity = np.eye(system.nstates)
    return np.moveaxis([system.C @ np.linalg.solve(z * identity - system.A, system.B) + system.D for z in points], 0, 2)


def random_system(seed: int, n: int, p: int, m: int, dt: float) -> control.StateSpace:
    """Stable, with one lightly damped pair."""
    random = np.random.default_rng(seed)
    A = random.normal(size=(n, n)) / np.sqrt(n)
    A -= (np.linalg.eigvals(A).real.max() + 0.3) * np.eye(n)
    A[:2], A[:, :2] = 0.0, 0.0
    A[:2, :2] = [[-0.01, 2.0], [-2.0, -0.01]]
    if dt:
        A = np.linalg.solve(np.eye(n) - A * dt / 2, np.eye(n) + A * dt / 2)
    return control.StateSpace(A, random.normal(size=(n, m)), random.normal(size=(p, n)), random.normal(size=(p, m)), dt)


def dense(system: control.StateSpace, blocks: list, top: float) -> Any:
    """mu on 2000 points around everything these systems have."""
    omega = np.concatenate([np.linspace(0, top, 1500), 2 + np.linspace(-0.1, 0.1, 501)])
    return rt.coupling.mu(at(system, omega), blocks)


def assert_sound(system: control.StateSpace, blocks: list, bound: rt.coupling.MuBound, top: float) -> None:
    """Proven, above every grid value, at most 2 % above the largest, and the lower bound shown by its delta."""
    assert bound.outcome.ok and bound.certificate.holds
    assert rt.verify(bound.certificate).valid
    grid = dense(system, blocks, top)
    assert bound.upper > grid.upper.max()
    assert bound.upper <= 1.02 * max(grid.upper.max(), bound.curve[1].max())
    assert bound.lower >= grid.lower.max() * (1 - 2e-3)
    M = system.D if np.isinf(bound.frequency) else at(system, np.array([bound.frequency]))[:, :, 0]
    assert np.abs(np.linalg.eigvals(M @ bound.delta) - 1).min() < 1e-8
    np.testing.assert_allclose(np.linalg.norm(bound.delta, 2), 1 / bound.lower, rtol=1e-9)


def test_distillation_column_at_every_frequency() -> None:
    b = rt.coupling.mu_bound(distillation(), PERFORMANCE)
    assert b.certificate.holds and rt.verify(b.certificate).valid
    np.testing.assert_allclose(b.lower, 5.78181, rtol=1e-4)  # 4001 points; 61 points see 5.77262
    assert 5.78181 < b.upper < 1.02 * 5.78182
    np.testing.assert_allclose(b.frequency, 1.46, rtol=0.02)


@pytest.mark.parametrize("dt", [0.0, 0.2])
@pytest.mark.parametrize("blocks", [SCALARS * 2, [("full", 1, 2), ("full", 1, 1)], [("repeated", 2)]], ids=str)
def test_random_systems_against_dense_grids(blocks: list, dt: float) -> None:
    p, m = sum(size[-1] for _, *size in blocks), sum(size[0] for _, *size in blocks)
    system = random_system(3, 5, p, m, dt)
    assert_sound(system, blocks, rt.coupling.mu_bound(system, blocks), top=np.pi / dt if dt else 20.0)


def test_resonance_between_all_grid_points_is_found() -> None:
    """Two oscillators with damping 1e-4: mu = sqrt|G12 G21| of an off-diagonal pair, 5000 at its peak."""
    A = np.kron(np.eye(2), [[0, 1], [-2.0, -2e-4 * np.sqrt(2)]])
    system = control.StateSpace(A, [[0, 0], [0, 1], [0, 0], [1, 0]], [[1, 0, 0, 0], [0, 0, 1, 0]], 0, 0)
    b = rt.coupling.mu_bound(system, SCALARS * 2)
    truth = 1 / (2 * 1e-4 * 2 * np.sqrt(1 - 1e-8))
    assert truth < b.upper < 1.02 * truth
    np.testing.assert_allclose(b.lower, truth, rtol=1e-3)
    np.testing.assert_allclose(b.frequency, np.sqrt(2), rtol=1e-4)


def test_one_full_block_is_the_h_infinity_norm() -> None:
    system = random_system(5, 4, 2, 3, 0.0)
    b = rt.coupling.mu_bound(system)
    omega = 2 + np.linspace(-0.1, 0.1, 2001)
    grid = np.linalg.norm(np.moveaxis(at(system, omega), 2, 0), 2, axis=(1, 2)).max()
    assert b.certificate.kind == "hinf" and rt.verify(b.certificate).valid
    assert grid * (1 - 1e-6) <= b.lower <= b.upper < 1.02 * grid


def test_master_and_slave_have_no_mu() -> None:
    system = control.StateSpace([[-1.0, 0.2], [0, -2.0]], np.eye(2), [[0, 1.0], [0, 0]], 0, 0)
    b = rt.coupling.mu_bound(system, SCALARS * 2)
    assert b.lower == 0.0 and np.isnan(b.delta).all()
    assert b.certificate.holds and b.upper < 1e-6


def test_constant_system() -> None:
    b = rt.coupling.mu_bound(control.ss([], [], [], [[0, 2.0], [3.0, 0]]), SCALARS * 2)
    np.testing.assert_allclose(b.lower, np.sqrt(6), rtol=1e-9)
    assert np.sqrt(6) < b.upper < 1.02 * np.sqrt(6)


def forge(certificate: rt.Certificate, **changes: Any) -> rt.Verdict:
    """Verdict on the certificate with parts of its region replaced, and the claim they would make."""
    region = {**certificate.region, **changes}
    claim = rt.verification.claim_sentence(certificate.kind, certificate.system, region, certificate.evidence)
    return rt.verify(replace(certificate, region=region, claim=claim))


@pytest.fixture(scope="module")
def proven() -> rt.coupling.MuBound:
    return rt.coupling.mu_bound(random_system(3, 5, 3, 3, 0.0), [("repeated", 2), ("full", 1, 1)])


def test_without_a_proof_there_is_no_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    def too_low(system: Any, edges: Any, bound: float, **scalings: Any) -> rt.Certificate:
        return rt.certify.frequency_norm(system, edges, 0.9 * bound, **scalings)

    monkeypatch.setattr("robthermal.coupling.mu_bounds._mu_bound.frequency_norm", too_low)
    b = rt.coupling.mu_bound(random_system(3, 5, 2, 2, 0.0), SCALARS * 2)
    assert not b.outcome and not b.certificate.holds
    assert b.upper == np.inf and b.lower > 0
    assert "No upper bound is proven" in str(b)


def test_certificate_survives_its_file(proven: rt.coupling.MuBound, tmp_path: Path) -> None:
    proven.certificate.save(tmp_path / "mu.json")
    loaded = rt.Certificate.load(tmp_path / "mu.json")
    assert forge(proven.certificate).valid and rt.verify(loaded).valid
    assert "structured singular value" in loaded.claim


def test_bound_below_mu_is_refused(proven: rt.coupling.MuBound) -> None:
    bounds = [float(bound) * 0.999 * proven.lower / proven.upper for bound in proven.certificate.region["bounds"]]
    verdict = forge(proven.certificate, bounds=bounds)
    assert not verdict.valid and "does not hold" in verdict.reason


def test_scaling_of_another_interval_is_refused(proven: rt.coupling.MuBound) -> None:
    region = proven.certificate.region
    worst = int(np.searchsorted(np.asarray(region["edges"], float), proven.frequency))
    other = 0 if worst else -1
    left, right = (list(region[key]) for key in ("left", "right"))
    left[worst], right[worst] = left[other], right[other]
    assert not forge(proven.certificate, left=left, right=right).valid


def test_scaling_that_does_not_commute_is_refused(proven: rt.coupling.MuBound) -> None:
    left = np.array(proven.certificate.region["left"], float)
    left[0, 0, 0] *= 1 + 1e-12
    verdict = forge(proven.certificate, left=left.tolist())
    assert not verdict.valid and "interval 0" in verdict.reason


def test_claim_for_more_structure_is_refused(proven: rt.coupling.MuBound) -> None:
    """Scalings of a repeated block are no scalings of two independent numbers, nor of one full block."""
    for blocks in ([["full", 2, 2], ["full", 1, 1]], [["full", 3, 3]]):
        assert not forge(proven.certificate, blocks=blocks).valid


@pytest.mark.parametrize(("system", "blocks", "message"), [
    (control.ss([[0.1]], [[1.0]], [[1.0]], 0), None, "not stable: pole at 0.1"),
    (control.ss([[0.0]], [[1.0]], [[1.0]], 0), None, "not stable"),
    (control.ss([[1.01]], [[1.0]], [[1.0]], 0, 0.1), None, "inside the unit circle"),
    (control.ss([[0.5]], [[1.0]], [[1.0]], 0, True), None, "no sample time"),
    (control.ss([[-1.0]], [[1.0]], [[1.0]], 0), [("full", 2, 2)], "the blocks make Delta 2 by 2"),
    (control.tf([1], [1, 1]), None, "control.StateSpace"),
    (np.eye(2), None, "rt.coupling.mu"),
    (control.ss([[-1.0]], [[np.nan]], [[1.0]], 0), None, "matrix B"),
])
def test_bad_input_is_named(system: Any, blocks: Any, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        rt.coupling.mu_bound(system, blocks)


def test_result_prints_and_draws() -> None:
    b = rt.coupling.mu_bound(random_system(3, 5, 2, 2, 0.0), SCALARS * 2)
    assert str(b).startswith("mu at every frequency: ") and "rad/s" in str(b)
    axes = b.plot()
    assert axes.get_xlabel() == "frequency [rad/s]"
    assert "holds at every frequency" in [line.get_label() for line in axes.lines]
