"""Anti-windup: the saturated loop integrated, the numbers of the proof exactly, loops that must not be certified."""

from __future__ import annotations

from fractions import Fraction

import control
import numpy as np
import pytest
from plants import norm

import robthermal as rt
from robthermal.errors import InputError
from robthermal.linear import read_plant
from robthermal.synthesis._anti_windup import weighted
from robthermal.synthesis._plant import split

P = control.ss([[-0.1]], [[0.1, 1.0]], [[1.0], [-1.0]], [[0, 0], [0, 0]])  # z = x, y = -x
K = control.ss([[-1e-3]], [[1.0]], [[0.1]], [[0.5]])
TWO = control.ss([[-0.2, 0.3], [-0.1, -0.4]], [[0.2, 0, 1.0, 0.3], [0, 0.2, -0.2, 1.0]], [[1, 0], [0, 1], [-1, 0],
                                                                                         [0, -1]], np.zeros((4, 4)))
K_TWO = control.ss(-1e-3 * np.eye(2), np.eye(2), [[0.2, 0], [0, 0.1]], [[0.5, 0], [0, 0.5]])
SAMPLED = control.ss([[0.9]], [[0.1, 0.5]], [[1.0], [-1.0]], [[0, 0], [0, 0]], 1.0)
K_SAMPLED = control.ss([[0.999]], [[1.0]], [[0.1]], [[0.5]], 1.0)


def gain(plant, K, d, limit, rng):
    """‖z‖/‖w‖ of the saturated loop by steps of its own, for one disturbance that ends."""
    own, dt = d.controller, plant.dt
    n_u = K.noutputs
    m, q = plant.ninputs - n_u, plant.noutputs - K.ninputs
    h = dt or 0.01
    steps, x, xk = int(60 / h) if not dt else 300, np.zeros(plant.nstates), np.zeros(own.nstates)
    shape, z2, w2 = rng.standard_normal((m, 6)), 0.0, 0.0
    for k in range(steps):
        s = k / steps
        w = (shape @ np.cos(np.arange(6) * 6 * s)) * (s < 0.5) * 20
        y = plant.C[q:] @ x
        v = own.C @ xk + own.D[:, :K.ninputs] @ y
        u = np.clip(v, -limit, limit)
        z = plant.C[:q] @ x
        z2, w2 = z2 + h * z @ z, w2 + h * w @ w
        dx = plant.A @ x + plant.B @ np.concatenate([w, u])
        dk = own.A @ xk + own.B @ np.concatenate([y, v - u])
        x, xk = (dx, dk) if dt else (x + h * dx, xk + h * dk)
    return np.sqrt(z2 / w2)


@pytest.mark.parametrize(("plant", "K"), [(P, K), (TWO, K_TWO), (SAMPLED, K_SAMPLED)])
def test_saturated_loops_stay_below_the_gain(plant, K):
    d = rt.design.anti_windup(plant, K, limits=1.0)
    assert d.holds and rt.verify(d.certificates[0]).valid and d.lower < d.value < np.inf
    rng = np.random.default_rng(0)
    seen = [gain(plant, K, d, limit, rng) for limit in (0.01, 0.3, 1.0, 3.0)]
    assert 0.03 < max(seen) < d.value
    assert np.array_equal(d.controller.B[:, :K.ninputs], K.B) and not d.controller.D[:, K.ninputs:].any()


def test_gain_of_the_open_loop_is_close():
    """With small limits the loop is all but open: its gain, 1, is a lower bound, and nearly reached by the proof."""
    d = rt.design.anti_windup(P, K, limits=1.0)
    assert 1.0 < d.value < 1.002 and d.lower == pytest.approx(norm(P, K), rel=1e-3)


def test_numbers_of_the_proof_are_exact():
    """Every entry is one of plant or controller, its half, c or a; a c >= bound in rational numbers."""
    d = rt.design.anti_windup(TWO, K_TWO, limits=[1.0, 2.0])
    system, bound = d.certificates[0].system, Fraction(d.certificates[0].region["bound"])
    n_u, whole = 2, split(read_plant(TWO), 2, 2)
    D_plant, D_K = np.asarray(system["plant"]["D"]), np.asarray(system["controller"]["D"])
    a, c = np.diag(D_plant[2:4, 4:6]), np.diag(D_K[n_u:, -n_u:])
    assert all(Fraction(x) * Fraction(y) >= bound for x, y in zip(a.tolist(), c.tolist(), strict=True))
    E = d.controller.B[:, 2:]
    plant, controller = weighted(whole, read_plant(K_TWO), E, c, a)
    for name in "ABCD":
        assert np.array_equal(np.asarray(system["plant"][name]), getattr(plant, name))
        assert np.array_equal(np.asarray(system["controller"][name]), getattr(controller, name))
    assert np.array_equal(2 * plant.B[:, -n_u:], -whole.B2) and np.array_equal(2 * plant.B[:, 4:6], whole.B2)


def test_the_dead_zone_is_what_the_proof_says():
    """The loop of the certificate with p = 2 q - v put in is the saturated loop: one step of both."""
    d = rt.design.anti_windup(TWO, K_TWO, limits=1.0)
    system = d.certificates[0].system
    plant, own = (control.ss(*(np.asarray(system[key][name]) for name in "ABCD")) for key in ("plant", "controller"))
    rng = np.random.default_rng(1)
    x, xk, w = rng.standard_normal(2), 5 * rng.standard_normal(2), rng.standard_normal(2)
    y = TWO.C[2:] @ x
    v = K_TWO.C @ xk + K_TWO.D @ y
    u = np.clip(v, -1, 1)
    p = v - 2 * u
    assert (abs(p) <= abs(v) + 1e-12).all()
    c = np.diag(own.D[2:, -2:])
    dx = plant.A @ x + plant.B @ np.concatenate([w, p / c, v, p])
    out = plant.C @ x + plant.D @ np.concatenate([w, p / c, v, p])
    assert dx == pytest.approx(TWO.A @ x + TWO.B @ np.concatenate([w, u])) and out[:2] == pytest.approx(x)
    assert out[4:] == pytest.approx(np.concatenate([y, v - u, p / c]))
    assert own.C @ xk + own.D @ out[4:] == pytest.approx(np.concatenate([v, p]))
    moved = d.controller.A @ xk + d.controller.B @ np.concatenate([y, v - u])
    assert own.A @ xk + own.B @ out[4:] == pytest.approx(moved)


UNSTABLE = control.ss([[0.3]], [[0.1, 1.0]], [[1.0], [-1.0]], [[0, 0], [0, 0]])
SADDLE = control.ss([[0.2, 0.3], [-0.1, -0.4]], [[0.2, 0, 1.0, 0.3], [0, 0.2, -0.2, 1.0]],
                    [[1, 0], [0, 1], [-1, 0], [0, -1]], np.zeros((4, 4)))
GROWING = control.ss([[1.1]], [[0.1, 0.5]], [[1.0], [-1.0]], [[0, 0], [0, 0]], 1.0)
K_GROWING = control.ss([[0.95]], [[0.1]], [[0.1]], [[0.9]], 1.0)
REGIONS = ((UNSTABLE, K, 1.0), (SADDLE, K_TWO, [1.0, 0.5]), (GROWING, K_GROWING, 1.0))


@pytest.fixture(scope="module")
def regional():
    return [(plant, own, limits, rt.design.anti_windup(plant, own, limits=limits)) for plant, own, limits in REGIONS]


def steps(plant, own, d, limits, xi, w=None, count=2000):
    """The limited loop from a start, by steps of its own: last states, and energies of z and w."""
    n_u, n, dt, h = own.noutputs, plant.nstates, plant.dt, plant.dt or 0.02
    m, q = plant.ninputs - n_u, plant.noutputs - own.ninputs
    x, xk, z2, w2 = xi[:n].copy(), xi[n:].copy(), 0.0, 0.0
    for k in range(count):
        now = np.zeros(m) if w is None else w(k)
        y = plant.C[q:] @ x
        v = own.C @ xk + own.D @ y
        u = np.clip(v, -np.asarray(limits), limits)
        z = plant.C[:q] @ x
        z2, w2 = z2 + h * z @ z, w2 + h * now @ now
        dx = plant.A @ x + plant.B @ np.concatenate([now, u])
        dk = d.controller.A @ xk + d.controller.B @ np.concatenate([y, v - u])
        x, xk = (dx, dk) if dt else (x + h * dx, xk + h * dk)
    return np.concatenate([x, xk]), z2, w2


def test_every_start_in_the_region_comes_to_rest(regional):
    rng = np.random.default_rng(0)
    assert len(regional) == 3
    for plant, own, limits, d in regional:
        assert d.holds and 0 < d.level < np.inf and d.rate > 0 and d.outcome.code == "certified_region"
        assert [one.kind for one in d.certificates] == ["ellipsoid"] * 2 and all(rt.verify(one).valid
                                                                                 for one in d.certificates)
        assert np.array_equal(d.certificates[0].system["controller"]["windup"], d.controller.B[:, own.ninputs:])
        root, size = np.linalg.inv(np.linalg.cholesky(d.matrix)).T, len(d.matrix)
        for direction in rng.standard_normal((4, size)):
            start = root @ direction / np.linalg.norm(direction) * 0.999
            assert d.contains(start) and not d.contains(1.01 * start)
            last, _, _ = steps(plant, own, d, limits, start)
            assert last @ d.matrix @ last < 0.01


def test_the_region_ends_before_the_limits_lose_the_plant(regional):
    """x' = p x + u, |u| <= 1, grows beyond 1/p whatever is done; x+ = a x + b u beyond b/(a - 1)."""
    for index, edge in ((0, 1 / 0.3), (2, 0.5 / 0.1)):
        d = regional[index][3]
        reach = 1 / np.sqrt(d.matrix[0, 0])
        assert 0.5 * edge < reach < edge, (reach, edge)
        assert np.sqrt(np.linalg.inv(d.matrix)[0, 0]) < edge  # whatever the controller starts from


def test_gains_in_the_region_hold_for_disturbances_of_the_energy(regional):
    rng = np.random.default_rng(1)
    assert len(regional) == 3
    for plant, own, limits, d in regional:
        assert d.lower < d.value < np.inf and 0 < d.energy < np.inf
        m, size, h, worst = plant.ninputs - own.noutputs, len(d.matrix), plant.dt or 0.02, 0.0
        for _ in range(3):
            shape = rng.standard_normal((m, 3))

            def push(k, shape=shape, m=m):
                return shape @ np.cos(np.arange(3) * k / 75) if k < 300 else np.zeros(m)
            scale = np.sqrt(0.98 * d.energy / (h * sum(float(push(k) @ push(k)) for k in range(300))))
            last, z2, w2 = steps(plant, own, d, limits, np.zeros(size),
                                 lambda k, push=push, scale=scale: scale * push(k), 1200)
            assert w2 <= d.energy and z2 <= d.value**2 * w2 and np.abs(last).max() < 1e3
            worst = max(worst, np.sqrt(z2 / w2))
        assert worst > 0.02


def test_an_unstable_plant_is_never_certified_for_every_start():
    for pole in (1e-6, 0.01, 0.3):
        plant = control.ss([[pole]], [[0.1, 1.0]], [[1.0], [-1.0]], [[0, 0], [0, 0]])
        d = rt.design.anti_windup(plant, K, limits=100.0)
        assert "not stable by itself" in d.outcome.text and d.level < np.inf and d.energy < np.inf
        assert d.holds and not d.contains([1.001 * 100.0 / pole, 0.0]) and "in a region" in d.outcome.text
    direct = control.ss([[0.3]], [[0.1, 1.0]], [[1.0], [-1.0]], [[0, 0], [0, 0.1]])
    d = rt.design.anti_windup(direct, K, limits=100.0)
    assert not d.holds and not d.certificates and np.isinf(d.value) and d.level == 0 and not d.contains([0.0, 0.0])
    assert not d.controller.B[:, 1:].any() and "direct path" in d.outcome.text


def test_a_global_design_says_so():
    d = rt.design.anti_windup(P, K, limits=1.0)
    assert d.outcome.code == "certified" and np.isinf(d.level) and np.isinf(d.energy) and d.rate == 0
    assert d.contains([1e6, -1e6])


@pytest.mark.parametrize(("arguments", "words"), [
    ({"limits": 0.0}, "limits"), ({"limits": [1, 2, 3]}, "limits"),
    ({"limits": 1.0, "performance": ([1], [0])}, "performance"),
    ({"limits": 1.0, "K": control.ss([], [], [], [[0.5]])}, "without states"),
    ({"limits": 1.0, "K": control.ss([[-1.0]], [[1.0]], [[-50.0]], 0)}, "does not stabilize"),
    ({"limits": 1.0, "K": K_SAMPLED}, "sample time")])
def test_bad_input(arguments, words):
    with pytest.raises(InputError, match=words):
        rt.design.anti_windup(P, **({"K": K} | arguments))
