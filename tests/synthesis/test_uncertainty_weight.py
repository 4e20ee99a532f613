"""Weights above measured uncertainty: plants drawn from the covariance lie below; several entries by brute force."""

from __future__ import annotations

import control
import numpy as np
import pytest

import robthermal as rt
from robthermal.errors import InputError

F = np.geomspace(1e-3, 1, 80)
PLANT, MODEL = control.tf([2.0], np.polymul([30, 1], [2, 1])), control.tf([1.9], [28, 1])


def measured(plant=PLANT, sigma=0.02, seed=0, freedom=50, f=F):
    """A response with circular noise of a known size; plant: a function of s with values (n_y, n_u, n_f) or (n_f,)."""
    G = np.asarray(plant(2j * np.pi * f))
    G = G[None, None] if G.ndim == 1 else G
    rng, n = np.random.default_rng(seed), len(f)
    noise = sigma * (rng.standard_normal(G.shape) + 1j * rng.standard_normal(G.shape)) / np.sqrt(2)
    p, m = G.shape[:2]
    return rt.identify.FrequencyResponse(
        frequencies=f, response=G + noise, noise_covariance=np.repeat(sigma**2 * np.eye(p)[:, :, None], n, axis=2),
        gram=np.repeat(np.eye(m)[:, :, None], n, axis=2), degrees_of_freedom=np.full(n, freedom),
        input_names=[f"q{k}" for k in range(m)], output_names=[f"T{k}" for k in range(p)], sample_time=0.4,
        n_samples=1000, method="made for a test")


def sizes(W, f=F):
    return abs(W(np.exp(2j * np.pi * f * W.dt) if W.dt else 2j * np.pi * f))


@pytest.mark.parametrize(("kind", "dt"), [("additive", 0.0), ("multiplicative", 0.0), ("additive", 0.4),
                                          ("multiplicative", 0.4)])
def test_plants_drawn_from_the_covariance_lie_below(kind, dt):
    """At all bins at once, 99 % of them; the weight is stable, has a stable inverse, and is not far above."""
    G = measured()
    model = control.sample_system(control.ss(MODEL), dt, "zoh") if dt else MODEL
    W = rt.design.uncertainty_weight(G, model, kind=kind)
    at = np.exp(2j * np.pi * F * dt) if dt else 2j * np.pi * F
    rng = np.random.default_rng(5)
    drawn = G.response[0, 0] + 0.02 * (rng.standard_normal((4000, 80)) + 1j * rng.standard_normal((4000, 80))) / 2**0.5
    gap = abs(drawn - model(at)) / (abs(model(at)) if kind == "multiplicative" else 1)
    below = np.mean((gap <= sizes(W)).all(axis=1))
    assert below >= 0.99 and np.mean((gap <= 0.6 * sizes(W)).all(axis=1)) < 0.5
    assert W.dt == dt and W.nstates == 4 and (sizes(W) < 3 * gap.max(axis=0)).all()
    limits = (abs(W.poles()), abs(W.zeros())) if dt else (1 + W.poles().real, 1 + W.zeros().real)
    assert max(part.max() for part in limits) < 1


@pytest.mark.exhaustive
def test_the_true_plant_lies_below_in_the_stated_share_of_measurements():
    """Few degrees of freedom: circles by F(2, 2q). 60 measurements, p = 0.9; at most 13 misses has probability 0.99."""
    missed = 0
    for seed in range(60):
        G = measured(sigma=0.3, seed=seed, f=F[::4])
        W = rt.design.uncertainty_weight(G, MODEL, probability=0.9, order=1)
        missed += bool((abs(PLANT(2j * np.pi * F[::4]) - MODEL(2j * np.pi * F[::4])) > sizes(W, F[::4])).any())
    assert missed <= 13


def test_two_inputs_and_outputs_by_brute_force():
    """The largest singular value of what entries in their circles make, phases drawn."""
    def plant(s):
        return np.array([[2 / (30 * s + 1), 0.5 / (9 * s + 1)], [0.3 / (12 * s + 1), 1.5 / (20 * s + 1)]])

    model = control.append(control.ss(control.tf([2.0], [32, 1])), control.ss(control.tf([1.6], [20, 1])))
    G, rng = measured(plant, seed=3), np.random.default_rng(0)
    radius = np.moveaxis(G.confidence_radius(1 - 0.01 / 320), 2, 0)
    nominal = np.array([model(2j * np.pi * f) for f in F])
    for kind in ("additive", "multiplicative"):
        W, worst = rt.design.uncertainty_weight(G, model, kind=kind), np.zeros(80)
        for _ in range(40):
            gap = np.moveaxis(G.response, 2, 0) + radius * np.exp(2j * np.pi * rng.random((80, 2, 2))) - nominal
            gap = gap @ np.linalg.inv(nominal) if kind == "multiplicative" else gap
            worst = np.maximum(worst, np.linalg.norm(gap, 2, axis=(1, 2)))
        assert (worst <= sizes(W)).all() and (sizes(W) < 3.5 * worst).all()


def test_every_record_is_covered_and_neighbors_hold_between_bins():
    stiff = control.tf([2.6], np.polymul([22, 1], [2, 1]))
    G = [measured(), measured(stiff, seed=1)]
    W, alone = (rt.design.uncertainty_weight(one, MODEL) for one in (G, G[0]))
    assert (sizes(W) > abs(stiff(2j * np.pi * F) - MODEL(2j * np.pi * F))).all()
    assert not (sizes(alone) > abs(stiff(2j * np.pi * F) - MODEL(2j * np.pi * F))).all()
    between = np.sqrt(F[1:] * F[:-1])
    gap = abs(G[0].response[0, 0] - MODEL(2j * np.pi * F))
    assert (sizes(alone, between) > np.maximum(gap[1:], gap[:-1])).all()
    assert sizes(alone, np.array([1e-9]))[0] > gap[0] and sizes(alone, np.array([30.0]))[0] > gap[-1]


def test_a_controller_made_for_the_weight_is_stable_with_every_plant_below_it():
    """|K S| < 1/|W|: model + W times any stable all-pass is stabilized; an unstable loop appears beyond the weight."""
    W = rt.design.uncertainty_weight(measured(), MODEL, order=2)
    M, shape = control.ss(MODEL), control.ss(control.tf([0.02], [1, 0.002]))  # of the error e = r - y
    n, k = M.nstates, W.nstates
    A = np.block([[M.A, np.zeros((n, k + 1))], [np.zeros((k, n)), W.A, np.zeros((k, 1))],
                  [-shape.B @ M.C, -shape.B @ W.C, shape.A]])
    B = np.block([[np.zeros((n, 2)), M.B], [W.B, np.zeros((k, 2))], [-shape.B @ W.D, shape.B, np.zeros((1, 1))]])
    C = np.block([[np.zeros((1, n + k + 1))], [np.zeros((1, n + k)), shape.C], [-M.C, -W.C, np.zeros((1, 1))]])
    D = np.block([[np.zeros((1, 2)), np.eye(1)], [np.zeros((1, 3))], [-W.D, np.eye(1), np.zeros((1, 1))]])
    d = rt.design.hinf(control.ss(A, B, C, D), 1, 1)
    assert d.holds and d.value < 1 and abs(d.controller(0)) > 1
    poles = []
    for size in (1.0, 40.0):
        worst = -np.inf
        for corner in np.geomspace(1e-3, 10, 25):
            for sign in (1, -1):
                other = M + W * control.ss(control.tf([-1 * sign * size, corner * sign * size], [1, corner]))
                loop = control.feedback(other * d.controller, 1, -1)
                worst = max(worst, loop.poles().real.max())
        poles.append(worst)
    assert poles[0] < 0 < poles[1]


@pytest.mark.parametrize(("arguments", "words"), [
    ({"kind": "inverse"}, "kind"), ({"probability": 1.0}, "probability"), ({"order": 0}, "order"),
    ({"G": []}, "no resp"), ({"G": MODEL}, "TransferFunction"), ({"model": 3.0}, "argument model"),
    ({"order": 2.5}, "order"),
    ({"model": control.append(control.ss(MODEL), control.ss(MODEL))}, "the model has 2 and 2"),
    ({"model": control.tf([0.0], [1, 1]), "kind": "multiplicative"}, "no inverse"),
    ({"model": control.sample_system(control.ss(MODEL), 480.0)}, "bins above zero and below Nyquist")])
def test_bad_arguments_are_named(arguments, words):
    given = {"G": measured(), "model": MODEL, **arguments}
    with pytest.raises(InputError, match=words):
        rt.design.uncertainty_weight(given.pop("G"), given.pop("model"), **given)


def test_responses_without_covariance_or_with_lost_bins_are_refused():
    G = measured()
    bare = rt.identify.FrequencyResponse(
        frequencies=F, response=G.response, noise_covariance=np.full((1, 1, 80), np.nan), gram=np.ones((1, 1, 80)),
        degrees_of_freedom=np.zeros(80), input_names=["q"], output_names=["T"], sample_time=0.4, n_samples=1000,
        method="made for a test")
    with pytest.raises(InputError, match="without covariance"):
        rt.design.uncertainty_weight(bare, MODEL)
    broken = G.response.copy()
    broken[0, 0, 7] = np.nan
    lost = rt.identify.FrequencyResponse(
        frequencies=F, response=broken, noise_covariance=np.full((1, 1, 80), 1e-4), gram=np.ones((1, 1, 80)),
        degrees_of_freedom=np.full(80, 50), input_names=["q"], output_names=["T"], sample_time=0.4, n_samples=1000,
        method="made for a test")
    with pytest.raises(InputError, match="1 bins are not determined"):
        rt.design.uncertainty_weight(lost, MODEL)
