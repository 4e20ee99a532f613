"""Ellipsoids under disturbances: Lyapunov equations, impulse responses, worst cases by simulation, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov, solve_discrete_lyapunov

import robthermal as rt
from robthermal.errors import InputError

SLOW, FAST = np.array([[0, 1], [-1.0, -1]]), np.array([[0, 1], [-2.0, -1]])
ONE = np.array([[0.0], [1.0]])
CHAIN, INTO = np.array([[-1.0, 2, 0], [0, -2, 1], [0.5, 0, -3]]), np.array([[1.0, 0], [0, 1], [1, 1]])


def smallest_by_scan(A, B, dt):
    """Least log det Q over the decays: AQ + QA' + αQ + BB'/α = 0, or AQA'/(1 - α) + BB'/α = Q."""
    longest = 1 - np.abs(np.linalg.eigvals(A)).max() ** 2 if dt else -2 * np.linalg.eigvals(A).real.max()
    found = []
    for a in np.linspace(0.01, 0.99, 400) * longest:
        Q = (solve_discrete_lyapunov(A / np.sqrt(1 - a), B @ B.T / a) if dt else
             solve_continuous_lyapunov(A + a / 2 * np.eye(len(A)), -B @ B.T / a))
        found.append(np.linalg.slogdet(Q)[1])
    return min(found)


@pytest.mark.parametrize(("A", "B", "dt"), [(SLOW, ONE, 0.0), (expm(0.3 * SLOW), 0.3 * ONE, 0.3),
                                            (CHAIN, INTO, 0.0)])
def test_one_plant_has_the_volume_of_its_lyapunov_equation(A, B, dt):
    e = rt.design.invariant_ellipsoid(A, B, sample_time=dt)
    assert e.holds and rt.verify(e.certificates[0]).valid
    own = -np.linalg.slogdet(e.matrix)[1]
    assert own == pytest.approx(smallest_by_scan(A, B, dt), abs=5e-3)


def test_extents_are_near_what_is_really_reached():
    """The peak of a state is the integral of its impulse response; the ellipsoid is larger, at most twice."""
    e = rt.design.invariant_ellipsoid(SLOW, ONE, disturbance=0.5)
    t = np.linspace(0, 30, 3001)
    peaks = 0.5 * np.trapezoid(np.abs([expm(SLOW * s) @ ONE[:, 0] for s in t]), t, axis=0)
    assert (e.extent > peaks).all() and (e.extent < 2 * peaks).all()


@pytest.mark.parametrize("together", [True, False])
def test_the_worst_disturbance_on_the_worst_plant_does_not_leave_the_set(together):
    """Greedy: at every moment the vertex and the disturbance that raise x'Px fastest."""
    B = np.array([[0.3, 0.0], [1.0, 0.5]])
    e = rt.design.invariant_ellipsoid([SLOW, FAST], B, disturbance=1.0 if together else [1.0, 0.4])
    assert e.holds and e.level == 1.0
    x, h, largest = np.zeros(2), 0.004, 0.0
    x[:] = 1e-3
    for _ in range(6000):
        way = B.T @ e.matrix @ x
        w = way / np.linalg.norm(way) if together else np.array([1.0, 0.4]) * np.sign(way)
        moves = [A @ x + B @ w for A in (SLOW, FAST)]
        x = x + h * max(moves, key=lambda move: x @ e.matrix @ move)
        largest = max(largest, x @ e.matrix @ x)
    assert 0.2 < largest < 1.002  # greedy is not the worst; steps of finite length
    assert e.contains(x * 0.99) and not e.contains(10 * e.extent)


def test_limits_shape_the_set_or_are_named():
    free = rt.design.invariant_ellipsoid(CHAIN, INTO)
    tight = rt.design.invariant_ellipsoid(CHAIN, INTO, limits=[0.96 * free.extent[0], np.inf, np.inf])
    assert tight.holds and tight.extent[0] <= 0.96 * free.extent[0] and tight.extent[1] > free.extent[1]
    assert "1 limit of region table" in tight.certificates[0].claim and "limit" not in free.certificates[0].claim
    rows = rt.design.invariant_ellipsoid([SLOW, FAST], ONE, disturbance=0.5, limits=([[1.0, 1.0]], [3.0]))
    assert rows.holds and np.sqrt(np.ones(2) @ np.linalg.solve(rows.matrix, np.ones(2))) <= 3.0
    far = rt.design.invariant_ellipsoid([SLOW, FAST], ONE, disturbance=0.5, limits=[2.0, 0.1])
    assert not far.holds and "limit 1" in far.outcome.text and not far.certificates and not far.contains([0, 0])


def test_sets_that_do_not_exist_are_never_certified():
    for A in ([[0.01]], [[1.0]]):
        e = rt.design.invariant_ellipsoid(A, [[1.0]])
        assert not e.holds and "vertex 1 is not stable" in e.outcome.text and np.isinf(e.extent).all()
    pair = np.array([[-0.1, 3.0], [0.0, -0.1]])  # both stable, their mean is not
    e = rt.design.invariant_ellipsoid([pair, pair.T], [[1.0], [0.0]])
    assert not e.holds and not e.certificates and not e.semi_axes.size and "hull" in str(e)


@pytest.mark.parametrize(("arguments", "words"), [
    ({"A_vertices": [[1.0, 2.0]]}, "A_vertices"), ({"A_vertices": [[np.nan]]}, "A_vertices"),
    ({"B_vertices": [[1.0, 0.0]]}, "B_vertices"), ({"disturbance": 0.0}, "disturbance"),
    ({"disturbance": [1.0, 2.0]}, "disturbance"), ({"limits": [-1.0, 1.0]}, "limits"),
    ({"limits": ([[1.0]], [1.0])}, "limits"), ({"sample_time": -1.0}, "sample_time"),
    ({"A_vertices": np.repeat(SLOW[None], 65, axis=0)}, "64")])
def test_bad_input(arguments, words):
    with pytest.raises(InputError, match=words):
        rt.design.invariant_ellipsoid(**({"A_vertices": SLOW, "B_vertices": ONE} | arguments))
