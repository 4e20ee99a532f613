"""PI of several inputs and outputs from frequency responses: search over all gains, drawn plants, refusals."""

from __future__ import annotations

import control
import numpy as np
import pytest
from scipy.optimize import minimize

import robthermal as rt
from robthermal.errors import InputError
from robthermal.identify import FrequencyResponse


def plant_of(channels):
    """State space of a 2x2 table of transfer functions."""
    blocks = control.append(*(control.ss(one) for row in channels for one in row))
    inputs, outputs = np.array([[1, 0], [0, 1], [1, 0], [0, 1.0]]), np.array([[1, 1, 0, 0], [0, 0, 1, 1.0]])
    return control.ss(blocks.A, blocks.B @ inputs, outputs @ blocks.C, np.zeros((2, 2)))


LAGS = plant_of([[control.tf([2], [1, 2, 1]), control.tf([0.8], [4, 4, 1])],
                 [control.tf([-0.5], [1, 2, 1]), control.tf([1], np.poly([-2, -2, -2]) / 8)]])
OMEGA = np.geomspace(1e-3, 100, 250)
STATIC = LAGS(0).real
DIAGONAL, FULL = [(0, 0), (1, 1)], [(0, 0), (0, 1), (1, 0), (1, 1)]


def matrices(gains):
    return [np.array([[gains[f"{name}{r}{c}"] for c in "12"] for r in "12"]) for name in ("Kp", "Ki")]


def action(Ki):
    return float(np.linalg.eigvalsh(STATIC @ Ki + (STATIC @ Ki).T)[0]) / 2


def margin_of(Kp, Ki, responses):
    K = Kp + Ki / (1j * OMEGA)[:, None, None]
    return float(np.linalg.svd(np.eye(2) + responses @ K, compute_uv=False)[:, -1].min())


def poles(plant, Kp, Ki):
    """Of y' into the integrators, by hand."""
    return np.linalg.eigvals(np.block([[plant.A - plant.B @ Kp @ plant.C, plant.B @ Ki],
                                       [-plant.C, np.zeros((2, 2))]]))


@pytest.fixture(scope="module")
def designs():
    return {name: rt.design.frf_pid(LAGS, modulus_margin=0.6, decentralized=name == "diagonal")
            for name in ("diagonal", "full")}


@pytest.mark.parametrize(("name", "free"), [("diagonal", DIAGONAL), ("full", FULL)])
def test_no_gains_of_a_search_have_more_integral_action(designs, name, free):
    d = designs[name]
    assert d.holds and rt.verify(d.certificates[0]).valid and d.certificates[0].kind == "closed_loop"
    Kp, Ki = matrices(d.gains)
    responses = np.moveaxis(LAGS(1j * OMEGA), -1, 0)
    assert margin_of(Kp, Ki, responses) >= 0.6 - 1e-9 and poles(LAGS, Kp, Ki).real.max() < 0
    cross = [d.gains[f"{which}{entry}"] for which in ("Kp", "Ki") for entry in ("12", "21")]
    assert any(cross) == (name == "full")
    rows, columns = np.array(free).T

    def cost(x):
        P, I = np.zeros((2, 2)), np.zeros((2, 2))  # noqa: E741
        P[rows, columns], I[rows, columns] = x[:len(free)], x[len(free):]
        broken = max(0.0, 0.6 - margin_of(P, I, responses)) + max(0.0, poles(LAGS, P, I).real.max() + 1e-4)
        return 100 * broken - action(I)

    rng = np.random.default_rng(0)
    starts = [rng.uniform(0, 0.6, 2 * len(free)), np.r_[Kp[rows, columns], Ki[rows, columns]]]
    best = min(minimize(cost, x, method="Nelder-Mead", options={"maxfev": 700}).fun for x in starts)
    assert 0.3 < -best <= 1.005 * action(Ki)


def test_all_entries_reach_more_than_the_diagonal(designs):
    full, diagonal = (action(matrices(designs[name].gains)[1]) for name in ("full", "diagonal"))
    assert full > 1.5 * diagonal > 0.5
    assert designs["full"].margins["both loops"]["modulus"] >= 0.6 - 1e-6
    assert designs["full"].value <= 1 / 0.6 * 1.001


def measured(noise, seed=0, dof=200):
    """Response of LAGS with independent errors of one size in every entry, and their covariance."""
    rng, count = np.random.default_rng(seed), len(OMEGA)
    error = noise / np.sqrt(2) * (rng.standard_normal((2, 2, count)) + 1j * rng.standard_normal((2, 2, count)))
    return FrequencyResponse(
        frequencies=OMEGA / (2 * np.pi), response=LAGS(1j * OMEGA) + error,
        noise_covariance=noise**2 * np.eye(2)[:, :, None] * np.ones(count),
        covariance=noise**2 * np.eye(4)[:, :, None] * np.ones(count), degrees_of_freedom=np.full(count, dof),
        input_names=["q1", "q2"], output_names=["T1", "T2"], sample_time=0.01, n_samples=10_000,
        method="made for a test", notes=())


@pytest.mark.exhaustive
def test_plants_drawn_from_the_covariance_keep_the_margin(designs):
    d = rt.design.frf_pid(measured(0.004), modulus_margin=0.5, probability=0.95)
    assert d.holds and d.outcome.code == "at_the_bins" and d.robust_against.data["probability"] == 0.95
    Kp, Ki = matrices(d.gains)
    assert poles(LAGS, Kp, Ki).real.max() < 0
    truth = np.moveaxis(LAGS(1j * OMEGA), -1, 0)
    assert margin_of(Kp, Ki, truth) > 0.5
    kept = []
    for seed in range(40):  # around the estimate, each with the covariance of the estimate
        other = np.moveaxis(measured(0.004, seed=100 + seed).response, -1, 0) - truth
        kept.append(margin_of(Kp, Ki, np.moveaxis(measured(0.004).response, -1, 0) + other) >= 0.5)
    assert all(kept)
    without = rt.design.frf_pid(LAGS, modulus_margin=0.5)
    assert action(Ki) < action(matrices(without.gains)[1])  # the circles cost something


def test_a_sampled_controller_is_certified_with_the_sampled_plant():
    sampled = control.c2d(LAGS, 0.05)
    d = rt.design.frf_pid(sampled, structure="pid", modulus_margin=0.6, decentralized=True)
    assert d.holds and d.controller.dt == 0.05 and rt.verify(d.certificates[0]).valid
    loop = control.feedback(sampled, d.controller)
    assert np.abs(loop.poles()).max() < 1
    z = np.exp(0.3j)
    expected = d.gains["Kp22"] + d.gains["Ki22"] * 0.05 * z / (z - 1)
    tau = d.structure.filter_time
    expected += d.gains["Kd22"] * (z - 1) / ((0.05 + tau) * z - tau)
    assert d.controller(z)[1, 1] == pytest.approx(expected) and d.controller(z)[0, 1] == 0


def test_circles_that_allow_no_loop_within_the_bins_are_a_result():
    d = rt.design.frf_pid(measured(0.2), modulus_margin=0.9)
    assert not d.holds and not d.certificates and d.outcome.code == "infeasible"
    assert d.value == np.inf and "crosses 1 below the first bin" in d.outcome.text


@pytest.mark.parametrize(("plant", "more", "message"), [
    (control.ss(LAGS.A, LAGS.B[:, :1], LAGS.C, np.zeros((2, 1))), {}, "1 inputs and 2 outputs"),
    (LAGS, {"structure": "pd"}, '"pi" or "pid"'), (LAGS, {"structure": 3}, '"pi" or "pid"'),
    (LAGS, {"weights": {"S": 1.0}}, "weights beside several inputs"),
    (LAGS, {"bandwidth": 1.0}, "bandwidth beside several"),
    (LAGS, {"unstable_poles": 1}, "unstable_poles beside several"),
    (LAGS, {"initial": {"Kp": 1.0}}, "expected gains|Expected gains"),
    (control.ss(-np.eye(2), np.eye(2), [[1, 2], [2, 1]], np.zeros((2, 2))), {"decentralized": True},
     "not every plant"),
    (control.ss(LAGS.A, LAGS.B[:, [0, 0]], LAGS.C, np.zeros((2, 2))), {}, "invertible static gain"),
    (control.tf([1], [1, 1]), {"decentralized": True}, "decentralized with one input"),
    (control.ss(-np.eye(5), np.eye(5), np.eye(5), 0 * np.eye(5)), {}, "as many of each, at most 4"),
    ([LAGS, control.ss(-np.eye(3), np.eye(3), np.eye(3), 0 * np.eye(3))], {}, "responses with 2 and 3 inputs"),
    (LAGS, {"sample_time": 1.0}, "sample_time = 1 s of a controller for a model of another"),
])
def test_bad_arguments_are_named(plant, more, message):
    with pytest.raises(InputError, match=message):
        rt.design.frf_pid(plant, **more)


THREE = [control.tf([1.0], np.polymul([T, 1], [T / 3, 1])) for T in (0.5, 1.0, 1.5)]
CROSS = np.array([[1.0, 0.2, -0.1], [-0.15, 0.9, 0.2], [0.1, -0.2, 1.1]])
BINS = np.geomspace(1e-2, 100, 70)


def recorded(response, noise=0.0):
    """The response with a covariance of one size in every entry."""
    size, count = len(response), len(BINS)
    return FrequencyResponse(
        frequencies=BINS / (2 * np.pi), response=response, degrees_of_freedom=np.full(count, 200),
        noise_covariance=noise**2 * np.eye(size)[:, :, None] * np.ones(count),
        covariance=noise**2 * np.eye(size**2)[:, :, None] * np.ones(count), input_names=[f"q{k}" for k in range(size)],
        output_names=[f"T{k}" for k in range(size)], sample_time=0.01, n_samples=10_000, method="made for a test",
        notes=())


def three(cross, noise=0.0, seed=0):
    """Response of three lags with inputs mixed, independent errors in every entry."""
    rng = np.random.default_rng(seed)
    truth = np.array([lag(1j * BINS) for lag in THREE])[:, None, :] * cross[:, :, None]
    error = rng.standard_normal(truth.shape) + 1j * rng.standard_normal(truth.shape)
    return recorded(truth + noise / np.sqrt(2) * error, noise)


def gains_of_three(d):
    return [np.array([[d.gains[f"{name}{r}{c}"] for c in "123"] for r in "123"]) for name in ("Kp", "Ki")]


def margin_of_three(Kp, Ki, response):
    K = Kp + Ki / (1j * BINS)[:, None, None]
    return float(np.linalg.svd(np.eye(3) + np.moveaxis(response, -1, 0) @ K, compute_uv=False)[:, -1].min())


def test_three_loops_that_do_not_interact_are_limited_by_the_slowest_alone():
    """Its largest integral gain by brute force over PI gains: margin at the bins, stability by Routh's criterion."""
    d = rt.design.frf_pid(three(np.eye(3)), modulus_margin=0.6, decentralized=True)
    assert d.holds and d.outcome.code == "at_the_bins" and set(d.margins) == {"all loops"}
    _, Ki = gains_of_three(d)
    P, I = np.meshgrid(np.linspace(0, 8, 161), np.linspace(0.02, 6, 300), indexing="ij")  # noqa: E741
    C = P[..., None] + I[..., None] / (1j * BINS)
    inside = abs(1 + THREE[2](1j * BINS) * C).min(axis=-1) >= 0.6
    stable = 4 * 1.5 / 3 * (1 + P) > 1.5**2 / 3 * I  # of 0.75 s³ + 2 s² + (1 + Kp) s + Ki
    assert min(np.diag(Ki)) == pytest.approx(I[inside & stable].max(), rel=0.02)
    assert np.count_nonzero(Ki) == 3 and d.controller.ninputs == d.controller.noutputs == 3


def test_three_interacting_loops_keep_the_margin_over_the_circles():
    measured_three = three(CROSS, 0.004)
    d = rt.design.frf_pid(measured_three, modulus_margin=0.5, decentralized=True, probability=0.95)
    assert d.holds and d.robust_against.data["probability"] == 0.95
    Kp, Ki = gains_of_three(d)
    truth = three(CROSS).response
    kept = [margin_of_three(Kp, Ki, measured_three.response + three(CROSS, 0.004, 100 + seed).response - truth)
            for seed in range(40)]
    assert min(kept) >= 0.5 and margin_of_three(Kp, Ki, truth) > 0.5
    blocks = control.ss(control.append(*(control.ss(one) for one in THREE)))
    B = blocks.B @ CROSS
    loop = np.block([[blocks.A - B @ Kp @ blocks.C, B @ Ki], [-blocks.C, np.zeros((3, 3))]])
    assert np.linalg.eigvals(loop).real.max() < 0


@pytest.mark.exhaustive
@pytest.mark.parametrize("decentralized", [True, False])
def test_no_gains_of_a_search_over_three_loops_have_more_integral_action(decentralized):
    response = three(CROSS)
    d = rt.design.frf_pid(response, modulus_margin=0.6, decentralized=decentralized)
    Kp, Ki = gains_of_three(d)
    free = np.eye(3, dtype=bool) if decentralized else np.ones((3, 3), bool)
    static = CROSS  # lags of static gain one

    def cost(x):
        P, I = np.zeros((3, 3)), np.zeros((3, 3))  # noqa: E741
        P[free], I[free] = np.split(x, 2)
        return 100 * max(0.0, 0.6 - margin_of_three(P, I, response.response)) - np.linalg.eigvalsh(
            static @ I + (static @ I).T)[0] / 2

    own = np.linalg.eigvalsh(static @ Ki + (static @ Ki).T)[0] / 2
    x = np.r_[Kp[free], Ki[free]]
    found = minimize(cost, x, method="Nelder-Mead", options={"maxfev": 6000, "adaptive": True})  # stays stable: near
    assert own > 0.3 and -found.fun <= 1.02 * own


@pytest.mark.exhaustive
def test_three_loops_of_a_model_are_certified():
    blocks = control.ss(control.append(*(control.ss(one) for one in THREE)))
    plant = control.ss(blocks.A, blocks.B @ CROSS, blocks.C, np.zeros((3, 3)))
    d = rt.design.frf_pid(plant, modulus_margin=0.6, decentralized=True)
    assert d.holds and d.certificates[0].kind == "closed_loop" and rt.verify(d.certificates[0]).valid
    assert d.value <= 1 / 0.6 * 1.001


def test_initial_gains_that_do_not_stabilize_are_refused():
    gains = {f"{name}{r}{c}": 0.0 for name in ("Kp", "Ki") for r in "12" for c in "12"}
    with pytest.raises(InputError, match="does not turn as that of a stable loop"):
        rt.design.frf_pid(LAGS, initial=gains | {"Ki11": 3.0, "Ki22": 3.0})
