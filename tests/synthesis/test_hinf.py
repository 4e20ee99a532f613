"""H-infinity synthesis: published optima, brute force, other norms, refusals, proofs of the numbers returned."""

from __future__ import annotations

import json
from pathlib import Path

import control
import numpy as np
import pytest
from plants import generalized, hard, mixed_sensitivity, norm, random_plant, scherer
from scipy.linalg import expm

import robthermal as rt
from robthermal.errors import InputError
from robthermal.synthesis._arithmetic import Floats
from robthermal.synthesis._central import regular, solutions
from robthermal.synthesis._plant import balanced, read_generalized

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data" / "compleib"


def proven(d: rt.design.Design, P: control.StateSpace) -> bool:
    """The certificate is valid, about these numbers, and the loop formed by python-control obeys it."""
    c = d.certificates[0]
    K = d.controller
    same = all(np.array_equal(np.asarray(c.system["controller"][key], float).reshape(part.shape), part)
               for key, part in zip("ABCD", (K.A, K.B, K.C, K.D), strict=True))
    return bool(d.holds and rt.verify(c).valid and same and c.region["bound"] == d.value and norm(P, K) < d.value)


@pytest.mark.parametrize(("P", "optimum"), [
    (scherer(), 9.508085), (mixed_sensitivity(1.0), 1.365925), (mixed_sensitivity(0.1), 0.923399), (hard(), 0.65**0.5)],
    ids=["scherer", "mixed sensitivity", "cheap control", "hard"])
def test_published_optima(P, optimum):
    d = rt.design.hinf(P, 1, 1)
    assert optimum * (1 - 1e-6) < d.value < 1.005 * optimum and abs(d.lower / optimum - 1) < 1e-3
    assert proven(d, P)


@pytest.mark.parametrize("factor", np.linspace(0.8, 1.2, 7))
def test_rounding_does_not_decide_whether_there_is_a_solution(factor):
    """w reaches y directly, so Y is zero at every level: its rounding must not count as a sign."""
    P = mixed_sensitivity(1.0)
    own = regular(balanced(read_generalized(factor * P, 1, 1)), Floats())
    levels = factor * 1.365925 * np.geomspace(1.001, 3, 40)
    assert all(solutions(own, level, Floats()) is not None for level in levels)


def test_optimum_of_one_state_in_closed_form():
    """x' = a x + w1 + u, z = (x, u), y = x + w2: X = Y = 1/(√(a² + 1 - 1/γ²) - a), and ρ(XY) = γ² gives the optimum."""
    for a in (-1.0, 0.0, 2.0):
        P = generalized([[a]], [[1, 0]], [[1]], [[1], [0]], [[1]], np.zeros((2, 2)), [[0], [1]], [[0, 1]])
        low, high = 1e-6, 1e3
        for _ in range(200):
            g = 0.5 * (low + high)
            inside = a * a + 1 - g**-2
            X = (a + np.sqrt(inside)) / (1 - g**-2) if inside > 0 and abs(1 - g**-2) > 1e-12 else np.inf
            low, high = (low, g) if 0 <= X < g else (g, high)
        d = rt.design.hinf(P, 1, 1)
        assert high * (1 - 1e-6) < d.value < 1.005 * high and proven(d, P)


@pytest.mark.parametrize("dt", [0.0, 0.1])
@pytest.mark.parametrize("seed", range(3))
def test_no_random_controller_does_better(seed, dt):
    """Random changes of the controller found never reach less than what is said to be the best."""
    P = random_plant(seed, dt=dt)
    d = rt.design.hinf(P, 2, 2)
    assert proven(d, P) and d.value <= 1.005 * d.lower
    rng, K = np.random.default_rng(seed), d.controller
    for size in (1e-3, 1e-2, 1e-1):
        for _ in range(8):
            parts = (part * (1 + size * rng.standard_normal(part.shape)) for part in (K.A, K.B, K.C, K.D))
            assert norm(P, control.ss(*parts, dt)) > d.lower * (1 - 1e-3)


def test_random_plants_of_the_notes():
    """A = randn - 0.3, of the kind for which slycot reports less than it attains."""
    rng = np.random.default_rng(0)
    n = 8
    D = np.block([[np.zeros((2, 2)), np.eye(2)], [np.eye(2), np.zeros((2, 2))]])
    P = control.ss(rng.standard_normal((n, n)) - 0.3 * np.eye(n), rng.standard_normal((n, 4)),
                   rng.standard_normal((4, n)), D)
    d = rt.design.hinf(P, 2, 2)
    assert proven(d, P) and d.value <= 1.005 * d.lower


def test_bilinear_map_keeps_the_optimum():
    """A sampled plant with the frequency response of a continuous one at tan(ωT/2) has its optimum."""
    P = scherer()
    one = np.eye(3)
    inverse = np.linalg.inv(one - P.A)  # z = (1 + s)/(1 - s)
    moved = control.ss((one + P.A) @ inverse, np.sqrt(2) * inverse @ P.B, np.sqrt(2) * P.C @ inverse,
                       P.D + P.C @ inverse @ P.B, 1.0)
    d = rt.design.hinf(moved, 1, 1)
    assert abs(d.lower / 9.508085 - 1) < 1e-3 and proven(d, moved)


def test_eigenvalue_at_minus_one_is_no_obstacle():
    P = generalized([[-1.0, 0.3], [0, 0.5]], np.eye(2), [[1], [0]], [[1, 0], [0, 0]], [[1, 0]], np.zeros((2, 2)),
                    [[0], [1]], [[0, 0.1]], dt=1.0)
    assert proven(rt.design.hinf(P, 1, 1), P)


def test_direct_path_from_control_to_measurement():
    """D22 changes the controller, not the optimum: u = K (y - D22 u)."""
    P = scherer()
    D = np.array(P.D)
    D[-1, -1] = 0.7
    other = control.ss(P.A, P.B, P.C, D)
    d = rt.design.hinf(other, 1, 1)
    assert abs(d.lower / 9.508085 - 1) < 1e-3 and proven(d, other)


@pytest.mark.parametrize(("D12", "D21"), [(0.0, 1.0), (1.0, 0.0), (0.0, 0.0)])
def test_plants_without_weights(D12, D21):
    """1/(s + 1) with cheap control or no noise: the infimum is 0 without both, and what is claimed is of P itself."""
    P = generalized([[-1.0]], [[1, 0]], [[1]], [[1], [0]], [[1]], np.zeros((2, 2)), [[0], [D12]], [[0, D21]])
    d = rt.design.hinf(P, 1, 1)
    assert proven(d, P)
    assert d.value < (1e-3 if D12 == D21 == 0 else 0.75)  # open loop: 1


def test_zeros_on_the_axis():
    """A disturbance that no control weight follows at frequency zero: z = s/(s + 1) (w + u), and u."""
    P = generalized([[-1.0]], [[1, 0]], [[1]], [[-1], [0]], [[1]], [[1, 0], [0, 0]], [[1], [0]], [[0, 1]])
    assert proven(rt.design.hinf(P, 1, 1), P)


def test_gamma_that_is_enough_and_gamma_that_is_not():
    P = scherer()
    d = rt.design.hinf(P, 1, 1, gamma=15)
    assert d.holds and 9.5 < d.value <= 15 and proven(d, P)
    d = rt.design.hinf(P, 1, 1, gamma=9)
    assert not d.holds and d.value == np.inf and d.outcome.code == "infeasible" and not d.certificates
    assert "gamma = 9: the best achievable is about 9.5" in d.outcome.text
    assert not np.any(d.controller.D) and d.controller.nstates == 0


def test_decay_of_the_closed_loop():
    P = scherer()
    d = rt.design.hinf(P, 1, 1, region={"decay": 0.5})
    assert d.holds and proven(d, P) and d.closed_loop.poles().real.max() < -0.5
    assert d.certificates[1].region == {"measure": "region", "decay": 0.5} and rt.verify(d.certificates[1]).valid
    d = rt.design.hinf(random_plant(1, dt=0.1), 2, 2, region={"radius": 0.9})
    assert d.holds and abs(d.closed_loop.poles()).max() < 0.9
    d = rt.design.hinf(P, 1, 1, region={"decay": 0.1, "damping": 0.999})
    assert not d.holds and "region" in d.outcome.text


def test_gain_of_the_controller_is_limited():
    P = mixed_sensitivity(0.1)
    free = rt.design.hinf(P, 1, 1)
    w = np.geomspace(1e-4, 1e5, 4000)
    top = abs(free.controller(1j * w)).max()
    d = rt.design.hinf(P, 1, 1, max_gain=0.85 * top)
    assert d.holds and abs(d.controller(1j * w)).max() <= 0.85 * top
    assert proven(d, P) and d.value > free.value
    d = rt.design.hinf(P, 1, 1, max_gain=1e-6 * top)
    assert not d.holds and "max_gain" in d.outcome.text


def test_fewer_states_are_certified_again():
    P = mixed_sensitivity(1.0)
    d = rt.design.hinf(P, 1, 1, order=3)
    assert d.controller.nstates == 3 and proven(d, P)
    with pytest.raises(InputError, match="order"):
        rt.design.hinf(P, 1, 1, order=-1)


def test_held_inputs():
    """Sampled plant by integration of the continuous one; the proof is about the sampled loop."""
    P, T = scherer(), 0.02
    d = rt.design.hinf(P, 1, 1, sample_time=T)
    moved = expm(np.block([[P.A, P.B], [np.zeros((2, 5))]]) * T)
    held = control.ss(moved[:3, :3], moved[:3, 3:], P.C, P.D, T)
    assert proven(d, held) and d.controller.dt == T


def test_weak_loops_are_not_called_certified(monkeypatch):
    """Controllers that are worse than they say: the proof is of what they reach; unstable ones are none."""
    honest = rt.synthesis._level._made
    P = scherer()

    def wrong(own, level, arithmetic):
        K = honest(own, level, arithmetic)
        return None if K is None else type(K)(K.A, 1.3 * K.B, K.C, K.D, K.dt)

    monkeypatch.setattr("robthermal.synthesis._level._made", wrong)
    d = rt.design.hinf(P, 1, 1)
    assert d.value == np.inf or proven(d, P)
    monkeypatch.setattr("robthermal.synthesis._level._made", lambda *given: None)
    d = rt.design.hinf(P, 1, 1)
    assert not d.holds and d.value == np.inf and d.outcome.code == "not_found"


@pytest.mark.parametrize(("change", "words"), [
    ({"B": [[1, 0, 0], [0, 1, 1]]}, r"not stabilisable: the mode at \+0.3 1/s"),
    ({"C": [[1, 0], [0, 1], [0, 1]]}, r"not detectable: the mode at \+0.3 1/s"),
    ({"A": [[np.nan, 0], [0, -1]]}, "finite")])
def test_modes_out_of_reach_are_named(change, words):
    parts = {"A": [[0.3, 0], [0, -1]], "B": [[1, 0, 1], [0, 1, 1]], "C": [[1, 0], [0, 1], [1, 1]],
             "D": [[0, 0, 1], [0, 0, 0], [0, 1, 0]]} | change
    with pytest.raises(InputError, match=words):
        rt.design.hinf(control.ss(*parts.values()), 1, 1)


def test_hidden_oscillation_is_named_by_its_frequency():
    P = control.ss([[0, 0.7, 0], [-0.7, 0, 0], [0, 0, -1]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], np.eye(3),
                   [[0, 0, 1], [0, 0, 0], [0, 1, 0]])
    with pytest.raises(InputError, match="not stabilisable: the mode at 0.7 rad/s"):
        rt.design.hinf(P, 1, 1)


@pytest.mark.parametrize(("given", "words"), [
    ({"n_ctrl": 5}, "n_ctrl = 5: the plant has 2 inputs"), ({"n_meas": 0}, "n_meas = 0"), ({"n_meas": 1.5}, "whole"),
    ({"gamma": -1}, "gamma"), ({"method": "magic"}, "method"), ({"tolerance": 0}, "tolerance"),
    ({"region": {"speed": 1}}, "region"), ({"region": {"radius": 3}}, "radius alone"),
    ({"max_gain": np.nan}, "max_gain"),
    ({"sample_time": -1}, "sample_time")])
def test_bad_arguments_are_named(given, words):
    with pytest.raises(InputError, match=words):
        rt.design.hinf(scherer(), **{"n_meas": 1, "n_ctrl": 1, **given})


def test_margins_are_those_of_the_loop():
    """Gains inside the margin keep the loop stable, and so do delays; the disk margin is that of S - T on a grid."""
    P = mixed_sensitivity(1.0)
    d = rt.design.hinf(P, 1, 1)
    G, K = control.ss(P.A, P.B[:, -1:], P.C[-1:], 0), d.controller
    w = np.geomspace(1e-4, 1e5, 20000)
    L = G(1j * w) * K(1j * w)
    S = 1 / (1 - L)
    found = d.margins[K.output_labels[0]]
    assert found["disk"] == pytest.approx(2 / abs(2 * S - 1).max(), rel=1e-3)
    assert found["modulus"] == pytest.approx(1 / abs(S).max(), rel=1e-3)
    for gain in (found["gain"] * 0.999, 1.001 / found["gain"]):
        assert np.isfinite(norm(P, gain * K))
    crossing = w[np.flatnonzero(np.diff(np.sign(abs(L) - 1)))]
    at = [np.interp(x, w, L.real) + 1j * np.interp(x, w, L.imag) for x in crossing]
    exact = min((np.angle(value) % (2 * np.pi) / x for x, value in zip(crossing, at, strict=True)), default=np.inf)
    assert 0 < found["delay"] <= exact


def test_design_prints_plots_and_is_frozen():
    d = rt.design.hinf(scherer(), 1, 1)
    text = str(d)
    assert "proven" in text and "disk margin" in text and "Delta" in text
    assert d.robust_against.data["delta_norm"] == pytest.approx(1 / d.value)
    axes = d.plot()
    top = max(line.get_ydata().max() for line in axes.lines if len(line.get_ydata()) > 10)
    assert 0.9 * d.value < top < d.value
    with pytest.raises(AttributeError):
        d.value = 0.0


def test_names_of_the_plant_are_kept():
    P = scherer()
    P.input_labels, P.output_labels = ["force", "current"], ["error", "effort", "T1"]
    d = rt.design.hinf(P, 1, 1)
    assert d.controller.input_labels == ["T1"] and d.controller.output_labels == ["current"]
    assert d.closed_loop.input_labels == ["force"] and d.closed_loop.output_labels == ["error", "effort"]


@pytest.mark.skipif(not SHARED.is_dir(), reason="no COMPleib models beside the project")
@pytest.mark.parametrize("name", ["AC15", "PSM", "HF2D_IS8", "NN13", "HE1", "REA2"])
def test_models_of_compleib_with_small_channels(name):
    """Where slycot says 8.87 for 14.86 (AC15), 0.268 for 0.920 (PSM), 8.40 for 91.3 (HF2D_IS8)."""
    data, reference = np.load(SHARED / "compleib.npz"), json.loads((SHARED / "reference.json").read_text())[name]
    A, B1, B, C1, C, D11, D12, D21 = (data[f"{name}.{key}"] for key in ("A", "B1", "B", "C1", "C", "D11", "D12", "D21"))
    n, m, p, eps = len(A), B.shape[1], len(C), reference["eps"]
    assert not reference["full"]
    P = generalized(A, np.hstack([B1, np.zeros((n, p))]), B, np.vstack([C1, np.zeros((m, n))]), C,
                    np.pad(D11, ((0, m), (0, p))), np.vstack([D12, eps * np.eye(m)]), np.hstack([D21, eps * np.eye(p)]))
    d = rt.design.hinf(P, p, m)
    assert proven(d, P) and reference["reg"] * (1 - 1e-6) < d.value < 1.005 * reference["reg"]


@pytest.mark.parametrize(("denominator", "optimum"), [([1, 1], 0.181682), ([1, 2, 1], 0.230758)])
def test_page_of_mixsyn(denominator, optimum):
    """(s - 1)/(s + 1) and (s - 1)/(s + 1)² with weights 0.1 (s + 100)/(100 s + 1) and 0.1: the page at MathWorks."""
    G, W = control.ss(control.tf([1, -1], denominator)), control.ss(control.tf([0.1, 10], [100, 1]))
    n = G.nstates
    P = generalized(np.block([[G.A, np.zeros((n, 1))], [-W.B @ G.C, W.A]]), np.vstack([np.zeros((n, 1)), W.B]),
                    np.vstack([G.B, -W.B @ G.D]), np.vstack([np.hstack([-W.D @ G.C, W.C]), np.zeros((1, n + 1))]),
                    np.hstack([-G.C, [[0.0]]]), np.vstack([W.D, [[0.0]]]), np.vstack([-W.D @ G.D, [[0.1]]]), [[1.0]],
                    -G.D)
    d = rt.design.hinf(P, 1, 1)
    assert d.holds and rt.verify(d.certificates[0]).valid and norm(P, d.controller) < d.value
    assert optimum * (1 - 1e-5) < d.value < 1.005 * optimum and d.lower == pytest.approx(optimum, rel=3e-4)
