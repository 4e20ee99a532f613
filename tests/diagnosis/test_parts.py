"""The parts against independent truth: dense covariance, nonlinear simulation, non-negative least squares, contract."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are
from scipy.optimize import lsq_linear, nnls

import robthermal as rt
from robthermal.diagnosis.data import as_measured
from robthermal.diagnosis.fit import descend, orthonormal, turned
from robthermal.diagnosis.path import LinearizedRecord, gathered, linearized_record, settled, whitener


def machine(plate: bool = False) -> rt.System:
    """A module between two faces, a heater, two sensors, one lagged; a plate that touches the cold face only."""
    return rt.System(
        ambients={"room": {"temperature": 298.15}},
        lumps={"cold": {"capacity": 20.0, "disturbance": 0.05, "initial": 298.15},
               "hot": {"capacity": 60.0, "disturbance": 0.02, "initial": 298.15},
               **({"plate": {"capacity": 30.0, "initial": 298.15}} if plate else {})},
        links=[{"between": ("cold", "room"), "conductance": 0.3}, {"between": ("hot", "room"), "conductance": 2.0},
               *([{"between": ("plate", "cold"), "conductance": 0.8}] if plate else [])],
        inputs={"heater": {"lump": "cold"}},
        modules={"m1": {"hot": "hot", "cold": "cold", "seebeck": 0.05, "resistance": 2.0, "conductance": 0.5}},
        sensors={"Tc": {"lump": "cold", "noise": 0.02}, "Th": {"lump": "hot", "noise": 0.03, "time_constant": 12.0}})


def linearized(system: rt.System) -> LinearizedRecord:
    """The system beside a record of switching inputs."""
    rng = np.random.default_rng(3)
    u = np.repeat(np.column_stack([rng.choice([0.0, 3.0], 12), rng.uniform(-0.5, 1.0, 12),
                                   298.15 + rng.normal(0.0, 1.0, 12)]), 12, axis=0)
    record = rt.Record(sample_time=2.0, inputs=u, outputs=np.full((144, 2), 298.15),
                       input_names=["heater", "m1", "room"], output_names=["Tc", "Th"])
    return linearized_record(system, as_measured(system, record, "records")[0])


@pytest.fixture(scope="module")
def cooler() -> rt.System:
    return machine()


@pytest.fixture(scope="module")
def path(cooler: rt.System) -> LinearizedRecord:
    return linearized(cooler)


@pytest.fixture(scope="module")
def with_gaps() -> LinearizedRecord:
    """Links can be missing here: the plate has none to the room nor to the hot face."""
    return linearized(machine(plate=True))


def test_catalog_is_the_contract() -> None:
    known = rt.thermal.effects()
    assert set(known) == set(rt.diagnosis.effects())
    for name, effect in rt.diagnosis.effects().items():
        assert {q.name for q in effect.quantities} <= set(known[name].parameters)
        assert effect.separated_by and effect.confused_with


def test_units_are_those_of_the_column(cooler: rt.System) -> None:
    percent = cooler.model_copy(update={"inputs": {"heater": cooler.inputs["heater"].model_copy(update={"gain": 0.2})}})
    for system, heater in ((cooler, "W"), (percent, "unit")):
        tried = rt.diagnosis.candidates(system, ["input_offset", "input_saturation"])
        known = {(c.where[0], q.name): q.unit for c in tried for q in c.effect.quantities}
        assert known["heater", "offset"] == known["heater", "clip"] == heater
        assert known["heater", "cubic"] == f"1/{heater}²"
        assert known["m1", "offset"] == known["m1", "clip"] == "A"


def test_whitener_inverts_the_dense_covariance(path: LinearizedRecord) -> None:
    noise, disturbance = np.array([0.02, 0.03]), np.array([0.05, 0.02])
    A, C, Q = path.steps[0], path.C, gathered(path, disturbance)
    n, nz = 40, A.shape[1]
    states = np.zeros((n, n, nz, nz))  # covariance of the deviations at samples j and k, from δ(0) = 0
    for k in range(1, n):
        for j in range(k):
            states[k, j] = A[k - 1] @ states[k - 1, j]
            states[j, k] = states[k, j].T
        states[k, k] = A[k - 1] @ states[k - 1, k - 1] @ A[k - 1].T + Q[k - 1]
    dense = np.block([[C[j] @ states[j, k] @ C[k].T + (np.diag(noise**2) if j == k else 0.0) for k in range(n)]
                      for j in range(n)])
    w = whitener(path, noise, disturbance)
    columns = np.zeros((len(A), 2, 2 * n))
    columns[:n].reshape(2 * n, 2 * n)[:] = np.eye(2 * n)
    L_inverse = w(columns)[:n].reshape(2 * n, 2 * n)
    assert np.allclose(L_inverse @ dense @ L_inverse.T, np.eye(2 * n), atol=1e-9)
    assert not np.allclose(dense, np.diag(np.diag(dense)), atol=1e-6)  # otherwise the test could not fail
    # what comes after does not matter
    begun = replace(w, A=w.A[:37], C=w.C[:37], gains=w.gains[:37], roots=w.roots[:37])
    assert np.allclose(begun(columns[:37]), w(columns)[:37], rtol=0, atol=1e-12)


def test_noise_gathered_in_a_sample_of_one_lump() -> None:
    bar = rt.System(ambients={"room": {"temperature": 300.0}}, lumps={"bar": {"capacity": 10.0}},
                    links=[{"between": ("bar", "room"), "conductance": 2.0}], sensors={"T": {"lump": "bar"}})
    record = rt.Record(sample_time=3.0, inputs=np.full(4, 300.0), outputs=np.full((4, 1), 300.0), input_names=["room"],
                       output_names=["T"])
    Q = gathered(linearized_record(bar, as_measured(bar, record, "records")[0]), np.array([0.7]))
    exact = (0.7 / 10.0) ** 2 * (1 - np.exp(-2 * 0.2 * 3.0)) / (2 * 0.2)
    assert Q[0, 0, 0] == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("name", sorted(rt.thermal.effects()))
def test_signature_is_the_derivative_of_the_simulation(path: LinearizedRecord, with_gaps: LinearizedRecord,
                                                       name: str) -> None:
    # The linearized signature, written by hand or from the equations, against two nonlinear simulations.
    path = with_gaps if name.startswith("missing") else path
    if name == "driven_heat":  # of a column that heats nothing
        path = linearized(path.system.with_parameters({"inputs.heater.gain": 0.0}))
    if name == "coolant_warming":
        links = [link for link in path.system.links if "room" not in link.between]
        links += [rt.thermal.Link(between=(lump, "room"), conductance=0.4) for lump in path.system.lumps]
        room = path.system.ambients["room"].model_copy(update={"coolant": tuple(path.system.lumps)})
        path = linearized(rt.System(**{**dict(path.system), "ambients": {"room": room}, "links": links}))
    found = rt.diagnosis.candidates(path.system, [name])[:3]
    assert found
    for candidate in found:
        trials = candidate.trials(path)
        # a large mass in a path moves its own lump, which the linearization leaves out
        trial = trials[0 if name == "path_mass" else len(trials) // 2]
        step = trial.shape.get(trial.effect.size.name, trial.effect.size.typical)
        linear = path.columns([trial])[..., 0]
        added = rt.thermal.trajectory(trial.add(path.system, step), path.one.record, tolerance=1e-7).readings
        without = rt.thermal.trajectory(path.system, path.one.record, tolerance=1e-7).readings
        true = (added - without) / step
        if np.linalg.norm(true) < 1e-9 * np.sqrt(true.size):
            assert np.linalg.norm(linear) < 1e-6
            continue
        cosine = float(np.sum(linear * true)) / np.linalg.norm(linear) / np.linalg.norm(true)
        assert cosine > 0.97, candidate.label
        assert np.linalg.norm(linear) / np.linalg.norm(true) == pytest.approx(1.0, abs=0.15)


def test_descent_with_bounds_is_non_negative_least_squares() -> None:
    rng = np.random.default_rng(5)
    J, z = rng.standard_normal((30, 6)), rng.standard_normal(30)
    problem = SimpleNamespace(residual=lambda v: z - J @ v, slopes=lambda v: J)
    found = descend(problem, np.full(6, 0.5), (np.zeros(6), np.full(6, np.inf)), 50, 1e-12).at
    _, least = nnls(J, z)
    assert np.linalg.norm(found.z) == pytest.approx(least, rel=1e-6)
    assert np.any(found.v == 0.0)


@pytest.mark.parametrize("seed", range(20))
def test_descent_does_not_claim_convergence_at_wrong_bounds(seed: int) -> None:
    # Correlated unknowns: those that a free step would carry out of the box are not those on its walls at the optimum.
    rng = np.random.default_rng(seed)
    J = rng.standard_normal((30, 6)) @ (np.eye(6) + 3.0 * rng.standard_normal((6, 6)))
    y, box = 5.0 * rng.standard_normal(30), (np.full(6, -0.3), np.full(6, 0.3))
    problem = SimpleNamespace(residual=lambda v: y - J @ v, slopes=lambda v: J)
    found = descend(problem, np.zeros(6), box, 50, 1e-9)
    assert found.converged
    assert found.at.z @ found.at.z == pytest.approx(2.0 * lsq_linear(J, y, box, "bvls").cost, rel=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_descent_converges_where_the_time_of_a_change_has_kinks(seed: int) -> None:
    # A ramp that starts at s: the sum of squares bends wherever s passes a sample. Compared with a fine grid of s.
    rng = np.random.default_rng(seed)
    t = np.arange(100.0)
    y = 0.3 + 0.02 * np.maximum(t - 40.0, 0.0) + 0.1 * rng.standard_normal(100)

    def ramp(v: np.ndarray) -> np.ndarray:
        return np.maximum(t - v[2], 0.0)

    problem = SimpleNamespace(residual=lambda v: y - v[0] - v[1] * ramp(v),
                              slopes=lambda v: np.column_stack([np.ones(100), ramp(v), -v[1] * (ramp(v) > 0)]))
    free = np.full(3, np.inf)
    found = descend(problem, np.array([0.0, 0.01, 35.0]), (-free, free), 40, 3e-5)
    best = min(np.linalg.lstsq(np.column_stack([np.ones(100), np.maximum(t - s, 0.0)]), y, rcond=None)[1][0]
               for s in np.arange(10.0, 80.0, 0.02))
    assert found.converged
    assert found.at.z @ found.at.z < best * (1 + 3e-3)


def test_scores_of_noise_follow_their_distribution(plant: rt.System, hide: Callable) -> None:
    # Under H0 the projected statistic is F(1, ν): over many noises and candidates its mean is 1, and few exceed 6.6.
    fit = rt.diagnosis.refit(plant, hide(n=300)[0])
    rng = np.random.default_rng(11)
    tested = rt.diagnosis.candidates(fit.system, ["missing_ambient_link", "sensor_offset", "sensor_gain", "heat_source",
                                                  "natural_convection"])
    J = fit.project(fit.whiten([path.columns([c.trials(path)[0] for c in tested]) for path in fit.paths]))
    J /= np.linalg.norm(J, axis=0)
    z = fit.project(rng.standard_normal((J.shape[0], 400)))
    T = (J.T @ z) ** 2 / (np.sum(z**2, axis=0) / fit.degrees_of_freedom)
    assert T.mean() == pytest.approx(1.0, abs=0.15)
    assert np.mean(T > 6.635) < 0.03


def test_no_variance_is_negative_where_a_direction_is_flat(plant: rt.System, hide: Callable) -> None:
    fit = rt.diagnosis.refit(plant, hide(n=300)[0])
    exact = np.linalg.inv(fit.J.T @ fit.J) * max(fit.variance, 1.0)
    np.testing.assert_allclose(fit.covariance, exact, rtol=1e-6, atol=1e-9 * np.abs(exact).max())
    rng = np.random.default_rng(8)
    for size in 10.0 ** -np.arange(6.0, 12.0):
        J = fit.J.copy()
        J[:, -1] = J[:, 0] + size * np.linalg.norm(J[:, 0]) * rng.standard_normal(len(J)) / np.sqrt(len(J))
        flat = replace(fit)
        vars(flat)["J"] = J
        assert np.all(np.diag(flat.covariance) >= 0.0)


def test_aliases_and_limits_need_no_readings(plant: rt.System, hide: Callable) -> None:
    # A record of inputs alone decides what can be told apart and how small an effect would be seen.
    record = hide(n=300)[0]
    quiet = rt.thermal.simulate(plant, record)
    noisy = quiet.with_outputs(quiet.outputs + 0.01 * np.random.default_rng(0).standard_normal(quiet.outputs.shape))
    scores = rt.diagnosis.score(rt.diagnosis.refit(plant, noisy), ["heat_source", "ambient_gradient",
                                                                   "sensor_self_heating", "missing_ambient_link"])
    labels = [candidate.label for candidate in scores.candidates]
    alike = {labels[j] for j in scores.aliases(labels.index("heat_source(plate)"))}
    assert alike == {"ambient_gradient(plate)", "sensor_self_heating(Tp)"}
    assert np.all(np.isfinite(scores.limit)) and np.all(scores.limit > 0)


def test_an_effect_at_its_declared_limit_is_mostly_detected(plant: rt.System, hide: Callable) -> None:
    record = hide(n=300)[0]
    clean = rt.thermal.simulate(plant, record)
    rng = np.random.default_rng(2)
    fit = rt.diagnosis.refit(plant, clean.with_outputs(clean.outputs + 0.01 * rng.standard_normal(clean.outputs.shape)))
    scores = rt.diagnosis.score(fit, ["sensor_gain"])
    limit = scores.limit[0]
    seen = 0
    lifted = rt.thermal.simulate(plant.with_parameters({"sensors.Tp.gain": 1.0 + 1.3 * limit}), record)
    for _ in range(12):
        noisy = lifted.with_outputs(lifted.outputs + 0.01 * rng.standard_normal(lifted.outputs.shape))
        again = rt.diagnosis.score(rt.diagnosis.refit(plant, noisy), ["sensor_gain"])
        seen += bool(again.p_value[0] < 0.01)
    assert seen >= 10


@pytest.mark.parametrize("condition", [1.0, 1e3, 1e7, 1e12])
@pytest.mark.parametrize("left", [1.0, 0.0])
def test_a_small_problem_has_the_answers_of_the_long_one(condition: float, left: float) -> None:
    """By products of columns where they are apart, by reflections where they are not, or nothing of z is left."""
    rng = np.random.default_rng(5)
    U, V = (np.linalg.qr(rng.standard_normal(shape))[0] for shape in ((1300, 9), (9, 9)))
    J = U * np.geomspace(1.0, 1.0 / condition, 9) @ V * np.geomspace(1e-4, 1e5, 9)
    z = left * rng.standard_normal(1300) + J @ (rng.standard_normal(9) / np.linalg.norm(J, axis=0))
    R, right = turned(J, z)
    assert R.shape == (10, 9) and right.shape == (10,)
    for _ in range(5):
        a = rng.standard_normal(9) / np.linalg.norm(J, axis=0)
        assert np.linalg.norm(right - R @ a) == pytest.approx(np.linalg.norm(z - J @ a), rel=1e-9)
    long, small = (np.linalg.lstsq(columns / np.linalg.norm(J, axis=0), target, rcond=None)[0]
                   for columns, target in ((J, z), (R, right)))
    np.testing.assert_allclose(small, long, atol=1e-15 * min(condition, 1e5)**2 * condition * np.abs(long).max())


def test_columns_that_vanish_are_turned_too() -> None:
    J = np.column_stack([np.arange(1.0, 31.0), np.zeros(30)])
    R, right = turned(J, np.ones(30))
    assert np.linalg.norm(right - R @ [0.1, 7.0]) == pytest.approx(np.linalg.norm(1.0 - J @ [0.1, 7.0]))


def test_an_orthonormal_basis_leaves_out_what_is_flat() -> None:
    rng = np.random.default_rng(6)
    J = rng.standard_normal((800, 5)) * np.geomspace(1e-6, 1e6, 5)
    J = np.column_stack([J, J @ rng.standard_normal(5), np.zeros(800)])
    basis = orthonormal(J, 1e-9)
    assert basis.shape == (800, 5)
    np.testing.assert_allclose(basis.T @ basis, np.eye(5), atol=1e-13)
    np.testing.assert_allclose((J - basis @ (basis.T @ J)) / np.abs(J).max(), 0.0, atol=1e-13)


def test_the_settled_covariance_solves_the_riccati_equation() -> None:
    """Against the equation itself, and scipy's solution by eigenvalues."""
    rng = np.random.default_rng(7)
    for _ in range(40):
        n, s = rng.integers(1, 9), rng.integers(1, 4)
        M = rng.standard_normal((n, n))
        A = expm(-(M @ M.T + 1e-3 * np.eye(n)) * rng.uniform(1e-3, 1.0))
        C, R = rng.standard_normal((s, n)), np.diag(10.0 ** rng.uniform(-6.0, 0.0, s))
        Q = np.diag(10.0 ** rng.uniform(-8.0, 0.0, n) * (rng.random(n) < 0.7) + 1e-12)
        P = settled(A, C, R, Q)
        kept = P - P @ C.T @ np.linalg.solve(C @ P @ C.T + R, C @ P)
        np.testing.assert_allclose(A @ kept @ A.T + Q, P, atol=1e-9 * np.abs(P).max())
        np.testing.assert_allclose(P, solve_discrete_are(A.T, C.T, Q, R), atol=1e-6 * np.abs(P).max())
    with pytest.raises(np.linalg.LinAlgError, match="does not settle"):
        settled(np.eye(1) * 1.1, np.zeros((1, 1)), np.eye(1), np.eye(1))
