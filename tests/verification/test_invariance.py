"""Box invariance against sampled heat flows on the faces, and against simulated trajectories."""

from __future__ import annotations

import certificate_truth as truth
import numpy as np
import pytest

from robthermal.errors import InputError
from robthermal.verification import Certificate, establish, verify


def make(system, region, margin=None):
    return establish("invariance", system=system, region=region, evidence={}, made_by={}, margin=margin)


def region_for(system, rng):
    high = rng.uniform(300, 420, len(system["lumps"]))
    low = rng.uniform(240, 300, len(system["lumps"]))
    top = float(rng.uniform(0.0, 1.0))
    return {"temperature": {name: [float(a), float(b)] for name, a, b in zip(system["lumps"], low, high, strict=True)},
            "current": {name: [-0.3 * top, top] for name in system["modules"]}, "ambient": {"room": [290.0, 300.0]},
            "heat": {next(iter(system["lumps"])): [0.0, 0.5]}}


def worst_outflow(system, region, rng, count):
    """Largest sampled outward heat flow over all faces [W]: above zero the box is left."""
    T, _ = truth.boxes(system, region)
    worst = -np.inf
    for x, currents in truth.points(system, region, rng, count):
        corner = {name: float(rng.choice(span)) for name, span in region["ambient"].items()}
        load = {name: float(rng.choice(span)) for name, span in region["heat"].items()}
        for k in range(len(x)):
            for face, sign in ((1, 1), (0, -1)):
                y = x.copy()
                y[k] = T[k, face]
                worst = max(worst, sign * truth.heat(system, y, currents, corner, load)[k])
    return worst


def test_never_valid_where_a_face_leaks_and_sharp():
    rng = np.random.default_rng(0)
    decided = {True: 0, False: 0}
    for trial in range(60):
        system = truth.random_system(rng, modules=1, nonlinear=trial % 2 == 1, wild=trial % 3 == 2)
        high, low = float(rng.uniform(310, 450)), float(rng.uniform(250, 285))
        region = {**region_for(system, rng), "temperature": [low, high]}
        certificate = make(system, region, {})
        outflow = worst_outflow(system, region, rng, 200)
        if certificate.holds:
            assert outflow <= 1e-9
        decided[certificate.holds] += 1
        if trial % 3 != 2 and abs(outflow) > 1e-6:  # without a nonlinear conductance the bound is exact
            assert certificate.holds == (outflow < 0)
    assert min(decided.values()) > 8


def test_trajectories_stay_in_a_certified_box():
    rng = np.random.default_rng(4)
    system = truth.random_system(rng, modules=1)
    region = {"temperature": [250.0, 400.0], "current": {"m0": [-0.2, 0.6]}, "ambient": {"room": [285.0, 305.0]},
              "heat": {"x0": [0.0, 1.0]}}
    assert make(system, region).holds
    E = np.array([lump["capacity"] for lump in system["lumps"].values()])
    x = rng.choice([250.0, 400.0], len(E))
    for _ in range(3000):
        load, ambient = {"x0": float(rng.choice([0.0, 1.0]))}, {"room": float(rng.choice([285.0, 305.0]))}
        flow = truth.heat(system, x, {"m0": float(rng.choice([-0.2, 0.6]))}, ambient, load)
        x = x + 0.01 * flow / E  # explicit Euler, far below the fastest time constant
        assert np.all(x >= 250.0) and np.all(x <= 400.0)


def test_margin_is_the_least_inward_flow():
    system = {"lumps": {"a": {"capacity": 1.0}}, "ambients": ["room"], "modules": {},
              "links": [{"between": ["room", "a"], "conductance": 0.5}]}
    region = {"temperature": [280, 350], "current": {}, "ambient": {"room": [290, 330]}, "heat": {"a": [-1, 4]}}
    certificate = make(system, region)
    assert verify(certificate).margins["heat"] == 4.0  # below: 0.5 (290 - 280) - 1; above: 0.5 (350 - 330) - 4 = 6
    assert 3.9 < certificate.margin["heat"] < 4.0
    for stored, expected in ((4.0, True), (4.001, False)):
        assert verify(Certificate(**{**vars(certificate), "margin": {"heat": stored}})).valid is expected
    region["heat"] = {"a": [-1, 10.001]}
    refused = make(system, region)
    assert not refused.holds and "'a'" in refused.reason and "upper" in refused.reason


def test_box_that_only_touches_is_invariant():
    """A passive lump between neighbors with the same box: zero flow at the face is allowed (Nagumo)."""
    system = {"lumps": {"a": {"capacity": 1.0}, "b": {"capacity": 1.0}}, "ambients": [], "modules": {},
              "links": [{"between": ["a", "b"], "conductance": 0.5, "natural": {"gain": 0.1, "exponent": 0.25},
                         "radiation": 1e-10}]}
    certificate = make(system, {"temperature": [280, 350], "current": {}, "ambient": {}})
    assert certificate.holds and certificate.margin == {"heat": 0.0}
    wider = {"temperature": {"a": [280, 350], "b": [280, "350.000001"]}, "current": {}, "ambient": {}}
    assert not make(system, wider).holds


@pytest.mark.parametrize(("change", "words"), [
    ({"ambient": {}}, "room"), ({"ambient": {"room": [300, 290]}}, "empty"), ({"ambient": {"room": [0, 290]}}, "zero"),
    ({"heat": {"z": [0, 1]}}, "'z'"), ({"heat": {"a": [1, 0]}}, "empty"), ({"heat": None}, "heat"),
    ({"ambient": {"room": [290, 300], "sky": [200, 210]}}, "sky")])
def test_malformed(change, words):
    system = {"lumps": {"a": {"capacity": 1.0}}, "ambients": ["room"], "modules": {},
              "links": [{"between": ["room", "a"], "conductance": 0.5}]}
    region = {"temperature": [280, 350], "current": {}, "ambient": {"room": [290, 300]}, **change}
    with pytest.raises(InputError) as caught:
        make(system, region)
    assert words in str(caught.value)
