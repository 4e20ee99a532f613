"""Kind "polytope": closed forms, plants that must not be certified, moving weights by simulation, malformed content."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from flint import fmpq
from scipy.linalg import expm

from robthermal.errors import InputError
from robthermal.verification import establish, machine_hash
from robthermal.verification._polytope import extreme_ways

# x' = a x + w + u, a from 1 to 2, u = -3 x: x' = -(1 to 2) x + w, z = x
LAG = {"vertices": [{"A": [[a]], "B": [[1, 1]], "C": [[1]], "D": [[0, 0]]} for a in (1, 2)], "gain": [[-3]],
       "sample_time": 0}


def made(system, region, evidence):
    return establish("polytope", system=system, region=region, evidence=evidence, made_by={}, margin={})


def switching(*matrices, gain=((0, 0),)):
    return {"vertices": [{"A": np.asarray(A).tolist(), "B": [[0], [0]]} for A in matrices], "gain": list(gain),
            "sample_time": 0}


def test_bounds_of_a_lag_are_decided_to_a_thousandth():
    """The worst loop is -1: rate 1, H-infinity norm 1, H2 norm √½ with P = ½."""
    for region, holds in (({"rate": 0.999}, True), ({"rate": 1}, False), ({"measure": "region", "decay": 0.999}, True),
                          ({"measure": "region", "decay": 1.001}, False),
                          ({"measure": "hinf", "bound": 1.001}, True), ({"measure": "hinf", "bound": 0.999}, False)):
        assert made(LAG, region, {"matrix": [[1]]}).holds is holds, region
    assert made(LAG, {"measure": "h2", "bound": 0.7075}, {"matrix": [[0.5001]]}).holds
    assert not made(LAG, {"measure": "h2", "bound": 0.7071}, {"matrix": [[0.5001]]}).holds
    assert not made(LAG, {"measure": "h2", "bound": 9}, {"matrix": [[0.4999]]}).holds


def test_sampled_bounds():
    """x+ = a x + w, a = 0.5 and -0.25: factor 0.5, norm 1/(1 - 0.5) = 2, H2 norm 1/√(1 - 0.25) with P = 4/3."""
    system = {"vertices": [{"A": [[a]], "B": [[1, 1]], "C": [[1]], "D": [[0, 0]]} for a in (1.5, 0.75)], "gain": [[-1]],
              "sample_time": 1}
    for region, P, holds in (({"rate": 0.499}, 1, True), ({"rate": 0.501}, 1, False),
                             ({"measure": "hinf", "bound": 2.002}, 2, True),
                             ({"measure": "hinf", "bound": 1.998}, 2, False),
                             ({"measure": "h2", "bound": 1.1549}, 1.3334, True),
                             ({"measure": "h2", "bound": 1.1546}, 1.3334, False),
                             ({"measure": "region", "radius": 0.501}, 1, True),
                             ({"measure": "region", "radius": 0.499}, 1, False)):
        assert made(system, region, {"matrix": [[P]]}).holds is holds, region


def test_a_hull_with_an_unstable_plant_inside_is_never_certified():
    """Both vertices are stable, their mean is not: no P, no P_i with slack, whatever the numbers."""
    A = np.array([[-0.1, 3.0], [0.0, -0.1]])
    system, rng = switching(A, A.T), np.random.default_rng(0)
    assert np.linalg.eigvals((A + A.T) / 2).real.max() > 1
    for _ in range(40):
        P = [(lambda X: (X @ X.T + 0.1 * np.eye(2)).tolist())(rng.standard_normal((2, 2))) for _ in range(2)]
        assert not made(system, {"rate": 0}, {"matrix": P[0]}).holds
        assert not made(system, {"rate": 0}, {"matrices": P, "slack": rng.standard_normal((4, 2)).tolist()}).holds


# x' = a x + w + u, z = y = x, a from -2 to 2; x_K' = -2 x_K + 3 y, u = -x_K - (1 + a) y: the same loop everywhere
SCHEDULED = {"vertices": [{"A": [[a]], "B": [[1, 1]], "C": [[1], [1]], "D": [[0, 0], [0, 0]]} for a in (-2, 2)],
             "controller": [{"A": [[-2]], "B": [[3]], "C": [[-1]], "D": [[d]]} for d in (1, -3)],
             "n_meas": 1, "n_ctrl": 1, "sample_time": 0}


def test_bounds_of_a_scheduled_loop_are_decided_to_a_thousandth():
    """P by a Riccati equation of the loop [[-1, -1], [3, -2]], its norm by its transfer function."""
    from scipy.linalg import solve_continuous_are
    A, B, C = np.array([[-1.0, -1], [3, -2]]), np.array([[1.0], [0]]), np.array([[1.0, 0]])
    w = np.linspace(0, 20, 20001)
    norm = max(abs((1j * w + 2) / ((1j * w + 1) * (1j * w + 2) + 3)))
    bound = 1.001 * norm
    P = solve_continuous_are(A, B, C.T @ C + 1e-9 * np.eye(2), -(bound * (1 - 1e-5)) ** 2 * np.eye(1))
    region = {"measure": "hinf", "bound": bound}
    held = made(SCHEDULED, region, {"matrix": ((P + P.T) / 2).tolist()})
    assert held.holds and "The controller u = K(w) y, continuous, the average of 2 controllers" in held.claim
    assert "the last 1 measured; controllers of 1 state; x: states of plant and controller" in held.claim
    for scale in np.geomspace(0.3, 3, 15):
        assert not made(SCHEDULED, {"measure": "hinf", "bound": 0.999 * norm},
                        {"matrix": (scale * (P + P.T) / 2).tolist()}).holds


def changed(path, value):
    system = copy.deepcopy(SCHEDULED)
    place = system
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return system


@pytest.mark.parametrize(("path", "value", "words"), [
    (("vertices", 1, "B"), [[1, 2]], r"\[B2; D12\] D_K \[C2 D21\]|more than one factor"),
    (("vertices", 1, "C"), [[1], [2]], "product .B2; D12. D_K .C2 D21. has more than one"),
    (("vertices", 1, "D"), [[0, 0], [1, 0]], "product .B2; D12. D_K .C2 D21. has more than one"),
    (("vertices", 0, "D"), [[0, 0], [0, 1]], "neither D22 nor D_K"),
    (("controller", 1), {"A": [[-2]], "B": [[3]], "C": [[-1]], "D": [[-3, 0]]}, "different sizes|columns|numbers"),
    (("n_meas",), 2, "1 inputs|2 measurements"), (("n_meas",), 3, "1 to 2"), (("n_ctrl",), 0.5, "whole number"),
    (("controller",), [SCHEDULED["controller"][0]], "one per vertex"), (("vertices",), [], "at least one vertex"),
    (("gain",), [[1]], "unknown key")])
def test_scheduled_loops_that_are_no_averages_are_refused(path, value, words):
    system = changed(path, value)
    if path == ("vertices", 1, "B"):
        system["controller"][1] |= {"C": [[-2]], "D": [[1]]}
    with pytest.raises(InputError, match=words):
        made(system, {"rate": 0}, {"matrix": [[1, 0], [0, 1]]})


def test_each_product_may_have_one_factor_that_varies():
    """B2 varies with C_K and D_K common, C2 with B_K and D_K common, D22 with D_K = 0 and B_K, C_K common."""
    for path, value in ((("vertices", 1, "A"), [[1]]), (("controller", 1, "D"), [[-4]]),
                        (("controller", 1, "C"), [[-0.5]]), (("controller", 1, "B"), [[2.5]])):
        assert made(changed(path, value), {"rate": 0}, {"matrix": [[3, 0], [0, 1]]}).holds, path
    common = changed(("controller", 1), SCHEDULED["controller"][1])
    common["controller"] = [common["controller"][1]] * 2
    for path, value in (("B", [[1, 1.5]]), ("C", [[1], [1.2]])):
        common["vertices"][1][path] = value
        assert made(common, {"rate": 0}, {"matrix": [[3, 0], [0, 1]]}).holds, path
        common["vertices"][1][path] = SCHEDULED["vertices"][1][path]
    passed = changed(("vertices", 1, "D"), [[0, 0], [0, 0.5]])
    for own in passed["controller"]:
        own |= {"B": [[0.5]], "D": [[0]]}
    passed["vertices"][1]["A"] = [[-1]]
    assert made(passed, {"rate": 0}, {"matrix": [[1, 0], [0, 1]]}).holds
    passed["controller"][1]["B"] = [[0.25]]
    with pytest.raises(InputError, match="B_K D22 C_K"):
        made(passed, {"rate": 0}, {"matrix": [[1, 0], [0, 1]]})


def test_controllers_that_only_work_at_their_vertices_are_never_certified():
    """x' = a x + b u, b = 1 or -1, u = -3 b x: both loops decay, the mean of the plants with the mean gain does not."""
    system = {"vertices": [{"A": [[1]], "B": [[b]], "C": [[1]], "D": [[0]]} for b in (1, -1)],
              "controller": [{"A": [], "B": [], "C": [[]], "D": [[-3 * b]]} for b in (1, -1)],
              "n_meas": 1, "n_ctrl": 1, "sample_time": 0}
    with pytest.raises(InputError, match="more than one factor"):
        made(system, {"rate": 0}, {"matrix": [[1]]})
    system["controller"] = [system["controller"][0]] * 2  # one gain for both: the loops themselves say no
    assert not made(system, {"rate": 0}, {"matrix": [[1]]}).holds


def constant_only():
    """Stiffness 1 or 4: constant plants decay, one that switches in resonance grows; P_i and G found with a solver."""
    from robthermal.synthesis._slack_program import slack_matrices
    A = np.array([[[0, 1], [-1 - k, -0.3]] for k in (0.0, 3.0)])
    P, G, _ = slack_matrices(A, 0.0, 0.0)
    return switching(*A), {"matrices": P.tolist(), "slack": G.tolist()}


def test_one_matrix_per_vertex_is_a_claim_about_constant_plants():
    system, evidence = constant_only()
    held = made(system, {"rate": 0}, evidence)
    assert held.holds and "every constant plant" in held.claim and "varying" not in held.claim
    assert not made(system, {"rate": 0, "parameter_rates": [100, 100]}, evidence).holds
    slow = made(system, {"rate": 0, "parameter_rates": [0.001, 0.001]}, evidence)
    assert slow.holds and "no faster than 0.001, 0.001 1/s" in slow.claim
    assert not any(made(system, {"rate": 0}, {"matrix": P}).holds for P in evidence["matrices"])


def test_the_largest_proven_rate_of_the_weights_is_below_one_that_breaks_it():
    """V = x'P(w)x along weights that move at the proven rate falls; the proof is lost before resonance."""
    system, evidence = constant_only()
    low, high = 0.0, 10.0
    for _ in range(20):
        middle = (low + high) / 2
        proven = made(system, {"rate": 0, "parameter_rates": [middle, middle]}, evidence).holds
        low, high = (middle, high) if proven else (low, middle)
    assert low > 0.01
    A = [np.array(vertex["A"], float) for vertex in system["vertices"]]
    P, rng = [np.array(one) for one in evidence["matrices"]], np.random.default_rng(1)
    for _ in range(20):
        x, w, dt, direction = rng.standard_normal(2), 0.5, 0.02, 1.0
        before = np.inf
        for _ in range(400):
            direction = -direction if rng.random() < 0.01 or not 0 <= w + direction * low * dt <= 1 else direction
            value = x @ (w * P[0] + (1 - w) * P[1]) @ x
            assert value <= before
            before = value
            middle = w + direction * low * dt / 2
            x, w = expm((middle * A[0] + (1 - middle) * A[1]) * dt) @ x, w + direction * low * dt


def test_extremes_of_moving_weights_hold_every_way():
    assert extreme_ways([2, 2]) == {(2, -2), (-2, 2)}
    rng = np.random.default_rng(3)
    for rates in ([1.0, 1.0, 1.0], [3.0, 1.0, 0.5], [1.0, 2.0, 3.0, 4.0]):
        points = np.array([[int(value.p) / int(value.q) for value in way] for way in
                           extreme_ways([fmpq(int(2 * rate), 2) for rate in rates])])
        assert np.abs(points.sum(axis=1)).max() == 0 and (np.abs(points) <= np.array(rates)).all()
        for direction in rng.standard_normal((30, len(rates))):  # support function: a linear program by brute force
            drawn = rng.uniform(-1, 1, (4000, len(rates))) * rates
            drawn[:, 0] = -drawn[:, 1:].sum(axis=1)
            drawn = drawn[np.abs(drawn[:, 0]) <= rates[0]]
            assert (points @ direction).max() >= (drawn @ direction).max() - 1e-12


@pytest.mark.parametrize("path", [("vertices", 0, "A", 0, 0), ("vertices", 1, "B", 0, 1), ("gain", 0, 0)])
def test_every_number_is_part_of_the_machine_and_of_the_proof(path):
    system = copy.deepcopy(LAG)
    place = system
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] += 2.5
    assert machine_hash(system) != machine_hash(LAG)
    held, other = (made(one, {"rate": 0.9}, {"matrix": [[1]]}) for one in (LAG, system))
    assert held.holds and other.claim.removeprefix("Not certified: ") != held.claim


@pytest.mark.parametrize(("part", "change", "words"), [
    ("system", {"vertices": []}, "no vertex"), ("system", {"gain": [[1, 2]]}, "1 rows"),
    ("system", {"gain": []}, "empty gain"), ("system", {"gain": [[1], [1], [1]]}, "2 inputs"),
    ("system", {"vertices": [LAG["vertices"][0], {"A": [[1]], "B": [[1]]}]}, "inputs"),
    ("system", {"note": 1}, "unknown key"), ("system", {"sample_time": -1}, "negative"),
    ("region", {"measure": "hinf"}, "'bound' is missing"), ("region", {"measure": "peak"}, "measure"),
    ("region", {"measure": "region"}, "no region"), ("region", {"measure": "region", "radius": 1}, "no region"),
    ("region", {"rate": 1, "bound": 2}, "unknown key"), ("region", {"rate": -1}, "negative"),
    ("region", {"rate": 0, "parameter_rates": [1, 1]}, "one matrix"),
    ("evidence", {"matrix": [[1, 0]]}, "2 numbers"), ("evidence", {}, "'matrices' is missing"),
    ("evidence", {"matrices": [[[1]]], "slack": [[1], [1]]}, "one per vertex"),
    ("evidence", {"matrices": [[[1]], [[1]]], "slack": [[1]]}, "1 rows")])
def test_malformed_content_is_an_input_error(part, change, words):
    parts = {"system": LAG, "region": {"rate": 0.1}, "evidence": {"matrix": [[1]]}}
    parts[part] = {**parts[part], **change} if part == "system" else change
    with pytest.raises(InputError, match=words):
        made(**parts)
