"""Mixed synthesis and regions: brute force over first-order controllers, floors, evaluated norms, refusals."""

from __future__ import annotations

import control
import numpy as np
import pytest
from plants import norm, random_plant, scherer

import robthermal as rt
from robthermal.errors import InputError
from robthermal.linear import read_plant

ONE = control.ss([[1.0]], [[1, 0, 1]], [[1], [0], [1]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]])  # x' = x + w1 + u


def h2_of(P, K, outputs=None, inputs=None):
    """H2 norm of python-control's loop by a gramian; infinity where it is not stable."""
    loop = P.lft(K)
    B = loop.B if inputs is None else loop.B[:, inputs]
    C = loop.C if outputs is None else loop.C[outputs]
    dt = loop.dt or 0.0
    poles = loop.poles()
    if (abs(poles) >= 1).any() if dt else (poles.real >= 0).any():
        return np.inf
    W = control.dlyap(loop.A, B @ B.T) if dt else control.lyap(loop.A, B @ B.T)
    D = loop.D if outputs is None else loop.D[outputs]
    return float(np.sqrt(np.trace(C @ W @ C.T) + (np.sum((D if inputs is None else D[:, inputs])**2) if dt else 0)))


def brute_force(limit):
    """Smallest H2 norm of all K = g/(s - a) with an H-infinity norm below the limit, on grids."""
    w = np.concatenate([[0.0], np.geomspace(1e-2, 1e3, 200)])
    s, best = 1j * w, np.inf
    for a in -np.geomspace(2, 40, 30):
        for g in -np.geomspace(4, 400, 60):
            if a + 1 >= 0 or -a + g >= 0 or np.roots([1, -1 - a, a - g]).real.max() >= 0:
                continue
            K = g / (s - a)
            L = 1 / (s - 1 - K)  # x = L (w1 + K w2), u = K (x + w2)
            T = np.array([[L, L * K], [K * L, K * (1 + L * K)]]).transpose(2, 0, 1)
            if np.linalg.norm(T, 2, axis=(1, 2)).max() < limit:
                best = min(best, h2_of(ONE, control.ss([[a]], [[1.0]], [[g]], 0)))
    return best


def proven(d, P, limit):
    """Certificates verify, speak of the controller returned, and python-control's norms agree."""
    first, second = d.certificates[:2]
    same = all(np.array_equal(np.asarray(c.system["controller"]["A"]).reshape(d.controller.A.shape), d.controller.A)
               for c in d.certificates)
    return bool(d.holds and same and all(rt.verify(c).valid for c in d.certificates) and
                first.region["bound"] == d.value and second.region["bound"] == limit
                and h2_of(P, d.controller) < d.value and norm(P, d.controller) < limit)


@pytest.mark.parametrize("limit", [3.3, 4.0])
def test_close_to_brute_force(limit):
    d = rt.design.mixed(ONE, 1, 1, hinf_limit=limit)
    assert proven(d, ONE, limit) and d.lower == pytest.approx(4.060207, rel=1e-5)
    assert d.value < 1.06 * brute_force(limit)


def test_a_wide_limit_gives_the_h2_controller_and_a_small_one_none():
    wide = rt.design.mixed(ONE, 1, 1, hinf_limit=6.0)
    assert proven(wide, ONE, 6.0) and wide.value == pytest.approx(wide.lower, rel=1e-4)
    none = rt.design.mixed(ONE, 1, 1, hinf_limit=2.7)
    assert not none.holds and not none.certificates and np.isinf(none.value)
    assert "hinf_limit = 2.7: the best achievable is about 2.73" in none.outcome.text
    assert not none.controller.D.any()


def test_example_7_never_worse_than_the_central_controller():
    """Channels of the paper: H2 of (x2, x3, u), H-infinity of (x1, u)."""
    own = scherer()
    P = control.ss(own.A, own.B, np.vstack([np.eye(3), np.zeros((1, 3)), own.C[2:]]),
                   [[0, 0], [0, 0], [0, 0], [0, 1], [2, 0]])
    values = []
    for limit in (10.0, 14.0, 23.6):
        d = rt.design.mixed(P, 1, 1, hinf_limit=limit, h2=([1, 2, 3], [0]), hinf=([0, 3], [0]))
        central = rt.design.hinf(scherer(), 1, 1, gamma=limit)
        assert d.holds and all(rt.verify(c).valid for c in d.certificates)
        assert norm(own, d.controller) < limit and h2_of(P, d.controller, [1, 2, 3], [0]) < d.value
        assert d.value <= h2_of(P, central.controller, [1, 2, 3], [0]) * 1.0001
        values.append(d.value)
    assert values[0] > values[1] > values[2] == pytest.approx(7.7484, rel=1e-4)


def test_sampled_plant():
    P = random_plant(1, 3, dt=0.5)
    best = rt.design.hinf(P, 2, 2)
    d = rt.design.mixed(P, 2, 2, hinf_limit=1.2 * best.value)
    assert proven(d, P, 1.2 * best.value) and d.value > rt.design.h2(P, 2, 2).lower * (1 - 1e-9)


@pytest.mark.parametrize("region", [{"damping": 0.5, "radius": 30.0}, {"decay": 0.5, "damping": 0.7}])
def test_regions_are_reached(region):
    """The central controller of this plant has neither."""
    P = scherer()
    for d in (rt.design.hinf(P, 1, 1, region=region), rt.design.mixed(P, 1, 1, hinf_limit=40.0, region=region)):
        loop = P.lft(d.controller).poles()
        assert d.holds and all(rt.verify(c).valid for c in d.certificates)
        assert d.certificates[-1].region["measure"] == "region" and norm(P, d.controller) < 40.0
        assert (loop.real < -region.get("decay", 0.0)).all() and (abs(loop) < region.get("radius", np.inf)).all()
        assert (-loop.real > region["damping"] * abs(loop)).all()


def test_a_mutant_of_the_controller_is_rejected():
    d = rt.design.mixed(ONE, 1, 1, hinf_limit=4.0)
    worse = control.ss(d.controller.A, d.controller.B, 0.8 * d.controller.C, d.controller.D)
    for c in d.certificates:
        system = dict(c.system) | {"controller": {key: getattr(worse, key) for key in "ABCD"}}
        made = rt.verification.establish("closed_loop", system=system, region=c.region, evidence=c.evidence, margin={},
                                         made_by={})
        assert not made.holds
    assert read_plant(worse).C.any()


@pytest.mark.parametrize(("arguments", "words"), [
    ({"hinf_limit": -1.0}, "hinf_limit"), ({"hinf_limit": 3.0, "h2": ([0, 0], [1])}, "h2 = "),
    ({"hinf_limit": 3.0, "hinf": ([0], [2])}, "from 0 to 1"), ({"hinf_limit": 3.0, "hinf": [0]}, "hinf = "),
    ({"hinf_limit": 3.0, "region": {"speed": 1.0}}, "region = ")])
def test_bad_input(arguments, words):
    with pytest.raises(InputError, match=words):
        rt.design.mixed(ONE, 1, 1, **arguments)
