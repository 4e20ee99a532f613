"""Normalized coprime factors against their definition and published margins; sampled filters."""

import control
import numpy as np
import pytest

import robthermal as rt


def random_plant(rng: np.random.Generator, dt: float) -> control.StateSpace:
    n, m, p = (int(rng.integers(1, high)) for high in (6, 4, 4))
    return control.ss(rng.normal(size=(n, n)), rng.normal(size=(n, m)), rng.normal(size=(p, n)),
                      rng.normal(size=(p, m)), dt)


@pytest.mark.parametrize("dt", [0, 0.1])
@pytest.mark.parametrize("side", ["right", "left"])
def test_factors_are_inner_stable_and_give_the_plant(dt: float, side: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(10):
        P = random_plant(rng, dt)
        f = rt.coupling.normalized(P, side)
        poles = f.M.poles()
        assert (np.abs(poles) < 1).all() if dt else (poles.real < 0).all()
        for w in (0.0, 0.3, 2.0, 20.0):
            at = np.exp(1j * w * dt) if dt else 1j * w
            N, M, G = (np.atleast_2d(part(at, squeeze=False)) for part in (f.N, f.M, P))
            if side == "right":
                square, plant = N.conj().T @ N + M.conj().T @ M, N @ np.linalg.inv(M)
            else:
                square, plant = N @ N.conj().T + M @ M.conj().T, np.linalg.inv(M) @ N
            np.testing.assert_allclose(square, np.eye(len(square)), atol=1e-9)
            np.testing.assert_allclose(plant, G, atol=1e-8 * (1 + np.abs(G).max()))


def test_published_margin_of_a_shaped_plant() -> None:
    s = control.tf("s")  # Glover and McFarlane's example, published gamma 2.34
    shaped = 200 / ((10 * s + 1) * (0.05 * s + 1) ** 2) * (s + 2) / (s + 1e-6)
    for side in ("right", "left"):
        assert 1 / rt.coupling.normalized(shaped, side).margin == pytest.approx(2.34, abs=0.005)


def test_hidden_unstable_mode_is_refused() -> None:
    hidden = control.ss(np.diag([1.0, -1.0]), [[0.0], [1.0]], [[1.0, 1.0]], 0)
    with pytest.raises(rt.InputError, match="Riccati"):
        rt.coupling.normalized(hidden)


def test_sampled_filters_are_judged_again() -> None:
    P, C = control.tf([1], [1, 1]), control.tf([5], [1])
    slow = rt.coupling.evaluate(P, P, C, C, X_hat=control.tf([-1], [0.1, 1]), Y_hat=0, cutoff=100.0)
    Pd, Cd = control.c2d(P, 0.001), control.tf([5], [1], 0.001)
    sampled = rt.coupling.discretize(slow, Pd, Pd, Cd, Cd)
    assert sampled.holds and sampled.certificates and all(rt.verify(cert).valid for cert in sampled.certificates)
    for w in (0.1, 5.0):  # far below the sample frequency they do the same
        assert abs(sampled.X_hat(np.exp(1j * w * 0.001)) - slow.X_hat(1j * w)) < 1e-4
    with pytest.raises(rt.InputError, match="sampled already"):
        rt.coupling.discretize(sampled, Pd, Pd, Cd, Cd)
    with pytest.raises(rt.InputError, match="argument P1"):
        rt.coupling.discretize(slow, P, P, C, C)
