"""All-pass and coprime factors against closed forms and direct evaluation."""

from __future__ import annotations

from collections.abc import Callable

import control
import numpy as np
import pytest

import robthermal as rt
from robthermal.coupling.systems import Response, Zpk, realize, zpk_of

from .conftest import DT, Pair, at

W = np.geomspace(1e-2, np.pi / DT * 0.999, 400)


def test_example_6_5_of_the_thesis() -> None:
    a, b = 2.0, 3.0
    Z, Q = rt.coupling.inner_factor(control.tf([1, -a], [1, b]))
    s = 1j * np.geomspace(1e-3, 1e3, 50)
    sign = np.sign(Z(0).real)
    np.testing.assert_allclose(Z(s), -sign * (s - a) / (s + a), rtol=1e-12)
    np.testing.assert_allclose(Q(s), -sign * (s + b) / (s + a), rtol=1e-12)
    improvement = abs(1 - sign * Z(s))  # X_hat(0) = -1/Z(0), errata to step 3
    assert improvement[0] < 2e-3 and 1.99 < improvement[-1] <= 2.0  # (6.17): from 0 to 2


@pytest.mark.parametrize("seed", range(6))
def test_random_discrete_plants(random_pair: Callable[[int], Pair], seed: int) -> None:
    P = random_pair(seed).P1
    Z, Q = rt.coupling.inner_factor(P)
    w = np.linspace(0.01, 314.0, 300)
    np.testing.assert_allclose(abs(at(Z, w)), 1.0, atol=1e-10)
    np.testing.assert_allclose(at(Q, w) * at(P, w), at(Z, w), atol=1e-8)
    assert max(abs(Z.poles())) < 1 and max(abs(Q.poles())) < 1
    assert Z.nstates == 3  # one wrong-side zero, relative degree two


def test_rigid_body_keeps_its_double_pole(pair: Pair) -> None:
    Z, Q = rt.coupling.inner_factor(pair.P1)
    plant = zpk_of(pair.P1, "P1", DT)
    assert np.sum(plant.poles == 1.0) == 2  # eigenvalues were 1 ± 1e-8
    exact = -(W[:40] ** 2) * 10.0  # 1/P of the rigid body at low frequency [N/m]
    np.testing.assert_allclose((Response(Q)(W[:40])[0, 0] / Response(Z)(W[:40])[0, 0]).real, exact, rtol=1e-2)
    np.testing.assert_allclose(abs(Response(Z)(W)[0, 0]), 1.0, atol=1e-12)


def test_continuous_relative_degree_needs_a_lowpass() -> None:
    P = control.tf([1, -5], [1, 2, 100, 0, 0])
    Z, Q = rt.coupling.inner_factor(P, cutoff=1e3)
    s = 1j * np.geomspace(3, 1e5, 200)  # below, Q (zero at 0, gain 1e9 above the cut-off) is rounding of its gain
    np.testing.assert_allclose(Q(s) * P(s), Z(s), rtol=1e-7, atol=1e-12)
    assert abs(abs(Z(30j)) - 1) < 1e-6 and np.all(abs(Z(s)) < 1 + 1e-9)
    assert Q.D[0, 0] != 0 and max(Q.poles().real) < 0
    default, _ = rt.coupling.inner_factor(P)
    assert abs(default(1j)) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_cascade_realizes_what_it_is_given(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pairs = rng.uniform(0.2, 0.99, 3) * np.exp(1j * rng.uniform(0.1, 3.0, 3))
    zeros = np.concatenate([pairs[:2] * 1.3, pairs[:2].conj() * 1.3, rng.uniform(-2, 2, seed % 4)])
    poles = np.concatenate([pairs, pairs.conj(), rng.uniform(-0.9, 0.9, 3), [1.0, 1.0]])
    system = Zpk(zeros.astype(complex), poles.astype(complex), 3e-7, DT)
    realized = realize(system)
    assert realized.nstates == len(poles)
    z = np.exp(1j * W * DT)
    direct = 3e-7 * np.prod(z[:, None] - zeros, axis=1) / np.prod(z[:, None] - poles, axis=1)
    np.testing.assert_allclose(system.at(W)[100:], direct[100:], rtol=1e-6)  # direct loses digits near z = 1
    np.testing.assert_allclose(Response(realized)(W)[0, 0], system.at(W), rtol=1e-8)


def test_responses_of_a_state_space_with_repeated_poles() -> None:
    a, n = 0.8, 12
    A = np.array([[0.0 if j > i else a if i == j else (1 - a * a) * (-a) ** (i - j - 1) for j in range(n)]
                  for i in range(n)])
    B = np.array([[np.sqrt(1 - a * a) * (-a) ** i] for i in range(n)])
    C = np.random.default_rng(0).normal(size=(2, n))
    system = control.StateSpace(A, B, C, np.zeros((2, 1)), 0.01)
    w = np.linspace(0, 314, 40)
    expected = np.stack([C @ np.linalg.solve(np.exp(0.01j * x) * np.eye(n) - A, B) for x in w], axis=-1)
    np.testing.assert_allclose(Response(system)(w), expected, rtol=1e-9)


def test_coprime_factors_of_stages_with_integrators(pair: Pair) -> None:
    f = rt.coupling.coprime((pair.P1, pair.P2), (pair.C1, pair.C2))
    factors = {name: getattr(f, name) for name in ("Np", "Dp", "Nk", "Dk", "L", "W")}
    for name, factor in factors.items():
        assert max(abs(factor.poles())) < 1, name
    values = {name: Response(factor)(W) for name, factor in factors.items()}
    for k, (P, C) in enumerate(((pair.P1, pair.C1), (pair.P2, pair.C2))):
        high = W > 30  # python-control's own response loses digits below
        np.testing.assert_allclose((values["Np"][k, k] / values["Dp"][k, k])[high], at(P, W)[high], rtol=1e-5)
        np.testing.assert_allclose((values["Nk"][k, k] / values["Dk"][k, k])[high], at(C, W)[high], rtol=1e-5)
    unimodular = np.moveaxis(np.block([[values["Dp"].transpose(2, 0, 1), -values["Nk"].transpose(2, 0, 1)],
                                       [values["Np"].transpose(2, 0, 1), values["Dk"].transpose(2, 0, 1)]]), 0, 0)
    assert np.min(np.abs(np.linalg.det(unimodular))) > 0
    proof = f.bezout()
    assert f.residual < 1e-9 and f.Np.dt == DT and proof.holds and rt.verify(proof).valid
    assert not f.bezout(bound=1e-6 * f.residual).holds  # `residual` is rounding of the responses by now


def test_coprime_inverse_of_the_double_matrix_is_stable(random_pair: Callable[[int], Pair]) -> None:
    p = random_pair(3)
    f = rt.coupling.coprime((p.P1, p.P2), (p.C1, p.C2))
    E = np.block([[f.Dp.D, -f.Nk.D], [f.Np.D, f.Dk.D]])
    A = np.zeros((0, 0))
    B, C = np.zeros((0, 4)), np.zeros((4, 0))
    for part, rows, columns, sign in ((f.Dp, 0, 0, 1), (f.Nk, 0, 2, -1), (f.Np, 2, 0, 1), (f.Dk, 2, 2, 1)):
        n = part.nstates
        widened_B, widened_C = np.zeros((n, 4)), np.zeros((4, n))
        widened_B[:, columns : columns + 2], widened_C[rows : rows + 2] = part.B, sign * part.C
        A = np.block([[A, np.zeros((len(A), n))], [np.zeros((n, len(A))), part.A]])
        B, C = np.vstack([B, widened_B]), np.hstack([C, widened_C])
    zeros = np.linalg.eigvals(A - B @ np.linalg.solve(E, C))
    assert max(abs(zeros)) < 1 - 1e-6


def test_unstable_plant_and_controller_in_continuous_time() -> None:
    P = control.tf([1], [1, -1])  # pole at +1
    C = control.tf([20, 40], [1, 0])  # integrator
    f = rt.coupling.coprime((P, P), (C, C), cutoff=50.0)
    s = 1j * np.geomspace(0.01, 100, 50)
    np.testing.assert_allclose([f.Np(x)[0, 0] / f.Dp(x)[0, 0] for x in s], P(s), rtol=1e-9)
    np.testing.assert_allclose([f.Nk(x)[1, 1] / f.Dk(x)[1, 1] for x in s], C(s), rtol=1e-9)
    assert f.residual < 1e-9


def test_two_by_two_systems_and_pairs_are_the_same(pair: Pair) -> None:
    P0, K0 = control.append(pair.P1, pair.P2), control.append(pair.C1, pair.C2)
    one, two = rt.coupling.coprime(P0, K0), rt.coupling.coprime((pair.P1, pair.P2), (pair.C1, pair.C2))
    np.testing.assert_allclose(Response(one.Dp)(W), Response(two.Dp)(W), rtol=1e-6, atol=1e-6)


def test_a_stable_controller_keeps_the_denominator_one(random_pair: Callable[[int], Pair]) -> None:
    p = random_pair(0)
    f = rt.coupling.coprime((p.P1, p.P2), (p.C1, p.C2))  # (6.9)
    assert f.Dk.nstates == 0
    np.testing.assert_array_equal(f.Dk.D, np.eye(2))


def test_slow_poles_are_no_integrators() -> None:
    slow = np.array([1 - 1e-5, 1 - 2e-5, 1 - 2.5e-5])  # thermal time constants, sampled fast
    plant = zpk_of(control.zpk([], slow, 1e-12, dt=0.01), "P", 0.01)
    assert np.all(plant.poles.real < 1)
    sampled = control.sample_system(control.ss([[0, 1], [0, 0]], [[0], [1]], [[1, 0]], 0), 0.01)
    turned = np.array([[0.6, 0.8], [-0.8, 0.6]])
    body = control.ss(turned @ sampled.A @ turned.T, turned @ sampled.B, sampled.C @ turned.T, 0, 0.01)
    assert np.any(np.linalg.eigvals(body.A) != 1.0)
    np.testing.assert_array_equal(zpk_of(body, "P", 0.01).poles, [1.0, 1.0])
    stiff = zpk_of(control.tf([1], np.poly([-1e-5, -1e6])), "P", 0.0)  # a slow lump beside fast electronics
    assert np.all(stiff.poles.real < 0)
