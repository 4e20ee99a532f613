"""Makers of certificates for linear systems: published norms, closed forms, simulated gains, refusals."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from scipy.linalg import expm

import robthermal as rt
from robthermal.errors import InputError
from robthermal.linear import hinf_norm, interval_norms, interval_radii

# python-control control/tests/sysnorm_test.py, values computed in MATLAB
A3 = [[-1.017041847539126, -0.224182952826418, 0.042538079149249],
      [-0.310374015319095, -0.516461581407780, -0.119195790221750],
      [-1.452723568727942, 1.7995860837102088, -1.491935830615152]]
B3 = [[0.312858596637428, -0.164879019209038], [-0.864879917324456, 0.627707287528727],
      [-0.030051296196269, 1.093265669039484]]
C3 = [[1.109273297614398, 0.077359091130425, -1.113500741486764],
      [-0.863652821988714, -1.214117043615409, -0.006849328103348]]


@pytest.mark.parametrize("sample", [None, 0.1])
def test_published_norm_of_a_third_order_system(sample):
    system = control.ss(A3, B3, C3, np.zeros((2, 2)))
    system = system if sample is None else control.sample_system(system, sample)
    norm, _ = hinf_norm(system)
    assert norm == pytest.approx(4.276759162964244, rel=1e-6)
    gain = rt.certify.hinf(system)
    assert gain.holds and 4.27675916 < gain.upper < 1.0051 * 4.27675917
    assert rt.verify(gain.certificate).valid and "proven" in str(gain)
    assert not rt.certify.hinf(system, 4.2763).holds


def test_lightly_damped_peak_is_found_and_proven():
    G = control.ss(control.tf([1], [1, 2e-6, 1]))
    gain = rt.certify.hinf(G)
    assert gain.holds and gain.lower == pytest.approx(5e5, rel=1e-6) and gain.upper < 1.0051 * 5e5
    assert gain.frequency == pytest.approx(1, abs=1e-6)


def test_scalings_are_part_of_the_claim():
    G = control.ss(A3, B3, C3, np.zeros((2, 2)))
    L, R = np.diag([2.0, 1.0]), np.array([[1.0, 0.5], [0.0, 3.0]])
    gain = rt.certify.hinf(G, left=L, right=R)
    direct = hinf_norm(control.ss(A3, B3 @ np.linalg.inv(R), L @ C3, np.zeros((2, 2))))[0]
    assert gain.holds and direct < gain.upper < 1.006 * direct


def test_unstable_systems_and_integrators_are_refused():
    for A, dt in (([[0.0]], 0), ([[1e-9]], 0), ([[1.0]], 0.1), ([[-1.0]], 0.1)):
        G = control.ss(A, [[1.0]], [[1.0]], [[0.0]], dt)
        assert not rt.certify.stability(G).holds
        assert not rt.certify.hinf(G).holds and not rt.certify.hinf(G, 1e9).holds
        assert not rt.certify.peak(G).holds and rt.certify.peak(G).upper == math.inf
        assert not rt.certify.frequency_norm(G, [0, np.inf], 1e9).holds
        with pytest.raises(InputError, match="not stable"):
            hinf_norm(G)
    hidden = control.ss([[-1.0, 0.0], [0.0, 0.5]], [[1.0], [0.0]], [[1.0, 0.0]], [[0.0]])
    assert not rt.certify.hinf(hidden).holds  # no input drives the unstable mode, no output sees it


def test_random_systems_are_proven_within_half_a_per_cent():
    rng = np.random.default_rng(3)
    for trial in range(8):
        n, dt = 5, 0.1 * (trial % 2)
        A = rng.standard_normal((n, n))
        poles = np.linalg.eigvals(A)
        A = 0.98 * A / abs(poles).max() if dt else A - (poles.real.max() + 0.02) * np.eye(n)
        G = control.ss(A, rng.standard_normal((n, 2)), rng.standard_normal((3, n)), rng.standard_normal((3, 2)), dt)
        gain = rt.certify.hinf(G)
        omega = np.append(0, np.geomspace(1e-3, math.pi / dt if dt else 1e3, 4000))
        values = np.moveaxis(G(np.exp(1j * omega * dt) if dt else 1j * omega), -1, 0)
        grid = np.linalg.norm(values, 2, axis=(1, 2)).max()
        assert gain.holds and grid * (1 - 1e-9) <= gain.lower < gain.upper <= 1.0051 * gain.lower
        assert rt.certify.stability(G).holds


def test_peak_gain_lies_above_the_worst_input():
    """SISO: the peak gain is the integral (sum) of the absolute impulse response."""
    rng = np.random.default_rng(8)
    for trial in range(6):
        dt = 0.1 * (trial % 2)
        A = np.array([[-0.1, 1.0], [-1.0, -0.3]]) + 0.1 * rng.standard_normal((2, 2))
        A = expm(A * 0.5) if dt else A
        B, C, D = rng.standard_normal((2, 1)), rng.standard_normal((1, 2)), rng.standard_normal((1, 1))
        if dt:
            truth = abs(D[0, 0]) + sum(abs((C @ np.linalg.matrix_power(A, k) @ B)[0, 0]) for k in range(600))
        else:
            step = expm(A * 0.01)
            x, truth = B, abs(D[0, 0])
            for _ in range(20_000):
                x, before = step @ x, x
                truth += 0.005 * (abs((C @ x)[0, 0]) + abs((C @ before)[0, 0]))
        gain = rt.certify.peak(control.ss(A, B, C, D, dt))
        assert gain.holds and truth * 0.9999 < gain.upper < 2.5 * truth
        assert gain.lower <= truth * 1.0001
    assert rt.verify(gain.certificate).valid


def test_positive_thermal_network_has_its_steady_gain():
    G = control.ss([[-3.0, 1.0], [2.0, -4.0]], [[1.0], [0.0]], [[0.0, 1.0]], [[0.0]])
    gain = rt.certify.peak(G)
    assert gain.holds and gain.upper == pytest.approx(0.2, rel=1e-9)  # 2/(12 - 2)


def test_interval_estimates_are_provable_bounds():
    rng = np.random.default_rng(6)
    G = control.ss(control.tf([1, 0.1, 4], np.polymul([1, 0.01, 1], [1, 0.3, 9])))
    edges = np.concatenate([[0], np.geomspace(0.2, 20, 30), [np.inf]])
    tops = interval_norms(G, edges)
    assert rt.certify.frequency_norm(G, edges, 1.001 * tops).holds
    assert not rt.certify.frequency_norm(G, edges, 0.999 * tops).holds
    two = control.ss(A3, B3, C3, np.zeros((2, 2)))
    R = rng.uniform(0, 1, (31, 2, 2))
    radius = interval_radii(two, edges, R).max()
    assert rt.certify.frequency_radius(two, edges, R, 1.003 * radius).holds
    assert not rt.certify.frequency_radius(two, edges, R, 0.998 * radius).holds
    left = rng.standard_normal((31, 2, 2)) + 1j * rng.standard_normal((31, 2, 2))
    bounds = 1.002 * interval_norms(two, edges, left=left)
    assert rt.certify.frequency_norm(two, edges, bounds, left=left).holds


@pytest.mark.parametrize(("call", "words"), [
    (lambda G: rt.certify.frequency_norm(G, [0, 1, 2], [1, 1]), "no frequency is left out"),
    (lambda G: rt.certify.frequency_norm(G, [0.1, np.inf], [1]), "no frequency is left out"),
    (lambda G: rt.certify.frequency_norm(G, [0, 2, 1, np.inf], [1, 1, 1]), "increase"),
    (lambda G: rt.certify.frequency_norm(G, [0, np.inf], [1, 2]), "one or 1"),
    (lambda G: rt.certify.frequency_norm(G, [0, np.inf], [1], left=np.zeros((1, 1))), "no inverse"),
    (lambda G: rt.certify.frequency_radius(G, [0, np.inf], [[-1.0]], 1), "zero or above"),
    (lambda G: rt.certify.hinf(G, -1), "positive"),
    (lambda G: rt.certify.stability(G, rate=-1), "rate"),
    (lambda G: rt.certify.stability("G"), "StateSpace"),
    (lambda G: rt.certify.hinf(control.ss(-0.5, 1, 1, 0, True)), "sample time"),
    (lambda G: rt.certify.hinf(control.ss(-0.5, math.nan, 1, 0)), "finite"),
])
def test_bad_input_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call(control.ss(-1.0, 1.0, 1.0, 0.0))


def test_linearized_two_module_system():
    G = rt.thermal.linearize(rt.systems.two_module(), inputs={"m1": 0.5, "m2": 0.5})
    assert rt.certify.stability(G).holds
    one = control.ss(G.A, G.B[:, :1], G.C[:1], G.D[:1, :1])
    gain = rt.certify.hinf(one)
    assert gain.holds and gain.upper < 1.006 * gain.lower
