"""H2 synthesis: published norms, closed forms, impulse responses, brute force, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import control
import numpy as np
import pytest
from plants import generalized, norm, random_plant, scherer
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

import robthermal as rt
from robthermal.errors import InputError

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data" / "compleib"


def h2_of(P, K):
    """H2 norm of python-control's loop by the controllability gramian; infinity where it is not stable."""
    loop = P.lft(K)
    dt = loop.dt or 0.0
    if (abs(loop.poles()) >= 1).any() if dt else (loop.poles().real >= 0).any():
        return np.inf
    driven = loop.B @ loop.B.T
    W = solve_discrete_lyapunov(loop.A, driven) if dt else solve_continuous_lyapunov(loop.A, -driven)
    return float(np.sqrt(np.trace(loop.C @ W @ loop.C.T) + (np.sum(loop.D**2) if dt else 0)))


def proven(d, P):
    c, K = d.certificates[0], d.controller
    same = np.array_equal(np.asarray(c.system["controller"]["B"]).reshape(K.B.shape), K.B)
    return bool(d.holds and same and rt.verify(c).valid and c.region["bound"] == d.value and h2_of(P, K) < d.value)


def doc_plant():
    """Plant of the page of h2syn at MathWorks, D22 not zero: H2 norm 877.5182, H-infinity optimum 196.1132."""
    return control.ss([[5, 6, -6], [6, 0, 5], [-6, 5, 4]], [[0, 4, 0, 0], [1, 1, -2, -2], [4, 0, 0, -3]],
                      [[-6, 0, 8], [0, 5, 0], [-2, 1, -4], [4, -6, -5], [0, -15, 7]],
                      [[0, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0], [0, 0, 3, 6], [8, 0, -7, 0]])


def test_page_of_h2syn():
    P = doc_plant()
    d = rt.design.h2(P, 2, 1)
    assert d.value == pytest.approx(877.5182, rel=2e-5) and proven(d, P)
    printed = [-31.6236, -12.6460 - 3.8045j, -12.6460 + 3.8045j, -9.6073, -9.2393, -8.6939]
    assert np.sort_complex(d.closed_loop.poles()) == pytest.approx(np.sort_complex(printed), abs=2e-4)
    best = rt.design.hinf(P, 2, 1)
    assert 196.1132 * (1 - 1e-6) < best.value < 1.005 * 196.1132 and norm(P, best.controller) < best.value


def test_published_norms():
    """Example 7 of Scherer, Gahinet and Chilali, output (x2, x3, u); a test of RobustAndOptimalControl.jl."""
    P = generalized([[0, 10, 2], [-1, 1, 0], [0, 2, -5]], [[1], [0], [1]], [[0], [1], [0]],
                    [[0, 1, 0], [0, 0, 1], [0, 0, 0]], [[0, 1, 0]], np.zeros((3, 1)), [[0], [0], [1]], [[2]])
    d = rt.design.h2(P, 1, 1)
    assert d.value == pytest.approx(7.748351, rel=2e-5) and d.value > 7.748351 * (1 - 1e-6) and proven(d, P)
    assert norm(scherer(), d.controller) == pytest.approx(23.5873, rel=5e-4)  # to x1 and u
    B1 = np.array([[0, 0], [1, 0], [0, 0]])
    P = generalized([[-1, 0, 4], [0, 2, 0], [0, 0, -3]], B1, np.ones((3, 1)), B1.T, np.ones((1, 3)), np.zeros((2, 2)),
                    [[0], [1]], [[0, 1]])
    d = rt.design.h2(P, 1, 1)
    assert d.value == pytest.approx(8.9582, abs=2e-4) and proven(d, P)


def test_sampled_optimum_of_one_state():
    """x+ = a x + w1 + u, z = (x, r u), y = x + s w2: brute force over all first-order controllers with direct gain."""
    a, r, s = 1.3, 0.5, 0.7
    P = generalized([[a]], [[1, 0]], [[1]], [[1], [0]], [[1]], np.zeros((2, 2)), [[0], [r]], [[0, s]], dt=1.0)
    d = rt.design.h2(P, 1, 1)
    assert proven(d, P)
    rng, best = np.random.default_rng(0), d.controller
    found = []
    for size in (1e-3, 1e-2, 0.1, 0.5):
        for _ in range(150):
            parts = [part + size * rng.standard_normal(part.shape) for part in (best.A, best.B, best.C, best.D)]
            found.append(h2_of(P, control.ss(*parts, 1.0)))
    assert d.lower * (1 - 1e-9) <= min(found) < 1.01 * d.lower


@pytest.mark.parametrize("dt", [0.0, 0.1])
@pytest.mark.parametrize("seed", range(3))
def test_no_random_controller_does_better(seed, dt):
    P = random_plant(seed, dt=dt)
    if not dt:
        D = np.array(P.D)
        D[:4, :4] = 0
        P = control.ss(P.A, P.B, P.C, D)
    d = rt.design.h2(P, 2, 2)
    assert proven(d, P) and d.value < d.lower * 1.01
    rng, K = np.random.default_rng(seed), d.controller
    for size in (1e-3, 1e-2):
        for _ in range(20):
            change = [part + size * abs(part).max() * rng.standard_normal(part.shape) for part in (K.A, K.B, K.C)]
            D = K.D + size * rng.standard_normal(K.D.shape) if dt else K.D
            assert h2_of(P, control.ss(*change, D, dt)) > d.lower * (1 - 1e-9)


def test_fast_sampling_approaches_the_continuous_norm():
    """With every input held for T, √T times the sampled norm of the noise of intensity 1/T tends to the norm."""
    P = generalized([[1.0]], [[1, 0]], [[1]], [[1], [0]], [[1]], np.zeros((2, 2)), [[0], [1]], [[0, 1]])
    exact = np.sqrt((1 + np.sqrt(2)) + (1 + np.sqrt(2)) ** 3)
    assert rt.design.h2(P, 1, 1).value == pytest.approx(exact, rel=2e-5)
    for T in (0.01, 0.001):
        d = rt.design.h2(P, 1, 1, sample_time=T)
        assert d.holds and d.value == pytest.approx(exact * np.sqrt(1 / T) * T / np.sqrt(T) * np.sqrt(T), rel=20 * T)


def test_direct_path():
    """w reaches z directly: refused where no gain cancels it, designed for where D12 and D21 reach it exactly."""
    parts = ([[1.0]], [[1, 0]], [[1]], [[1], [0]], [[1]])
    with pytest.raises(InputError, match="direct path from disturbance 0 to performance output 0"):
        rt.design.h2(generalized(*parts, [[1, 0], [0, 0]], [[0], [1]], [[0, 1]]), 1, 1)
    P = generalized(*parts, [[0, 0], [0, 2]], [[0], [1]], [[0, 1]])
    d = rt.design.h2(P, 1, 1)
    assert proven(d, P) and d.controller.D[0, 0] == -2
    P = generalized(*parts, [[0, 0], [0, 1.1]], [[0], [0.3]], [[0, 0.7]])
    d = rt.design.h2(P, 1, 1)
    assert d.holds or ("to rounding" in d.outcome.text and d.value == np.inf)


@pytest.mark.parametrize("dt", [0.0, 0.5])
def test_missing_weights(dt):
    """No control weight: what is proven is proven of P, and cheap control never does worse than dear control."""
    a = 0.5 if dt else -1.0
    P = generalized([[a]], [[1, 0]], [[1]], [[1], [0]], [[1]], np.zeros((2, 2)), [[0], [0]], [[0, 1]], dt=dt)
    dear = generalized([[a]], [[1, 0]], [[1]], [[1], [0]], [[1]], np.zeros((2, 2)), [[0], [0.3]], [[0, 1]], dt=dt)
    d = rt.design.h2(P, 1, 1)
    assert proven(d, P) and d.value < rt.design.h2(dear, 1, 1).value


def test_weak_controllers_are_not_called_certified(monkeypatch):
    """A claim below what the loop reaches is never made: with the norm in floats too small nothing holds."""
    monkeypatch.setattr("robthermal.synthesis._h2.h2_norm", lambda loop: 0.9 * 877.5182)
    d = rt.design.h2(doc_plant(), 2, 1)
    assert not d.holds and d.value == np.inf and not d.certificates


def test_hidden_modes_are_named():
    P = control.ss([[0.3, 0], [0, -1]], [[1, 0, 0], [0, 1, 1]], [[1, 0], [0, 1], [1, 1]],
                   [[0, 0, 1], [0, 0, 0], [0, 1, 0]])
    with pytest.raises(InputError, match=r"not stabilisable: the mode at \+0.3 1/s"):
        rt.design.h2(P, 1, 1)


@pytest.mark.skipif(not SHARED.is_dir(), reason="no COMPleib models beside the project")
@pytest.mark.parametrize("name", ["NN1", "AC15", "HF2D10", "DIS5", "AC8"])
def test_models_of_compleib(name):
    data, reference = np.load(SHARED / "compleib.npz"), json.loads((SHARED / "reference.json").read_text())[name]
    A, B1, B, C1, C, D11, D12, D21 = (data[f"{name}.{key}"] for key in ("A", "B1", "B", "C1", "C", "D11", "D12", "D21"))
    n, m, p, eps = len(A), B.shape[1], len(C), reference["eps"]
    P = generalized(A, np.hstack([B1, np.zeros((n, p))]), B, np.vstack([C1, np.zeros((m, n))]), C,
                    np.pad(D11, ((0, m), (0, p))), np.vstack([D12, eps * np.eye(m)]), np.hstack([D21, eps * np.eye(p)]))
    d = rt.design.h2(P, p, m)
    assert d.holds and reference["h2"] * (1 - 1e-6) < d.value < reference["h2"] * 1.002


def test_only_a_bound_of_singular_values_is_drawn_beside_them() -> None:
    """An H2 norm is no bound of the curve; an H-infinity norm is, and no point of the curve lies above it."""
    labels = {}
    for synthesis in (rt.design.h2, rt.design.hinf):
        ax = synthesis(scherer(), 1, 1).plot()
        labels[synthesis] = [line.get_label() for line in ax.get_lines()]
    assert labels[rt.design.h2] == ["closed loop"] and labels[rt.design.hinf] == ["closed loop", "proven bound"]
    curve, bound = (np.asarray(line.get_ydata(), float) for line in ax.get_lines())
    assert curve.max() <= bound[0] <= 1.01 * curve.max()
