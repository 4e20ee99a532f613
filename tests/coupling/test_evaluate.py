"""Theorem 6.4, norms, variances and verdicts of given filters against direct computation with python-control."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.signal import sosfilt

import robthermal as rt

from .conftest import DT, Array, Pair, at, make_random_pair

W = np.linspace(0.3, 314.0, 400)


def filter_of(seed: int, size: float) -> control.StateSpace:
    """Stable random filter of order three with the given largest magnitude."""
    rng = np.random.default_rng(seed)
    system = control.ss(control.zpk(rng.uniform(-0.9, 0.9, 2), rng.uniform(-0.8, 0.9, 3), 1.0, dt=0.01))
    return system * (size / float(np.max(abs(at(system, W)))))


def coupled(pair: Pair, X: float = 0.6, Y: float = 0.5, seed: int = 0, **more: object) -> rt.coupling.Filters:
    return rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=filter_of(seed, X),
                                Y_hat=filter_of(seed + 50, Y), **more)  # type: ignore[arg-type]


def diagonal(first: Array, second: Array) -> Array:
    """(n_f, 2, 2) from two (n_f,)."""
    result = np.zeros((len(first), 2, 2), dtype=complex)
    result[:, 0, 0], result[:, 1, 1] = first, second
    return result


@pytest.mark.parametrize("seed", range(2))
def test_coupled_loop_by_direct_inversion(seed: int) -> None:
    pair = make_random_pair(seed)
    f = coupled(pair, seed=seed)
    P, C = diagonal(at(pair.P1, W), at(pair.P2, W)), diagonal(at(pair.C1, W), at(pair.C2, W))
    K = np.moveaxis(at(f.controller, W), -1, 0)
    X, Y = at(f.X, W), at(f.Y, W)
    H = np.repeat(np.eye(2, dtype=complex)[None], len(W), axis=0)
    H[:, 0, 1], H[:, 1, 0] = -X, -Y
    N = C.copy()
    N[:, 0, 1], N[:, 1, 0] = X / P[:, 0, 0], Y / P[:, 1, 1]
    np.testing.assert_allclose(K, N @ np.linalg.inv(H), atol=1e-8 * np.abs(K).max())  # (6.12)
    S0, S = np.linalg.inv(np.eye(2) + P @ C), np.linalg.inv(np.eye(2) + P @ K)
    np.testing.assert_allclose(S[:, [0, 1], [0, 1]], S0[:, [0, 1], [0, 1]], atol=1e-9)  # (c)
    np.testing.assert_allclose(S[:, 0, 1], -X * S0[:, 1, 1], atol=1e-9)  # (6.40)
    np.testing.assert_allclose(S[:, 1, 0], -Y * S0[:, 0, 0], atol=1e-9)
    e_plus = np.linalg.inv(H) @ -S
    np.testing.assert_allclose(e_plus[:, [0, 1], [1, 0]], 0, atol=1e-9)  # (d)
    e12 = np.stack([S[:, 1, 0] - S[:, 0, 0], S[:, 1, 1] - S[:, 0, 1]])  # y2 - y1
    np.testing.assert_allclose(at(f.e12, W)[0], e12, atol=1e-9)  # (6.14)
    np.testing.assert_allclose(at(f.X_input, W) * P[:, 0, 0], X, atol=1e-8)
    np.testing.assert_allclose(at(f.improvement_1, W), 1 + Y, atol=1e-12)
    np.testing.assert_allclose(at(f.improvement_2, W), 1 + X, atol=1e-12)


@pytest.mark.parametrize("size", [0.5, 3.0])
def test_every_stable_filter_keeps_the_loop_stable(size: float) -> None:  # (a)
    for seed in range(2):
        pair = make_random_pair(seed)
        f = coupled(pair, X=size, Y=size, seed=seed)
        assert f.nominally_stable and f.holds
        plants = block_diag(pair.P1.A, pair.P2.A)
        inputs, outputs = block_diag(pair.P1.B, pair.P2.B), block_diag(pair.P1.C, pair.P2.C)
        K = f.controller
        A = np.block([[plants - inputs @ K.D @ outputs, inputs @ K.C], [-K.B @ outputs, K.A]])
        assert max(abs(np.linalg.eigvals(A))) < 1


def test_the_loop_is_affine_in_the_filters() -> None:  # (b)
    pair = make_random_pair(1)
    values = [at(coupled(pair, X=scale, Y=0.0 if not scale else 0.4 * scale / 0.3, seed=2).e12, W)
              for scale in (0.3, 0.6)]
    zero = at(rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2).e12, W)
    np.testing.assert_allclose(values[1] - zero, 2 * (values[0] - zero), atol=1e-9)


def test_master_slave() -> None:
    pair = make_random_pair(2)
    w = np.linspace(1, 314, 200)
    frf = np.moveaxis(diagonal(1.5 * at(pair.P1, w), 0.5 * at(pair.P2, w)), 0, -1)
    f = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=filter_of(0, 5.0),
                             uncertainty=control.FRD(frf, w))
    assert f.norms["robust"] == 0.0 and f.robustly_stable and f.controller_stable and f.verdict == "robust"
    assert f.norms["small_gain"] > 0 and f.norms["XY"] == 0.0 and f.norms["Y"] == 0.0


@pytest.mark.parametrize("seed", range(2))
def test_norms_bound_and_are_tight(seed: int) -> None:
    pair = make_random_pair(seed)
    w = np.linspace(1, 314, 60)
    frf = np.moveaxis(diagonal(1.4 * at(pair.P1, w), 0.7 * at(pair.P2, w)), 0, -1)
    frf[0, 1] = 0.02
    u = rt.coupling.dual_youla(control.FRD(frf, w), (pair.P1, pair.P2), (pair.C1, pair.C2))
    W1, W2 = control.tf([0.2, 0], [1, -0.8], 0.01), 0.3
    f = coupled(pair, seed=seed, uncertainty=u, disturbances=(W1, W2), weight=control.tf([0.5], [1, -0.5], 0.01))
    dense = np.concatenate([np.linspace(1e-3, np.pi / 0.01, 3001), w])
    X, Y, weight = at(f.X, dense), at(f.Y, dense), at(control.tf([0.5], [1, -0.5], 0.01), dense)
    S1, S2 = 1 / (1 + at(pair.P1, dense) * at(pair.C1, dense)), 1 / (1 + at(pair.P2, dense) * at(pair.C2, dense))
    a, b = weight * S1 * at(W1, dense), weight * S2 * W2
    Xh, Yh, R = at(f.X_hat, dense), at(f.Y_hat, dense), np.moveaxis(u.at(dense), -1, 0)
    delta = np.zeros((len(dense), 2, 2))
    delta[:, 0, 1], delta[:, 1, 0] = abs(Xh), abs(Yh)  # the controllers are stable: Dk = 1
    truth = {"X": abs(X), "Y": abs(Y), "XY": abs(X * Y), "improvement_1": abs(1 + Y), "improvement_2": abs(1 + X),
             "hinf": np.hypot(abs((1 + Y) * a), abs((1 + X) * b)), "hinf_uncoupled": np.hypot(abs(a), abs(b)),
             "robust": np.abs(np.linalg.eigvals(delta @ R)).max(axis=1),
             "small_gain": np.maximum(abs(Xh), abs(Yh)) * np.abs(np.linalg.eigvals(R[:, ::-1])).max(axis=1)}
    for name, values in truth.items():
        largest = float(values.max())
        assert largest * (1 - 1e-6) <= f.norms[name] <= largest * 1.01, name
    pulse, times = np.eye(1, 4000)[0], np.arange(4000) * 0.01
    shaped = (control.tf([0.5], [1, -0.5], 0.01) * W1 * (1 + f.Y) * control.feedback(1, pair.P1 * pair.C1),
              control.tf([0.5], [1, -0.5], 0.01) * W2 * (1 + f.X) * control.feedback(1, pair.P2 * pair.C2))
    h2 = np.sqrt(sum(np.sum(control.forced_response(system, times, pulse).outputs ** 2) for system in shaped))
    assert f.norms["h2"] == pytest.approx(h2, rel=1e-6)
    assert abs(f.worst_frequency - dense[np.argmax(truth["robust"])]) < 5.0


def test_moving_average_by_filtering_the_impulse_response() -> None:
    pair = make_random_pair(0)
    f = coupled(pair, window=0.13, disturbances=(0.2, control.tf([0.1], [1, -0.9], 0.01)))
    n, box = 6000, np.ones(13) / 13
    ma = total = 0.0
    for column, shape in ((0, control.tf([0.2], [1], 0.01)), (1, control.tf([0.1], [1, -0.9], 0.01))):
        impulse = np.zeros(n)
        impulse[0] = 1.0
        v = control.forced_response(control.ss(shape), inputs=impulse, timepts=np.arange(n) * 0.01).outputs
        channel = control.ss(f.e12.A, f.e12.B[:, [column]], f.e12.C, f.e12.D[:, [column]], 0.01)
        h = control.forced_response(channel, inputs=v, timepts=np.arange(n) * 0.01).outputs
        ma += np.sum(np.convolve(h, box) ** 2)
        total += np.sum(h**2)
    assert f.performance.ma_after == pytest.approx(3 * np.sqrt(ma), rel=1e-8)
    assert f.performance.msd_after == pytest.approx(3 * np.sqrt(total - ma), rel=1e-8)
    before = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, window=0.13,
                                  disturbances=(0.2, control.tf([0.1], [1, -0.9], 0.01))).performance
    assert before.ma_before == pytest.approx(before.ma_after) == pytest.approx(f.performance.ma_before)
    assert "MA" in str(f) and np.isnan(coupled(pair).performance.ma_before)


def test_an_unstable_controller_is_seen_though_the_loop_is_stable() -> None:
    pair = make_random_pair(0)
    f = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=-1.2, Y_hat=-1.2)  # Z(1) = 1: XY(1) = 1.44
    assert f.nominally_stable and not f.controller_stable and f.norms["XY"] == pytest.approx(1.44, rel=0.01)
    assert max(abs(np.linalg.eigvals(f.controller.A))) > 1


@pytest.mark.parametrize(("size", "robust"), [(0.95, True), (1.05, False)])
def test_the_robust_number_is_exact_for_free_phases(size: float, robust: bool) -> None:
    """Delta_p = diag(r1/z, r2): 1 - X_hat Y_hat r1 r2/z has its root in the unit circle iff the number is below 1."""
    pair = make_random_pair(3)
    w = np.linspace(0.5, 314.15, 400)
    f = rt.coupling.coprime((pair.P1, pair.P2), (pair.C1, pair.C2))
    r = np.array([0.4, 0.25])
    values = f.at(w)
    plants = []
    for sign in (1, -1):
        d = np.stack([r[0] * np.exp(-0.01j * w), np.full(len(w), sign * r[1])])
        P = (values["Np"] + values["Dk"] * d) / (values["Dp"] - values["Nk"] * d)
        plants.append(control.FRD(np.moveaxis(diagonal(*P), 0, -1), w))
    gain = size / np.sqrt(r[0] * r[1])
    filters = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=gain, Y_hat=gain, uncertainty=plants)
    assert filters.norms["robust"] == pytest.approx(size, rel=0.01)
    assert filters.robustly_stable == robust == filters.holds
    stable = []
    for sign in (1, -1):  # the perturbed plants themselves, as state spaces in feedback with the factors
        loop = closed_loop_of_perturbed_plant(f, filters, r[0], sign * r[1])
        stable.append(max(abs(np.linalg.eigvals(loop))) < 1)
    assert all(stable) == robust


def closed_loop_of_perturbed_plant(f: rt.coupling.CoprimeFactors, filters: rt.coupling.Filters, r1: float, r2: float
                                   ) -> Array:
    """State matrix of K_Delta with P = (Np + Dk D)(Dp - Nk D)⁻¹, D = diag(r1/z, r2)."""
    delta = control.ss([[0.0]], [[1.0, 0.0]], [[r1], [0.0]], [[0.0, 0.0], [0.0, r2]], 0.01)
    N, D = f.Np + f.Dk * delta, f.Dp - f.Nk * delta
    K = filters.controller
    # xi = D⁻¹ u, y = N xi, u = -K y: one algebraic loop closed by D + K N, whose zeros are the closed-loop poles
    whole = D + K * N
    return np.asarray(whole.A - whole.B @ np.linalg.solve(whole.D, whole.C))


def test_given_factors_and_uncertainty_made_with_others() -> None:
    pair = make_random_pair(1)
    w = np.linspace(1, 314, 60)
    frf = control.FRD(np.moveaxis(diagonal(1.2 * at(pair.P1, w), 0.9 * at(pair.P2, w)), 0, -1), w)
    u = rt.coupling.dual_youla(frf, (pair.P1, pair.P2), (pair.C1, pair.C2))
    Z1, _ = rt.coupling.inner_factor(pair.P1)
    late = control.tf([0.8], [1, 0], 0.01) * Z1  # one more sample and another gain than necessary
    args, hats = (pair.P1, pair.P2, pair.C1, pair.C2), {"X_hat": filter_of(1, 0.5), "Y_hat": filter_of(2, 0.5)}
    given = rt.coupling.evaluate(*args, **hats, Z1=late, uncertainty=u)
    again = rt.coupling.evaluate(*args, **hats, Z1=late, uncertainty=[frf])
    for name, value in given.norms.items():
        assert value == pytest.approx(again.norms[name], rel=1e-6), name
    np.testing.assert_allclose(abs(at(given.Z1, w)), 0.8, rtol=1e-9)


def test_stages_with_integrators_and_rigid_bodies(pair: Pair) -> None:
    f = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=control.tf([0.09], [1, -0.9], DT),
                             Y_hat=control.tf([-0.05], [1, -0.9], DT), window=0.01, disturbances=(1e-9, 1e-9))
    assert f.nominally_stable and f.controller_stable and f.norms["XY"] == pytest.approx(0.45, rel=0.01)
    w = np.geomspace(100, np.pi / DT, 300)
    K = np.moveaxis(at(f.controller, w), -1, 0)
    P = diagonal(at(pair.P1, w), at(pair.P2, w))
    S = np.linalg.inv(np.eye(2) + P @ K)
    S1 = 1 / (1 + at(pair.P1, w) * at(pair.C1, w))
    np.testing.assert_allclose(S[:, 0, 0], S1, atol=1e-6)
    np.testing.assert_allclose(S[:, 1, 0], -at(f.Y, w) * S1, atol=1e-6)


def test_continuous_time_example() -> None:
    P = control.tf([1, -2], [1, 3])
    C = control.tf([-0.5], [1, 1])
    f = rt.coupling.evaluate(P, P, C, C, X_hat=control.tf([1], [0.1, 1]), Y_hat=0.2,
                             disturbances=(control.tf([1], [1, 1]),) * 2)
    assert f.nominally_stable and np.isfinite(f.norms["h2"])
    s = 1j * np.geomspace(1e-3, 1e3, 2000)
    assert f.norms["improvement_2"] == pytest.approx(np.max(abs(1 + f.X(s))), rel=0.01)
    assert rt.coupling.evaluate(P, P, C, C).norms["h2"] == np.inf  # white noise passes 1 + PC at infinity


def test_disturbance_with_an_integrator_the_loop_suppresses(pair: Pair) -> None:
    drift = control.tf([1e-12, 0], [1, -1], DT)
    f = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, window=0.01, disturbances=(drift, 1e-9))
    assert 0 < f.performance.ma_before < np.inf
    stable = make_random_pair(0)
    with pytest.raises(rt.InputError, match=r"disturbances\[0\]: S1 W1 is unstable: pole at 1"):
        rt.coupling.evaluate(stable.P1, stable.P2, stable.C1, stable.C2,
                             disturbances=(control.tf([1], [1, -1], 0.01), 1))


def test_sections_and_file(pair: Pair, tmp_path: Path) -> None:
    f = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=control.tf([0.09], [1, -0.9], DT),
                             Y_hat=control.tf([-0.05, 0.01], [1, -0.9, 0.4], DT), window=0.01)
    impulse = np.zeros(400)
    impulse[0] = 1.0
    for name, rows in f.sections().items():
        response = control.forced_response(getattr(f, name), inputs=impulse, timepts=np.arange(400) * DT).outputs
        np.testing.assert_allclose(sosfilt(rows, impulse), response, atol=1e-6 * np.abs(response).max(), err_msg=name)
    f.save(tmp_path / "coupling.json", name="stages")
    content = json.loads((tmp_path / "coupling.json").read_text(encoding="utf-8"))
    assert content["format"] == "robthermal-coupling/1" and content["verdict"] == "nominal"
    assert content["sample_time"] == DT and content["name"] == "stages"
    np.testing.assert_array_equal(content["filters"]["controller"]["A"], f.controller.A)
    assert set(content["sections"]) == {"X", "Y", "X_input", "Y_input"}
    assert content["performance"]["ma_after"] == f.performance.ma_after
    with pytest.raises(rt.InputError, match="cannot be written"):
        f.save(tmp_path / "missing" / "coupling.json")


def test_reduce_keeps_what_counts(random_pair: Callable[[int], Pair]) -> None:
    pair = random_pair(1)
    long = [control.series(filter_of(seed, size), control.zpk([0.5 + 1e-6], [0.5], 1, dt=0.01),
                           control.zpk([-0.3 + 1e-6], [-0.3], 1, dt=0.01)) for seed, size in ((1, 0.5), (2, 0.4))]
    w = np.linspace(1, 314, 60)
    frf = control.FRD(np.moveaxis(diagonal(1.2 * at(pair.P1, w), 0.9 * at(pair.P2, w)), 0, -1), w)
    f = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=long[0], Y_hat=long[1], uncertainty=frf,
                             window=0.1)
    short = f.reduce()
    assert f.X_hat.nstates == 5 and short.X_hat.nstates <= 3 and short.holds
    assert short.performance.ma_after <= 1.01 * f.performance.ma_after
    assert f.reduce(order=2).X_hat.nstates == 2
    with pytest.raises(rt.InputError, match="order"):
        f.reduce(order=-1)


def test_certificates_are_verified_and_mutations_rejected(tmp_path: Path) -> None:
    pair = make_random_pair(0)
    w = np.linspace(1, 314, 40)
    frf = control.FRD(np.moveaxis(diagonal(1.2 * at(pair.P1, w), 0.9 * at(pair.P2, w)), 0, -1), w)
    f = coupled(pair, uncertainty=frf)
    kinds = [c.kind for c in f.certificates]
    assert kinds.count("stability") == 2 and kinds.count("hinf") == 7 and kinds.count("frequency") == 1
    for number, certificate in enumerate(f.certificates):
        certificate.save(tmp_path / f"{number}.json")
        assert rt.verify(rt.Certificate.load(tmp_path / f"{number}.json")).valid
    loop = next(c for c in f.certificates if c.kind == "stability")
    A = np.array([[float(v) for v in row] for row in loop.system["A"]])
    unstable = replace(loop, system={**loop.system, "A": (A + np.eye(len(A))).tolist()})
    assert not rt.verify(unstable).valid


def test_a_resonance_between_all_measured_frequencies_is_seen() -> None:
    pair = make_random_pair(0)
    w = np.linspace(2, 314, 79)  # 4 rad/s apart
    frf = np.moveaxis(diagonal(1.3 * at(pair.P1, w), 0.8 * at(pair.P2, w)), 0, -1)
    u = rt.coupling.dual_youla(control.FRD(frf, w), (pair.P1, pair.P2), (pair.C1, pair.C2))
    pole = np.exp((-0.02 + 100j) * 0.01)  # 0.04 rad/s wide at 100 rad/s, between 98 and 102
    sharp = control.tf(control.zpk([], [pole, np.conj(pole)], 1.0, dt=0.01))
    sharp = sharp * (1.2 / (float(abs(sharp(np.exp(1j)))) * np.sqrt(np.prod(u.at([100.0])[[0, 1], [0, 1], 0]))))
    f = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=sharp, Y_hat=sharp, uncertainty=u)
    on_grid = abs(at(sharp, w)) ** 2 * u.envelope[0, 0] * u.envelope[1, 1]
    assert np.max(on_grid) < 0.01  # (6.22) at the measured frequencies says nothing is wrong
    assert f.norms["robust"] == pytest.approx(1.2, rel=0.02) and not f.robustly_stable and not f.holds
    assert f.outcome.code == "not_robust" and abs(f.worst_frequency - 100) < 0.1 and f.verdict == "nominal"


def test_plots(pair: Pair) -> None:
    pytest.importorskip("matplotlib").use("Agg")
    f = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=0.1, Y_hat=0.1)
    assert f.plot().shape == (3,)
