"""Networks of two lumps with one wild module: what is proven at most, against a dense grid of the box."""

from __future__ import annotations

import certificate_truth as truth
import numpy as np
import pytest

from robthermal.verification import establish


def wild(rng):
    """Two lumps whose module may have S, R, K and slopes of either sign, in a box that may be a point."""
    def sign():
        return float(rng.choice([-1, 1, 1]))

    module = {"hot": "a", "cold": "b", "reference_temperature": round(float(rng.uniform(280, 340)), 1),
              "seebeck": {"value": sign() * 0.05, "slope": sign() * round(float(rng.uniform(0, 3e-4)), 6)},
              "resistance": {"value": sign() * 4.0, "slope": sign() * round(float(rng.uniform(0, 0.5)), 3)},
              "conductance": {"value": sign() * 0.3, "slope": sign() * round(float(rng.uniform(0, 5e-3)), 5)}}
    links = [{"between": [name, "room"], "conductance": round(float(rng.uniform(2, 9)), 2)} for name in ("a", "b")]
    links.append({"between": ["b", "a"], "conductance": round(float(rng.uniform(0, 2)), 2)})
    system = {"lumps": {"a": {"capacity": 7.0}, "b": {"capacity": 2.0}}, "ambients": ["room"], "links": links,
              "modules": {"m": module}}
    ranges = {name: sorted(rng.uniform(270, 350, 2).round(1).tolist()) for name in "ab"}
    current = sorted(rng.uniform(-3, 3, 2).round(2).tolist()) if rng.random() < 0.9 else [1.0, 1.0]
    return system, {"temperature": ranges, "current": {"m": current}}


def dense(system, region):
    """Jacobians at the corners of the temperatures and a fine grid of the current, (count, 2, 2)."""
    found = []
    for a in np.linspace(*region["temperature"]["a"], 3):
        for b in np.linspace(*region["temperature"]["b"], 3):
            low, high = region["current"]["m"]
            J = [truth.jacobian(system, np.array([a, b]), {"m": current}) for current in (low, (low + high) / 2, high)]
            s = np.linspace(0, 1, 201)[:, None, None]  # each entry is a quadratic in the current, through three points
            found.append((2 * s - 1) * (s - 1) * J[0] + 4 * s * (1 - s) * J[1] + s * (2 * s - 1) * J[2])
    return np.concatenate(found)


def true_rate(method, J, w, E):
    """The largest rate for which the inequality of a method holds at all of them."""
    if method == "energy":
        root = np.sqrt(np.outer(E, E))
        return -float(np.linalg.eigvalsh((J + J.transpose(0, 2, 1)) / 2 / root)[:, -1].max())
    size = np.abs(J)
    size[:, [0, 1], [0, 1]] = J[:, [0, 1], [0, 1]]
    size = size if method == "max" else size.transpose(0, 2, 1)
    return -float((size @ w / (E * w)).max())


@pytest.mark.parametrize("method", ["sum", "max", "energy"])
def test_the_proven_rate_is_the_true_one(method):
    """Never above it; for sum, max and energy with R' >= 0 not below it either."""
    rng = np.random.default_rng(8)
    proven = 0
    for _ in range(40):
        system, region = wild(rng)
        E, w = np.array([7.0, 2.0]), np.round(rng.uniform(0.5, 2, 2), 3)
        exact = true_rate(method, dense(system, region), w, E)
        evidence = {"method": method, **({} if method == "energy" else {"weights": w.tolist()})}
        sharp = method != "energy" or system["modules"]["m"]["resistance"]["slope"] >= 0
        for rate, expected in ((exact + 1e-9, False), (exact + 1e-3, False), (exact - 1e-3 * (1 + abs(exact)), sharp)):
            if rate >= 0:
                made = establish("contraction", system=system, region=region, made_by={}, margin={},
                                 evidence={**evidence, "rate": rate})
                assert not made.holds or rate <= exact + 1e-9
                assert made.holds or not expected
                proven += made.holds
    assert proven > 8


def test_the_proven_inward_flow_is_the_true_one():
    rng, s = np.random.default_rng(9), np.linspace(0, 1, 101)
    proven = 0
    for _ in range(40):
        system, region = wild(rng)
        region["temperature"] = {name: [low - 60, high + 30] for name, (low, high) in region["temperature"].items()}
        region["ambient"] = {"room": [290.0, 300.0]}
        least, largest = np.inf, 0.0
        for k, name in enumerate("ab"):
            other = region["temperature"]["ba"[k]]
            for face, sign, room in ((0, 1, 290.0), (1, -1, 300.0)):
                own = region["temperature"][name][face]
                for far in np.linspace(*other, 17):
                    x = np.array([own, far] if k == 0 else [far, own])
                    low, high = region["current"]["m"]
                    q = [sign * truth.heat(system, x, {"m": current}, {"room": room})[k]
                         for current in (low, (low + high) / 2, high)]
                    flow = (2 * s - 1) * (s - 1) * q[0] + 4 * s * (1 - s) * q[1] + s * (2 * s - 1) * q[2]
                    least, largest = min(least, flow.min()), max(largest, np.abs(flow).max())
        cert = establish("invariance", system=system, region=region, evidence={}, made_by={})
        assert not (cert.holds and least < -1e-9)
        if cert.holds:
            assert cert.margin["heat"] <= least
            proven += 1
        assert cert.holds or least < 0.02 * largest  # not much more cautious than the truth
    assert 5 < proven < 36


