"""Subsystems of several inputs and outputs, against python-control's own interconnection and brute force."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest
from scipy.linalg import block_diag

import robthermal as rt

from .conftest import Array, make_random_pair

DT = 0.01
W = np.linspace(0.5, 314.0, 500)
DRIFT = control.tf([0.2], [1, -0.98], DT)


def values(system: control.StateSpace, omega: Array = W) -> Array:
    """Responses by python-control, frequency first."""
    points = np.exp(1j * omega * system.dt) if system.dt else 1j * omega
    return np.moveaxis(np.asarray(system(points, squeeze=False)), -1, 0)


def make_plant(rng: np.random.Generator, outputs: int, inputs: int, *, states: int = 4, size: float = 0.9
               ) -> control.StateSpace:
    """Random plant with direction-dependent wrong-side zeros and a delay in every channel."""
    A = rng.normal(size=(states, states))
    A *= size / np.abs(np.linalg.eigvals(A)).max()
    return control.ss(A, rng.normal(size=(states, inputs)), rng.normal(size=(outputs, states)),
                      np.zeros((outputs, inputs)), DT)


def make_controller(rng: np.random.Generator, plant: control.StateSpace) -> control.StateSpace:
    """Full matrix with a pole at z = 0.6, of loop gain below one."""
    largest = np.linalg.norm(values(plant), 2, axis=(1, 2)).max()
    K = rng.normal(size=(plant.ninputs, plant.noutputs))
    K *= 0.5 / largest / np.linalg.norm(K, 2)
    return control.ss([[0.6]], np.ones((1, plant.noutputs)), 0.2 * K[:, :1], K, DT)


@pytest.fixture(scope="module")
def pair() -> tuple[control.StateSpace, ...]:
    rng = np.random.default_rng(1)
    plants = make_plant(rng, 2, 2), make_plant(rng, 2, 1)  # the second is tall: one input for two outputs
    return *plants, *(make_controller(rng, plant) for plant in plants)


def random_filter(rng: np.random.Generator, outputs: int, inputs: int) -> control.StateSpace:
    A = np.diag(rng.uniform(-0.8, 0.8, 3))
    return control.ss(A, 0.5 * rng.normal(size=(3, inputs)), 0.5 * rng.normal(size=(outputs, 3)),
                      0.4 * rng.normal(size=(outputs, inputs)), DT)


@pytest.fixture(scope="module")
def given(pair: tuple[control.StateSpace, ...]) -> rt.coupling.MatrixFilters:
    rng = np.random.default_rng(4)
    return rt.coupling.evaluate_matrix(*pair, X_hat=random_filter(rng, 2, 2), Y_hat=random_filter(rng, 1, 2),
                                       disturbances=(DRIFT, DRIFT))


@pytest.mark.parametrize(("outputs", "inputs", "size"), [(2, 2, 0.9), (3, 3, 1.2), (3, 2, 0.95)])
def test_the_plant_times_q_is_inner(outputs: int, inputs: int, size: float) -> None:
    plant = make_plant(np.random.default_rng(outputs), outputs, inputs, states=5, size=size)  # unstable for 1.2
    Z, Q = rt.coupling.inner_factor(plant)
    z, q = values(Z), values(Q)
    np.testing.assert_allclose(values(plant) @ q, z, atol=1e-10)
    np.testing.assert_allclose(z.conj().transpose(0, 2, 1) @ z - np.eye(inputs), 0.0, atol=1e-10)
    assert np.abs(np.linalg.eigvals(Z.A)).max() < 1


def test_in_continuous_time_the_cut_off_takes_the_place_of_the_low_pass() -> None:
    """Two double integrators turned into each other: directions roll off as a Butterworth filter of order two."""
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    A = block_diag([[0, 1], [0, 0]], [[0, 1], [0, 0]])
    B, C = block_diag([[0], [1]], [[0], [1]]), block_diag([[1, 0]], [[1, 0]])
    plant = control.ss(A, B @ turn, C, np.zeros((2, 2)))
    Z, Q = rt.coupling.inner_factor(plant, cutoff=30.0)
    omega = np.geomspace(0.3, 3000, 60)
    singular = np.linalg.svd(values(Z, omega), compute_uv=False)
    np.testing.assert_allclose(singular, np.repeat(1 / np.sqrt(1 + (omega / 30.0) ** 4)[:, None], 2, 1), rtol=1e-8)
    np.testing.assert_allclose(values(plant, omega) @ values(Q, omega), values(Z, omega), atol=1e-9)


def test_coupled_loop_by_direct_interconnection(given: rt.coupling.MatrixFilters,
                                                pair: tuple[control.StateSpace, ...]) -> None:
    """(I + P K)⁻¹ of the controller's numbers: diagonal blocks kept, improvement left of the sensitivity."""
    P1, P2, C1, C2 = pair
    loop = control.feedback(control.append(P1, P2), given.controller)
    assert np.abs(loop.poles()).max() < 1 and given.nominally_stable
    eye = np.eye(2)
    S = np.linalg.inv(np.eye(4) + values(control.append(P1, P2)) @ values(given.controller))
    S1, S2 = (np.linalg.inv(eye + values(P) @ values(C)) for P, C in ((P1, C1), (P2, C2)))
    X, Y = values(given.X), values(given.Y)
    np.testing.assert_allclose(S, np.block([[S1, -X @ S2], [-Y @ S1, S2]]), atol=1e-9)
    e12 = S[:, 2:] - S[:, :2]
    np.testing.assert_allclose(e12, np.concatenate([-(eye + Y) @ S1, (eye + X) @ S2], axis=2), atol=1e-9)
    assert np.abs(S1 @ (eye + Y) - (eye + Y) @ S1).max() > 0.05  # the order counts
    np.testing.assert_allclose(values(P1) @ values(given.X_input), X, atol=1e-9)
    np.testing.assert_allclose(values(P2) @ values(given.Y_input), Y, atol=1e-9)


def test_norms_bound_and_are_tight(given: rt.coupling.MatrixFilters, pair: tuple[control.StateSpace, ...]) -> None:
    fine = np.linspace(1e-3, np.pi / DT, 4000)
    eye = np.eye(2)
    S1, S2 = (np.linalg.inv(eye + values(P, fine) @ values(C, fine)) for P, C in (pair[::2], pair[1::2]))
    X, Y, w = values(given.X, fine), values(given.Y, fine), values(control.ss(DRIFT), fine)
    row = np.concatenate([(eye + Y) @ S1 * w, (eye + X) @ S2 * w], axis=2)
    truth = {"X": X, "Y": Y, "XY": X @ Y, "improvement_1": eye + Y, "improvement_2": eye + X, "hinf": row,
             "hinf_uncoupled": np.concatenate([S1 * w, S2 * w], axis=2)}
    for key, response in truth.items():
        largest = np.linalg.norm(response, 2, axis=(1, 2)).max()
        assert largest <= given.norms[key] <= 1.01 * largest, key
    power = np.sum(np.abs(row) ** 2, axis=(1, 2))
    assert given.norms["h2"] == pytest.approx(np.sqrt(np.trapezoid(power, fine) * DT / np.pi), rel=1e-3)
    assert not np.isclose(given.norms["XY"], np.linalg.norm(Y @ X, 2, axis=(1, 2)).max(), rtol=0.02)


def test_certificates_are_verified_and_mutants_rejected(given: rt.coupling.MatrixFilters) -> None:
    proof = given.proofs["internal stability"]
    assert rt.verify(proof).valid
    A = np.array([[float(v) for v in row] for row in proof.system["A"]])
    wrong = replace(proof, system={**proof.system, "A": (A + np.eye(len(A))).tolist()})
    assert not rt.verify(wrong).valid


def with_delta(problem: Any, delta: Array) -> control.StateSpace:
    """The plant (Np + Dk Δ/z)(Dp - Nk Δ/z)⁻¹ of a constant Δ, one sample late."""
    Np, Dp, Nk, Dk = (control.append(*(getattr(loop, name) for loop in problem.factors.loops))
                      for name in ("Z", "Q", "Nk", "Dk"))
    D = control.ss(np.zeros((3, 3)), np.eye(3), delta, np.zeros((4, 3)), DT)
    denominator = Dp - Nk * D
    inverse = np.linalg.inv(denominator.D)
    A = denominator.A - denominator.B @ inverse @ denominator.C
    back = control.StateSpace(A, denominator.B @ inverse, -inverse @ denominator.C, inverse, DT,
                              remove_useless_states=False)
    return (Np + Dk * D) * back


@pytest.fixture(scope="module")
def uncertain(pair: tuple[control.StateSpace, ...], given: rt.coupling.MatrixFilters) -> tuple[Any, list[Array]]:
    """Plants of four constant Δ and what `dual_youla` makes of their responses."""
    rng = np.random.default_rng(8)
    deltas = [0.1 * rng.uniform(-1, 1, (4, 3)) for _ in range(4)]
    plants = [with_delta(given.problem, delta) for delta in deltas]
    fine = np.linspace(0.5, np.pi / DT, 600)
    measured = [control.FRD(np.moveaxis(values(plant, fine), 0, -1), fine) for plant in plants]
    return rt.coupling.dual_youla(measured, pair[:2], pair[2:]), deltas


def test_measured_plants_give_back_the_perturbation_they_were_made_with(uncertain: tuple[Any, list[Array]]) -> None:
    found, deltas = uncertain
    for sample, delta in zip(found.samples, deltas, strict=True):
        np.testing.assert_allclose(sample, delta[:, :, None] * np.exp(-1j * found.omega * DT), atol=1e-7)
    np.testing.assert_allclose(found.envelope[:, :, 7], np.abs(deltas).max(axis=0), atol=1e-7)


def test_robust_filters_stabilize_every_plant_under_the_envelope(pair: tuple[control.StateSpace, ...],
                                                                 uncertain: tuple[Any, list[Array]]) -> None:
    filters = rt.coupling.synthesize_matrix(*pair, uncertainty=uncertain[0], disturbances=(DRIFT, DRIFT), order=4)
    assert filters.holds and filters.verdict == "robust" and filters.norms["robust"] <= 0.9
    assert rt.verify(filters.proofs["robust number"]).valid
    assert filters.norms["h2"] < 0.9 * filters.norms["h2_uncoupled"]
    assert filters.norms["h2"] == pytest.approx(filters.requested["h2"], rel=0.02)
    R = uncertain[0].envelope[:, :, 7]
    rng = np.random.default_rng(5)
    for _ in range(30):
        plant = with_delta(filters.problem, R * rng.choice([-1.0, 1.0], R.shape))
        assert np.abs(control.feedback(plant, filters.controller).poles()).max() < 1


def test_what_is_unstable_with_a_plant_under_the_envelope_is_not_certified(pair: tuple[control.StateSpace, ...],
                                                                           uncertain: tuple[Any, list[Array]]) -> None:
    filters = rt.coupling.evaluate_matrix(*pair, X_hat=-8.0 * np.eye(2), Y_hat=[[6.0, -6.0]], uncertainty=uncertain[0])
    R = uncertain[0].envelope[:, :, 7]
    rng = np.random.default_rng(5)
    radii = [np.abs(control.feedback(with_delta(filters.problem, R * rng.choice([-1.0, 1.0], R.shape)),
                                     filters.controller).poles()).max() for _ in range(30)]
    assert max(radii) > 1  # brute force: one of them is unstable
    assert filters.nominally_stable and not filters.robustly_stable and not filters.holds
    assert filters.norms["robust"] >= 1 and filters.outcome.code == "not_robust"


def test_coefficients_are_of_least_variance(pair: tuple[control.StateSpace, ...]) -> None:
    """No direction of X_hat or Y_hat lowers the variance, integrated from python-control's responses."""
    found = rt.coupling.synthesize_matrix(*pair, disturbances=(DRIFT, DRIFT), basis="fir", order=3)
    fine = np.concatenate([np.geomspace(1e-3, 1.0, 200)[:-1], np.linspace(1.0, np.pi / DT, 3000)])
    eye, w, delay = np.eye(2), values(control.ss(DRIFT), fine), np.exp(-1j * fine * DT)
    rng = np.random.default_rng(2)
    for P, C, Z, hat in ((pair[1], pair[3], found.Z1, found.X_hat), (pair[0], pair[2], found.Z2, found.Y_hat)):
        S, z, F = np.linalg.inv(eye + values(P, fine) @ values(C, fine)) * w, values(Z, fine), values(hat, fine)

        def variance(change: Array, S: Array = S, z: Array = z, F: Array = F) -> float:
            error = (eye + z @ (F + sum(delay[:, None, None] ** k * change[k] for k in range(3)))) @ S
            return float(np.trapezoid(np.sum(np.abs(error) ** 2, axis=(1, 2)), fine))

        shape, least = (3, *F.shape[1:]), variance(np.zeros((3, *F.shape[1:])))
        for _ in range(20):
            change = rng.normal(size=shape)
            change *= 0.02 / np.linalg.norm(change)
            assert variance(change) > least * (1 - 1e-6) and variance(change) + variance(-change) > 2 * least


def test_one_channel_each_is_close_to_the_cone_program() -> None:
    pair = make_random_pair(3)
    plants = pair.P1, pair.P2, pair.C1, pair.C2
    rng = np.random.default_rng(0)
    fine = np.linspace(0.5, np.pi / DT, 300)
    size = np.abs(values(control.append(pair.P1, pair.P2), fine)).max()
    measured = []
    for _ in range(2):
        P = values(control.append(pair.P1, pair.P2), fine)
        extra = 0.2 * size * rng.uniform(-1, 1, (2, 2)) / (np.exp(1j * fine * DT)[:, None, None] - 0.5)
        measured.append(control.FRD(np.moveaxis(P + 0.5 * extra, 0, -1), fine))
    options: dict[str, Any] = {"uncertainty": measured, "disturbances": (DRIFT, DRIFT), "order": 4, "pole": 0.8}
    cones = rt.coupling.synthesize(*plants, **options)
    ours = rt.coupling.synthesize_matrix(*plants, **options)
    assert cones.holds and ours.holds
    assert ours.norms["h2_uncoupled"] == pytest.approx(cones.norms["h2_uncoupled"], rel=1e-6)
    assert ours.norms["h2"] < 1.03 * cones.norms["h2"] < 0.97 * cones.norms["h2_uncoupled"]


def test_controllers_with_integrators_in_continuous_time() -> None:
    """Coupled masses under a decoupled PID: normalized factors of K, low-pass from the cut-off."""
    A = block_diag([[0, 1], [0, 0]], [[0, 1], [0, 0]])
    B, C = block_diag([[0], [1.0]], [[0], [0.5]]) @ np.array([[1.0, 0.3], [-0.2, 1.0]]), block_diag([[1, 0]], [[1, 0]])
    plant = control.ss(A, B, C, np.zeros((2, 2)))
    law = control.ss(control.tf([60, 100, 40], [0.02, 1, 0]))
    inverse = np.linalg.inv(np.array([[1.0, 0.0], [0.0, 0.5]]) @ np.array([[1.0, 0.3], [-0.2, 1.0]]))
    K = control.ss([], [], [], inverse) * control.append(law, law)
    noise = control.tf([1.0], [1, 0.1])
    filters = rt.coupling.synthesize_matrix(plant, plant, K, K, disturbances=(noise, noise), order=4, cutoff=100.0,
                                            weight=control.tf([1.0], [0.01, 1.0]))
    assert filters.holds and filters.verdict == "nominal"
    assert filters.norms["h2"] < 0.8 * filters.norms["h2_uncoupled"]
    loop = control.feedback(control.append(plant, plant), filters.controller)
    assert loop.poles().real.max() < 0


def test_bad_input_is_named(pair: tuple[control.StateSpace, ...], uncertain: tuple[Any, list[Array]]) -> None:
    P1, P2, C1, C2 = pair
    wide = make_plant(np.random.default_rng(2), 2, 3)
    twice = control.ss(P1.A, P1.B[:, [0, 0]], P1.C, np.zeros((2, 2)), DT)
    cases: list[tuple[str, Any]] = [
        ("evaluate_matrix and synthesize_matrix", lambda: rt.coupling.evaluate(*pair)),
        ("P1: 3 inputs and 2 outputs", lambda: rt.coupling.evaluate_matrix(wide, P2, make_controller(
            np.random.default_rng(3), wide), C2)),
        ("P: no stable Q makes P Q inner", lambda: rt.coupling.inner_factor(twice)),
        ("P1 has 2 outputs, P2 has 3", lambda: rt.coupling.evaluate_matrix(
            P1, make_plant(np.random.default_rng(3), 3, 2), C1, C2)),
        ("C2 has 2 outputs and 2 inputs", lambda: rt.coupling.evaluate_matrix(P1, P2, C1, C1)),
        ("loop of plant and controller is unstable", lambda: rt.coupling.evaluate_matrix(P1, P2, 30 * C1, C2)),
        ("X_hat: is unstable", lambda: rt.coupling.evaluate_matrix(*pair, X_hat=control.ss(
            1.1 * np.eye(2), np.eye(2), np.eye(2), np.eye(2), DT))),
        ("Y_hat: 2 outputs and 2 inputs", lambda: rt.coupling.evaluate_matrix(*pair, Y_hat=np.eye(2))),
        ("margin = 1.0", lambda: rt.coupling.synthesize_matrix(*pair, margin=1.0)),
        ("basis = 'spline'", lambda: rt.coupling.synthesize_matrix(*pair, basis="spline")),
        ("made for other plants", lambda: rt.coupling.evaluate_matrix(P1, P2, 0.5 * C1, C2, uncertainty=uncertain[0])),
        ("2x2 response", lambda: rt.coupling.dual_youla(control.FRD(np.ones((2, 2, 3)), [1.0, 2, 3]), (P1, P2),
                                                       (C1, C2))),
    ]
    assert len(cases) == 12
    for message, call in cases:
        with pytest.raises(rt.errors.InputError, match=message.replace("(", r"\(")):
            call()


def test_a_measured_plant_that_the_controllers_do_not_stabilize_is_refused(pair: tuple[control.StateSpace, ...]
                                                                           ) -> None:
    P1, P2, C1, C2 = pair
    stiff = -15.0 * C1
    factors = [P1 * 8.0, P2]
    assert np.abs(control.feedback(P1, stiff).poles()).max() < 1 < np.abs(control.feedback(8 * P1, stiff).poles()).max()
    fine = np.linspace(0.5, np.pi / DT, 900)
    measured = control.FRD(np.moveaxis(values(control.append(*factors), fine), 0, -1), fine)
    with pytest.raises(rt.errors.InputError, match="do not stabilize this measured plant"):
        rt.coupling.dual_youla(measured, (P1, P2), (stiff, C2))


def test_result_prints_draws_and_saves(given: rt.coupling.MatrixFilters, tmp_path: Any) -> None:
    import json

    assert "h2_uncoupled" in str(given) and "nominal" in repr(given)
    assert given.plot().shape == (3,)
    given.save(tmp_path / "coupling.json", "pair")
    content = json.loads((tmp_path / "coupling.json").read_text())
    np.testing.assert_array_equal(content["filters"]["controller"]["A"], given.controller.A)
    assert content["sections"] == {} and content["verdict"] == "nominal"


def test_the_simulation_is_the_loop_of_python_control(given: rt.coupling.MatrixFilters,
                                                      pair: tuple[control.StateSpace, ...]) -> None:
    v = np.random.default_rng(6).normal(size=(2, 300, 2))
    run = rt.coupling.simulate(given, disturbances=v)
    stacked, time = np.concatenate([v[0].T, v[1].T]), DT * np.arange(300)
    for controller, e12 in ((given.controller, run.after), (control.append(*pair[2:]), run.before)):
        S = control.feedback(control.ss([], [], [], np.eye(4), DT), control.append(*pair[:2]) * controller)
        y = control.forced_response(S, time, stacked).outputs
        np.testing.assert_allclose(e12, (y[2:] - y[:2]).T, atol=1e-9)
    S1 = control.feedback(control.ss([], [], [], np.eye(2), DT), pair[0] * pair[2])
    np.testing.assert_allclose(run.e1_seen, -control.forced_response(S1, time, v[0].T).outputs.T, atol=1e-9)


def test_a_coupling_that_is_cut_rings_out_and_the_loops_see_nothing(given: rt.coupling.MatrixFilters) -> None:
    v = np.random.default_rng(7).normal(size=(2, 900, 2))
    always, switched = (rt.coupling.simulate(given, disturbances=v, on=on) for on in (None, (100, 400)))
    np.testing.assert_allclose(switched.e2_seen, always.e2_seen, atol=1e-9)
    np.testing.assert_allclose(switched.after[:100], switched.before[:100], atol=1e-12)
    np.testing.assert_allclose(switched.after[-50:], switched.before[-50:], atol=1e-6)
    assert np.abs(switched.after - switched.before)[100:400].max() > 0.1
    assert switched.plot().shape == (2,)


def test_one_channel_as_matrices_runs_like_one_channel() -> None:
    one = make_random_pair(0)
    arguments = one.P1, one.P2, one.C1, one.C2
    filters = rt.coupling.evaluate(*arguments, X_hat=-0.5, Y_hat=0.2)
    matrices = rt.coupling.evaluate_matrix(*(control.ss(part) for part in arguments), X_hat=filters.X_hat,
                                           Y_hat=filters.Y_hat)
    v = np.random.default_rng(8).normal(size=(2, 200))
    runs = [rt.coupling.simulate(each, disturbances=v) for each in (filters, matrices)]
    np.testing.assert_allclose(runs[1].before, runs[0].before, atol=1e-9)
    factor = values(matrices.Z1)[:, 0, 0] / values(filters.Z1)[:, 0, 0]  # Z may differ by its sign
    assert np.allclose(factor, factor[0], atol=1e-6)


@pytest.mark.parametrize("wrong", [np.zeros((2, 50)), np.zeros((2, 50, 3)), [np.zeros((50, 2)), np.zeros((40, 2))],
                                   np.full((2, 50, 2), np.nan)])
def test_disturbances_of_another_shape_are_refused(given: rt.coupling.MatrixFilters, wrong: Any) -> None:
    with pytest.raises(rt.InputError, match=r"shape \(n, 2\) each"):
        rt.coupling.simulate(given, disturbances=wrong)


def test_noise_of_the_design_has_its_variance(given: rt.coupling.MatrixFilters) -> None:
    run = rt.coupling.simulate(given, samples=4000, seed=1)
    assert np.sqrt(np.mean(np.sum(run.after**2, axis=1))) == pytest.approx(given.norms["h2"], rel=0.1)
    assert np.sqrt(np.mean(np.sum(run.before**2, axis=1))) == pytest.approx(given.norms["h2_uncoupled"], rel=0.1)


@pytest.fixture(scope="module")
def designed(pair: tuple[control.StateSpace, ...]) -> rt.coupling.MatrixFilters:
    return rt.coupling.synthesize_matrix(*pair, disturbances=(DRIFT, DRIFT), order=6)


def test_reduced_filters_are_shorter_and_proven_again(designed: rt.coupling.MatrixFilters,
                                                      pair: tuple[control.StateSpace, ...]) -> None:
    short = designed.reduce(tolerance=0.01)
    assert max(short.X_hat.nstates, short.Y_hat.nstates) < max(designed.X_hat.nstates, designed.Y_hat.nstates)
    assert short.holds and short.norms["h2"] <= 1.01 * designed.norms["h2"] < 0.9 * designed.norms["h2_uncoupled"]
    assert np.abs(control.feedback(control.append(*pair[:2]), short.controller).poles()).max() < 1
    assert all(rt.verify(proof).valid for proof in short.certificates)
    fine = np.linspace(1e-3, np.pi / DT, 3000)  # the variance again, from the loop of python-control
    S = np.linalg.inv(np.eye(4) + values(control.append(*pair[:2]), fine) @ values(short.controller, fine))
    e12 = (S[:, 2:] - S[:, :2]) * values(control.ss(DRIFT), fine)
    power = np.sum(np.abs(e12) ** 2, axis=(1, 2))
    assert short.norms["h2"] == pytest.approx(np.sqrt(np.trapezoid(power, fine) * DT / np.pi), rel=2e-3)


def test_filters_without_a_state_too_many_are_not_reduced(designed: rt.coupling.MatrixFilters,
                                                          pair: tuple[control.StateSpace, ...]) -> None:
    gains = rt.coupling.evaluate_matrix(*pair, X_hat=-0.3 * np.eye(2), disturbances=(DRIFT, DRIFT))
    kept = gains.reduce()
    assert kept.outcome.code == "not_reduced" and kept.X_hat is gains.X_hat and kept.holds
    assert designed.reduce(order=2).X_hat.nstates == 2
    with pytest.raises(rt.InputError, match="order"):
        designed.reduce(order=-1)
