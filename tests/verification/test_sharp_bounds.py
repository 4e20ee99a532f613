"""Recomputed margins against dense grids, on systems chosen so that a careless bound would be too generous.

Inner currents as the worst case (R' < 0), conductances that bend (K'), shared lumps, radiation and convection alone.
Each test wants the proven margin below the sampled one (safe) and close to it (the bound was not just lucky).
"""

from __future__ import annotations

import itertools

import certificate_truth as truth
import numpy as np
import pytest
import scipy.linalg
from flint import arb, arb_mat

from robthermal.verification import establish, verify
from robthermal.verification._definite import is_positive_preconditioned


def module(hot, cold, **slopes):
    base = {"seebeck": {"value": 0.05, "slope": 7e-5}, "resistance": {"value": 4.5, "slope": 0.02},
            "conductance": {"value": 0.3, "slope": 0.0}}
    return {"hot": hot, "cold": cold, "reference_temperature": 308.15,
            **{key: {**part, "slope": slopes.get(key, part["slope"])} for key, part in base.items()}}


def system(modules, *, conductance=0.5):
    names = sorted({module[face] for module in modules for face in ("hot", "cold")})
    links = [{"between": [a, b], "conductance": conductance} for a, b in itertools.pairwise(names)]
    links += [{"between": [name, "room"], "conductance": 1.0 + 0.3 * k} for k, name in enumerate(names)]
    return {"lumps": {name: {"capacity": 2.0 + k} for k, name in enumerate(names)}, "ambients": ["room"],
            "links": links, "modules": {f"m{k}": module for k, module in enumerate(modules)}}


def grid_jacobians(network, region, steps):
    """Jacobians on all temperature vertices times a grid of currents."""
    T, I = truth.boxes(network, region)  # noqa: E741 - the current
    currents = [np.linspace(low, high, steps) for low, high in I]
    for corner in itertools.product(*T):
        for chosen in itertools.product(*currents):
            yield truth.jacobian(network, np.array(corner), dict(zip(network["modules"], chosen, strict=True)))


def sampled_margin(network, region, evidence, steps=41):
    """Least decay rate over the grid [1/s]."""
    E = np.array([lump["capacity"] for lump in network["lumps"].values()])
    method, least = evidence["method"], np.inf
    for J in grid_jacobians(network, region, steps):
        if method in ("sum", "max"):
            w = np.array(evidence["weights"])
            A = np.abs(J) - np.diag(np.abs(np.diag(J))) + np.diag(np.diag(J))
            A = A if method == "max" else A.T
            least = min(least, float(np.min(-(A @ w) / (w * E))))
        else:
            P = np.array(evidence["matrix"]) if method == "lyapunov" else np.diag(E)
            M = P / E @ J
            least = min(least, -scipy.linalg.eigh(M + M.T, P, eigvals_only=True)[-1] / 2)
    return least


HOSTILE = {
    "one": [module("a", "b")],
    "inner current": [module("a", "b", resistance=-0.05, seebeck=0.0)],
    "bending conductance": [module("a", "b", conductance=0.004)],
    "bending the other way": [module("a", "b", conductance=-0.004, resistance=-0.03)],
    "falling Seebeck": [module("a", "b", seebeck=-3e-4)],
    "two stages": [module("a", "b", conductance=0.002), module("b", "c", resistance=-0.03)],
    "opposed": [module("a", "b"), module("b", "a", seebeck=-2e-4, resistance=-0.02)],
}


@pytest.mark.parametrize("method", ["sum", "max", "energy", "lyapunov"])
@pytest.mark.parametrize("name", list(HOSTILE))
def test_margin_is_safe_and_close(name, method):
    network = system(HOSTILE[name])
    region = {"temperature": [280.0, 350.0], "current": {key: [-1.0, 4.0] for key in network["modules"]}}
    n = len(network["lumps"])
    extra = {"weights": [1.0, 1.1, 0.9][:n]}
    if method == "lyapunov":
        extra = {"matrix": (np.diag([2.0, 3.0, 4.0][:n]) + 0.3 * (np.ones((n, n)) - np.eye(n))).tolist()}
    found, scale = None, 1.0
    for scale in (1.0, 0.5, 0.25, 0.1, 0.03):  # the largest current box of these that is certified
        current = {key: [-1.0 * scale, 4.0 * scale] for key in network["modules"]}
        region = {**region, "current": current}
        found = establish("contraction", system=network, region=region, made_by={},
                          evidence={"method": method, "rate": 0.0, **extra})
        if found.holds:
            break
    assert found is not None and found.holds
    true = sampled_margin(network, region, found.evidence, 41 if len(network["modules"]) == 1 else 9)
    exact = method in ("sum", "max")
    proven = verify(found).margins["rate"]
    assert proven <= true * (1 + 1e-9)
    slack = 0.02 if len(network["modules"]) == 1 or not exact else 0.1  # the grid misses an inner current by a little
    assert proven >= (1 - slack) * true - (0.01 if method == "lyapunov" else 0.002)


@pytest.mark.parametrize(("gain", "exponent"), [(0.05, 0.25), (0.003, 1.0)])
def test_convection_alone(gain, exponent):
    """Unequal weights on a convective link: the worst slope is that of the largest temperature difference."""
    network = system([module("a", "b")], conductance=0.0)
    network["modules"] = {}
    network["links"][0]["natural"] = {"gain": gain, "exponent": exponent}
    region = {"temperature": [280.0, 350.0], "current": {}}
    for method in ("sum", "max"):
        evidence = {"method": method, "rate": 0.0, "weights": [1.0, 2.0]}
        found = establish("contraction", system=network, region=region, evidence=evidence, made_by={})
        assert found.holds
        assert verify(found).margins["rate"] == pytest.approx(sampled_margin(network, region, evidence), rel=1e-6)


@pytest.mark.parametrize("spans", [([280.0, 420.0], [280.0, 280.0]), ([280.0, 280.0], [280.0, 420.0]),
                                   ([280.0, 420.0], [280.0, 420.0])])
def test_radiation_alone_in_the_energy_norm(spans):
    """Hot radiates to cold more steeply than back: J is not symmetric, and a weak path to ambient is not enough."""
    network = system([module("a", "b")], conductance=0.0)
    network["modules"] = {}
    network["links"][0]["radiation"] = 5e-9
    region, verdicts = {"temperature": dict(zip("ab", spans, strict=True)), "current": {}}, []
    for conductance in np.geomspace(1e-3, 3.0, 60):
        for link in network["links"][1:]:
            link["conductance"] = float(conductance)
        found = establish("contraction", system=network, region=region, evidence={"method": "energy", "rate": 0.0},
                          made_by={}, margin={})
        true = sampled_margin(network, region, found.evidence)
        assert not found.holds or true > 0
        verdicts.append((found.holds, true > 0))
    assert (False, False) in verdicts and (True, True) in verdicts


@pytest.mark.parametrize("spans", [([280.0, 420.0], [280.0, 280.0]), ([280.0, 280.0], [280.0, 420.0])])
@pytest.mark.parametrize("evidence", [
    {"method": "sum", "weights": [1.0, 1.2]}, {"method": "sum", "weights": [1.2, 1.0]},
    {"method": "max", "weights": [1.0, 1.2]}, {"method": "max", "weights": [1.2, 1.0]},
    {"method": "max", "weights": [1.0, 3.0]}, {"method": "lyapunov", "matrix": [[2.0, 0.7], [0.7, 3.0]]},
    {"method": "lyapunov", "matrix": [[2.0, -0.7], [-0.7, 3.0]]}])
def test_radiation_alone_in_the_other_norms(evidence, spans):
    """One end's temperature is fixed, so that the slopes are the only unknown and the margin must be exact."""
    network = system([module("a", "b")], conductance=0.0)
    network["modules"] = {}
    network["links"][0]["radiation"] = 2e-9
    region = {"temperature": dict(zip("ab", spans, strict=True)), "current": {}}
    found = establish("contraction", system=network, region=region, evidence={"rate": 0.0, **evidence}, made_by={})
    true = sampled_margin(network, region, evidence)
    assert found.holds == (true > 0)
    if found.holds:
        assert 0.99 * true < verify(found).margins["rate"] <= true * (1 + 1e-9)


def flow_extremes(network, region, room):
    """Least inward heat flow over all faces, partner temperatures on a grid."""
    T, I = truth.boxes(network, region)  # noqa: E741 - the current
    least = np.inf
    for a, b in itertools.product(np.linspace(*T[0], 71), np.linspace(*T[1], 71)):
        for current in np.linspace(*I[0], 5):
            flow = truth.heat(network, np.array([a, b]), {"m0": current}, {"room": room})
            for k, x in enumerate((a, b)):
                if x == T[k, 1]:
                    least = min(least, -flow[k])
                if x == T[k, 0]:
                    least = min(least, flow[k])
    return least


@pytest.mark.parametrize(("slope", "room"), [(-0.02, 350.0), (0.02, 280.0), (-0.01, 300.0)])
def test_invariance_with_a_conductance_that_changes_sign(slope, room):
    """K(T) = 0 inside the box: the worst temperature of the partner is an inner one."""
    network = system([module("a", "b", conductance=slope)])
    region = {"temperature": [250.0, 380.0], "current": {"m0": [-0.1, 0.1]}, "ambient": {"room": [room, room]}}
    found = establish("invariance", system=network, region=region, evidence={}, made_by={})
    proven, true = verify(found).margins.get("heat"), flow_extremes(network, region, room)
    if found.holds:
        assert proven <= true + 1e-9
    else:
        proven = float(found.reason.split(" can be ")[1].split(" W")[0])
        assert proven <= true + 1e-9
    assert proven > true - 1.0


@pytest.mark.parametrize("hint", [np.eye(2), np.diag([1e8, 1e-8]), np.array([[1.0, 0.999999], [0.999999, 1.0]])])
def test_a_wrong_hint_proves_nothing(hint):
    """The float preconditioner is only a hint: an indefinite matrix is never called positive definite."""
    for off in ("1.5", "-2", "1.0000000000000000000001", "1"):
        assert not is_positive_preconditioned(arb_mat(2, 2, [arb(1), arb(off), arb(off), arb(1)]), hint)
    assert is_positive_preconditioned(arb_mat(2, 2, [arb(1), arb("0.5"), arb("0.5"), arb(1)]), np.eye(2))
