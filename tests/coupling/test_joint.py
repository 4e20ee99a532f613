"""Several axes: the joint robust number by brute force, and a loop that only the axes together close."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import control
import numpy as np
import pytest

import robthermal as rt

from .conftest import Array, Pair, at, make_random_pair

W = np.linspace(1.0, 314.0, 80)


@cache
def axis(seed: int, X: float, Y: float) -> tuple[Pair, rt.coupling.Filters]:
    pair = make_random_pair(seed)
    return pair, rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=X, Y_hat=Y)


def plants_of(pairs: list[Pair], delta: Array) -> Array:
    """(n, n, n_f) plants P = (Np + Dk Delta)(Dp - Nk Delta)⁻¹ for Delta (n_f, n, n); the controllers are stable."""
    factors = [rt.coupling.coprime((p.P1, p.P2), (p.C1, p.C2)).at(W) for p in pairs]
    diag = {name: np.moveaxis(np.concatenate([f[name] for f in factors])[:, None] * np.eye(2 * len(pairs))[:, :, None],
                              -1, 0) for name in ("Np", "Dp", "Nk", "Dk")}
    P = (diag["Np"] + diag["Dk"] @ delta) @ np.linalg.inv(diag["Dp"] - diag["Nk"] @ delta)
    return np.moveaxis(P, 0, -1)


def test_robust_number_of_two_axes_by_brute_force() -> None:
    (first, fx), (second, fy) = axis(0, 0.5, 0.4), axis(1, -0.6, 0.3)
    rng = np.random.default_rng(0)
    size = rng.uniform(0.1, 0.6, (4, 4))
    samples = [size * np.exp(1j * (W[:, None, None] * 0.01 * rng.integers(0, 3, (4, 4)))) for _ in range(2)]
    measured = [control.FRD(plants_of([first, second], sample), W) for sample in samples]
    found = rt.coupling.joint({"x": fx, "y": fy}, measured)
    assert found.uncertainty is not None
    np.testing.assert_allclose(np.moveaxis(found.uncertainty.samples, -1, 1), samples, atol=1e-9)
    delta = np.zeros((4, 4))
    delta[0, 1], delta[1, 0], delta[2, 3], delta[3, 2] = 0.5, 0.4, 0.6, 0.3  # constant filters, Dk = 1
    truth = float(np.abs(np.linalg.eigvals(delta @ size)).max())
    assert truth < found.robust < 1.01 * truth and truth < 1 and found.robustly_stable and found.holds
    assert truth > 1.05 * max(np.abs(np.linalg.eigvals(delta[k, k] @ size[k, k])).max()
                              for k in (slice(0, 2), slice(2, 4)))  # interaction counts
    proof = found.certificates["together: robust number"]
    assert rt.verify(proof).valid
    assert not rt.verify(replace(proof, region={**proof.region, "bound": 0.99 * truth})).valid
    assert "interaction" in str(found) and len(found.certificates) > 10


@pytest.mark.parametrize(("size", "robust"), [(0.95, True), (1.05, False)])
def test_two_axes_close_a_loop_that_none_has_alone(size: float, robust: bool) -> None:
    """Master-slave in both axes: alone robust whatever the plants. Axis x acts on y and back: a loop through both."""
    (first, fx), (second, fy) = axis(2, 2.0, 0.0), axis(3, 3.0, 0.0)
    r = size * np.sqrt([1 / 6, 1 / 6])  # 1 - 2 · 3 r1 r2/z has its root at size²
    delta = np.zeros((len(W), 4, 4), dtype=complex)
    delta[:, 3, 0], delta[:, 1, 2] = r[0] * np.exp(-0.01j * W), r[1]
    measured = control.FRD(plants_of([first, second], delta), W)
    alone = rt.coupling.joint({"x": fx, "y": fy})
    assert alone.holds and alone.robust == 0.0 and not alone.robustly_stable and "Assumed" in alone.outcome.text
    found = rt.coupling.joint({"x": fx, "y": fy}, measured)
    assert found.robust == pytest.approx(size, rel=0.01)
    assert found.robustly_stable == found.holds == robust
    assert (spectral_radius_of_the_loop([first, second], [fx, fy], r) < 1) == robust


def spectral_radius_of_the_loop(pairs: list[Pair], filters: list[rt.coupling.Filters], r: Array) -> float:
    """Largest closed-loop pole with P = (Np + Dk D)(Dp - Nk D)⁻¹, the delayed entry of D from x to y."""
    f = [rt.coupling.coprime((p.P1, p.P2), (p.C1, p.C2)) for p in pairs]
    Np, Dp, Nk, Dk = (control.append(*[getattr(factors, name) for factors in f]) for name in ("Np", "Dp", "Nk", "Dk"))
    B, C, D = np.zeros((1, 4)), np.zeros((4, 1)), np.zeros((4, 4))
    B[0, 0], C[3, 0], D[1, 2] = 1.0, r[0], r[1]
    delta = control.ss([[0.0]], B, C, D, 0.01)
    K = control.append(*[filter.controller for filter in filters])
    # D xi + K N xi = 0 closes the loop of P = N D⁻¹: its zeros are the closed-loop poles
    whole = (Dp - Nk * delta) + K * (Np + Dk * delta)
    return float(max(abs(np.linalg.eigvals(whole.A - whole.B @ np.linalg.solve(whole.D, whole.C)))))


def test_an_axis_that_fails_fails_all() -> None:
    pair, good = axis(0, 0.5, 0.4)
    frf = np.zeros((2, 2, len(W)), dtype=complex)
    frf[0, 0], frf[1, 1] = 1.3 * at(pair.P1, W), 0.7 * at(pair.P2, W)
    bad = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=30.0, Y_hat=30.0,
                               uncertainty=control.FRD(frf, W))
    found = rt.coupling.joint({"x": good, "bad one": bad})
    assert not bad.holds and not found.holds and "bad one" in found.outcome.text
    assert found.robust == bad.norms["robust"] > 1 and found.worst_frequency == bad.worst_frequency


def test_bad_arguments() -> None:
    pair, good = axis(0, 0.5, 0.4)
    P, C = control.tf([0.01], [1, -0.99], 0.02), control.tf([20.0], [1], 0.02)
    slow = rt.coupling.evaluate(P, P, C, C, X_hat=-0.9)
    for axes in ({}, [good], {"x": 3.0}):
        with pytest.raises(rt.InputError, match="dict of axis name to Filters"):
            rt.coupling.joint(axes)  # type: ignore[arg-type]
    with pytest.raises(rt.InputError, match=r"x has dt = 0.01 s, y has dt = 0.02 s"):
        rt.coupling.joint({"x": good, "y": slow})
    small = control.FRD(np.zeros((2, 2, len(W))), W)
    with pytest.raises(rt.InputError, match="2x2 response"):
        rt.coupling.joint({"x": good, "y": good}, small)
