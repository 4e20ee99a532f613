"""State feedback over polytopes: exact truth for two states, published decay, plants drawn from the hull, refusals."""

from __future__ import annotations

import control
import numpy as np
import pytest
from scipy.linalg import solve_continuous_are, solve_continuous_lyapunov

import recheck
import robthermal as rt
from robthermal.errors import InputError
from robthermal.synthesis import _formulations
from robthermal.synthesis._vertices import read_vertices

SPRING = [control.ss([[0, 1], [s, -0.1]], [[0], [1]], [[1, 0]], 0) for s in (-1.0, 2.0)]
DRIVEN = [control.ss([[0, 1], [s, -0.1]], [[0, 0], [1, 1]], [[1, 0], [0, 0]], [[0, 0], [0, 0.1]]) for s in (-1.0, 2.0)]
GEVP = [control.ss(A, [[0], [0]], [[1, 0]], 0) for A in ([[-1, 2], [1, -3]], [[-0.8, 1.5], [1.3, -2.7]],
                                                        [[-1.4, 0.9], [0.7, -2]])]


def proven(d):
    """Both checkers accept every certificate, and it is about the plants and the gain of the result."""
    for certificate in d.certificates:
        assert rt.verify(certificate).valid
        keys = ("format", "kind", "claim", "system", "region", "evidence", "margin", "made_by")
        document = {key: getattr(certificate, key) for key in keys}
        second = recheck.check(document)
        assert second.status == ("not covered" if "damping" in certificate.region else "valid"), second.reason
        assert np.array_equal(certificate.system["gain"], d.gain)
        for plant, vertex in zip(d.plants, certificate.system["vertices"], strict=True):
            assert np.array_equal(vertex["A"], plant.A)
    return bool(d.certificates)


def hull(plants, rng, count):
    """A, B, C, D of plants drawn from the hull."""
    for weights in rng.dirichlet(np.full(len(plants), 0.5), count):
        yield tuple(np.tensordot(weights, np.array([getattr(plant, key) for plant in plants]), 1) for key in "ABCD")


def test_every_drawn_plant_decays_also_one_that_switches():
    d = rt.design.polytopic_feedback(SPRING, 1, rate=0.5)
    assert d.holds and d.rate >= 0.5 and proven(d) and d.value == -d.rate
    rng = np.random.default_rng(0)
    loops = [A + B @ d.gain for A, B, _, _ in hull(SPRING, rng, 200)]
    assert max(np.linalg.eigvals(A).real.max() for A in loops) < -d.rate
    for _ in range(20):  # V along switching plants, steps of a matrix exponential
        x = rng.standard_normal(2)
        for A in rng.permutation(np.array(loops))[:30]:
            dt = rng.uniform(0.01, 0.5)
            values, vectors = np.linalg.eig(A)
            moved = (vectors @ np.diag(np.exp(values * dt)) @ np.linalg.inv(vectors)).real @ x
            assert moved @ d.matrix @ moved <= x @ d.matrix @ x * np.exp(-2 * d.rate * dt) * (1 + 1e-9)
            x = moved
    assert d.controller.input_labels == list(SPRING[0].state_labels) and d.controller.output_labels == ["u[0]"]
    assert d.margins["all loops at once"]["disk"] > 0.2


def test_published_common_decay():
    """MathWorks, gevp: A'P + PA < α P for three matrices, α = -0.12213 = -2 rate."""
    assert rt.design.polytopic_feedback(GEVP, 1, rate=0.1220 / 2).holds
    refused = rt.design.polytopic_feedback(GEVP, 1, rate=0.1223 / 2)
    assert not refused.holds and refused.value == np.inf and not refused.gain.any() and not refused.certificates


@pytest.mark.parametrize("seed", [0, 1, 2, 5])
def test_two_states_with_a_common_input_are_decided_exactly(seed):
    """W b⊥ = c makes every inequality linear in one unknown: b⊥'(A W + W A')b⊥ < 0, W b⊥ = b⊥ + τ b, b'b = 1."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, np.pi)
    b, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    A = [rng.standard_normal((2, 2)) for _ in range(3)]

    def feasible(rate):
        low, high = -np.inf, np.inf
        for one in A:  # across' (A + rate) (across + τ b) < 0
            constant, slope = across @ one @ across + rate, across @ one @ b
            low, high = (max(low, -constant / slope), high) if slope < 0 else (low, min(high, -constant / slope))
        return low < high

    low, high = -20.0, 20.0
    assert feasible(low)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if feasible(middle) else (low, middle)
    assert low < 19
    plants = [control.ss(one + (low - 0.5) * np.eye(2), b[:, None], [[1, 0]], 0) for one in A]  # the largest is 0.5
    found = rt.design.polytopic_feedback(plants, 1, rate=0.49)
    assert found.holds and proven(found) and "varying" in str(found.robust_against)
    other = rt.design.polytopic_feedback(plants, 1, rate=0.51)  # one matrix cannot; one per vertex may
    assert "varying" not in str(other.robust_against)


def test_bounds_of_one_plant_are_those_of_riccati_equations():
    """H2 of state feedback: tr B1'XB1 of the Riccati equation; its H-infinity bound is never above that of the H2 gain.
    """
    plant = DRIVEN[1]
    A, B1, B2 = plant.A, plant.B[:, :1], plant.B[:, 1:]
    X = solve_continuous_are(A, B2, np.diag([1.0, 0.0]), 0.01 * np.eye(1))
    d = rt.design.polytopic_feedback([plant], 1, objective="h2")
    assert d.holds and proven(d) and d.value == pytest.approx(float(np.sqrt(np.trace(B1.T @ X @ B1))), rel=2e-3)
    loop = control.ss(A - B2 @ (B2.T @ X) / 0.01, B1, np.vstack([[1, 0], -0.1 * (B2.T @ X) / 0.01]), 0)
    norm = max(np.linalg.norm(loop(1j * w)) for w in np.geomspace(1e-3, 1e3, 400))
    best = rt.design.polytopic_feedback([plant], 1, objective="hinf")
    assert best.holds and 0.1 <= best.lower <= best.value < norm


@pytest.mark.parametrize("dt", [0.0, 0.2])
@pytest.mark.parametrize("objective", ["hinf", "h2"])
def test_no_drawn_plant_exceeds_the_bound(objective, dt):
    plants = DRIVEN if not dt else [control.sample_system(plant, dt) for plant in DRIVEN]
    d = rt.design.polytopic_feedback(plants, 1, objective=objective)
    assert d.holds and proven(d) and d.lower <= d.value
    worst, w = 0.0, np.geomspace(1e-2, np.pi / dt if dt else 1e3, 80)
    for A, B, C, D in hull(plants, np.random.default_rng(1), 12):
        loop = control.ss(A + B[:, 1:] @ d.gain, B[:, :1], C + D[:, 1:] @ d.gain, D[:, :1], dt)
        size = [np.linalg.norm(loop(np.exp(1j * x * dt) if dt else 1j * x), 2) for x in w]
        if objective == "hinf":
            worst = max(worst, max(size))
        elif dt:
            worst = max(worst, control.norm(loop, 2))
        else:
            P = solve_continuous_lyapunov(loop.A.T, -loop.C.T @ loop.C)
            worst = max(worst, float(np.sqrt(np.trace(loop.B.T @ P @ loop.B))))
    assert 0.5 * d.value < worst <= d.value


@pytest.mark.parametrize("objective", ["hinf", "h2"])
def test_reference_program_gives_the_same_level(objective):
    from robthermal.synthesis._polytope_program import Wanted, find
    plants = [control.ss(A, B, [[1, 0], [0, 0], [0, 0]], [[0, 0], [0, 0], [0, 0.3]]) for A, B in (
        ([[0, 1], [-1, -0.1]], [[0.3, 0], [1, 1]]), ([[0, 1], [1, -0.3]], [[0.1, 0.2], [1, 1.4]]))]
    v = read_vertices(plants, 1, None, True)
    fast = find(v, Wanted(objective, 0.0, {}, np.ones((1, 2), bool)))
    assert np.sqrt(fast.level) == pytest.approx(_formulations.polytope_level(v, objective), rel=1e-4)


def test_region_and_structure_are_kept():
    d = rt.design.polytopic_feedback(SPRING, 1, region={"decay": 0.8, "damping": 0.7, "radius": 20.0})
    assert d.holds and proven(d) and d.certificates[1].region["damping"] == 0.7
    for A, B, _, _ in hull(SPRING, np.random.default_rng(2), 50):
        modes = np.linalg.eigvals(A + B @ d.gain)
        assert modes.real.max() < -0.8 and (-modes.real / abs(modes)).min() > 0.7 and abs(modes).max() < 20
    two = [control.ss([[0.2, c], [-c, 0.1]], np.eye(2), np.eye(2), 0) for c in (0.1, 0.3)]
    own = rt.design.polytopic_feedback(two, 2, rate=0.1, structure=[[1, 0], [0, 1]])
    assert own.holds and proven(own) and own.gain[0, 1] == own.gain[1, 0] == 0.0


def test_one_form_per_vertex_where_one_for_all_is_too_much():
    """A = [[0, 1], [-1 - k, -0.3]], k = 0 or 3, no input: constant plants are stable, one P does not exist."""
    plants = [control.ss([[0, 1], [-1 - k, -0.3]], [[0], [0]], [[1, 0]], 0) for k in (0.0, 3.0)]
    d = rt.design.polytopic_feedback(plants, 1)
    assert d.holds and proven(d) and "as long as it is constant" in str(d.robust_against)
    assert "every constant plant" in d.certificates[0].claim and "matrices" in d.certificates[0].evidence
    # a plant that switches in resonance grows, so that a claim about it would be false
    x, grown = np.array([1.0, 0.0]), 0.0
    for _ in range(4000):
        A = plants[1 if x[0] * x[1] < 0 else 0].A  # stiff on the way in, soft on the way out
        x = x + 0.005 * A @ (x + 0.0025 * A @ x)
        grown = max(grown, float(np.linalg.norm(x)))
    assert grown > 5


def test_the_plant_that_blocks_is_named():
    d = rt.design.polytopic_feedback([control.ss([[0.3]], [[b]], [[1]], 0) for b in (1.0, -1.0)], 1)
    assert not d.holds
    assert "at the mean of vertices 1 and 2 the input no longer reaches the mode at +0.3" in d.outcome.text
    unstable = [control.ss([[a, 0], [0, -1]], [[0], [1]], [[1, 0]], 0) for a in (-0.5, 0.5)]
    assert "at vertex 2" in rt.design.polytopic_feedback(unstable, 1).outcome.text
    sampled = [control.ss([[1.3]], [[b]], [[1]], 0, 0.1) for b in (1.0, -1.0)]
    assert "z = 1.3" in rt.design.polytopic_feedback(sampled, 1).outcome.text


def test_a_rate_out_of_reach_names_the_best():
    """Gain and rate are bound by a state that the input drives through the other: the best is found by bisection."""
    plants = [control.ss([[-0.2, s], [0, 0]], [[0], [1]], [[1, 0]], 0) for s in (-0.05, 0.05)]  # reach changes sign
    d = rt.design.polytopic_feedback(plants, 1, rate=0.3)
    assert not d.holds and ("the mode at -0.2" in d.outcome.text or "best achievable" in d.outcome.text)
    assert rt.design.polytopic_feedback(plants, 1, rate=0.19).holds


@pytest.mark.parametrize(("arguments", "words"), [
    ({"n_ctrl": 5}, "n_ctrl = 5: the plant has 1 inputs"), ({"n_ctrl": 0}, "n_ctrl = 0"),
    ({"plants": []}, "1 to 4096"), ({"plants": [SPRING[0], 3]}, "is a int"), ({"rate": -1.0}, "rate = -1"),
    ({"rate": np.nan}, "not finite"), ({"objective": "l1"}, "objective"), ({"objective": "hinf"}, "no input is left"),
    ({"region": {"speed": 1.0}}, "region"), ({"structure": [[2, 1]]}, "structure"),
    ({"structure": [[1, 1, 1]]}, "1 rows of 2"), ({"n_out": 4}, "n_out = 4"),
    ({"plants": [SPRING[0], control.ss([[1.0]], [[1.0]], [[1.0]], 0)]}, "plant 1 has 1 states"),
    ({"plants": [SPRING[0], control.ss(SPRING[0].A, SPRING[0].B, [[1, 0]], 0, states=["a", "b"])]}, "the states of")])
def test_bad_arguments_are_named(arguments, words):
    with pytest.raises(InputError, match=words):
        rt.design.polytopic_feedback(**{"plants": SPRING, "n_ctrl": 1, **arguments})


def test_direct_path_has_no_h2_norm():
    plants = [control.ss(p.A, p.B, p.C, np.array([[1.0, 0], [0, 0.1]])) for p in DRIVEN]
    with pytest.raises(InputError, match="direct path"):
        rt.design.polytopic_feedback(plants, 1, objective="h2")
    sampled = [control.ss(0.3 * p.A, p.B, p.C, np.array([[1.0, 0], [0, 0.1]]), 0.1) for p in DRIVEN]
    assert rt.design.polytopic_feedback(sampled, 1, objective="h2").value > 1.0


def test_export_writes_gain_and_certificate(tmp_path):
    d = rt.design.polytopic_feedback(SPRING, 1, rate=0.5)
    d.export(tmp_path / "out")
    assert rt.verify(rt.Certificate.load(tmp_path / "out" / "certificates" / "1_stability.json")).valid
